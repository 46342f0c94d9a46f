// Occupied cells of one level, a thread each. Their order is the voxeliser's race: no result may depend on it.

#include "ground/heads.glsl"
#include "ground/layout.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer Cells { uint cells[]; };
layout(scalar) readonly buffer CellCounts { ListCount cell_counts[]; };
