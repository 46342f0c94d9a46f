#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Voxelise: every voxel that a triangle touches gets it into its list. A thread lists a triangle that is seen by few
// columns of voxels; a workgroup goes through the columns of each other one together, or, where triangles are few,
// several workgroups do.

#include "common/count.glsl"
#include "common/dominant_axis.glsl"
#include "ground/layout.glsl"
#include "ground/list_column.glsl"

layout(local_size_x = 64) in;

// Columns that a thread lists a triangle in by itself.
const uint FEW_COLUMNS = 16u;

layout(scalar) readonly buffer Recorded { Globals recorded; }; // the base grid's counters
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };

// A rectangle of columns, along the two axes after the projected one.
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

// The columns about a triangle, a hundredth of a voxel for rounding about them. None if all of it is outside.
Columns columns_of(Projected p) {
    vec3 low = min(p.a, min(p.b, p.c)) - 0.01;
    vec3 high = max(p.a, max(p.b, p.c)) + 0.01;
    bool outside = any(lessThan(high, vec3(0.0))) || any(greaterThan(low, vec3(float(EDGE))));
    uint u = (p.axis + 1u) % 3u;
    uint v = (p.axis + 2u) % 3u;
    float last = float(EDGE) - 1.0;
    uvec2 first = uvec2(clamp(floor(vec2(low[u], low[v])), 0.0, last));
    uvec2 end = uvec2(clamp(floor(vec2(high[u], high[v])), 0.0, last));
    return Columns(first, outside ? uvec2(0u) : end - first + 1u);
}

uvec2 column_at(Columns columns, uint i) {
    return columns.first + uvec2(i % columns.size.x, i / columns.size.x);
}

void main() {
    uint count = min(recorded.vertex_count / 3u, uint(triangles.length()));
    // Triangles of a workgroup stand side by side: what goes through lists then finds their items close together.
    uint group = gl_WorkGroupID.x + gl_NumWorkGroups.x * gl_WorkGroupID.y;
    uint own = group * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    wide_count = 0u;
    barrier();
    if (own < count) {
        COUNT(CORNERS, 3u);
        Projected p = projected(own);
        Columns columns = columns_of(p);
        uint many = columns.size.x * columns.size.y;
        if (many > FEW_COLUMNS) {
            wide_triangles[atomicAdd(wide_count, 1u)] = own;
        }
        for (uint i = 0u; i < (many <= FEW_COLUMNS && gl_WorkGroupID.z == 0u ? many : 0u); i++) {
            list_column(own, p, column_at(columns, i));
        }
    }
    barrier();
    uint wide = wide_count;
    for (uint k = 0u; k < wide; k++) {
        COUNT(CORNERS, 3u);
        Projected p = projected(wide_triangles[k]);
        Columns columns = columns_of(p);
        uint many = columns.size.x * columns.size.y;
        uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.z;
        for (uint i = gl_LocalInvocationID.x + gl_WorkGroupSize.x * gl_WorkGroupID.z; i < many; i += stride) {
            list_column(wide_triangles[k], p, column_at(columns, i));
        }
    }
}
