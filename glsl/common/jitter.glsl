// A pseudo-random number in [0, 1) for a seed of integers: a voxel, a pixel or the bits of a place, and the hash of the
// animation's time (D9).
float jitter_hash(uvec4 seed) {
    // PCG, Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020.
    seed = seed * 1664525u + 1013904223u;
    seed.x += seed.y * seed.w;
    seed.y += seed.z * seed.x;
    seed.z += seed.x * seed.y;
    seed.w += seed.y * seed.z;
    seed ^= seed >> 16u;
    seed.x += seed.y * seed.w;
    return float(seed.x >> 8) / 16777216.0;
}
