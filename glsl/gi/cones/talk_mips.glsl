// The mips as printed in the talk, for rows of the ledger in their printed form.

#include "gi/cones/constants.glsl"
#include "ground/faces/mips.glsl"

// D2: −y reads (1,0,1) twice in its fourth column, so that alpha can reach 1.25.
vec4 minus_y_fault(sampler3D source, ivec3 corner) {
    COUNT(VOLUME_TEXELS, 2u);
    vec4 near = texelFetch(source, corner + ivec3(1), 0);
    vec4 far = texelFetch(source, corner + ivec3(1, 0, 1), 0);
    return 0.25 * (far - near);
}

vec4[7] talk_average_of(sampler3D x, sampler3D y, sampler3D z, ivec3 corner) {
    vec4 faces[7] = average_of(x, y, z, corner);
    if (printed(2)) {
        faces[4] += minus_y_fault(y, corner);
    }
    return faces;
}

vec4[7] mip_faces(ivec3 corner) {
    if (printed(1)) { // D1: −x −y −z fetch the volumes of +x +y +z
        return talk_average_of(source_0, source_1, source_2, corner);
    }
    return talk_average_of(source_3, source_4, source_5, corner);
}
