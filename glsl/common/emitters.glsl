// Emissive triangles as area lights (emitters = sampled). CPU twin: src/twins/emitters.rs.
// Needs: emitters[], frame, jitter.glsl.

#include "common/count.glsl"
#include "common/color.glsl"

struct EmitterSample {
    vec3 point; // voxels
    vec3 irradiance; // what the piece stands for would give a surface with that normal, if nothing stood between
};

// Irradiance over radiance from the front of triangle abc at the origin, on a surface with unit normal n: Lambert's sum
// over the edges of what lies above the horizon. Positive if the origin sees the front, negative if the back.
float triangle_irradiance(vec3 a, vec3 b, vec3 c, vec3 n) {
    vec3 corners[3] = vec3[3](a, b, c);
    vec3 leave = vec3(0.0); // where the outline goes below the horizon, and where it comes up again
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
        // Of the difference: no cancellation where the triangle is small and far.
        vec3 normal = cross(u, v - u);
        float sine = length(normal);
        float angle = atan(sine, dot(u, v));
        sum += counts && sine > 1e-20 ? dot(normal, n) * (angle / sine) : 0.0;
    }
    return -0.5 * sum;
}

// Candidates per sample where there are more pieces than samples.
const uint MOST_CANDIDATES = 4u;

uint choose_emitter(float u) {
    uint first = 0u;
    uint last = frame.emitter_count - 1u;
    for (uint k = 0u; k < 32u && first < last; k++) {
        uint middle = (first + last) / 2u;
        COUNT(LAMP_RECORDS, 1u);
        if (emitters[middle].cumulative <= u) {
            first = middle + 1u;
        } else {
            last = middle;
        }
    }
    return first;
}

// Of EMITTER_SAMPLES samples the one with index i; `random`: two numbers of the place that is lit.
// At most as many pieces as samples: each gets its own, so that only what is half in shadow is noisy. More: of a few
// candidates, chosen by power, one is taken by what it gives here (Talbot et al., "Importance Resampling for Global
// Illumination", 2005).
EmitterSample sample_emitter(uint i, vec3 position, vec3 normal, vec2 random) {
    uint candidates = frame.emitter_count > EMITTER_SAMPLES ? MOST_CANDIDATES : 1u;
    float strata = float(EMITTER_SAMPLES * candidates);
    uint chosen = 0u;
    vec3 chosen_irradiance = vec3(0.0);
    float chosen_weight = 0.0;
    float total = 0.0;
    float choice = fract(random.y + 0.6180339887 * float(i));
    for (uint k = 0u; k < candidates; k++) {
        uint index = choose_emitter((float(i * candidates + k) + random.x) / strata);
        Emitter e = emitters[index];
        COUNT(LAMP_RECORDS, 1u);
        float seen = triangle_irradiance(e.a - position, e.b - position, e.c - position, normal);
        seen = e.two_sided != 0u ? abs(seen) : max(seen, 0.0);
        vec3 irradiance = e.radiance * (seen / (e.probability * strata));
        float weight = brightest(irradiance);
        total += weight;
        // One random number serves all choices: what is left of it is even again.
        float share = total > 0.0 ? weight / total : 0.0;
        bool taken = choice < share;
        choice = taken ? choice / share : (choice - share) / max(1.0 - share, 1e-6);
        chosen = taken ? index : chosen;
        chosen_irradiance = taken ? irradiance : chosen_irradiance;
        chosen_weight = taken ? weight : chosen_weight;
    }
    Emitter e = emitters[chosen];
    // The R2 sequence (Roberts, 2018), shifted by the place.
    vec2 r = fract(random.yx + vec2(0.7548776662, 0.5698402909) * float(i + 1u));
    float root = sqrt(r.x);
    EmitterSample s;
    s.point = mix(e.a, mix(e.b, e.c, r.y), root);
    s.irradiance = chosen_weight > 0.0 ? chosen_irradiance * (total / chosen_weight) : vec3(0.0);
    return s;
}
