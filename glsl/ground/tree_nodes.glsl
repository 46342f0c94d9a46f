// The tree's nodes. `links` of a node: 9 words, written by src/ground/tree/links.rs; an instance, which leaves of the tree over all
// instances name, takes the place of one: `links`, `boxes` and `source` of TreeInstance; `box`: on which of 65536 planes along each axis
// the volume's part that holds the node's triangles begins (low half) and ends (high half).

const uint NODE_WORDS = 9u;
const uint NODE_NEXT = 1u; // where the 8 octants' ways past the node start
const uint LEAF = 3u; // in the two low bits of the first word, instead of the axis that parts the children

const uint EMPTY_BOX = 0x0000ffffu; // begins where others end

// One plane lies outside of the volume on each side.
float planes_per_voxel() {
    return 65533.0 / float(EDGE);
}
