// The voxels of a column that contain samples of a pixel: a pixel is a column of voxels, and its samples are points of
// the triangle. CPU twin: tests/twins/cover.rs.
//! fragment

#include "ground/constants.glsl"

// Vulkan's standard sample locations, in sixteenths of a pixel.
const vec2 FOUR[4] = vec2[4](vec2(6, 2), vec2(14, 6), vec2(2, 10), vec2(10, 14));
const vec2 EIGHT[8] =
    vec2[8](vec2(9, 5), vec2(7, 11), vec2(13, 9), vec2(5, 3), vec2(3, 13), vec2(1, 7), vec2(11, 15), vec2(15, 1));

vec2 sample_place(uint i) {
    return (SAMPLES == 8u ? EIGHT[i & 7u] : SAMPLES == 4u ? FOUR[i & 3u] : vec2(8.0)) / 16.0;
}

bool covered(uint i) {
    return (gl_SampleMaskIn[0] & (1 << int(i))) != 0;
}

// Samples in three successive voxels of the column.
struct Slices {
    int first;
    uvec3 counts;
};

// The dominant axis keeps both slopes at or below 1, so samples of one pixel lie in at most three voxels.
Slices slices_of(vec3 a, vec3 b, vec3 c, uint axis, vec3 normal) {
    uint u = (axis + 1u) % 3u;
    uint v = (axis + 2u) % 3u;
    // The rasteriser snaps corners to a fraction of a pixel. A sample just outside of the triangle is clamped to its
    // depth.
    float least = min(a[axis], min(b[axis], c[axis]));
    float most = max(a[axis], max(b[axis], c[axis]));
    vec2 slope = vec2(normal[u], normal[v]) / normal[axis];
    vec2 pixel = floor(gl_FragCoord.xy);
    int slices[8];
    int first = 0x7fffffff;
    for (uint i = 0u; i < SAMPLES; i++) {
        float depth = a[axis] - dot(slope, pixel + sample_place(i) - vec2(a[u], a[v]));
        slices[i] = int(floor(clamp(depth, least, most)));
        first = covered(i) ? min(first, slices[i]) : first;
    }
    uvec3 found = uvec3(0u);
    for (uint i = 0u; i < SAMPLES; i++) {
        int above = slices[i] - first;
        found += covered(i) ? uvec3(above == 0, above == 1, above >= 2) : uvec3(0u);
    }
    return Slices(first, found);
}

// Whether samples lie in slice k within the grid, and in which voxel.
bool voxel_of(Slices slices, int k, uint axis, out uvec3 voxel) {
    voxel[(axis + 1u) % 3u] = uint(gl_FragCoord.x);
    voxel[(axis + 2u) % 3u] = uint(gl_FragCoord.y);
    voxel[axis] = uint(slices.first + k);
    return slices.counts[k] > 0u && slices.first + k >= 0 && slices.first + k < int(EDGE);
}
