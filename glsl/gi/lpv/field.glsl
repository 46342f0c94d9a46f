// Light that travels through a cell, in two bands: its intensity along unit ω is (flux + x ω.x + y ω.y + z ω.z) / 4π.
// In the source's coefficients, flux = 2 √π c₀, and x = −√(12 π) c₃ (y and z likewise). CPU twin:
// tests/twins/propagation.rs. rgb is stored radiance × area of a cell's face, and a the same for a sky of radiance 1.

#include "gi/lpv/constants.glsl"

struct Field {
    vec4 flux;
    vec4 x;
    vec4 y;
    vec4 z;
};

Field no_light() {
    return Field(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
}

// The clamped cosine about a unit direction, 1 + 2 cos θ in two bands.
Field lobe(vec4 flux, vec3 direction) {
    vec4 moment = 2.0 * flux;
    return Field(flux, moment * direction.x, moment * direction.y, moment * direction.z);
}

Field add(Field a, Field b) {
    return Field(a.flux + b.flux, a.x + b.x, a.y + b.y, a.z + b.z);
}

Field scaled(Field f, float by) {
    return Field(by * f.flux, by * f.x, by * f.y, by * f.z);
}

vec4 moment_along(Field f, vec3 direction) {
    return f.x * direction.x + f.y * direction.y + f.z * direction.z;
}

// Shares of the sphere that the next cell's faces cover, seen from this cell's centre: the opposite face, and each side
// face (Doghramachi's listing 7.3: 22.95668 and 24.26083 of 720). The five faces of six cells cover the sphere.
const float OPPOSITE = 22.95668 / 720.0;
const float SIDE = 24.26083 / 720.0;
// The direction to the middle of a side face: its parts along and across the direction of travel.
const float SIDE_ALONG = 0.894427191;
const float SIDE_ACROSS = 0.447213595;
// The share of the moment along the direction of travel that crosses into the next cell; for the flux it is a sixth.
const float CROSSING = OPPOSITE + 4.0 * SIDE * SIDE_ALONG;

// Flux into the next cell along a unit direction of travel, without clamping.
vec4 crossing(Field f, vec3 direction) {
    return f.flux / 6.0 + CROSSING * moment_along(f, direction);
}

// Light of radiance 1 from all sides, summed over all steps: every face receives π of it.
const float EVEN_FLUX = 6.0 * 3.14159265358979;

uint cell_index(ivec3 cell) {
    return (uint(cell.z) * LPV_EDGE + uint(cell.y)) * LPV_EDGE + uint(cell.x);
}

bool in_volume(ivec3 cell) {
    return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, ivec3(LPV_EDGE)));
}
