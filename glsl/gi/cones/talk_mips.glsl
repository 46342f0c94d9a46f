// The mips as the talk prints them, where the ledger says so.

#include "gi/cones/constants.glsl"
#include "ground/faces/mips.glsl"

// D2: −y reads (1,0,1) twice in its fourth column, so that alpha can reach 1.25.
vec4 minus_y_fault(sampler3D source, ivec3 corner) {
    COUNT(VOLUME_TEXELS, 2u);
    vec4 near = texelFetch(source, corner + ivec3(1), 0);
    vec4 far = texelFetch(source, corner + ivec3(1, 0, 1), 0);
    return 0.25 * (far - near);
}

// D1: −x −y −z fetch the volumes of +x +y +z.
vec4[7] mips_of_three(ivec3 corner) {
    vec4 faces[7];
    faces[0] = mip_directional(source_0, corner, 0, false);
    faces[1] = mip_directional(source_1, corner, 1, false);
    faces[2] = mip_directional(source_2, corner, 2, false);
    faces[3] = mip_directional(source_0, corner, 0, true);
    faces[4] = mip_directional(source_1, corner, 1, true);
    faces[5] = mip_directional(source_2, corner, 2, true);
    faces[6] = mip_average(source_6, corner);
    return faces;
}

vec4[7] mip_faces(ivec3 corner) {
    vec4 faces[7];
    if (printed(1)) {
        faces = mips_of_three(corner);
    } else {
        faces = average_children(corner);
    }
    if (printed(2)) {
        if (printed(1)) {
            faces[4] += minus_y_fault(source_1, corner);
        } else {
            faces[4] += minus_y_fault(source_4, corner);
        }
    }
    return faces;
}
