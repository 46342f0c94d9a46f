// How far around every voxel nothing is listed, so that rays pass it at once: a nibble per voxel, eight to a word.
// 0: the voxel lists something. 1 to 4: Chebyshev distance in voxels to the nearest one that does, or more at 4. 5 to 15: of its
// brick to the nearest one with such a voxel, in bricks, plus 3, or more at 15.

const int MOST_NEAR = 4;
const int MOST_REACH = 12; // bricks

int clearance_code(uint word, int voxel) {
    return int(word >> (uint(voxel & 7) * 4u) & 15u);
}

// Voxels around it, on each side, of which none lists anything.
int clear_radius(int code) {
    return max(max(code - 1, int(BRICK) * (code - MOST_NEAR)), 0);
}
