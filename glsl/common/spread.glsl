// The order in which the blocks of a list are processed. llvmpipe gives each processor a contiguous range of
// workgroups, and expensive items are adjacent in a list, so processors would get uneven work.

// The distance in the list of blocks that are adjacent in the dispatch: a prime.
const uint BLOCK_STRIDE = 211u;

// The block at position `turn` of `blocks`; every block occurs once.
uint block_at(uint turn, uint blocks) {
    return turn * (blocks % BLOCK_STRIDE == 0u ? 1u : BLOCK_STRIDE) % blocks; // coprime to their number
}
