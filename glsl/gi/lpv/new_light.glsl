// The light of the next step, for writing.

#include "gi/lpv/field.glsl"

layout(rgba32f) writeonly uniform image3D new_light[4];

void store_new(ivec3 cell, Field f) {
    imageStore(new_light[0], cell, f.flux);
    imageStore(new_light[1], cell, f.x);
    imageStore(new_light[2], cell, f.y);
    imageStore(new_light[3], cell, f.z);
}
