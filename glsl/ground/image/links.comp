#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Links: finds gathered pixels that lie on one surface with their right or lower neighbour, without a wall or a crease
// between them. The pass share follows these links, and the pass image looks for light across them.

#include "ground/constants.glsl"
#include "ground/image/likeness.glsl"
#include "ground/image/linked.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D gathered; // position, packed normal, −1 without gathering
layout(rgba32f) writeonly uniform image2D linked_surfaces; // with links in the normal's word

layout(push_constant) uniform Push {
    uint rows; // of this band
} push;

// The minimum difference of normals at a crease, and the minimum multiple of the difference next to it.
const float LEAST_CREASE = 0.07;
const float CREASE = 2.0;

// The change of normal between two neighbours, as the length of the difference of their normals; −1 if they do not show
// one surface.
float turn(ivec2 from, ivec2 to, ivec2 size) {
    vec4 p = texelFetch(gathered, clamp(from, ivec2(0), size - 1), 0);
    vec4 q = texelFetch(gathered, clamp(to, ivec2(0), size - 1), 0);
    vec3 n = unpack_normal(max(p.w, 0.0));
    vec3 m = unpack_normal(max(q.w, 0.0));
    bool inside = all(greaterThanEqual(min(from, to), ivec2(0))) && all(lessThan(max(from, to), size));
    bool one = inside && min(p.w, q.w) >= 0.0 && likeness(p.xyz, n, q.xyz, m) > 0.0;
    return one ? length(n - m) : -1.0;
}

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
        float here_to_there = turn(at, to, size);
        float beside = max(turn(2 * at - to, at, size), turn(to, 2 * to - at, size));
        bool crease = beside >= 0.0 && here_to_there > LEAST_CREASE + CREASE * beside;
        bool may_share = here_to_there >= 0.0 && !crease;
        // This is a loop, which a CPU device leaves early.
        for (uint tests = may_share ? 1u : 0u; tests > 0u; tests--) {
            links |= linked(here.xyz, normal, there.xyz, other) ? LINK_RIGHT << k : 0u;
        }
    }
    imageStore(linked_surfaces, at, vec4(here.xyz, here.w < 0.0 ? here.w : pack_links(here.w, links)));
}
