#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Empties voxels of a volume that the last frame filled and this one does not.

#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "gi/photons/octahedron.glsl"
#include "gi/photons/store.glsl"

void empty_cell(uvec3 cell);

#include "ground/empty_cells.glsl"

void empty_cell(uvec3 cell) {
    for (uint texel = 0u; texel < TEXELS; texel++) {
        imageStore(photon_map, map_place(cell, texel, EDGE >> push.level), vec4(0.0));
    }
    imageStore(opacity_forth, ivec3(cell), vec4(0.0));
    imageStore(opacity_back, ivec3(cell), vec4(0.0));
}
