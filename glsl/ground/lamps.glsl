// Emissive triangles as area lights (lights.lamps = sampled). CPU twin: tests/twins/lamps.rs.

#include "common/count.glsl"
#include "common/color.glsl"
#include "common/numbers.glsl"
#include "ground/bindings.glsl"

struct LampPoint {
    vec3 point; // voxels
    vec3 irradiance; // irradiance of a surface with that normal from the represented lamps without occlusion
    float here; // irradiance if all of the piece were visible like its part around the point, over its own
    vec3 normal; // unit, of the piece's front
    float shine; // of the piece
};

// Irradiance over radiance from the front of triangle abc at the origin, on a surface with unit normal n: Lambert's sum
// over the edges of the part above the horizon. Positive if the origin sees the front, negative if the back.
float triangle_irradiance(vec3 a, vec3 b, vec3 c, vec3 n) {
    vec3 corners[3] = vec3[3](a, b, c);
    vec3 leave = vec3(0.0); // the points where the outline crosses the horizon
    vec3 enter = vec3(0.0);
    bool crossed = false;
    float sum = 0.0;
    for (int i = 0; i < 4; i++) {
        // The last edge closes the outline along the horizon.
        bool closing = i == 3;
        vec3 u = closing ? leave : corners[min(i, 2)];
        vec3 v = closing ? enter : corners[(i + 1) % 3];
        float hu = dot(u, n);
        float hv = dot(v, n);
        bool crosses = !closing && (hu < 0.0) != (hv < 0.0);
        vec3 crossing = mix(u, v, crosses ? hu / (hu - hv) : 0.0);
        enter = crosses && hu < 0.0 ? crossing : enter;
        leave = crosses && hu >= 0.0 ? crossing : leave;
        bool counts = closing ? crossed : crosses || hu >= 0.0;
        crossed = crossed || crosses;
        u = crosses && hu < 0.0 ? crossing : u;
        v = crosses && hu >= 0.0 ? crossing : v;
        // The formula uses the difference, to avoid cancellation for small and distant triangles.
        vec3 normal = cross(u, v - u);
        float sine = length(normal);
        float angle = atan(sine, dot(u, v));
        sum += counts && sine > 1e-20 ? dot(normal, n) * (angle / sine) : 0.0;
    }
    return -0.5 * sum;
}

// Candidates per sample if there are more pieces than samples: the tree's candidates are good.
const uint MOST_CANDIDATES = 4u;
const uint TREE_CANDIDATES = 2u;

// The largest cosine, at least 0, within an angle in [0, π] of a direction with cosine c. Arc functions are avoided,
// because a walk down the tree needs two of these at each node.
float nearest_cosine(float c, float within_cosine, float within_sine) {
    float nearest = c * within_cosine + sqrt(max(1.0 - c * c, 0.0)) * within_sine;
    return c >= within_cosine ? 1.0 : max(nearest, 0.0);
}

// Upper bound of the light of a node's pieces at a place, up to a factor: power over squared distance, times both
// cosines.
float importance(uint node, vec3 position, vec3 normal) {
    COUNT(WORDS, 9u);
    LampNode n = lamp_nodes[node];
    vec3 d = n.center - position;
    float distance = length(d);
    d /= max(distance, 1e-20);
    // The half angle of the sphere as seen from the place, and its sum with that of the normals.
    float seen_sine = n.radius / max(distance, 1e-20);
    float seen_cosine = sqrt(max(1.0 - seen_sine * seen_sine, 0.0));
    float spread_sine = sqrt(max(1.0 - n.spread_cosine * n.spread_cosine, 0.0));
    float both_sine = spread_sine * seen_cosine + n.spread_cosine * seen_sine;
    float both_cosine = n.spread_cosine * seen_cosine - spread_sine * seen_sine;
    // Beyond π: any direction.
    float from = both_sine < 0.0 ? 1.0 : nearest_cosine(-dot(d, n.axis), both_cosine, both_sine);
    float to = nearest_cosine(dot(d, normal), seen_cosine, seen_sine);
    return n.power * (seen_sine < 1.0 ? to * from : 1.0) / max(distance * distance, n.radius * n.radius);
}

// The approximate irradiance from a node's pieces at a place with that normal, without occlusion: that of a disc at
// their middle.
float lamps_about(uint node, vec3 position, vec3 normal) {
    COUNT(WORDS, 9u);
    LampNode n = lamp_nodes[node];
    vec3 d = n.center - position;
    float distance2 = max(dot(d, d), 1e-20);
    d *= inversesqrt(distance2);
    float seen_sine = min(n.radius * inversesqrt(distance2), 1.0);
    float spread_sine = n.spread_cosine < 0.0 ? 1.0 : sqrt(max(1.0 - n.spread_cosine * n.spread_cosine, 0.0));
    // The part above the horizon, for a node that is partly below.
    float to = max(dot(d, normal) + seen_sine, 0.0) / (1.0 + seen_sine);
    float from = max(spread_sine - dot(d, n.axis), 0.0) / (1.0 + spread_sine);
    return 0.5 * n.power * to * from / (distance2 + n.radius * n.radius); // power is twice the area times the radiance
}

// The approximate irradiance from all lamps: summed along the path down the tree that follows the largest
// contributions. It needs a tree.
float lamps_irradiance(vec3 position, vec3 normal) {
    uint first = 0u;
    uint end = frame.lamp_count;
    uint node = 1u;
    float taken = lamps_about(node, position, normal);
    float beside = 0.0;
    for (uint k = 0u; k < 32u && first + 1u < end; k++) {
        float low = lamps_about(2u * node, position, normal);
        float high = lamps_about(2u * node + 1u, position, normal);
        bool goes_low = low >= high;
        taken = max(low, high);
        beside += min(low, high);
        uint middle = (first + end) / 2u;
        first = goes_low ? first : middle;
        end = goes_low ? middle : end;
        node = 2u * node + (goes_low ? 0u : 1u);
    }
    return taken + beside;
}

struct LampChoice {
    uint index;
    float probability;
};

// The piece at `u` in [0, 1). With many lamps, a walk down the tree chooses between halves by their possible
// contribution (Conty and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018, without the
// splitting). Few lamps are chosen uniformly.
LampChoice choose_lamp(float u, vec3 position, vec3 normal) {
    bool many = frame.lamp_tree != 0u;
    float count = float(frame.lamp_count);
    uint first = many ? 0u : min(uint(u * count), frame.lamp_count - 1u);
    uint end = many ? frame.lamp_count : first + 1u;
    float probability = many ? 1.0 : 1.0 / count;
    uint node = 1u;
    for (uint k = 0u; k < 32u && first + 1u < end; k++) {
        float low = importance(2u * node, position, normal);
        float high = importance(2u * node + 1u, position, normal);
        float share = low + high > 0.0 ? low / (low + high) : 0.5;
        u = min(u, 0.99999994); // it may have been rounded up to 1, which would select a half without contribution
        bool goes_low = u < share;
        uint middle = (first + end) / 2u;
        first = goes_low ? first : middle;
        end = goes_low ? middle : end;
        node = 2u * node + (goes_low ? 0u : 1u);
        probability *= goes_low ? share : 1.0 - share;
        // The rest of the number is uniform again, so that strata stay strata.
        u = goes_low ? u / share : (u - share) / max(1.0 - share, 1e-6);
    }
    return LampChoice(first, probability);
}

// Sample i of LAMP_POINTS; `random` holds two numbers of the lit place. With at most as many pieces as samples, each
// sample has its own piece, so that only penumbrae are noisy. With more, one of a few candidates is chosen by its
// contribution (Talbot et al., "Importance Resampling for Global Illumination", 2005). A sample is limited to the
// irradiance of a hemisphere with the radiance of its brightest candidate. Lamps of one radiance never exceed this
// together, so that only sparks are cut: pieces that are chosen far too rarely.
LampPoint sample_lamp(uint i, vec3 position, vec3 normal, vec2 random) {
    uint candidates = frame.lamp_tree != 0u ? TREE_CANDIDATES : frame.lamp_count > LAMP_POINTS ? MOST_CANDIDATES : 1u;
    float strata = float(LAMP_POINTS * candidates);
    uint chosen = 0u;
    vec3 chosen_irradiance = vec3(0.0);
    float chosen_weight = 0.0;
    float chosen_seen = 0.0;
    float total = 0.0;
    float most = 0.0;
    float choice = fract(random.y + 0.6180339887 * float(i));
    for (uint k = 0u; k < candidates; k++) {
        LampChoice candidate = choose_lamp((float(i * candidates + k) + random.x) / strata, position, normal);
        Lamp e = lamps[candidate.index];
        COUNT(LAMP_RECORDS, 1u);
        float seen = triangle_irradiance(e.a - position, e.b - position, e.c - position, normal);
        seen = e.two_sided != 0u ? abs(seen) : max(seen, 0.0);
        vec3 irradiance = e.radiance * (seen / (candidate.probability * strata));
        float weight = brightest(irradiance);
        total += weight;
        most = max(most, PI * brightest(e.radiance));
        // One random number serves all choices: its remainder is uniform again.
        float share = total > 0.0 ? weight / total : 0.0;
        bool taken = choice < share;
        choice = taken ? choice / share : (choice - share) / max(1.0 - share, 1e-6);
        chosen = taken ? candidate.index : chosen;
        chosen_irradiance = taken ? irradiance : chosen_irradiance;
        chosen_weight = taken ? weight : chosen_weight;
        chosen_seen = taken ? seen : chosen_seen;
    }
    Lamp e = lamps[chosen];
    // The R2 sequence (Roberts, 2018), shifted by place.
    vec2 r = fract(random.yx + vec2(0.7548776662, 0.5698402909) * float(i + 1u));
    float root = sqrt(r.x);
    LampPoint s;
    s.point = mix(e.a, mix(e.b, e.c, r.y), root);
    s.irradiance = chosen_weight > 0.0 ? chosen_irradiance * (min(total, most) / chosen_weight) : vec3(0.0);
    vec3 front = cross(e.b - e.a, e.c - e.a);
    vec3 to = s.point - position;
    float distance2 = dot(to, to);
    float cosines = max(dot(to, normal), 0.0) * (e.two_sided != 0u ? abs(dot(to, front)) : max(-dot(to, front), 0.0));
    s.here = chosen_seen > 0.0 ? 0.5 * cosines / (distance2 * distance2 * chosen_seen) : 0.0;
    s.normal = normalize(front);
    s.shine = e.shine;
    return s;
}
