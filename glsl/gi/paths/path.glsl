// Path tracing from the surfaces that a viewer sees. Reflection and refraction count as scattering; a pass through a
// blended surface or a smooth thin wall does not. Light that is seen or was scattered once is direct light.
//
// One loop traces all paths of a pixel one after another. Each round traces a ray to the next surface and rays to
// lights. A lane whose path has ended begins the next path at once.

#include "common/count.glsl"
#include "common/random.glsl"
#include "gi/paths/constants.glsl"
#include "gi/paths/lights.glsl"

// The start of a path: at a surface that the viewer sees, or along a ray that was scattered once.
struct PathStart {
    bool at_surface; // whether it starts at a surface
    uint place; // index of the surface's triangle among the recorded ones
    bool back; // whether the viewer sees the back of the surface
    vec3 weights; // barycentric
    vec3 origin; // of the ray, voxels
    vec3 d; // unit, from the viewer or along the ray
    float lights_found; // share of the lamps and of the sky's bright part that the ray adds
};

struct MethodLight {
    vec3 direct; // radiance
    vec3 indirect; // radiance
};

struct Path {
    vec3 origin; // of the ray, voxels
    vec3 d; // unit, of the ray
    float least; // least distance of a hit from the origin, voxels
    vec3 throughput; // per channel
    float squeezed; // factor of the throughput that comes from refraction, which scales radiance
    uint scattered; // number of scattering events
    float density; // of d, per steradian; 0: only this ray can find the light along d
    float lamps_sought; // result of lamps_sought() for the origin and d
    uint channel; // the only channel left after dispersion; 3: all channels are left
};

// Scattering events before Russian roulette begins, where bounces are unlimited.
const uint ROULETTE_AFTER = 3u;
const float MOST_SURVIVE = 0.95; // the largest probability of survival
// Longer paths have a lower limit of survival: a CPU device ends an invocation's loops after 65535 rounds, counted over
// all its rays together.
const uint LONG_PATH = 16u;
const float MOST_SURVIVE_LONG = 0.75;

Path begin_path(PathStart start) {
    return Path(start.origin, start.d, 0.0, vec3(1.0), 1.0, start.at_surface ? 0u : 1u, 0.0, 0.0, 3u);
}

void add_light(inout MethodLight sum, Path p, vec3 light) {
    light *= p.throughput;
    sum.direct += p.scattered <= 1u ? light : vec3(0.0);
    sum.indirect += p.scattered <= 1u ? vec3(0.0) : light;
}

// The sky's radiance for a path that leaves the scene, weighted against light sampling.
vec3 sky_met(Path p, PathStart start) {
    bool unseen = feature(FEATURE_SKY_UNSEEN) && p.scattered == 0u; // a viewer who looks through a thin wall
    vec3 sky = unseen ? vec3(0.0) : sky_towards(p.d) / frame.scale;
    if (p.density > 0.0) {
        sky *= power_share(p.density, bright_sky_density(p.d));
    }
    bool first = p.scattered <= 1u && !start.at_surface;
    if (first) {
        sky = sky_about(p.d, 0.0, start.lights_found) / frame.scale;
    }
    return sky;
}

// The weight of a lamp's radiance where a path meets it.
float lamp_share(Path p, PathStart start, Met met) {
    float shine = brightest(materials[met.triangle.material].emissive);
    float other = lamp_density(p.lamps_sought, shine, met.distance, abs(dot(met.normal, p.d)));
    bool first = p.scattered <= 1u && !start.at_surface;
    return first ? start.lights_found : p.density > 0.0 ? power_share(p.density, other) : 1.0;
}

// Light that a vertex scatters from one sampled point on a light of each kind.
vec3 light_found(Surface s, Scatterer b, uint kinds, uvec4 seed) {
    bool both_sides = b.chances.z > 0.0 || b.chances.w > 0.0;
    vec3 sum = vec3(0.0);
    for (uint left = kinds; left != 0u; left &= left - 1u) {
        uint kind = uint(findLSB(left));
        vec4 random = random_numbers(seed + uvec4(0u, 0u, 0u, kind));
        ToLight to = NO_LIGHT;
        if (kind == KIND_LAMP) {
            to = to_lamp(s.position, b.facet, both_sides, random);
        } else if (kind == KIND_LIGHT) {
            to = to_punctual(s.position, random.x, random.zw);
        } else {
            to = to_bright_sky(s.position, random.x, random.zw);
        }
        vec3 light = vec3(0.0);
        if (to.any) {
            vec4 f = scattering(s, b, to.way);
            light = f.rgb * to.radiance * (to.density > 0.0 ? power_share(to.density, f.w) : 1.0);
        }
        for (uint once = 0u; once < (any(greaterThan(light, vec3(0.0))) ? 1u : 0u); once++) {
            vec3 origin = ray_start(s.position, b.facet, to.way);
            bool far = to.distance > 1e29;
            vec3 way = far ? to.way : s.position + to.way * to.distance - origin;
            float distance = far ? to.distance : length(way);
            light *=
                light_through(origin, far ? way : way / max(distance, 1e-20), distance, kind == KIND_LAMP, to.even);
        }
        sum += light;
    }
    return sum;
}

// The refractive index under dispersion (KHR_materials_dispersion). The path goes on with one of the three channels.
float dispersed_ior(inout Path p, Surface s, Material m, float choice) {
    float ior = s.ior;
    if (feature(FEATURE_DISPERSION) && m.flags >> MATERIAL_FINISH_SHIFT != 0u) {
        float dispersion = finish_row((m.flags >> MATERIAL_FINISH_SHIFT) + 2u).z;
        if (dispersion > 0.0) {
            if (p.channel == 3u) {
                p.channel = min(uint(choice * 3.0), 2u);
                vec3 left = vec3(0.0);
                left[p.channel] = 3.0 * p.throughput[p.channel];
                p.throughput = left;
            }
            // The offset of red and of blue from green is (ior − 1) / V / 2, where Abbe's number V is 20 / dispersion.
            ior += (max(ior, 1.0) - 1.0) * 0.025 * dispersion * (float(p.channel) - 1.0);
        }
    }
    return max(ior, 1.0);
}

// Handles the surface that a path met: adds the light there, and sets the path's next ray. It returns whether the path
// goes on.
bool pass_vertex(inout Path p, inout MethodLight sum, PathStart start, Met met, bool shown, uvec4 seed) {
    Material m = materials[met.triangle.material];
    bool refracts = is_volume(m);
    bool inside = refracts && met.back;
    Surface s = surface_met(met, refracts);
    vec4 random = random_numbers(seed);
    if (feature(FEATURE_DISPERSION) && refracts) {
        s.ior = dispersed_ior(p, s, m, random.w);
    }
    if (inside) {
        p.throughput *= attenuation(m, (met.distance - p.least) * frame.voxel_m);
    }
    Scatterer b = scatterer(s, -p.d, refracts, inside);
    // The image itself blends the surfaces that it shows.
    float opacity = shown ? 1.0 : s.opacity;
    if (feature(FEATURE_ALPHA)) {
        // The image culls the backs of one-sided surfaces.
        bool absent = !shown && p.scattered == 0u && met.dark && !refracts;
        vec3 straight = absent ? vec3(1.0) : mix(vec3(1.0), straight_through(s, b), opacity);
        float passes = brightest(straight);
        if (random.x < passes) {
            p.throughput *= straight / passes;
            p.origin = shown ? ray_start(s.position, s.facet, p.d) : p.origin;
            p.least = shown ? 0.0 : met.distance;
            return true;
        }
        p.throughput *= opacity / (1.0 - passes);
    }
    if (s.unlit) {
        add_light(sum, p, p.scattered == 0u ? s.emitted : vec3(0.0));
        return false;
    }
    if (!met.dark && any(greaterThan(s.emitted, vec3(0.0)))) {
        add_light(sum, p, s.emitted * (coat_leaves(s, -p.d) * lamp_share(p, start, met)));
    }
    bool lit = (!met.dark || refracts) && p.scattered <= BOUNCES;
    vec3 found = light_found(s, b, lit ? kinds_of_light() : 0u, seed + uvec4(0u, 0u, 0u, 1u)) * p.throughput;
    sum.direct += p.scattered == 0u ? found : vec3(0.0);
    sum.indirect += p.scattered == 0u ? vec3(0.0) : found;

    vec4 further = random_numbers(seed + uvec4(0u, 0u, 0u, 1u + KINDS_OF_LIGHT));
    Scattered to = scatter(s, b, random.y, further.xy);
    p.throughput *= to.weight;
    p.squeezed *= to.squeezed;
    bool goes_on = lit && to.any && (p.scattered < BOUNCES || light_is_met());
    if (BOUNCES == ALL_BOUNCES && p.scattered >= ROULETTE_AFTER) {
        float most = p.scattered < LONG_PATH ? MOST_SURVIVE : MOST_SURVIVE_LONG;
        float survives = min(brightest(p.throughput) / p.squeezed, most);
        goes_on = goes_on && further.z < survives;
        p.throughput /= max(survives, 1e-20);
    }
    p.scattered++;
    p.density = to.density;
    p.origin = ray_start(s.position, b.facet, to.way);
    p.d = to.way;
    p.least = 0.0;
    p.lamps_sought = 0.0;
    if (to.density > 0.0) {
        p.lamps_sought = lamps_sought(s.position, b.facet, b.chances.z > 0.0 || b.chances.w > 0.0, to.way);
    }
    return goes_on && any(greaterThan(p.throughput, vec3(0.0)));
}

const uint NUMBERS_PER_ROUND = 2u + KINDS_OF_LIGHT;

// The mean radiance of PATHS paths. `seed` depends on the pixel and the pass.
MethodLight follow_paths(PathStart start, uvec2 seed) {
    MethodLight sum = MethodLight(vec3(0.0), vec3(0.0));
    uint path = 0u;
    uint round = 0u; // number of surfaces that this path has met
    Path p = begin_path(start);
    for (uint k = 0u; k < 65535u && path < PATHS; k++) {
        bool shown = start.at_surface && round == 0u;
        RayHit hit = RayHit(start.place + 1u, start.weights.yz, 0.0);
        if (!shown) {
            hit = trace_ray(p.origin, p.d, p.least);
        }
        Met met = meet(hit, p.d);
        met.back = shown ? start.back : met.back;
        met.dark = met.dark && !shown;
        bool going = false;
        for (uint once = 0u; once < (met.any ? 1u : 0u); once++) {
            going = pass_vertex(p, sum, start, met, shown, uvec4(seed, path, round * NUMBERS_PER_ROUND));
        }
        if (!met.any) {
            add_light(sum, p, sky_met(p, start));
        }
        round = going ? round + 1u : 0u;
        path += going ? 0u : 1u;
        if (!going) {
            p = begin_path(start);
        }
    }
    COUNT(RAYS_CUT, path < PATHS ? 1u : 0u);
    sum.direct /= float(PATHS);
    sum.indirect /= float(PATHS);
    return sum;
}
