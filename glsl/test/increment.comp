#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(scalar) buffer Values { uint values[]; };

void main() {
    values[gl_GlobalInvocationID.x] += 1;
}
