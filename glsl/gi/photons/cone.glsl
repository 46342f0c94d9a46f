// Cones through a volume, as touching spheres. Positions and lengths are in voxels; light is stored radiance (×
// frame.scale). Checked by tests/device/functions_photons.rs.

#include "common/count.glsl"
#include "ground/frame.glsl"
#include "gi/photons/volume.glsl"

const uint STEP_CAP = 1024u; // steps of half a voxel cross 256³ in 887
const float SPENT_CONE = 0.005; // the open share below which the rest of a cone counts as hidden

// Tangent of the half angle of a cone with that solid angle in sr. One of N directions with a density of pdf represents
// the share min(1/(N·pdf), 2π) of the hemisphere; cos = 1 − Ω/2π. (Colbert and Křivánek, "GPU-Based Importance
// Sampling", 2007.)
float cone_ratio(float solid_angle) {
    float cosine = 1.0 - min(solid_angle / (2.0 * PI), 1.0);
    return sqrt(1.0 - cosine * cosine) / max(cosine, 1e-6);
}

// A sphere on the axis, with the stretch of the axis that it covers.
struct Sphere {
    float middle; // distance along the axis
    float extent; // diameter
};

// The sphere whose near side is at distance `front`: h − hR = front. Near the apex spheres shrink to nothing, and h = 0
// leads to h = 0, so the extent has a lower bound.
Sphere sphere_at(float front, float ratio) {
    float middle = front / (1.0 - ratio);
    float extent = 2.0 * ratio * middle;
    return extent < LEAST_STEP ? Sphere(front + 0.5 * LEAST_STEP, LEAST_STEP) : Sphere(middle, extent);
}

// The first sphere. For R ≥ 1, half angles from 45°, there is none, and near 1 it would cover everything: R has an
// upper bound.
Sphere sphere_beyond(float front, float ratio) {
    return sphere_at(front, min(ratio, MOST_RATIO));
}

// The next touching sphere. The printed form is h' = (h + hR)/(1 − R) for every R: from R = 1 on there is none, which a
// negative extent indicates, and for R = 0 it does not move.
Sphere sphere_after(Sphere last, float ratio) {
    float front = last.middle + 0.5 * last.extent;
    float r = printed(ROW_STEPS) ? ratio : min(ratio, MOST_RATIO);
    if (r >= 1.0) {
        return Sphere(last.middle + last.extent, -1.0);
    }
    float middle = front / (1.0 - r);
    return printed(ROW_STILL) ? Sphere(middle, 2.0 * r * middle) : sphere_at(front, r);
}

struct ConeLight {
    vec3 light; // stored radiance, without the background
    float open; // share of light that passes through
    float near; // the same with exponential weights along the axis: ∫ λ exp(−λt) V(t) dt
};

// The distance at which a ray leaves the cube; 0 if it never enters.
float exit_distance(vec3 from, vec3 d) {
    vec3 inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 far = max(-from * inverse, (vec3(float(EDGE)) - from) * inverse);
    return max(min(far.x, min(far.y, far.z)), 0.0);
}

// Opacity over a stretch of `length` voxels, of which each `edge` has the opacity a. Beer's law for a homogeneous
// medium is 1 − (1 − a)^(length/edge). Surfaces are not a medium: the parts of a wall that neighbouring spheres find
// add up to the wall. The printed exponent is inverted.
float opacity_over(float a, float length, float edge, float increment) {
    if (COMPOSITE == COMPOSITE_SUM) {
        return a * length / edge;
    }
    float exponent = printed(ROW_BEER) ? edge / max(increment, 1e-6) : length / edge;
    return 1.0 - pow(1.0 - clamp(a, 0.0, 1.0), exponent);
}

// Traces a cone along unit d from `from`.
ConeLight trace_cone(vec3 from, vec3 d, float ratio) {
    float end = exit_distance(from, d);
    float rate = AO_RATE * frame.voxel_m;
    Sphere sphere = sphere_beyond(START_ALONG, ratio);
    float front = START_ALONG;
    ConeLight seen = ConeLight(vec3(0.0), 1.0, 0.0);
    // Everything is open before the first sphere; the printed sum omits this.
    seen.near = printed(ROW_AO) ? 0.0 : 1.0 - exp(-rate * front);
    bool going = true;
    for (uint i = 0u; i < STEP_CAP && going; i++) {
        COUNT(CONE_STEPS, 1u);
        float diameter = max(sphere.extent, 1.0); // a sphere smaller than a voxel reads a whole voxel
        float edge = min(diameter, float(EDGE)); // of the sampled level
        float level = log2(edge);
        vec3 at = from + sphere.middle * d;
        Sphere next = sphere_after(sphere, ratio);
        float a = opacity_at(at, d, level);
        float whole = opacity_over(a, sphere.extent, edge, next.middle - sphere.middle);
        float met = COMPOSITE == COMPOSITE_SUM ? min(whole, seen.open) : whole * seen.open;
        if (a > 0.0) {
            // Colour is weighted by opacity; in the printed form by the opacity that was read.
            float weight = printed(ROW_COLOR) ? a * seen.open : met;
            // Σ photons · v²/D²: mips hold Σ photons · v²/edge². The diameter exceeds the edge only at the coarsest
            // level.
            float factor = printed(ROW_MIPS) ? edge * edge / (diameter * diameter) : 1.0;
            seen.light += weight * factor * light_towards(-d, at, level, a);
        }
        float before = seen.open;
        seen.open = max(seen.open - met, 0.0);
        float back = sphere.middle + 0.5 * sphere.extent;
        // Visibility up to the sphere, as for its light; in the printed form, behind it.
        float reached = exp(-rate * front);
        front = printed(ROW_AO) ? sphere.middle : back;
        seen.near += (printed(ROW_AO) ? seen.open : before) * (reached - exp(-rate * front));
        // A sum continues beyond the border as far as filtering spreads a wall.
        float last = COMPOSITE == COMPOSITE_SUM ? end + min(next.extent, float(EDGE)) : end + 0.5 * next.extent;
        going = seen.open > SPENT_CONE && next.middle < last && next.middle > sphere.middle && next.extent > 0.0;
        sphere = next;
    }
    seen.open = seen.open > SPENT_CONE ? seen.open : 0.0;
    // The rest of the axis has the last visibility. The printed sum ends before it.
    seen.near += printed(ROW_AO) ? 0.0 : seen.open * exp(-rate * front);
    return seen;
}
