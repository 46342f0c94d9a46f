// Next-event estimation at the vertices of paths: a vertex samples one point on each kind of light in the scene.

#include "common/power_heuristic.glsl"
#include "gi/paths/through.glsl"
#include "ground/lamps.glsl"
#include "ground/lights.glsl"
#include "ground/sky.glsl"

const uint KIND_LIGHT = 0u; // point, spot and directional lights
const uint KIND_LAMP = 1u;
const uint KIND_SKY = 2u; // the bright part of the sky's map
const uint KINDS_OF_LIGHT = 3u;

// A sampled point on a light, seen from a surface point.
struct ToLight {
    bool any; // whether the point can light the surface
    vec3 way; // unit, towards the light
    float distance; // voxels
    vec3 radiance; // radiance divided by the density per steradian; for a lamp 1 divided by the density
    vec3 even; // radiance of the lamp's triangle
    float density; // per steradian, for the weight against BSDF sampling; 0: BSDF sampling cannot find the light
};

const ToLight NO_LIGHT = ToLight(false, vec3(0.0), 0.0, vec3(0.0), vec3(0.0), 0.0);

// Samples a unit direction uniformly in a cone about unit `axis`. `sine2` is the squared sine of the cone's half angle.
// `versine` is 1 minus the cosine between the direction and the axis.
vec3 within_cone(vec3 axis, float sine2, vec2 u, out float versine) {
    versine = u.y * sine2 / (1.0 + sqrt(max(1.0 - sine2, 0.0)));
    float sine = sqrt(max(versine * (2.0 - versine), 0.0));
    float turn = 2.0 * PI * u.x;
    return normalize(tangent_frame(axis) * vec3(sine * cos(turn), sine * sin(turn), 1.0 - versine));
}

// The irradiance at a position of a light of the sky, or of another one; 0 for a light that is not `of_sky`.
float light_weight(Light light, bool of_sky, vec3 position) {
    bool counts = (light.kind == LIGHT_SKY) == of_sky;
    return counts ? brightest(sample_light(light, position, frame.voxel_m).irradiance) : 0.0;
}

struct LightChoice {
    uint index;
    float share; // probability; 0: no light shines here
    float within; // position of the random number in the interval of the light, 0 to 1
};

// Chooses one of the sky's lights, or of all others, with a probability proportional to its irradiance.
LightChoice choose_light(bool of_sky, vec3 position, float choice) {
    float total = 0.0;
    for (uint k = 0u; k < frame.light_count; k++) {
        total += light_weight(lights[k], of_sky, position);
    }
    LightChoice taken = LightChoice(0u, 0.0, 0.0);
    float left = choice * total;
    bool searching = total > 0.0;
    for (uint k = 0u; k < frame.light_count && searching; k++) {
        float own = light_weight(lights[k], of_sky, position);
        if (own > 0.0) {
            taken = LightChoice(k, own / total, left / own);
        }
        searching = own <= 0.0 || left >= own;
        left -= own;
    }
    return taken;
}

// Samples a point on one of the point, spot and directional lights. A light with a radius is a uniform sphere; a
// directional light is a uniform disc.
ToLight to_punctual(vec3 position, float choice, vec2 u) {
    LightChoice taken = choose_light(false, position, choice);
    if (taken.share <= 0.0) {
        return NO_LIGHT;
    }
    Light light = lights[taken.index];
    LightSample middle = sample_light(light, position, frame.voxel_m);
    float radius2 = light.radius * light.radius;
    bool far = is_far(light);
    float sine2 = far ? radius2 / (1.0 + radius2) : min(radius2 / (middle.distance * middle.distance), 1.0);
    float versine;
    ToLight to = NO_LIGHT;
    to.any = true;
    to.way = within_cone(middle.direction, sine2, u, versine);
    // A cone of even radiance L gives the irradiance π L sin²; its solid angle is 2π sin² / (1 + cos).
    to.radiance = middle.irradiance * (2.0 / ((1.0 + sqrt(1.0 - sine2)) * taken.share));
    float aside2 = middle.distance * middle.distance * versine * (2.0 - versine);
    float reach = middle.distance * (1.0 - versine) - sqrt(max(radius2 - aside2, 0.0));
    to.distance = far ? 1e30 : max(reach, 0.0);
    return to;
}

float piece_shine(Lamp e) {
    return 0.5 * length(cross(e.b - e.a, e.c - e.a)) * e.shine;
}

// Chooses a triangle of a short list of lamps with a probability proportional to its power.
LampChoice lamp_by_shine(float choice) {
    float left = choice * frame.lamp_shine;
    LampChoice taken = LampChoice(0u, 1.0);
    bool searching = true;
    for (uint k = 0u; k < frame.lamp_count && searching; k++) {
        COUNT(LAMP_RECORDS, 1u);
        float own = piece_shine(lamps[k]);
        taken = LampChoice(k, own / frame.lamp_shine);
        searching = left >= own;
        left -= own;
    }
    return taken;
}

// The factor of lamp_density() for unit direction d from a surface point. lamp_density() is the density with which
// to_lamp() samples, or an approximation of it where the tree chooses the triangle.
float lamps_sought(vec3 position, vec3 facet, bool both_sides, vec3 d) {
    if (frame.lamp_count == 0u) {
        return 0.0;
    }
    if (frame.lamp_tree == 0u) {
        return 1.0 / frame.lamp_shine;
    }
    float irradiance = 0.0;
    for (uint side = 0u; side < (both_sides ? 2u : 1u); side++) {
        irradiance += lamps_irradiance(position, side == 0u ? facet : -facet);
    }
    return abs(dot(d, facet)) / max(irradiance, 1e-20);
}

// Density per steradian with which to_lamp() samples a point on a lamp. `sought` comes from lamps_sought(). `shine` is
// the brightest channel of the material's emission. `to_normal` is the cosine between the direction and the normal.
float lamp_density(float sought, float shine, float distance, float to_normal) {
    float distance2 = distance * distance;
    // Where a triangle is nearer than its size, few of its points are near. The mean size of all triangles stands for
    // the size of this one.
    float size2 = frame.lamp_shine / (float(frame.lamp_count) * shine);
    float about = frame.lamp_tree != 0u ? min(distance2 / size2, 1.0) : distance2 / max(to_normal, 1e-6);
    return sought * shine * about;
}

// Samples a point on a lamp. `both_sides`: the surface also transmits light from its far side. `random` chooses the
// side (x), the triangle (y) and the point on it (z, w).
ToLight to_lamp(vec3 position, vec3 facet, bool both_sides, vec4 random) {
    bool many = frame.lamp_tree != 0u;
    float side = many && both_sides && random.x < 0.5 ? -1.0 : 1.0;
    LampChoice piece = many ? choose_lamp(random.y, position, side * facet) : lamp_by_shine(random.y);
    Lamp e = lamps[piece.index];
    COUNT(LAMP_RECORDS, 1u);
    float root = sqrt(random.z);
    vec3 to_point = mix(e.a, mix(e.b, e.c, random.w), root) - position;
    vec3 front = cross(e.b - e.a, e.c - e.a);
    float twice_area = length(front);
    float distance2 = dot(to_point, to_point);
    ToLight to = NO_LIGHT;
    to.distance = sqrt(distance2);
    to.way = to_point / max(to.distance, 1e-20);
    float to_normal = -dot(front, to.way) / max(twice_area, 1e-30);
    to_normal = e.two_sided != 0u ? abs(to_normal) : to_normal;
    float towards = dot(to.way, facet);
    bool sends = both_sides ? !many || side * towards > 0.0 : towards > 0.0;
    float probability = piece.probability * (many && both_sides ? 0.5 : 1.0);
    to.any = sends && to_normal > 0.0 && distance2 > 0.0 && probability > 0.0;
    to.radiance = vec3(0.5 * twice_area * max(to_normal, 0.0) / max(distance2 * probability, 1e-30));
    to.even = e.radiance;
    to.density = lamp_density(lamps_sought(position, facet, both_sides, to.way), e.shine, to.distance, to_normal);
    return to;
}

// Squared sines of the half angles of two cones about a light of the sky. The first is as wide as the light's disc. The
// second is twice as wide, since the bright part of the map need not be round.
vec2 sky_cones(Light light) {
    vec2 tangent2 = light.radius * light.radius * vec2(1.0, 4.0);
    return tangent2 / (1.0 + tangent2);
}

// Density per steradian with which to_bright_sky() samples unit direction d.
float bright_sky_density(vec3 d) {
    float sum = 0.0;
    float total = 0.0;
    for (uint k = 0u; k < (feature(FEATURE_SKY_MAP) ? frame.light_count : 0u); k++) {
        Light light = lights[k];
        COUNT(LIGHTS, 1u);
        vec3 axis = -light.direction;
        vec3 aside = cross(axis, d);
        float own = light.kind == LIGHT_SKY ? brightest(light.intensity) : 0.0;
        vec2 sine2 = sky_cones(light);
        vec2 solid_angle = max(2.0 * PI * sine2 / (1.0 + sqrt(1.0 - sine2)), vec2(1e-12));
        bvec2 within = lessThanEqual(vec2(dot(aside, aside)), sine2);
        sum += dot(axis, d) > 0.0 ? own * dot(vec2(within), 0.5 / solid_angle) : 0.0;
        total += own;
    }
    return total > 0.0 ? sum / total : 0.0;
}

// Samples a direction towards the bright part of the sky's map.
ToLight to_bright_sky(vec3 position, float choice, vec2 u) {
    LightChoice taken = choose_light(true, position, choice);
    Light light = lights[taken.index];
    vec2 sine2 = sky_cones(light);
    float versine;
    ToLight to = NO_LIGHT;
    to.way = within_cone(-light.direction, taken.within < 0.5 ? sine2.x : sine2.y, u, versine);
    to.distance = 1e30;
    to.density = bright_sky_density(to.way);
    to.any = taken.share > 0.0 && to.density > 0.0;
    to.radiance = sky_towards(to.way) / (frame.scale * max(to.density, 1e-30));
    return to;
}

// A bit for each kind of light that the scene has.
uint kinds_of_light() {
    uint kinds = frame.lamp_count > 0u ? 1u << KIND_LAMP : 0u;
    for (uint k = 0u; k < frame.light_count; k++) {
        kinds |= 1u << (lights[k].kind == LIGHT_SKY ? KIND_SKY : KIND_LIGHT);
    }
    return kinds;
}

// Whether a scattered ray may meet light.
bool light_is_met() {
    bool sky = feature(FEATURE_SKY_MAP) || any(greaterThan(frame.sky, vec3(0.0)));
    return LAMPS != LAMPS_SAMPLED || frame.lamp_count > 0u || sky;
}
