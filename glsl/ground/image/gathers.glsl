// The surfaces for which light is gathered.
//! per method

#include "ground/layers.glsl"
#include "method/look_up.glsl"

// Smooth metals, glass and unlit surfaces do not gather light.
bool gathers(Surface s) {
#ifdef METHOD_GATHERS_LOBES
    return scatters(s) || gathers_lobe(s);
#else
    return scatters(s);
#endif
}
