// Places of a workgroup's 64 threads in a square of 8 by 8. CPU devices run eight threads at a time, which so are neighbours along
// both axes, and take what the slowest takes.

uvec2 place_in_tile(uint thread) {
    uint x = bitfieldExtract(thread, 0, 2) | bitfieldExtract(thread, 3, 1) << 2;
    return uvec2(x, bitfieldExtract(thread, 2, 1) | bitfieldExtract(thread, 4, 2) << 1);
}
