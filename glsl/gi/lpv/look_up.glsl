// Method `lpv`: what the propagation added up in the cells around.

#include "common/refraction.glsl"
#include "gi/lpv/constants.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"

const bool FINDS_LAMPS = false;

layout(set = 0, binding = 33, scalar) readonly buffer BlockersBuffer { uvec4 blockers[]; };
layout(set = 0, binding = 34, scalar) readonly buffer CascadePlaces { vec4 cascades[]; }; // cells = voxels · w + xyz

layout(set = 0, binding = 48) uniform sampler3D sum_flux; // the grids one above the other
layout(set = 0, binding = 49) uniform sampler3D sum_x;
layout(set = 0, binding = 50) uniform sampler3D sum_y;
layout(set = 0, binding = 51) uniform sampler3D sum_z;

Field sum_in(uint cascade, ivec3 cell) {
    ivec3 at = cell + ivec3(0, 0, cascade * LPV_EDGE);
    return Field(texelFetch(sum_flux, at, 0), texelFetch(sum_x, at, 0), texelFetch(sum_y, at, 0), texelFetch(sum_z, at, 0));
}

// Linear between the cells around `at`. With APPLY_FLUX those that a surface like this one fills are left out: behind it
// there is other light. `n`: of the surface.
Field field_around(uint cascade, vec3 at, vec3 n) {
    ivec3 corner = ivec3(floor(at - 0.5));
    vec3 part = at - 0.5 - vec3(corner);
    Field open = no_light();
    Field all = no_light();
    float total = 0.0;
    COUNT(WORDS, 8u * 20u);
    for (int k = 0; k < 8; k++) {
        ivec3 step = ivec3(k & 1, (k >> 1) & 1, k >> 2);
        vec3 near = mix(1.0 - part, part, vec3(step));
        float weight = near.x * near.y * near.z;
        ivec3 cell = clamp(corner + step, ivec3(0), ivec3(LPV_EDGE - 1u));
        Field f = sum_in(cascade, cell);
        all = add(all, scaled(f, weight));
        if (APPLY == APPLY_FLUX) {
            weight *= 1.0 - dot(n * n, across(unpack_blockers(blockers[cascade * CELLS_PER_GRID + cell_index(cell)])));
            open = add(open, scaled(f, weight));
            total += weight;
        }
    }
    return total > 1e-3 ? scaled(open, 1.0 / total) : all;
}

// Cells that one of the grids keeps off its border, and over which the next coarser one takes over.
const float BLENDED_CELLS = 2.0;

// What travels in front of a surface: half a cell off it; a whole one where the surface's own cells are left out.
Field field_before(vec3 position, vec3 facet, vec3 normal) {
    Field sum = no_light();
    float left = 1.0;
    for (uint k = 0u; k < CASCADES && left > 0.0; k++) {
        vec3 at = position * cascades[k].w + cascades[k].xyz + facet * (APPLY == APPLY_FLUX ? 1.0 : 0.5);
        vec3 inside = min(at, float(LPV_EDGE) - at) - 1.0;
        float taken = k + 1u == CASCADES ? 1.0 : clamp(min(inside.x, min(inside.y, inside.z)) / BLENDED_CELLS, 0.0, 1.0);
        if (taken > 0.0) {
            sum = add(sum, scaled(field_around(k, at, normal), left * taken));
        }
        left *= 1.0 - taken;
    }
    return sum;
}

// Irradiance of a surface with that normal. Flux: what crosses a face that looks that way, which is right in light from all
// sides and conserves what propagation conserves. SH: two bands against the clamped cosine, over a face: 1.5 times too much
// in light from all sides, for a cube's mean projected area is 1.5 faces.
vec4 irradiance_of(Field f, vec3 normal) {
    return max(APPLY == APPLY_FLUX ? crossing(f, -normal) : f.flux / 4.0 - moment_along(f, normal) / 6.0, vec4(0.0));
}

// Radiance seen along unit d, in two bands with the same irradiance.
vec4 radiance_along(Field f, vec3 d) {
    return max(APPLY == APPLY_FLUX ? (f.flux - 9.0 * CROSSING * moment_along(f, d)) / EVEN_FLUX
                                   : (f.flux - moment_along(f, d)) / (4.0 * PI), vec4(0.0));
}

vec3 with_sky(vec4 found) {
    return found.rgb + found.a * frame.sky * frame.scale;
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    vec4 found = irradiance_of(field_before(s.position, s.facet, s.normal), s.normal) / PI;
    found.a = min(found.a, 1.0);
    return vec4(with_sky(found), found.a);
}

vec3 look_up_specular(Surface s) {
    return with_sky(radiance_along(field_before(s.position, s.facet, s.normal), s.normal));
}

// Two bands are all that there is: a mirror shows no more of a room than where it is bright.
void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    if (feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)))) {
        vec3 d = reflect(-v.view, s.normal);
        sent.indirect += v.lobes.specular * with_sky(radiance_along(field_before(s.position, s.facet, s.normal), d));
    }
    if (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0) {
        vec3 d = refraction_direction(-v.view, s.normal, s.ior, v.back, s.thickness_m <= 0.0);
        float side = dot(d, s.facet) > 0.0 ? 1.0 : -1.0;
        sent.indirect += s.transmitted * v.lobes.rest * with_sky(radiance_along(field_before(s.position, side * s.facet, s.normal), d));
    }
}
