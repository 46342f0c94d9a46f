#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Mips in layered form, as in the talk: a fragment per cell of the whole level, a layer per slice.

#include "gi/cones/talk_mips.glsl"

layout(location = 0) flat in int in_layer;

layout(location = 0) out vec4 out_faces_0;
layout(location = 1) out vec4 out_faces_1;
layout(location = 2) out vec4 out_faces_2;
layout(location = 3) out vec4 out_faces_3;
layout(location = 4) out vec4 out_faces_4;
layout(location = 5) out vec4 out_faces_5;
layout(location = 6) out vec4 out_faces_6;

void main() {
    vec4 faces[7] = mip_faces(2 * ivec3(ivec2(gl_FragCoord.xy), in_layer));
    out_faces_0 = faces[0];
    out_faces_1 = faces[1];
    out_faces_2 = faces[2];
    out_faces_3 = faces[3];
    out_faces_4 = faces[4];
    out_faces_5 = faces[5];
    out_faces_6 = faces[6];
}
