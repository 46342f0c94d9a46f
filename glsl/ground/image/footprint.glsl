#include "ground/surface.glsl"

// Per pixel, how uv moves to the neighbours. Of the weights, which are interpolated: helper lanes beyond the triangle's
// edge read zeros from buffers on lavapipe, so a uv made there would be 0.
Footprint pixel_footprint(Triangle t, vec3 weights) {
    vec4 dx = triangle_uv(t, dFdx(weights));
    vec4 dy = triangle_uv(t, dFdy(weights));
    return Footprint(mat2[2](mat2(dx.xy, dy.xy), mat2(dx.zw, dy.zw)));
}

// How far the shading normal turns over half a pixel, radians, normal maps left out.
float normal_bend(Triangle t, vec3 weights) {
    mat3 normals = mat3(t.vertices[0].normal, t.vertices[1].normal, t.vertices[2].normal);
    return 0.5 * max(length(normals * dFdx(weights)), length(normals * dFdy(weights)));
}
