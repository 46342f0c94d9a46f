// Occupied cells of one level, a thread each. Their order varies between runs, so no result may depend on it.

#include "ground/counts.glsl"
#include "ground/heads.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer Cells { uint cells[]; };
