// The uniforms of a frame, followed by the map of the sky.

#include "ground/layout.glsl"

layout(scalar) readonly buffer FrameBuffer {
    Frame frame;
    uint sky_words[]; // texels of the sky's map and its levels
};
