// One level of a volume, to be written. The map holds its sixteen directions side by side, 4 × 4 blocks of the whole
// grid each, so that hardware filters within a block.

layout(rgba16f) writeonly uniform image3D photon_map;
layout(rgba16f) writeonly uniform image3D opacity_forth; // met along +x +y +z; share of samples
layout(rgba16f) writeonly uniform image3D opacity_back; // met along −x −y −z

// `edge`: of the level.
ivec3 map_place(uvec3 cell, uint texel, uint edge) {
    return ivec3(cell) + int(edge) * ivec3(texel & 3u, texel >> 2u, 0);
}
