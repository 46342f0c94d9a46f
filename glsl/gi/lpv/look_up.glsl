// Method `lpv`: looks up the summed light in the cells around a point.

#include "common/lobe.glsl"
#include "common/refraction.glsl"
#include "ground/brdf.glsl"
#include "ground/sky.glsl"
#include "ground/ray.glsl"
#include "gi/lpv/constants.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"

const bool FINDS_LAMPS = false;

layout(scalar) readonly buffer BlockersBuffer { uvec4 blockers[]; };
layout(scalar) readonly buffer CascadePlaces { vec4 cascades[]; }; // cells = voxels · w + xyz
uniform sampler3D sums[6]; // the grids stacked along z

// With beams: the light sent along +x +y +z −x −y −z; otherwise the four parts of a Field.
struct Found {
    vec4 parts[6];
};

Found nothing_found() {
    return Found(vec4[6](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)));
}

// `weight` applies to the colours and to the sky's share.
void add_found(inout Found sum, Found f, vec4 weight) {
    for (int k = 0; k < 6; k++) {
        sum.parts[k] += weight * f.parts[k];
    }
}

Found found_in(uint cascade, ivec3 cell) {
    ivec3 at = cell + ivec3(0, 0, cascade * LPV_EDGE);
    Found f = nothing_found();
    f.parts[0] = texelFetch(sums[0], at, 0);
    f.parts[1] = texelFetch(sums[1], at, 0);
    f.parts[2] = texelFetch(sums[2], at, 0);
    f.parts[3] = texelFetch(sums[3], at, 0);
    if (LOBE == LOBE_BEAM) {
        f.parts[4] = texelFetch(sums[4], at, 0);
        f.parts[5] = texelFetch(sums[5], at, 0);
    }
    return f;
}

// Linear interpolation between the cells around `at`. With APPLY_FLUX, cells filled by a surface like this one are left
// out, because they hold the light behind it. `n` is the surface's normal.
Found found_around(uint cascade, vec3 at, vec3 n) {
    ivec3 corner = ivec3(floor(at - 0.5));
    vec3 part = at - 0.5 - vec3(corner);
    float weights[8];
    float open = 0.0;
    for (int k = 0; k < 8; k++) {
        ivec3 step = ivec3(k & 1, (k >> 1) & 1, k >> 2);
        vec3 near = mix(1.0 - part, part, vec3(step));
        weights[k] = near.x * near.y * near.z;
        if (APPLY == APPLY_FLUX) {
            ivec3 cell = clamp(corner + step, ivec3(0), ivec3(LPV_EDGE - 1u));
            float blocked = dot(n * n, across(unpack_blockers(blockers[cascade * CELLS_PER_GRID + cell_index(cell)])));
            weights[k] *= max(1.0 - blocked, 1e-4); // if all are filled, they count equally
            open += weights[k];
        }
    }
    COUNT(WORDS, 8u * (LOBE == LOBE_BEAM ? 28u : 20u));
    Found sum = nothing_found();
    for (int k = 0; k < 8; k++) {
        ivec3 step = ivec3(k & 1, (k >> 1) & 1, k >> 2);
        ivec3 cell = clamp(corner + step, ivec3(0), ivec3(LPV_EDGE - 1u));
        add_found(sum, found_in(cascade, cell), vec4(APPLY == APPLY_FLUX ? weights[k] / open : weights[k]));
    }
    return sum;
}

// The number of cells by which look-ups stay away from a grid's border, and over which the next coarser grid is blended
// in.
const float BLENDED_CELLS = 2.0;

// The share of the light in a cell off a facet that no surface blocks. Without this, a wall of two sheets within a cell
// would reflect incoming light twice, because both sheets find the light of the room in front of them.
vec4 free_before(vec3 position, vec3 facet, float cell) {
    vec3 free = APPLY == APPLY_FLUX ? trace_shadow_ray(ray_start(position, facet, facet), facet, cell) : vec3(1.0);
    return vec4(free, brightest(free));
}

// Light that travels in front of a surface: one cell off its facet, without cells that it fills, or half a cell off
// along its shading normal (a buffer of perturbed normals has no facets).
Found found_before(vec3 position, vec3 facet, vec3 normal) {
    vec3 off = APPLY == APPLY_FLUX ? facet : 0.5 * normal;
    Found sum = nothing_found();
    float left = 1.0;
    for (uint k = 0u; k < CASCADES && left > 0.0; k++) {
        vec3 at = position * cascades[k].w + cascades[k].xyz + off;
        vec3 inside = min(at, float(LPV_EDGE) - at) - 1.0;
        float taken =
            k + 1u == CASCADES ? 1.0 : clamp(min(inside.x, min(inside.y, inside.z)) / BLENDED_CELLS, 0.0, 1.0);
        if (taken > 0.0) {
            vec4 free = free_before(position, facet, 1.0 / cascades[k].w); // voxels
            add_found(sum, found_around(k, at, normal), left * taken * free);
        }
        left *= 1.0 - taken;
    }
    return sum;
}

Field as_field(Found f) {
    return Field(f.parts[0], f.parts[1], f.parts[2], f.parts[3]);
}

// Light that was sent along −d, interpolated between the axes by the squares of d's components.
vec4 sent_against(Found f, vec3 d) {
    return d.x * d.x * (d.x > 0.0 ? f.parts[3] : f.parts[0]) + d.y * d.y * (d.y > 0.0 ? f.parts[4] : f.parts[1])
        + d.z * d.z * (d.z > 0.0 ? f.parts[5] : f.parts[2]);
}

// Irradiance of a surface with that normal. Flux: the light that crosses a face of that orientation, which is exact for
// uniform light and conserves energy. SH: two bands times the clamped cosine, over a face, which is 1.5 times too much
// for uniform light, because the mean projected area of a cube is 1.5 faces.
vec4 irradiance_of(Found f, vec3 normal) {
    if (LOBE == LOBE_BEAM) {
        return sent_against(f, normal);
    }
    Field field = as_field(f);
    return max(APPLY == APPLY_FLUX ? crossing(field, -normal) : field.flux / 4.0 - moment_along(field, normal) / 6.0,
        vec4(0.0));
}

// Radiance along unit d, with the same irradiance under uniform light.
vec4 radiance_along(Found f, vec3 d) {
    if (LOBE == LOBE_BEAM) {
        return sent_against(f, d) / PI;
    }
    Field field = as_field(f);
    return max(APPLY == APPLY_FLUX ? (field.flux - 9.0 * CROSSING * moment_along(field, d)) / EVEN_FLUX
                                   : (field.flux - moment_along(field, d)) / (4.0 * PI),
        vec4(0.0));
}

// The found share of the sky is assumed to come from around d, as wide as the lobe. `bright` is as for sky_about.
vec3 with_sky(vec4 found, Surface s, vec3 d, float bright) {
    return found.rgb + found.a * sky_about(d, ggx_aperture(s.roughness), bright);
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    vec4 found = irradiance_of(found_before(s.position, s.facet, s.normal), s.normal) / PI;
    found.a = min(found.a, 1.0);
    return vec4(found.rgb + found.a * sky_over(s.normal), found.a); // from all directions
}

vec3 look_up_specular(Surface s) {
    return with_sky(radiance_along(found_before(s.position, s.facet, s.normal), s.normal), s, s.normal, 0.0);
}

// There are only six directions or two bands, so a mirror only shows where a room is bright.
void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    if (feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)))) {
        vec3 d = mirrored(s, v.view);
        sent.indirect += v.lobes.specular
            * with_sky(
                radiance_along(found_before(s.position, s.facet, s.normal), d), s, d, 1.0 - lamps_in_lobe(s.roughness));
    }
    if (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0) {
        vec3 d = refraction_direction(-v.view, s.normal, s.ior, v.back, s.thickness_m <= 0.0);
        float side = dot(d, s.facet) > 0.0 ? 1.0 : -1.0;
        sent.indirect += s.transmitted * v.lobes.rest
            * with_sky(radiance_along(found_before(s.position, side * s.facet, side * s.normal), d), s, d, 1.0);
    }
}
