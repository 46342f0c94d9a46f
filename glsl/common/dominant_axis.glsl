// The axis with the largest component of a vector: 0, 1 or 2; the first of equal ones.
uint dominant_axis(vec3 n) {
    vec3 size = abs(n);
    return size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
}

// The components of a vector along the two axes after that one.
vec2 across(vec3 v, uint axis) {
    return vec2(v[(axis + 1u) % 3u], v[(axis + 2u) % 3u]);
}

float cross2(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}
