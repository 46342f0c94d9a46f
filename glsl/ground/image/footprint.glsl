#include "ground/surface.glsl"

// Per pixel, how uv moves to the neighbours; `dx` and `dy`: how weights do.
Footprint footprint_of(Attributes attributes, vec3 dx, vec3 dy) {
    vec4 x = between(attributes.uvs, dx);
    vec4 y = between(attributes.uvs, dy);
    return Footprint(mat2[2](mat2(x.xy, y.xy), mat2(x.zw, y.zw)));
}

// Of interpolated weights: helper lanes beyond the triangle's edge read zeros from buffers on lavapipe, so a uv made there would
// be 0.
Footprint pixel_footprint(Attributes attributes, vec3 weights) {
    return footprint_of(attributes, dFdx(weights), dFdy(weights));
}
