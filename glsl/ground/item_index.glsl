// Where the list item of a triangle in a voxel is: a hash table with open addressing, of which two thirds are taken at
// most. It lies behind the heads of all voxels' lists, since devices bind few buffers at once. No outcome depends on the
// order in which items entered it.

#include "common/count.glsl"
#include "ground/bindings.glsl"

const uint INDEX_FIRST = (1u + BOXES) * EDGE * EDGE * EDGE; // among the heads; items, 1-based; 0: free

// How many there are, a power of two; 0 where a method makes none.
uint index_places() {
    return uint(heads.length()) - INDEX_FIRST;
}

// The first place of an item, from 0 on.
uint index_place(uint triangle, uint voxel) {
    // Odd numbers near 2³² divided by the golden ratio and by √2, and a last mix of the high bits into the low ones.
    uint hash = (triangle * 0x9e3779b1u) ^ (voxel * 0xb504f333u);
    hash = (hash ^ hash >> 15u) * 0x85ebca77u;
    return (hash ^ hash >> 13u) & index_places() - 1u;
}

uint index_after(uint place) {
    return place + 1u & index_places() - 1u;
}
