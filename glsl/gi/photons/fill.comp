#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with OPACITY
// Fills the occupied voxels with the light of their photons: a thread per voxel and direction. With OPACITY it fills
// their opacity: a thread per voxel. Checked by tests/device/passes_photons.rs.

#include "common/color.glsl"
#include "common/count.glsl"
#include "common/fixed_sum.glsl"
#include "common/triangle_box.glsl"
#include "gi/photons/constants.glsl"
#include "gi/photons/lobes.glsl"
#include "gi/photons/octahedron.glsl"
#include "gi/photons/store.glsl"
#include "ground/bindings.glsl"
#include "ground/cells.glsl"

layout(scalar) readonly buffer ItemLights { ItemLight item_lights[]; };
layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };
layout(scalar) readonly buffer ItemSamples { uint item_samples[]; };

const float DARK_BACK = 1e-3; // as a share of the front's light; below it the back counts as dark (rounding and leaks)

// A triangle in a voxel.
struct Photon {
    vec3 front; // stored radiance
    vec3 back;
    vec3 normal; // unit, of the front
    float share; // of the column's samples, times opacity
    float area; // over a voxel's face, times opacity
    LobeLight front_lobe;
    LobeLight back_lobe;
    bool dark_back; // left out, because on walls of zero thickness it would only darken the light of the front
};

Photon photon_of(uint item) {
    ListItem entry = list_items[item];
    COUNT(LIST_ITEMS, 1u);
    COUNT(CORNERS, 3u);
    COUNT(WORDS, LIT == LIT_GROUPED ? 10u : 9u);
    uint lit_by = LIT == LIT_GROUPED ? item_parts[item].lit_by : item;
    ItemLight light = item_lights[lit_by];
    vec3 n = normalize(triangle_normal(triangles[entry.triangle].corners[0], triangles[entry.triangle].corners[1],
        triangles[entry.triangle].corners[2]));
    Photon photon;
    photon.front = light.front;
    photon.back = light.back;
    photon.normal = n;
    photon.share = light.opacity * float(item_samples[item]) / float(SAMPLES);
    // Samples measure the area along the axis that the triangle faces most.
    photon.area = photon.share / max(abs(n.x), max(abs(n.y), abs(n.z)));
    photon.front_lobe = unpack_lobe(uvec4(0u));
    photon.back_lobe = photon.front_lobe;
    if (feature(FEATURE_SPECULAR)) {
        COUNT(WORDS, 8u);
        photon.front_lobe = unpack_lobe(item_lobes[2u * lit_by]);
        photon.back_lobe = unpack_lobe(item_lobes[2u * lit_by + 1u]);
    }
    photon.dark_back = KEEPS_BACKS == 0u
        && brightest(light.back + photon.back_lobe.light)
            <= DARK_BACK * brightest(light.front + photon.front_lobe.light);
    return photon;
}

#ifdef OPACITY
const uint THREADS = 1u;

void fill(uvec3 cell, uint first, uint texel) {
    FixedSum forth = fixed_zero();
    FixedSum back = fixed_zero();
    uint item = first;
    for (uint k = 0u; k < globals.item_count && item != 0u; k++) {
        Photon photon = photon_of(item - 1u);
        // Light that travels along +x meets fronts whose normal points against it, and the backs of other triangles.
        vec3 facing = photon.area * abs(photon.normal);
        vec3 fronts = vec3(lessThan(photon.normal, vec3(0.0)));
        vec3 backs = photon.dark_back ? vec3(0.0) : 1.0 - fronts;
        fixed_add(forth, vec4(facing * (fronts + backs), photon.share));
        fronts = 1.0 - fronts;
        backs = photon.dark_back ? vec3(0.0) : 1.0 - fronts;
        fixed_add(back, vec4(facing * (fronts + backs), 0.0));
        item = list_items[item - 1u].next;
    }
    // The printed form stores the sum, and cuts it when it is read as opacity.
    vec4 most = vec4(printed(ROW_MIPS) ? LARGEST_STORED : 1.0);
    imageStore(opacity_forth, ivec3(cell), min(fixed_value(forth), most));
    imageStore(opacity_back, ivec3(cell), min(fixed_value(back), most));
}
#else
const uint THREADS = TEXELS;

// Radiance in the directions of a texel times the area that faces them, and that area.
vec4 sent(Photon photon, uint texel) {
    if (printed(ROW_DIRECTIONS)) {
        // At the texel's middle only: BRDF · E · opacity.
        vec3 d = texel_middle(texel);
        float cosine = dot(photon.normal, d);
        vec3 front = photon.front
            + photon.front_lobe.light
                * lobe_towards(d, photon.normal, photon.front_lobe.toward, photon.front_lobe.alpha);
        vec3 back = photon.back
            + photon.back_lobe.light * lobe_towards(d, -photon.normal, photon.back_lobe.toward, photon.back_lobe.alpha);
        return vec4(cosine > 0.0 ? front : cosine < 0.0 ? back : vec3(0.0), 1.0) * photon.share;
    }
    // The sum of the means is made π for every normal, so that a voxel sends exactly the light of its triangles.
    float whole = photon.area * PI / texels_total(photon.normal);
    float front = whole * texel_cosine(texel, photon.normal);
    float back = photon.dark_back ? 0.0 : whole * texel_cosine(texel, -photon.normal);
    vec3 light = photon.front * front + photon.back * back;
    if (feature(FEATURE_SPECULAR)) {
        light += photon.area * lobe_sent(photon.front_lobe, texel, photon.normal);
        light += (photon.dark_back ? 0.0 : photon.area) * lobe_sent(photon.back_lobe, texel, -photon.normal);
    }
    return vec4(light, front + back);
}

void fill(uvec3 cell, uint first, uint texel) {
    FixedSum sum = fixed_zero();
    uint item = first;
    for (uint k = 0u; k < globals.item_count && item != 0u; k++) {
        fixed_add(sum, sent(photon_of(item - 1u), texel));
        item = list_items[item - 1u].next;
    }
    vec4 value = fixed_value(sum);
    // If triangles more than fill the voxel, light and area are reduced by the same factor. In the printed form they
    // add up.
    value = printed(ROW_MIPS) ? min(value, vec4(LARGEST_STORED)) : value / max(value.a, 1.0);
    imageStore(photon_map, map_place(cell, texel, EDGE), value);
}
#endif

void main() {
    uint count = cell_counts[0].count * THREADS;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint cell = cells[i / THREADS];
        COUNT(HEADS, 1u);
        fill(cell_at(cell, EDGE), heads[cell], i % THREADS);
    }
}
