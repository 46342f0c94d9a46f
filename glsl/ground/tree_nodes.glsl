// The tree's nodes. `links` has 9 words per node, written by src/ground/tree/. `box` has, for each axis, the first
// plane (low half) and the last plane (high half) of the node's triangles within the volume, out of 65536 planes. The
// words after those of the nodes are sources of triangles.

#include "ground/constants.glsl"

const uint NODE_WORDS = 9u;
const uint NODE_NEXT = 1u; // first of the 8 words with the next node for each octant
const uint LEAF = 3u; // in the two low bits of the first word, instead of the axis that separates the children

const uint EMPTY_BOX = 0x0000ffffu; // begins where other boxes end

// For a leaf, by its first word: the number of its triangles, and the word with the source of the first one. 0 has
// none.
uint leaf_count(uint word) {
    return word == 0u ? 0u : (word >> 2u & 1u) + 1u;
}

uint leaf_first(uint word) {
    return word >> 3u;
}

// One plane lies outside of the volume on each side.
float planes_per_voxel() {
    return 65533.0 / float(EDGE);
}
