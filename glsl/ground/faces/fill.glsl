// A voxel from the light of its list's items: premultiplied stored radiance and alpha for travel along +x +y +z −x −y
// −z, and averages. With `uniform` and `front` a triangle is shaded once, for its front; the other fills distinguish
// its sides. CPU twin: tests/twins/shade.rs.
//! given const uint FILL = 3u;

#include "common/color.glsl"
#include "common/fixed_sum.glsl"
#include "ground/layout.glsl"
#include "ground/faces/fill_kinds.glsl"

const float DARK_BACK = 1e-3; // as a share of the front's light; below it the back counts as dark (rounding and leaks)

struct Filling {
    FixedSum sums[7];
    uint count;
};

Filling start_filling() {
    Filling f;
    for (int k = 0; k < 7; k++) {
        f.sums[k] = fixed_zero();
    }
    f.count = 0u;
    return f;
}

// Both fills average the light of the fronts over the triangles, independent of their areas.
const bool TAKES_MEANS = FILL == FILL_UNIFORM || FILL == FILL_FRONT;

// `n` is the unit normal of the front.
void fill_with(inout Filling f, ItemLight light, vec3 n, bool two_sided) {
    float whole = TAKES_MEANS ? light.opacity : light.opacity * light.area;
    for (int k = 0; k < 6; k++) {
        float along = k < 3 ? n[k] : -n[k - 3];
        bool sees_front = along < 0.0 || FILL == FILL_UNIFORM;
        float weight = FILL == FILL_UNIFORM ? whole : whole * abs(along);
        vec3 seen = sees_front ? light.front : light.back;
        if (FILL == FILL_FRONT && !sees_front) {
            weight = 0.0;
        }
        // A nearly black back is left out, because on walls of zero thickness it would only darken the light of the
        // front.
        if (FILL == FILL_SIDED && !sees_front && brightest(light.back) <= DARK_BACK * brightest(light.front)) {
            weight = 0.0;
        }
        fixed_add(f.sums[k], vec4(seen * weight, weight));
    }
    bool mixes = two_sided && !TAKES_MEANS;
    fixed_add(f.sums[6], vec4((mixes ? 0.5 * (light.front + light.back) : light.front) * whole, whole));
    f.count++;
}

vec4[7] filled(Filling f) {
    vec4 faces[7];
    for (int k = 0; k < 7; k++) {
        vec4 sum = fixed_value(f.sums[k]);
        faces[k] = TAKES_MEANS ? sum / float(max(f.count, 1u))
            : sum.a > 0.0      ? sum * (min(sum.a, 1.0) / sum.a)
                               : vec4(0.0);
    }
    return faces;
}
