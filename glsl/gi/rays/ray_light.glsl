// A ray that finds its triangle exactly and takes the light that the voxels hold there.

#include "ground/ray.glsl"
#include "ground/faces/look_up.glsl"

// Stored radiance of a surface at `at`, from a footprint of `diameter` voxels; d: unit, against the normal of the side that
// is met. Of its own faces alone: by the ray's direction, a bright top would show its dark sides to a ray along it.
// Divided by alpha: neither a wall's thickness nor the grid can lose energy.
vec3 volume_radiance(vec3 at, vec3 d, float diameter) {
    vec4 v = mix_faces(look_up_faces(at, d, max(0.0, log2(diameter))), d * d);
    return v.rgb / max(v.a, 1e-4);
}

// Leaves along unit d from a surface with normal `facet`: rgb = stored radiance of what it meets, a = 1 − what is open.
// `aperture`: tangent of the half angle that the ray stands for.
vec4 trace_light(vec3 position, vec3 facet, vec3 d, float aperture) {
    // A shading normal's hemisphere reaches below the facet: what would go there is mirrored up.
    d -= 2.0 * min(dot(d, facet), 0.0) * facet;
    vec3 origin = position + facet * RAY_START;
    vec3 through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_ALPHA) ? MOST_PASSED : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        vec3 radiance = volume_radiance(origin + d * met.distance, met.back ? met.normal : -met.normal, 2.0 * aperture * met.distance);
        vec3 passed = transmittance(met);
        sum += met.any && !met.dark ? through * (1.0 - passed) * radiance : vec3(0.0);
        through *= met.any ? passed : vec3(1.0);
        bool spent = brightest(through) < SPENT;
        through = spent ? vec3(0.0) : through;
        going = met.any && !spent;
        least = met.distance;
    }
    return vec4(sum, 1.0 - (through.r + through.g + through.b) / 3.0);
}
