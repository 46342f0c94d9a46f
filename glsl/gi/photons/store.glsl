// One level of a volume, for writing. The map stores its sixteen directions as 4 × 4 blocks, each of the whole grid, so
// that hardware filters within a block.

layout(rgba16f) writeonly uniform image3D photon_map;
layout(rgba16f) writeonly uniform image3D opacity_forth; // for travel along +x +y +z; share of samples
layout(rgba16f) writeonly uniform image3D opacity_back; // for travel along −x −y −z

// `edge` is that of the level.
ivec3 map_place(uvec3 cell, uint texel, uint edge) {
    return ivec3(cell) + int(edge) * ivec3(texel & 3u, texel >> 2u, 0);
}
