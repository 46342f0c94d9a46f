// Directions on a square: the octahedron |x| + |y| + |z| = 1 is unfolded about +z (Praun and Hoppe, "Spherical
// Parametrization and Remeshing", 2003). CPU twin: tests/twins/octahedron.rs.

// A point of the octahedron's surface (not a unit vector) for a map position with coordinates in −1…1.
vec3 octahedron_point(vec2 at) {
    float z = 1.0 - abs(at.x) - abs(at.y);
    vec2 side = vec2(at.x < 0.0 ? -1.0 : 1.0, at.y < 0.0 ? -1.0 : 1.0);
    return z < 0.0 ? vec3((1.0 - abs(at.yx)) * side, z) : vec3(at, z);
}

// The map position of a direction.
vec2 octahedron_at(vec3 d) {
    vec3 p = d / (abs(d.x) + abs(d.y) + abs(d.z));
    vec2 side = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return p.z < 0.0 ? (1.0 - abs(p.yx)) * side : p.xy;
}
