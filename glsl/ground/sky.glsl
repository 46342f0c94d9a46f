// Stored radiance of the sky towards unit d: the same all around, brighter above than below where it has a gradient.
vec3 sky_towards(vec3 d) {
    return (frame.sky + frame.sky_gradient * d.y) * frame.scale;
}
