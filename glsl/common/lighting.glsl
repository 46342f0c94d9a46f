// Light on a surface: direct with shadows, and gathered through cones. Used by the voxels and by the image.
// Radiance, except what comes back from cones (stored radiance: divide by frame.scale).

// A place's own; with jitter, another one in every frame.
uvec4 place_seed(vec3 position) {
    return uvec4(floatBitsToUint(position), frame.frame_index * uint(feature(FEATURE_JITTER)));
}

// The lit share of a light's disc, by rays to points spread evenly over it and turned from place to place; one ray goes to
// its middle.
vec3 shadow_rays(Light light, LightSample to, vec3 position, vec3 facet) {
    bool far = light.kind == LIGHT_DIRECTIONAL;
    uint count = light.radius > 0.0 ? SHADOW_RAYS : 1u;
    vec3 x = normalize(cross(to.direction, abs(to.direction.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 y = cross(to.direction, x);
    float turn = 2.0 * PI * jitter_hash(place_seed(position));
    vec3 open = vec3(0.0);
    for (uint k = 0u; k < count; k++) {
        float r = count > 1u ? light.radius * sqrt((float(k) + 0.5) / float(count)) : 0.0;
        float angle = turn + GOLDEN_ANGLE * float(k);
        vec3 d = to.direction * (far ? 1.0 : to.distance) + r * (cos(angle) * x + sin(angle) * y);
        float distance = length(d);
        open += trace_shadow_ray(ray_start(position, facet, d), d / distance, far ? 1e30 : distance);
    }
    return open / float(count);
}

vec3 shadow_towards(Light light, LightSample to, vec3 position, vec3 facet, vec3 normal, bool volume_is_there) {
    if (SHADOWS == SHADOWS_RAYS) {
        return shadow_rays(light, to, position, facet);
    }
#ifdef CONES
    if (SHADOWS == SHADOWS_CONES && volume_is_there) {
        vec3 from = position + normal * frame.shadow_start_normal;
        bool far = light.kind == LIGHT_DIRECTIONAL;
        vec3 d = far ? to.direction : light.position - from;
        float distance = far ? 1e30 : max(length(d), 1e-6);
        d = far ? d : d / distance;
        float aperture = frame.shadow_aperture >= 0.0 ? frame.shadow_aperture : far ? light.radius : light.radius / distance;
        float start = frame.shadow_start_along;
        if (feature(FEATURE_JITTER)) {
            start += frame.shadow_step * jitter_hash(uvec4(floatBitsToUint(from), frame.frame_index));
        }
        return vec3(trace_shadow_cone(from, d, distance, aperture, start, frame.shadow_step, frame.shadow_end));
    }
#endif
    return vec3(1.0);
}

// Light from lamps with an extent, sample by sample.
vec2 emitter_random(vec3 position) {
    uvec4 seed = place_seed(position);
    return vec2(jitter_hash(seed), jitter_hash(seed.wzyx ^ 0x9e3779b9u));
}

uint emitter_samples() {
    return EMITTERS == EMITTERS_SAMPLED && frame.emitter_count > 0u ? EMITTER_SAMPLES : 0u;
}

vec3 shadow_towards_point(vec3 position, vec3 facet, vec3 point) {
    if (SHADOWS == SHADOWS_NONE) {
        return vec3(1.0);
    }
    vec3 origin = ray_start(position, facet, point - position);
    vec3 to = point - origin; // not from the position: along a slanting way the start is nearer to the lamp by more than itself
    float distance = length(to);
    // Short of the lamp, which is listed like any triangle.
    return trace_shadow_ray(origin, to / max(distance, 1e-6), distance * 0.9999 - RAY_START);
}

// The way light goes on behind a surface. `incident`: unit, towards the surface; `normal`: of the side it meets.
// D24: printed knows no back face, and its refract() = 0 past total reflection becomes NaN when normalised.
vec3 refraction_direction(vec3 incident, vec3 normal, float ior, bool back, bool thin) {
    if (thin && !printed(24)) {
        return incident;
    }
    vec3 d = refract(incident, normal, back && !printed(24) ? ior : 1.0 / ior);
    if (dot(d, d) > 0.25) {
        return normalize(d);
    }
    return printed(24) ? incident : reflect(incident, normal);
}

// Diffuse cones: rgb = E/π in stored radiance, the sky behind them included; a = share of the hemisphere that is open.
#ifdef CONES
vec4 gather_diffuse(vec3 position, vec3 facet, vec3 normal, uvec3 seed) {
    vec3 from = GATHER == GATHER_RAYS ? position : position + normal * frame.diffuse_start_normal;
    mat3 basis = tangent_frame(normal);
    if (feature(FEATURE_JITTER)) {
        basis = jitter_rotation(normal, jitter_hash(uvec4(seed, frame.frame_index))) * basis;
    }
    vec2 shift = INTERLEAVE > 1u ? interleaved_shift(seed) : vec2(0.5, 0.0);
    if (INTERLEAVE > 1u && CONE_SET != COSINE_SETS) {
        basis = jitter_rotation(normal, shift.y) * basis;
    }
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < CONE_COUNT; i++) {
        Cone cone = cone_set(i, shift);
        vec3 d = basis * cone.direction;
        // What the neighbours find is shared: a ray stands for its part of all their directions.
        float aperture = cone.aperture * frame.cone_aperture / (GATHER == GATHER_RAYS ? float(INTERLEAVE) : 1.0);
        vec4 seen = GATHER == GATHER_RAYS ? trace_gather_ray(from, facet, d, aperture)
                                          : trace_cone(from, d, aperture, frame.diffuse_start_along);
        float open = 1.0 - min(seen.a, 1.0);
        // D21: printed drops alpha, and the sky with it.
        sum += cone.weight * vec4(printed(21) ? seen.rgb : seen.rgb + open * frame.sky * frame.scale, open);
    }
    return sum;
}

vec3 gather_along(vec3 from, vec3 d, float aperture, float start) {
    vec4 seen = trace_cone(from, d, aperture, start);
    return printed(21) ? seen.rgb : seen.rgb + (1.0 - min(seen.a, 1.0)) * frame.sky * frame.scale;
}

vec3 gather_specular(vec3 position, vec3 normal, vec3 direction, float roughness) {
    return gather_along(position + normal * frame.specular_start_normal, direction, roughness_to_aperture(roughness),
        frame.specular_start_along);
}

vec3 gather_refraction(Surface s, vec3 incident, bool back) {
    vec3 d = refraction_direction(incident, s.normal, s.ior, back, s.thickness_m <= 0.0);
    // D23: printed starts outside the surface that it enters. Total reflection stays on its own side.
    float side = printed(23) || dot(d, s.normal) > 0.0 ? 1.0 : -1.0;
    return gather_along(s.position + side * s.normal * frame.refraction_start_normal, d, roughness_to_aperture(s.roughness),
        frame.refraction_start_along);
}
#endif
