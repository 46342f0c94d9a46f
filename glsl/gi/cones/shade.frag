#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Shading in layered form, as in the talk: a fragment per voxel of the whole grid, a layer per slice. With LOOK_UP it
// gathers from the volume of the previous bounce; without, no volume is bound.

#include "gi/cones/shade_voxel.glsl"

layout(location = 0) flat in int in_layer;

layout(location = 0) out vec4 out_faces_0;
layout(location = 1) out vec4 out_faces_1;
layout(location = 2) out vec4 out_faces_2;
layout(location = 3) out vec4 out_faces_3;
layout(location = 4) out vec4 out_faces_4;
layout(location = 5) out vec4 out_faces_5;
layout(location = 6) out vec4 out_faces_6;

void main() {
    vec4 faces[7] = shade_voxel(uvec3(gl_FragCoord.xy, in_layer));
    out_faces_0 = faces[0];
    out_faces_1 = faces[1];
    out_faces_2 = faces[2];
    out_faces_3 = faces[3];
    out_faces_4 = faces[4];
    out_faces_5 = faces[5];
    out_faces_6 = faces[6];
}
