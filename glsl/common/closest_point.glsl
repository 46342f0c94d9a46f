// Barycentric weights (of b and c) of the point of a triangle nearest to p (Ericson, "Real-Time Collision
// Detection", 5.1.5).
vec2 closest_point(vec3 a, vec3 b, vec3 c, vec3 p) {
    vec3 ab = b - a;
    vec3 ac = c - a;
    vec3 ap = p - a;
    float d1 = dot(ab, ap);
    float d2 = dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) {
        return vec2(0.0);
    }
    vec3 bp = p - b;
    float d3 = dot(ab, bp);
    float d4 = dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) {
        return vec2(1.0, 0.0);
    }
    vec3 cp = p - c;
    float d5 = dot(ab, cp);
    float d6 = dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) {
        return vec2(0.0, 1.0);
    }
    float vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        return vec2(d1 / max(d1 - d3, 1e-30), 0.0);
    }
    float vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        return vec2(0.0, d2 / max(d2 - d6, 1e-30));
    }
    float va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 >= d3 && d5 >= d6) {
        float w = (d4 - d3) / max((d4 - d3) + (d5 - d6), 1e-30);
        return vec2(1.0 - w, w);
    }
    return vec2(vb, vc) / max(va + vb + vc, 1e-30);
}

// Barycentric weights (of b and c) of a point in the triangle's plane.
vec2 barycentric(vec3 a, vec3 b, vec3 c, vec3 p) {
    vec3 n = cross(b - a, c - a);
    float inverse = 1.0 / max(dot(n, n), 1e-30);
    return vec2(dot(cross(p - a, c - a), n), dot(cross(b - a, p - a), n)) * inverse;
}
