// The light that travels on, to be written.

layout(set = 0, binding = 44, rgba32f) writeonly uniform image3D new_flux;
layout(set = 0, binding = 45, rgba32f) writeonly uniform image3D new_x;
layout(set = 0, binding = 46, rgba32f) writeonly uniform image3D new_y;
layout(set = 0, binding = 47, rgba32f) writeonly uniform image3D new_z;

void store_new(ivec3 cell, Field f) {
    imageStore(new_flux, cell, f.flux);
    imageStore(new_x, cell, f.x);
    imageStore(new_y, cell, f.y);
    imageStore(new_z, cell, f.z);
}
