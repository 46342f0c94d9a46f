// The axis along which a vector is longest: 0, 1 or 2; the first of equal ones.
uint dominant_axis(vec3 n) {
    vec3 size = abs(n);
    return size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
}
