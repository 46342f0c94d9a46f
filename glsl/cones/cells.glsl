// Occupied cells of one level, a thread each. Their order is the voxeliser's race: no result may depend on it.

layout(local_size_x = 64) in;

layout(set = 0, binding = 32, scalar) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 22, scalar) readonly buffer CellCounts { CellCount cell_counts[]; };

uvec3 cell_at(uint index, uint edge) {
    return uvec3(index % edge, index / edge % edge, index / (edge * edge));
}
