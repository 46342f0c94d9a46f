#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method except none
// Gather: diffuse light of what is seen, at fewer pixels than the image has, each looking along directions of its own.
// The pass share takes the mean over neighbours, the pass image brings it up to its pixels.

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"
#include "ground/lamp_light.glsl"
#include "ground/image/likeness.glsl"
#include "ground/image/seen.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the gathered pixels, at the top of this band
} push;

uniform usampler2D seen; // visibility buffer of the band's gathered pixels

layout(location = 0) out vec4 out_surface; // position, voxels; packed normal, −1 where nothing gathers
layout(location = 1) out vec4 out_light; // E/π in stored radiance; open share of the hemisphere
layout(location = 2) out vec4 out_lamps; // the same of sampled lamps
layout(location = 3) out vec4 out_lamps_specular; // stored radiance
#ifdef METHOD_GATHERS_LOBES
layout(location = 4) out vec4 out_mirrored; // stored radiance, of the specular lobe
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uint id = texelFetch(seen, at, 0).r;
    uvec3 place = uvec3(at, 0u) + uvec3(0u, push.first_row, 0u);
    vec4 surface = vec4(0.0, 0.0, 0.0, -1.0);
    vec4 light = vec4(0.0);
    vec3 mirrored = vec3(0.0);
    LampLight lamps = LampLight(vec3(0.0), vec3(0.0));
    // Loops, which a CPU device leaves early.
    for (uint i = 0u; i < min(id, 1u); i++) {
        uint triangle = (id - 1u) / 2u;
        Triangle t = triangles[triangle];
        Attributes attributes = attributes_of(triangle);
        COUNT(TRIANGLES, 1u);
        COUNT(MATERIALS, 1u);
        vec2 size = gathered_pixel();
        vec3 facet = normalize(triangle_normal(t.corners[0], t.corners[1], t.corners[2]));
        PlaceOnTriangle middle = place_on_triangle((vec2(place.xy) + 0.5) * size, size, t, facet);
        Surface s =
            evaluate_surface(t, attributes, middle.weights, pixel_footprint(attributes, middle), (id & 1u) == 0u);
        vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
        // Metals, glass and unlit surfaces gather nothing.
        for (uint k = 0u; k < (scatters(s) ? 1u : 0u); k++) {
            surface = vec4(s.position, pack_normal(s.normal));
#ifdef METHOD_GATHERS_LOBES
            light = look_up_for_view(s, view, place, mirrored);
#else
            light = look_up_diffuse(s, place);
#endif
            lamps = lamp_light(s, view);
        }
    }
    out_surface = surface;
    out_light = light;
    out_lamps = vec4(min(lamps.diffuse * frame.scale, LARGEST_STORED), 0.0);
    out_lamps_specular = vec4(min(lamps.specular * frame.scale, LARGEST_STORED), 0.0);
#ifdef METHOD_GATHERS_LOBES
    if (feature(FEATURE_SPECULAR)) { // else there is no such target
        out_mirrored = vec4(min(mirrored, LARGEST_STORED), 0.0);
    }
#endif
}
