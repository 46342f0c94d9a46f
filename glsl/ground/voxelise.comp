#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Voxelise: adds every triangle to the list of every voxel that it touches. A thread lists a triangle with few columns
// of voxels. A workgroup visits the columns of larger triangles together or, if there are few triangles, several
// workgroups do. Each thread reserves room for the items of a block of columns at once: items that are adjacent in the
// lists are then adjacent in space, and passes over them read nearby memory.

#include "common/count.glsl"
#include "common/dominant_axis.glsl"
#include "common/thread.glsl"
#include "ground/layout.glsl"
#include "ground/list_column.glsl"

// The maximum number of columns of a triangle that a single thread lists.
const uint FEW_COLUMNS = 16u;
// Columns of a block; MOST_IN_COLUMN voxels of each have a bit in one word.
const uint BLOCK_COLUMNS = 8u;
// The shape of a block among many columns, along the two axes after the projected one.
const uvec2 BLOCK = uvec2(4u, 2u);

layout(scalar) readonly buffer Recorded { Globals recorded; }; // the base grid's counters
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };

// A rectangle of columns along the two axes after the projected one.
struct Columns {
    uvec2 first;
    uvec2 size; // 0: none
};

shared uint wide_triangles[gl_WorkGroupSize.x];
shared uint wide_count;

Projected projected(uint triangle) {
    vec3 a = in_grid(triangles[triangle].corners[0]);
    vec3 b = in_grid(triangles[triangle].corners[1]);
    vec3 c = in_grid(triangles[triangle].corners[2]);
    vec3 normal = triangle_normal(a, b, c);
    return Projected(a, b, c, normal, dominant_axis(normal));
}

// The columns of a triangle, with a hundredth of a voxel for rounding. Empty if the triangle is outside.
Columns columns_of(Projected p) {
    vec3 low = min(p.a, min(p.b, p.c)) - 0.01;
    vec3 high = max(p.a, max(p.b, p.c)) + 0.01;
    bool outside = any(lessThan(high, vec3(0.0))) || any(greaterThan(low, vec3(float(EDGE))));
    float last = float(EDGE) - 1.0;
    uvec2 first = uvec2(clamp(floor(across(low, p.axis)), 0.0, last));
    uvec2 end = uvec2(clamp(floor(across(high, p.axis)), 0.0, last));
    return Columns(first, outside ? uvec2(0u) : end - first + 1u);
}

// Column k of a block, counted from the first column. A few columns are split into blocks in their order, many into
// rectangles.
uvec2 column_at(Columns columns, bool few, uint block, uint k) {
    uint i = BLOCK_COLUMNS * block + k;
    uint across = (columns.size.x + BLOCK.x - 1u) / BLOCK.x;
    return few ? uvec2(i % columns.size.x, i / columns.size.x)
               : BLOCK * uvec2(block % across, block / across) + uvec2(k % BLOCK.x, k / BLOCK.x);
}

void list_block(uint triangle, Projected p, Columns columns, bool few, uint block) {
    uint touched = 0u;
    for (uint k = 0u; k < BLOCK_COLUMNS; k++) {
        uvec2 at = column_at(columns, few, block, k);
        if (all(lessThan(at, columns.size))) {
            touched |= touched_in(p, columns.first + at) << MOST_IN_COLUMN * k;
        }
    }
    uint item = touched != 0u ? take_items(uint(bitCount(touched))) : 0u;
    for (uint k = 0u; k < BLOCK_COLUMNS && touched != 0u; k++) {
        uint of_column = touched & (1u << MOST_IN_COLUMN) - 1u;
        list_column(triangle, p, columns.first + column_at(columns, few, block, k), of_column, item);
        item += uint(bitCount(of_column));
        touched >>= MOST_IN_COLUMN;
    }
}

void main() {
    uint count = min(recorded.vertex_count / 3u, uint(triangles.length()));
    // Triangles of a workgroup are adjacent, so that passes over lists find their items in nearby memory.
    uint own = thread();
    wide_count = 0u;
    barrier();
    if (own < count) {
        COUNT(CORNERS, 3u);
        Projected p = projected(own);
        Columns columns = columns_of(p);
        uint many = columns.size.x * columns.size.y;
        bool few = many <= FEW_COLUMNS;
        if (!few) {
            wide_triangles[atomicAdd(wide_count, 1u)] = own;
        }
        uint blocks = few && gl_WorkGroupID.z == 0u ? (many + BLOCK_COLUMNS - 1u) / BLOCK_COLUMNS : 0u;
        for (uint block = 0u; block < blocks; block++) {
            list_block(own, p, columns, true, block);
        }
    }
    barrier();
    uint wide = wide_count;
    for (uint k = 0u; k < wide; k++) {
        COUNT(CORNERS, 3u);
        Projected p = projected(wide_triangles[k]);
        Columns columns = columns_of(p);
        uvec2 blocks = (columns.size + BLOCK - 1u) / BLOCK;
        uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.z;
        uint first = gl_LocalInvocationID.x + gl_WorkGroupSize.x * gl_WorkGroupID.z;
        for (uint block = first; block < blocks.x * blocks.y; block += stride) {
            list_block(wide_triangles[k], p, columns, false, block);
        }
    }
}
