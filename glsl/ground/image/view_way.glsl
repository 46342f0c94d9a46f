// The offset of an image position from the axis of the view.

#include "ground/frame.glsl"

// For an image position in pixels: voxels per voxel along the axis, or voxels for an orthographic view.
vec3 off_axis(vec2 place) {
    vec2 ndc = place / frame.image_size * 2.0 - 1.0 - frame.ndc_shift;
    return frame.right_per_ndc * ndc.x + frame.down_per_ndc * ndc.y;
}
