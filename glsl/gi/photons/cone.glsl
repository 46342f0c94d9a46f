// Cones through a volume: spheres that touch. Positions and lengths in voxels; light is stored radiance (×
// frame.scale). Held by tests/device/functions_photons.rs.

#include "common/count.glsl"
#include "ground/frame.glsl"
#include "gi/photons/volume.glsl"

const uint STEP_CAP = 1024u; // steps of half a voxel cross 256³ in 887
const float SPENT_CONE = 0.005; // of what a cone sees; what is left is taken to be hidden

// Half angle's tangent of a cone with that solid angle, sr: the share of the hemisphere that one of N directions with a
// density of pdf stands for is min(1/(N·pdf), 2π); cos = 1 − Ω/2π. (Colbert and Křivánek, "GPU-Based Importance
// Sampling", 2007.)
float cone_ratio(float solid_angle) {
    float cosine = 1.0 - min(solid_angle / (2.0 * PI), 1.0);
    return sqrt(1.0 - cosine * cosine) / max(cosine, 1e-6);
}

// A sphere on the axis. It owns the stretch that it covers: its extent.
struct Sphere {
    float middle; // distance along the axis
    float extent; // diameter
};

// The sphere whose near side is `front` away: h − hR = front. Near the apex spheres shrink to nothing, and h = 0 leads
// to h = 0: the extent is bounded.
Sphere sphere_at(float front, float ratio) {
    float middle = front / (1.0 - ratio);
    float extent = 2.0 * ratio * middle;
    return extent < LEAST_STEP ? Sphere(front + 0.5 * LEAST_STEP, LEAST_STEP) : Sphere(middle, extent);
}

// The first one. At R ≥ 1, half angles from 45°, there is none, and near 1 one that swallows everything: R is bounded.
Sphere sphere_beyond(float front, float ratio) {
    return sphere_at(front, min(ratio, MOST_RATIO));
}

// The next one touches it. As printed h' = (h + hR)/(1 − R) for every R: from R = 1 on there is none, which a negative
// extent says, and at R = 0 it is where the last one was.
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
    vec3 light; // stored radiance, what is behind all of it not included
    float open; // share that goes through
    float near; // the same, exponentially weighted along the way: ∫ λ exp(−λt) V(t) dt
};

// How far a ray goes until it leaves the cube; 0 if it never enters.
float exit_distance(vec3 from, vec3 d) {
    vec3 inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 far = max(-from * inverse, (vec3(float(EDGE)) - from) * inverse);
    return max(min(far.x, min(far.y, far.z)), 0.0);
}

// Opacity over a stretch of `length` voxels, of which `edge` voxels have the opacity a. Beer's law for a homogeneous
// medium is 1 − (1 − a)^(length/edge). Surfaces are no medium: the parts of one wall that neighbouring spheres find add
// up to one wall. As printed the exponent is upside down.
float opacity_over(float a, float length, float edge, float increment) {
    if (COMPOSITE == COMPOSITE_SUM) {
        return a * length / edge;
    }
    float exponent = printed(ROW_BEER) ? edge / max(increment, 1e-6) : length / edge;
    return 1.0 - pow(1.0 - clamp(a, 0.0, 1.0), exponent);
}

// Travels along unit d from `from`.
ConeLight trace_cone(vec3 from, vec3 d, float ratio) {
    float end = exit_distance(from, d);
    float rate = AO_RATE * frame.voxel_m;
    Sphere sphere = sphere_beyond(START_ALONG, ratio);
    float front = START_ALONG;
    ConeLight seen = ConeLight(vec3(0.0), 1.0, 0.0);
    // Until the first sphere all is open; the printed sum leaves that out.
    seen.near = printed(ROW_AO) ? 0.0 : 1.0 - exp(-rate * front);
    bool going = true;
    for (uint i = 0u; i < STEP_CAP && going; i++) {
        COUNT(CONE_STEPS, 1u);
        float diameter = max(sphere.extent, 1.0); // a sphere that is smaller than a voxel reads a whole one
        float edge = min(diameter, float(EDGE)); // of the level that is read
        float level = log2(edge);
        vec3 at = from + sphere.middle * d;
        Sphere next = sphere_after(sphere, ratio);
        float a = opacity_at(at, d, level);
        float whole = opacity_over(a, sphere.extent, edge, next.middle - sphere.middle);
        float met = COMPOSITE == COMPOSITE_SUM ? min(whole, seen.open) : whole * seen.open;
        if (a > 0.0) {
            // Colour counts as much as opacity does; printed, as much as the opacity that was read.
            float weight = printed(ROW_COLOR) ? a * seen.open : met;
            // Σ photons · v²/D²: mips hold Σ photons · v²/edge². The diameter exceeds the edge only where the grid
            // ends.
            float factor = printed(ROW_MIPS) ? edge * edge / (diameter * diameter) : 1.0;
            seen.light += weight * factor * light_towards(-d, at, level, a);
        }
        float before = seen.open;
        seen.open = max(seen.open - met, 0.0);
        float back = sphere.middle + 0.5 * sphere.extent;
        // Visibility up to the sphere, as for its light; printed, beyond it.
        float reached = exp(-rate * front);
        front = printed(ROW_AO) ? sphere.middle : back;
        seen.near += (printed(ROW_AO) ? seen.open : before) * (reached - exp(-rate * front));
        // A sum goes on beyond the border until filtering spreads no wall that far.
        float last = COMPOSITE == COMPOSITE_SUM ? end + min(next.extent, float(EDGE)) : end + 0.5 * next.extent;
        going = seen.open > SPENT_CONE && next.middle < last && next.middle > sphere.middle && next.extent > 0.0;
        sphere = next;
    }
    seen.open = seen.open > SPENT_CONE ? seen.open : 0.0;
    // The rest of the way: its visibility is the last one's. The printed sum ends before.
    seen.near += printed(ROW_AO) ? 0.0 : seen.open * exp(-rate * front);
    return seen;
}
