// Cones through the volume. Positions and lengths are in voxels; the result is stored radiance (× frame.scale),
// premultiplied, and alpha. CPU twin: tests/twins/cone.rs.

#include "common/count.glsl"
#include "ground/faces/look_up.glsl"
#include "gi/cones/constants.glsl"

const uint BLEND_SUM = 1u;
const float NEARLY_OPAQUE = 0.995; // D18: the remaining light cannot change an 8-bit image
const uint STEP_CAP = 2048u; // a hard shadow cone crosses 256³ in 1331 steps of ⅓
const float MAX_FACE_ALPHA = 0.9999; // keeps −ln(1 − α) finite

vec3 direction_weights(vec3 d) {
    if (WEIGHTS == WEIGHTS_NORM1) {
        vec3 a = abs(d);
        return a / (a.x + a.y + a.z);
    }
    return WEIGHTS == WEIGHTS_ABS ? abs(d) : d * d;
}

// Alpha over a step of `ratio` voxel edges, and the colour with it (D12).
vec4 correct_opacity(vec4 v, float ratio) {
    float a = clamp(v.a, 0.0, 1.0);
    float corrected = 1.0 - pow(1.0 - a, ratio);
    return a > 1e-6 ? v * (corrected / a) : v * ratio;
}

// The volume as seen along unit d, over one edge of the sampled level.
vec4 sample_directional(vec3 at, vec3 d, vec3 weights, float level) {
    Faces f = look_up_faces(at, d, level);
    if (WEIGHTS == WEIGHTS_EXTINCTION) {
        // A slab of microfacets: optical depth Σ|dᵢ|τᵢ, colour Σ|dᵢ|τᵢcᵢ / Σ|dᵢ|τᵢ.
        vec3 alpha = clamp(vec3(f.x.a, f.y.a, f.z.a), 0.0, MAX_FACE_ALPHA);
        vec3 tau = -log(1.0 - alpha) * abs(d);
        float depth = tau.x + tau.y + tau.z;
        if (depth <= 0.0) {
            return vec4(0.0);
        }
        vec3 share = tau / max(vec3(f.x.a, f.y.a, f.z.a), 1e-6) / depth;
        float a = 1.0 - exp(-depth);
        return vec4(mix_faces(f, share).rgb * a, a);
    }
    return mix_faces(f, weights);
}

// The distance at which a ray leaves the cube; 0 if it never enters.
float exit_distance(vec3 from, vec3 d) {
    vec3 inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 far = max(-from * inverse, (vec3(float(EDGE)) - from) * inverse);
    return max(min(far.x, min(far.y, far.z)), 0.0);
}

// Width of the cone in voxels at distance s. D17: the printed form compares the aperture, a ratio, with an edge of the
// volume, a length.
float cone_diameter(float aperture, float s) {
    return printed(17) ? max(0.5, max(1.0 / float(EDGE), 2.0 * aperture) * s) : max(1.0, 2.0 * aperture * s);
}

// With blend = sum a cone continues until it has met the whole last wall, which the border may cut.
float cone_end(float end, float diameter) {
    return BLEND == BLEND_SUM ? end + 0.5 + min(cones.exit_margin * diameter, float(EDGE) / 8.0) : end;
}

// Traces a cone along unit d from `from`; the first look-up is at `start`, and the aperture is the tangent of the half
// angle. `over`: nearer samples hide farther ones. `sum`: alphas add up to 1. A full wall that is read at every edge
// with linear filtering gives alphas a and 1 − a, of which "over" loses a(1 − a), and the sum nothing.
vec4 trace_cone(vec3 from, vec3 d, float aperture, float start) {
    vec3 weights = direction_weights(d);
    // D10, D11: the printed form ends at √2 edges with the border repeated, the corrected one at the exit.
    float end = printed(10) ? 1.41421356237 * float(EDGE) : exit_distance(from, d);
    if (printed(10) && !printed(11)) {
        end = min(end, exit_distance(from, d));
    }
    float opaque = printed(18) ? 1.0 : NEARLY_OPAQUE;
    float s = start;
    float diameter = cone_diameter(aperture, s);
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < STEP_CAP && sum.a < opaque && s < cone_end(end, diameter); i++) {
        float level = max(0.0, log2(diameter));
        COUNT(CONE_STEPS, 1u);
        vec4 seen = sample_directional(from + s * d, d, weights, level);
        if (BLEND == BLEND_SUM) {
            seen *= cones.step;
            sum += seen * min(1.0, (1.0 - sum.a) / max(seen.a, 1e-6));
        } else {
            if (cones.step != 1.0) {
                seen = correct_opacity(seen, cones.step);
            }
            sum += (1.0 - sum.a) * seen;
        }
        s += max(diameter, 1.0) * cones.step;
        diameter = cone_diameter(aperture, s);
    }
    return max(sum, vec4(0.0));
}

// The share of light from `distance` away along unit d that reaches the point, 0…1.
float trace_shadow_cone(
    vec3 from, vec3 d, float distance, float aperture, float start, float step_over_diameter, float end_bias) {
    vec3 weights = direction_weights(d);
    float end = min(distance - end_bias, exit_distance(from, d));
    if (printed(10)) {
        end = min(end, 1.41421356237 * float(EDGE));
    }
    float opaque = printed(18) ? 1.0 : NEARLY_OPAQUE;
    float s = start;
    float alpha = 0.0;
    for (uint i = 0u; i < STEP_CAP && s < end && alpha < opaque; i++) {
        float diameter = cone_diameter(aperture, s);
        float level = max(0.0, log2(printed(13) ? diameter + 1.0 : diameter)); // D13
        vec3 at = from + s * d;
        COUNT(SHADOW_STEPS, 1u);
        COUNT(VOLUME_TEXELS, printed(15) ? trilinear_texels(level) : 0u);
        // D15: averaged over all sides, the alpha of a wall halves with every level.
        float a =
            printed(15) ? textureLod(volume_6, at / float(EDGE), level).a : sample_directional(at, d, weights, level).a;
        float advance = max(diameter, 1.0) * step_over_diameter;
        a = clamp(a, 0.0, 1.0);
        if (!printed(12)) {
            a = 1.0 - pow(1.0 - a, advance / exp2(level)); // D12
        }
        alpha += (1.0 - alpha) * a;
        s += advance;
    }
    return clamp(1.0 - alpha, 0.0, 1.0);
}
