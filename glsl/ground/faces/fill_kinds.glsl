// The rules by which a voxel's triangles fill its seven values; the includer declares `FILL`.

const uint FILL_UNIFORM = 0u;
const uint FILL_FACING = 1u;
const uint FILL_COVERAGE = 2u;
const uint FILL_SIDED = 3u;
const uint FILL_FRONT = 4u;
