// The order in which the blocks of a list are worked at. llvmpipe hands each processor one run of workgroups: with two
// processors, the first had a half of the list to itself, and places that are dear stand beside each other.

// How far apart in the list blocks are that stand beside each other in the dispatch: a prime.
const uint BLOCK_STRIDE = 211u;

// The block at `turn`, of `blocks`: every one has its turn.
uint block_at(uint turn, uint blocks) {
    return turn * (blocks % BLOCK_STRIDE == 0u ? 1u : BLOCK_STRIDE) % blocks; // prime to their number
}
