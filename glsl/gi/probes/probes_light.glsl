// The light that the probes about a point hold.

#include "common/color.glsl"
#include "common/count.glsl"
#include "ground/frame.glsl"
#include "gi/probes/grid.glsl"
#include "gi/probes/weights.glsl"

layout(scalar) readonly buffer ProbeList { Probe probes[]; };
layout(scalar) readonly buffer ProbeGrids { ProbeGrid probe_grids[]; };
layout(scalar) readonly buffer ProbeDistances { vec2 probe_distances[]; }; // mean and mean square, voxels
// rgb: irradiance/π in stored radiance. a: the unoccluded share of the hemisphere. The first buffer holds the light of
// all bounces, the second that of the first bounce.
layout(scalar) readonly buffer ProbeLight { vec4 probe_light[]; };
layout(scalar) readonly buffer FirstLight { vec4 first_light[]; };

// Width of the blend with the next coarser grid, cells.
const float BLENDED_CELLS = 1.0;
// Least trilinear weight along an axis: rounding may put a point outside of its cell, which must still have weights.
const float LEAST_NEAR = 1e-3;

vec4 texel_light(uint place, uint bounces) {
    if (BOUNCES == 2u && bounces == 1u) {
        return first_light[place];
    }
    return probe_light[place];
}

vec4 light_of(uint probe, Texels t, uint bounces) {
    uint place = probe * LIGHT_TEXELS + t.first;
    const uint row = LIGHT_SIDE + 2u;
    COUNT(WORDS, 16u);
    return mix(mix(texel_light(place, bounces), texel_light(place + 1u, bounces), t.part.x),
        mix(texel_light(place + row, bounces), texel_light(place + row + 1u, bounces), t.part.x), t.part.y);
}

vec2 moments_of(uint probe, vec3 d) {
    Texels t = texels_about(d, DISTANCE_SIDE);
    uint place = probe * DISTANCE_TEXELS + t.first;
    const uint row = DISTANCE_SIDE + 2u;
    COUNT(WORDS, 8u);
    return mix(mix(probe_distances[place], probe_distances[place + 1u], t.part.x),
        mix(probe_distances[place + row], probe_distances[place + row + 1u], t.part.x), t.part.y);
}

// A surface point at which the probes are read.
struct Lit {
    vec3 position; // voxels
    vec3 normal; // unit, for shading
    vec3 facet; // unit, of the triangle
    vec3 off; // direction in which the bias moves the point off the surface for the test of visibility
};

// The bias combines normal and view as in the papers. A view from behind the surface is replaced by the facet normal.
Lit lit_point(vec3 position, vec3 normal, vec3 facet, vec3 view) {
    return Lit(position, normal, facet, 0.2 * facet + 0.8 * (dot(view, facet) > 0.0 ? view : facet));
}

// Light of the eight probes about a point in a grid. `total` is the sum of their weights; 0: no probe has light.
vec4 light_in(uint grid, Lit p, uint bounces, out float total) {
    ProbeGrid g = probe_grids[grid];
    COUNT(WORDS, 7u);
    vec3 at = (p.position - g.corner) / g.spacing - 0.5;
    ivec3 base = clamp(ivec3(floor(at)), ivec3(0), ivec3(int(PROBE_EDGE) - 2));
    vec3 part = clamp(at - vec3(base), vec3(0.0), vec3(1.0));
    vec3 seen_from = p.position + (0.75 * g.spacing * BIAS) * p.off;
    Texels towards = texels_about(p.normal, LIGHT_SIDE);
    vec4 sum = vec4(0.0);
    total = 0.0;
    for (int k = 0; k < 8; k++) {
        ivec3 step = ivec3(k & 1, (k >> 1) & 1, k >> 2);
        uint index = probe_of(grid, g.first + base + step);
        Probe probe = probes[index];
        COUNT(WORDS, 7u);
        if (probe.state == PROBE_ACTIVE) {
            vec3 near = max(mix(1.0 - part, part, vec3(step)), vec3(LEAST_NEAR));
            vec3 to = probe.position - p.position;
            to *= inversesqrt(max(dot(to, to), 1e-12));
            float weight = facing_weight(dot(to, p.normal), dot(to, p.facet), COUNTS_BEHIND);
            if (VISIBILITY) {
                vec3 from = seen_from - probe.position;
                weight *= seen_weight(moments_of(index, from), length(from));
            }
            weight = crushed(weight) * near.x * near.y * near.z;
            sum += weight * light_of(index, towards, bounces);
            total += weight;
        }
    }
    return total > 0.0 ? sum / total : vec4(0.0);
}

// rgb: irradiance/π of a surface in stored radiance, including the sky's. a: the unoccluded share of its hemisphere.
// `bounces` is the number of bounces, of which the sky's light is the first; 0: no light.
vec4 probes_light(Lit p, uint bounces) {
    vec4 sum = vec4(0.0);
    float left = bounces > 0u ? 1.0 : 0.0;
    for (uint k = 0u; k < CASCADES && left > 0.0; k++) {
        vec3 at = (p.position - probe_grids[k].corner) / probe_grids[k].spacing;
        vec3 inside = min(at, float(PROBE_EDGE) - at) - 0.5;
        float taken =
            k + 1u == CASCADES ? 1.0 : clamp(min(inside.x, min(inside.y, inside.z)) / BLENDED_CELLS, 0.0, 1.0);
        if (taken > 0.0) {
            float total;
            vec4 found = light_in(k, p, bounces, total);
            taken = total > 0.0 ? taken : 0.0;
            sum += left * taken * found;
            left *= 1.0 - taken;
        }
    }
    return sum;
}
