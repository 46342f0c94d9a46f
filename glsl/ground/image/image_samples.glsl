// Where a pixel sees the plane of the triangle that it shades.

// Vulkan's standard sample locations.
const vec2 SAMPLES_4[4] = vec2[4](vec2(0.375, 0.125), vec2(0.875, 0.375), vec2(0.125, 0.625), vec2(0.625, 0.875));

// Of the whole pixel, from its corner.
vec2 sample_place(uint i) {
    return frame.samples == 4u ? SAMPLES_4[i] : vec2(0.5);
}

// The point of a triangle's plane that is seen at a place of the image, pixels; voxels. `a`: any of its corners.
vec3 seen_point(vec2 place, vec3 a, vec3 facet) {
    vec2 ndc = place / frame.image_size * 2.0 - 1.0 - frame.ndc_shift;
    vec3 offset = frame.right_per_ndc * ndc.x + frame.down_per_ndc * ndc.y;
    vec3 from = frame.orthographic != 0u ? frame.eye + offset : frame.eye;
    vec3 d = frame.orthographic != 0u ? frame.forward : frame.forward + offset;
    float along = dot(facet, d);
    return from + d * (dot(facet, a - from) / (along == 0.0 ? 1e-20 : along));
}
