// Light that a path looks for at its vertices: one point on each kind of light that the scene has.

#include "gi/paths/through.glsl"
#include "ground/lamps.glsl"
#include "ground/lights.glsl"
#include "ground/sky.glsl"

const uint KIND_LIGHT = 0u; // points, spots, far lights
const uint KIND_LAMP = 1u;
const uint KIND_SKY = 2u; // the bright part of a map
const uint KINDS_OF_LIGHT = 3u;

// A point on a light, as a place sees it.
struct ToLight {
    bool any;
    vec3 way; // unit
    float distance; // voxels
    vec3 radiance; // over the density of the point per steradian; of a lamp 1 over it
    vec3 even; // radiance of a lamp's piece
    float density; // per steradian, by which it is weighed against what scatters there; 0: nothing scattered finds it
};

const ToLight NO_LIGHT = ToLight(false, vec3(0.0), 0.0, vec3(0.0), vec3(0.0), 0.0);

// The share of a sample whose own way has that density, where another way has `other`: the power heuristic with
// exponent 2 (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995).
float power_share(float own, float other) {
    float ratio = other / max(own, 1e-30);
    return 1.0 / (1.0 + ratio * ratio);
}

// Unit, within a cone about unit `axis` whose half angle has that squared sine, evenly; `versine`: 1 − its cosine.
vec3 within_cone(vec3 axis, float sine2, vec2 u, out float versine) {
    versine = u.y * sine2 / (1.0 + sqrt(max(1.0 - sine2, 0.0)));
    float sine = sqrt(max(versine * (2.0 - versine), 0.0));
    float turn = 2.0 * PI * u.x;
    return normalize(tangent_frame(axis) * vec3(sine * cos(turn), sine * sin(turn), 1.0 - versine));
}

// One light, taken as often as it is bright here. With a radius it is an even ball, or far away an even disc.
ToLight to_punctual(vec3 position, float choice, vec2 u) {
    float total = 0.0;
    for (uint k = 0u; k < frame.light_count; k++) {
        float shines = lights[k].kind == LIGHT_SKY ? 0.0 : 1.0;
        total += shines * brightest(sample_light(lights[k], position, frame.voxel_m).irradiance);
    }
    float left = choice * total;
    uint taken = 0u;
    float share = 0.0;
    bool searching = total > 0.0;
    for (uint k = 0u; k < frame.light_count && searching; k++) {
        float shines = lights[k].kind == LIGHT_SKY ? 0.0 : 1.0;
        float own = shines * brightest(sample_light(lights[k], position, frame.voxel_m).irradiance);
        taken = own > 0.0 ? k : taken;
        share = own > 0.0 ? own / total : share;
        searching = own <= 0.0 || left >= own;
        left -= own;
    }
    if (share <= 0.0) {
        return NO_LIGHT;
    }
    Light light = lights[taken];
    LightSample middle = sample_light(light, position, frame.voxel_m);
    float radius2 = light.radius * light.radius;
    bool far = is_far(light);
    float sine2 = far ? radius2 / (1.0 + radius2) : min(radius2 / (middle.distance * middle.distance), 1.0);
    float versine;
    ToLight to = NO_LIGHT;
    to.any = true;
    to.way = within_cone(middle.direction, sine2, u, versine);
    // A cone of even radiance L gives the irradiance π L sin²; its solid angle is 2π sin² / (1 + cos).
    to.radiance = middle.irradiance * (2.0 / ((1.0 + sqrt(1.0 - sine2)) * share));
    float aside2 = middle.distance * middle.distance * versine * (2.0 - versine);
    float reach = middle.distance * (1.0 - versine) - sqrt(max(radius2 - aside2, 0.0));
    to.distance = far ? 1e30 : max(reach, 0.0);
    return to;
}

float piece_shine(Lamp e) {
    return 0.5 * length(cross(e.b - e.a, e.c - e.a)) * e.shine;
}

// A piece of a few, as often as it shines.
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

// By how much lamps are looked for along unit d from a place on a surface: with lamp_density() the density of what
// to_lamp() finds, or about that, where pieces are chosen through the tree.
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

// `shine`: the brightest channel of its material's emission, `to_normal`: the cosine between the way and its normal.
float lamp_density(float sought, float shine, float distance, float to_normal) {
    float distance2 = distance * distance;
    // Points on a piece that is nearer than it is large are seldom near. About as large as all are in the mean.
    float size2 = frame.lamp_shine / (float(frame.lamp_count) * shine);
    float about = frame.lamp_tree != 0u ? min(distance2 / size2, 1.0) : distance2 / max(to_normal, 1e-6);
    return sought * shine * about;
}

// `both_sides`: the surface sends on light from its far side too. `random`: for the side, the piece, the point on it.
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

// Squared sines of the half angles of two cones about a light of the sky: as wide as its disc, and twice as wide, since
// what it stands for need not be round.
vec2 sky_cones(Light light) {
    vec2 tangent2 = light.radius * light.radius * vec2(1.0, 4.0);
    return tangent2 / (1.0 + tangent2);
}

// Density per steradian with which to_bright_sky() finds unit d.
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

// Towards a bright part of the sky's map.
ToLight to_bright_sky(float choice, vec2 u) {
    float total = 0.0;
    for (uint k = 0u; k < frame.light_count; k++) {
        total += lights[k].kind == LIGHT_SKY ? brightest(lights[k].intensity) : 0.0;
    }
    float left = choice * total;
    uint taken = 0u;
    float within = 0.0; // where in the share of the light the number lies
    bool searching = total > 0.0;
    for (uint k = 0u; k < frame.light_count && searching; k++) {
        float own = lights[k].kind == LIGHT_SKY ? brightest(lights[k].intensity) : 0.0;
        taken = own > 0.0 ? k : taken;
        within = own > 0.0 ? left / own : within;
        searching = own <= 0.0 || left >= own;
        left -= own;
    }
    Light light = lights[taken];
    vec2 sine2 = sky_cones(light);
    float versine;
    ToLight to = NO_LIGHT;
    to.way = within_cone(-light.direction, within < 0.5 ? sine2.x : sine2.y, u, versine);
    to.distance = 1e30;
    to.density = bright_sky_density(to.way);
    to.any = total > 0.0 && to.density > 0.0;
    to.radiance = sky_towards(to.way) / (frame.scale * max(to.density, 1e-30));
    return to;
}

// The kinds of light that the scene has, a bit each.
uint kinds_of_light() {
    uint kinds = frame.lamp_count > 0u ? 1u << KIND_LAMP : 0u;
    for (uint k = 0u; k < frame.light_count; k++) {
        kinds |= 1u << (lights[k].kind == LIGHT_SKY ? KIND_SKY : KIND_LIGHT);
    }
    return kinds;
}

// Whether what is scattered may meet light.
bool light_is_met() {
    bool sky = feature(FEATURE_SKY_MAP) || any(greaterThan(frame.sky, vec3(0.0)));
    return LAMPS != LAMPS_SAMPLED || frame.lamp_count > 0u || sky;
}
