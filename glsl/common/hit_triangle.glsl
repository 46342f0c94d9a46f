const float RAY_START = 1e-3; // voxels along the facet: 100 times the rounding of a position at edge 128

// Möller and Trumbore, both sides. Returns distance (negative: no hit), barycentric weights of b and c in `uv`.
float hit_triangle(vec3 origin, vec3 d, vec3 a, vec3 b, vec3 c, out vec2 uv) {
    vec3 e1 = b - a;
    vec3 e2 = c - a;
    vec3 p = cross(d, e2);
    float det = dot(e1, p);
    uv = vec2(0.0);
    if (det == 0.0) {
        return -1.0;
    }
    float inverse = 1.0 / det;
    vec3 s = origin - a;
    uv.x = dot(s, p) * inverse;
    vec3 q = cross(s, e1);
    uv.y = dot(d, q) * inverse;
    // A small tolerance keeps light from passing between two triangles with a common edge.
    if (uv.x < -1e-5 || uv.y < -1e-5 || uv.x + uv.y > 1.00001) {
        return -1.0;
    }
    return dot(e2, q) * inverse;
}
