// The constants of a whole frame, and behind it the map of the sky.

#include "ground/layout.glsl"

layout(scalar) readonly buffer FrameBuffer {
    Frame frame;
    uint sky_words[]; // texels of the sky's map and of its levels
};
