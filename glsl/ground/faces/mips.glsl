// Mips: six directional preintegrations and one plain average. CPU twin: tests/twins/mips.rs.

#include "common/count.glsl"

// The level below, one view per face.
uniform sampler3D source_0;
uniform sampler3D source_1;
uniform sampler3D source_2;
uniform sampler3D source_3;
uniform sampler3D source_4;
uniform sampler3D source_5;
uniform sampler3D source_6;

vec4 under(vec4 front, vec4 back) {
    return front + (1.0 - front.a) * back;
}

// Four columns along `axis`, composited in the direction of travel and averaged.
vec4 mip_directional(sampler3D source, ivec3 corner, int axis, bool negative) {
    ivec3 along = ivec3(axis == 0, axis == 1, axis == 2);
    ivec3 u = ivec3(axis == 1, axis == 2, axis == 0);
    ivec3 v = ivec3(axis == 2, axis == 0, axis == 1);
    ivec3 first = negative ? along : ivec3(0);
    ivec3 second = negative ? ivec3(0) : along;
    COUNT(VOLUME_TEXELS, 8u);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++) {
        ivec3 column = corner + u * (i & 1) + v * (i >> 1);
        sum += under(texelFetch(source, column + first, 0), texelFetch(source, column + second, 0));
    }
    return sum * 0.25;
}

vec4 mip_average(sampler3D source, ivec3 corner) {
    COUNT(VOLUME_TEXELS, 8u);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 8; i++) {
        sum += texelFetch(source, corner + ivec3(i & 1, (i >> 1) & 1, i >> 2), 0);
    }
    return sum * 0.125;
}

// The seven values of the cell whose children's least corner is `corner`; x, y, z are for travel along −x −y −z.
vec4[7] average_of(sampler3D x, sampler3D y, sampler3D z, ivec3 corner) {
    vec4 faces[7];
    faces[0] = mip_directional(source_0, corner, 0, false);
    faces[1] = mip_directional(source_1, corner, 1, false);
    faces[2] = mip_directional(source_2, corner, 2, false);
    faces[3] = mip_directional(x, corner, 0, true);
    faces[4] = mip_directional(y, corner, 1, true);
    faces[5] = mip_directional(z, corner, 2, true);
    faces[6] = mip_average(source_6, corner);
    return faces;
}

vec4[7] average_children(ivec3 corner) {
    return average_of(source_3, source_4, source_5, corner);
}
