// The seven images of one level, for writing.

layout(rgba16f) writeonly uniform image3D faces_0;
layout(rgba16f) writeonly uniform image3D faces_1;
layout(rgba16f) writeonly uniform image3D faces_2;
layout(rgba16f) writeonly uniform image3D faces_3;
layout(rgba16f) writeonly uniform image3D faces_4;
layout(rgba16f) writeonly uniform image3D faces_5;
layout(rgba16f) writeonly uniform image3D faces_6;

void store_faces(uvec3 voxel, vec4 faces[7]) {
    imageStore(faces_0, ivec3(voxel), faces[0]);
    imageStore(faces_1, ivec3(voxel), faces[1]);
    imageStore(faces_2, ivec3(voxel), faces[2]);
    imageStore(faces_3, ivec3(voxel), faces[3]);
    imageStore(faces_4, ivec3(voxel), faces[4]);
    imageStore(faces_5, ivec3(voxel), faces[5]);
    imageStore(faces_6, ivec3(voxel), faces[6]);
}
