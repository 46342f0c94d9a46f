// How a voxel's triangles fill its seven faces; `FILL` is the includer's.

const uint FILL_UNIFORM = 0u;
const uint FILL_FACING = 1u;
const uint FILL_COVERAGE = 2u;
const uint FILL_SIDED = 3u;
const uint FILL_FRONT = 4u;
