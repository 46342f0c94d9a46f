// The content of a volume at a position: its opacity, and the light that it sends.

#include "common/count.glsl"
#include "gi/photons/constants.glsl"
#include "gi/photons/octahedron.glsl"

uniform sampler3D photons;
uniform sampler3D met_forth;
uniform sampler3D met_back;

// The share that planes across one axis hide. They are filtered along it, and continue beyond the grid's sides.
float met_along(uint axis, vec3 at, vec3 d, float level) {
    vec3 inside =
        clamp(at / float(EDGE), vec3(0.5 * exp2(level) / float(EDGE)), vec3(1.0 - 0.5 * exp2(level) / float(EDGE)));
    inside[axis] = at[axis] / float(EDGE);
    float met = (d[axis] < 0.0 ? textureLod(met_back, inside, level) : textureLod(met_forth, inside, level))[axis];
    return abs(d[axis]) * (printed(ROW_MIPS) ? min(met, 1.0) : met); // sums are not opacities
}

// Opacity over one edge of the level, for travel along unit d. `at` is in voxels of the base grid.
float opacity_at(vec3 at, vec3 d, float level) {
    if (OPACITY_KIND == OPACITY_SAMPLES) {
        COUNT(VOLUME_TEXELS, trilinear_texels(level));
        return clamp(textureLod(met_forth, at / float(EDGE), level).a, 0.0, 1.0);
    }
    COUNT(VOLUME_TEXELS, 3u * trilinear_texels(level));
    // The result is exact for planes along the axes. Others are met at least once: Σ |dᵢ nᵢ| ≥ |d · n|.
    return met_along(0u, at, d, level) + met_along(1u, at, d, level) + met_along(2u, at, d, level);
}

// One direction at one level, filtered over voxels but not into the next block.
vec4 map_at(ivec2 texel, vec3 at, float level) {
    float edge = float(EDGE) / exp2(level);
    vec3 inside = clamp(at / exp2(level), vec3(0.5), vec3(edge - 0.5));
    COUNT(VOLUME_TEXELS, 8u);
    uvec2 block = printed(ROW_SEAMS) ? uvec2(clamp(texel, ivec2(0), ivec2(3))) : folded(texel);
    return textureLod(photons, vec3((inside.xy / edge + vec2(block)) / 4.0, inside.z / edge), level);
}

// As map_at, linearly interpolated between levels.
vec4 map_between(ivec2 texel, vec3 at, float level) {
    float below = floor(level);
    float part = level - below;
    vec4 found = map_at(texel, at, below);
    return part > 0.0 ? mix(found, map_at(texel, at, below + 1.0), part) : found;
}

// Stored radiance along unit d from a position of opacity a, as if it filled all of it.
vec3 light_towards(vec3 d, vec3 at, float level, float a) {
    vec2 place = octahedron_place(d) - 0.5;
    vec2 corner = floor(place);
    vec2 part = place - corner;
    ivec2 texel = ivec2(corner);
    vec4 sum = (1.0 - part.x) * (1.0 - part.y) * map_between(texel, at, level)
        + part.x * (1.0 - part.y) * map_between(texel + ivec2(1, 0), at, level)
        + (1.0 - part.x) * part.y * map_between(texel + ivec2(0, 1), at, level)
        + part.x * part.y * map_between(texel + ivec2(1, 1), at, level);
    if (printed(ROW_PREMULTIPLIED)) {
        return sum.rgb / a; // the cone multiplies it by a again, which gives the premultiplied light
    }
    // Light and area were filtered equally, so neither an unevenly filled voxel nor the map's resolution loses energy.
    return sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0);
}
