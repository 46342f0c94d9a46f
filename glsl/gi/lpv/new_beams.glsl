// The beams of the next step, for writing.

#include "gi/lpv/beams.glsl"

layout(rgba32f) writeonly uniform image3D new_light[2];

void store_new(ivec3 cell, KeptBeam beam) {
    imageStore(new_light[0], cell, beam.flux);
    imageStore(new_light[1], cell, beam.direction);
}
