#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;
uniform sampler3D volume[2];
uniform sampler2DArray unorm;
uniform sampler2DArray srgb;
layout(rgba16f) uniform writeonly image3D written;
layout(scalar) writeonly buffer Result { vec4 result[]; };

void main() {
    result[0] = textureLod(volume[0], vec3(0.5), 0.0);
    result[1] = textureLod(volume[1], vec3(0.5), 1.0);
    result[2] = textureLod(unorm, vec3(0.5, 0.5, 1.0), 0.0);
    result[3] = textureLod(srgb, vec3(0.5, 0.5, 1.0), 0.0);
    imageStore(written, ivec3(0), vec4(7.0));
}
