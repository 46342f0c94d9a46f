// The point where a pixel sees the plane of its triangle, and the change of the triangle's attributes there.

#include "ground/surface.glsl"
#include "common/closest_point.glsl"
#include "ground/image/view_way.glsl"

// Vulkan's standard sample locations.
const vec2 SAMPLES_4[4] = vec2[4](vec2(0.375, 0.125), vec2(0.875, 0.375), vec2(0.125, 0.625), vec2(0.625, 0.875));

// Of the whole pixel, relative to its corner.
vec2 sample_place(uint i) {
    return frame.samples == 4u ? SAMPLES_4[i] : vec2(0.5);
}

// The size of a gathered pixel in pixels of the image.
vec2 gathered_pixel() {
    uvec2 image = uvec2(frame.image_size);
    return frame.image_size / vec2((image + GATHER_SCALE - 1u) / GATHER_SCALE);
}

// The point of a triangle's plane at an image position in pixels; in voxels. `a` is any of its corners.
vec3 seen_point(vec2 place, vec3 a, vec3 facet) {
    vec3 offset = off_axis(place);
    vec3 from = frame.orthographic != 0u ? frame.eye + offset : frame.eye;
    vec3 d = frame.orthographic != 0u ? frame.forward : frame.forward + offset;
    float along = dot(facet, d);
    return from + d * (dot(facet, a - from) / (along == 0.0 ? 1e-20 : along));
}

// Barycentric weights at an image position in pixels.
vec3 seen_weights(vec2 place, Triangle t, vec3 facet) {
    vec3 a = t.corners[0];
    vec2 bc = barycentric(a, t.corners[1], t.corners[2], seen_point(place, a, facet));
    return vec3(1.0 - bc.x - bc.y, bc);
}

// Barycentric weights at a position, and their change to the next pixels.
struct PlaceOnTriangle {
    vec3 weights;
    vec3 across;
    vec3 down;
};

PlaceOnTriangle place_on_triangle(vec2 place, vec2 pixel, Triangle t, vec3 facet) {
    vec3 weights = seen_weights(place, t, facet);
    vec3 across = seen_weights(place + vec2(pixel.x, 0.0), t, facet) - weights;
    return PlaceOnTriangle(weights, across, seen_weights(place + vec2(0.0, pixel.y), t, facet) - weights);
}

// The change of uv to the neighbours.
Footprint pixel_footprint(Attributes attributes, PlaceOnTriangle at) {
    vec4 x = between(attributes.uvs, at.across);
    vec4 y = between(attributes.uvs, at.down);
    return Footprint(mat2[2](mat2(x.xy, y.xy), mat2(x.zw, y.zw)));
}
