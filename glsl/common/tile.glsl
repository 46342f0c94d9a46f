// Places of threads in squares of 16 by 16, for four workgroups of 64 each. Threads beside each other are four pixels
// apart: of the squares in which directions differ (ground/interleave.glsl) they have the same place, and look along
// the same directions.

uvec2 place_in_tile(uint thread) {
    uvec2 square = uvec2(bitfieldExtract(thread, 0, 2), bitfieldExtract(thread, 2, 2));
    return 4u * square + uvec2(bitfieldExtract(thread, 4, 2), bitfieldExtract(thread, 6, 2));
}
