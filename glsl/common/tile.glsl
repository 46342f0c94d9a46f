// Positions of threads in tiles of 16 by 16 pixels, each shared by four workgroups of 64. Adjacent threads are four
// pixels apart, so that they have the same position in their squares of different directions (ground/interleave.glsl),
// and trace the same directions.

uvec2 place_in_tile(uint thread) {
    uvec2 square = uvec2(bitfieldExtract(thread, 0, 2), bitfieldExtract(thread, 2, 2));
    return 4u * square + uvec2(bitfieldExtract(thread, 4, 2), bitfieldExtract(thread, 6, 2));
}
