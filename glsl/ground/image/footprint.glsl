#include "ground/surface.glsl"

// Per pixel, how uv moves to the neighbours. Of the weights, which are interpolated: helper lanes beyond the triangle's
// edge read zeros from buffers on lavapipe, so a uv made there would be 0.
Footprint pixel_footprint(Attributes attributes, vec3 weights) {
    vec4 dx = between(attributes.uvs, dFdx(weights));
    vec4 dy = between(attributes.uvs, dFdy(weights));
    return Footprint(mat2[2](mat2(dx.xy, dy.xy), mat2(dx.zw, dy.zw)));
}

// How far the shading normal turns over half a pixel, radians, normal maps left out.
float normal_bend(Attributes attributes, vec3 weights) {
    return 0.5 * max(length(attributes.normals * dFdx(weights)), length(attributes.normals * dFdy(weights)));
}
