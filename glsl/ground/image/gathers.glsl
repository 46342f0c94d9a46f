// Which surfaces light is gathered for.
//! per method

#include "ground/layers.glsl"
#include "method/look_up.glsl"

// Smooth metals, glass and unlit surfaces gather nothing.
bool gathers(Surface s) {
#ifdef METHOD_GATHERS_LOBES
    return scatters(s) || gathers_lobe(s);
#else
    return scatters(s);
#endif
}
