#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Links: which gathered pixels and their neighbours on the right and below lie on one surface with nothing between
// them. The pass share goes along these links, and the pass image looks for light across them.

#include "ground/constants.glsl"
#include "ground/image/likeness.glsl"
#include "ground/image/linked.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D gathered; // position, packed normal, −1 where nothing gathers
layout(rgba32f) writeonly uniform image2D linked_surfaces; // with links beside the normal

layout(push_constant) uniform Push {
    uint rows; // of this band
} push;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(textureSize(gathered, 0).x, push.rows);
    if (any(greaterThanEqual(at, size))) {
        return;
    }
    vec4 here = texelFetch(gathered, at, 0);
    vec3 normal = unpack_normal(max(here.w, 0.0));
    uint links = 0u;
    for (int k = 0; k < 2; k++) {
        ivec2 to = at + ivec2(1 - k, k);
        vec4 there = texelFetch(gathered, min(to, size - 1), 0);
        vec3 other = unpack_normal(max(there.w, 0.0));
        bool may_share = all(lessThan(to, size)) && here.w >= 0.0 && there.w >= 0.0
            && likeness(here.xyz, normal, there.xyz, other) > 0.0;
        // A loop, which a CPU device leaves early.
        for (uint tests = may_share ? 1u : 0u; tests > 0u; tests--) {
            links |= linked(here.xyz, normal, there.xyz, other) ? LINK_RIGHT << k : 0u;
        }
    }
    imageStore(linked_surfaces, at, vec4(here.xyz, here.w < 0.0 ? here.w : pack_links(here.w, links)));
}
