// Per pixel, how uv moves to the neighbours. Of the weights, which are interpolated: helper lanes beyond the triangle's
// edge read zeros from buffers on lavapipe, so a uv made there would be 0.
Footprint pixel_footprint(Triangle t, vec3 weights) {
    vec4 dx = triangle_uv(t, dFdx(weights));
    vec4 dy = triangle_uv(t, dFdy(weights));
    return Footprint(mat2[2](mat2(dx.xy, dy.xy), mat2(dx.zw, dy.zw)));
}
