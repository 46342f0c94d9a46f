#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Record: appends a record of each triangle of the scene. Zero-area triangles are counted and dropped. A thread per
// triangle.

#include "common/thread.glsl"
#include "ground/recorded.glsl"

layout(scalar) readonly buffer RecordDraws { RecordDraw record_draws[]; };
layout(scalar) readonly buffer SceneVertices { float scene_vertices[]; };
layout(scalar) readonly buffer SceneIndices { uint scene_indices[]; };

// The first word of a corner's vertex: its position, then its attributes.
uint vertex_place(uint number, uint corner) {
    uint index = scene_indices[draw.first_index + 3u * number + corner] + uint(draw.vertex_offset);
    return index * (3u + 3u + tangent_words() + uv_words() + color_words());
}

vec3 position_at(uint place) {
    return vec3(scene_vertices[place], scene_vertices[place + 1u], scene_vertices[place + 2u]);
}

float read_word(inout uint place) {
    return scene_vertices[place++];
}

Corner corner_at(uint place) {
    Corner corner = Corner(position_at(place), vec3(0.0), vec4(0.0), vec4(0.0), vec4(1.0));
    place += 3u;
    for (int k = 0; k < 3; k++) {
        corner.normal[k] = read_word(place);
    }
    for (int k = 0; k < int(tangent_words()); k++) {
        corner.tangent[k] = read_word(place);
    }
    for (int k = 0; k < int(uv_words()); k++) {
        corner.uv[k] = read_word(place);
    }
    if (color_words() > 0u) {
        corner.color.xy = unpackHalf2x16(floatBitsToUint(scene_vertices[place]));
        corner.color.zw = unpackHalf2x16(floatBitsToUint(scene_vertices[place + 1u]));
    }
    return corner;
}

// The last draw that begins at or before a triangle.
uint draw_of(uint source) {
    uint first = 0u;
    uint end = uint(record_draws.length());
    while (end - first > 1u) {
        uint middle = (first + end) / 2u;
        bool begins = record_draws[middle].first_source <= source;
        first = begins ? middle : first;
        end = begins ? end : middle;
    }
    return first;
}

void main() {
    uint source = thread();
    draw = record_draws[draw_of(source)];
    uint number = source - draw.first_source;
    if (number >= draw.triangles) {
        return;
    }
    COUNT(SCENE_VERTICES, 3u);
    Corner corners[3];
    for (uint i = 0u; i < 3u; i++) {
        corners[i] = in_voxels(corner_at(vertex_place(number, corner_number(i))));
    }
    if (triangle_normal(corners[0].position, corners[1].position, corners[2].position) == vec3(0.0)) {
        atomicAdd(globals.degenerate_count, 1u);
        return;
    }
    uint slot = take_slot();
    if (slot < uint(triangles.length())) {
        for (uint i = 0u; i < 3u; i++) {
            write_corner(slot, i, corners[i]);
        }
        write_triangle(slot, number);
    }
}
