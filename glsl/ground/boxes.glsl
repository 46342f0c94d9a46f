// Nested boxes of voxels. Box 0 is the base grid. Each further box has as many voxels, a quarter as wide, and its
// content is not listed in the box around it. Triangles, rays and points are in voxels of box 0; positions within one
// voxel are in those of its box. Without further boxes all of this is constant. CPU twin: src/ground/boxes.rs.

#include "common/hit_triangle.glsl"
#include "ground/frame.glsl"
#include "ground/heads.glsl"

struct Box {
    uint number;
    float scale; // voxels of the box per voxel of box 0
    vec3 begin; // origin of the box in its own voxels
};

Box make_box(uint number, vec3 corner) {
    float scale = BOXES == 0u ? 1.0 : float(1u << 2u * number);
    return Box(number, scale, number == 0u ? vec3(0.0) : corner * scale);
}

Box box_numbered(uint number) {
    return make_box(number, frame.boxes[max(number, 1u) - 1u]);
}

// Whether box `number`, whose least corner is `corner`, contains a point.
bool box_holds(uint number, vec3 corner, vec3 p) {
    vec3 from = p - corner;
    float side = float(EDGE) / float(1u << 2u * number);
    return all(greaterThanEqual(from, vec3(0.0))) && all(lessThan(from, vec3(side)));
}

// The smallest box that contains a point.
Box box_at(vec3 p) {
    uint number = 0u;
    for (uint i = 1u; i <= BOXES; i++) {
        number = box_holds(i, frame.boxes[i - 1u], p) ? i : number;
    }
    return box_numbered(number);
}

// The smallest box that contained a point when the previous lists were made.
Box last_box_at(vec3 p) {
    uint number = 0u;
    for (uint i = 1u; i <= BOXES; i++) {
        number = box_holds(i, frame.last_boxes[i - 1u], p) ? i : number;
    }
    return make_box(number, frame.last_boxes[max(number, 1u) - 1u]);
}

// The box of a voxel, by its index among the heads.
Box box_of(uint voxel) {
    return box_numbered(BOXES == 0u ? 0u : voxel / (EDGE * EDGE * EDGE));
}

uvec3 cell_in(Box box, uint voxel) {
    return cell_at(voxel - box.number * (EDGE * EDGE * EDGE), EDGE);
}

// The index of the nearest cell among the heads.
uint voxel_in(Box box, ivec3 cell) {
    return box.number * (EDGE * EDGE * EDGE) + uint(head_index(clamp(cell, ivec3(0), ivec3(int(EDGE) - 1))));
}

vec3 in_box(Box box, vec3 p) {
    return p * box.scale - box.begin;
}

mat3 in_box(Box box, mat3 corners) {
    return mat3(in_box(box, corners[0]), in_box(box, corners[1]), in_box(box, corners[2]));
}

vec3 from_box(Box box, vec3 p) {
    return (p + box.begin) / box.scale;
}

// Whether the next smaller box lists the content of a cell.
bool is_covered(Box box, ivec3 cell) {
    if (box.number >= BOXES) {
        return false;
    }
    ivec3 from = cell - ivec3(in_box(box, frame.boxes[min(box.number, MOST_BOXES - 1u)]));
    return all(greaterThanEqual(from, ivec3(0))) && all(lessThan(from, ivec3(int(EDGE / 4u))));
}

// The offset of ray origins from a surface in voxels of box 0: that of rounding there, even in smaller boxes.
float ray_start_in(Box box) {
    return RAY_START * max(1.0 / box.scale, 0.0625);
}

float ray_start_at(vec3 p) {
    return ray_start_in(box_at(p));
}
