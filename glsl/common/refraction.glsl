// The direction of light behind a surface. `incident` is a unit vector towards the surface, and `normal` is that of the
// side that it meets. Total reflection reflects; thin walls do not refract. CPU twin: tests/twins/directions.rs.
vec3 refraction_direction(vec3 incident, vec3 normal, float ior, bool back, bool thin) {
    if (thin) {
        return incident;
    }
    vec3 d = refract(incident, normal, back ? ior : 1.0 / ior);
    return dot(d, d) > 0.25 ? normalize(d) : reflect(incident, normal);
}
