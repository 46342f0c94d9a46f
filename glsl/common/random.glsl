// Random numbers by a hash of integers. A seed combines, say, the pixel, the pass and the number of earlier draws.

// Four numbers in [0, 1): PCG4D (Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020), upper 24 bits.
vec4 random_numbers(uvec4 seed) {
    uvec4 v = seed * 1664525u + 1013904223u;
    for (uint round = 0u; round < 2u; round++) {
        v.x += v.y * v.w;
        v.y += v.z * v.x;
        v.z += v.x * v.y;
        v.w += v.y * v.z;
        v = round == 0u ? v ^ (v >> 16u) : v;
    }
    return vec4(v >> 8u) / 16777216.0;
}
