// The tree's nodes. `links` of a node: 9 words, written by src/ground/tree/. `box`: on which of 65536 planes along each
// axis the volume's part that holds the node's triangles begins (low half) and ends (high half). Words behind the
// nodes' are sources of triangles.

#include "ground/constants.glsl"

const uint NODE_WORDS = 9u;
const uint NODE_NEXT = 1u; // where the 8 octants' ways past the node start
const uint LEAF = 3u; // in the two low bits of the first word, instead of the axis that parts the children

const uint EMPTY_BOX = 0x0000ffffu; // begins where others end

// Of a leaf, by its first word: how many triangles it has, and the word that holds the first one's source. 0 has none.
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
