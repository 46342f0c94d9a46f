// A ray that finds its triangle exactly and takes the light that the voxels hold there. Needs: ray.glsl, cone.glsl.

// Stored radiance of a surface at `at`, from a footprint of `diameter` voxels; d: unit, against the normal of the side that
// is met. Of its own faces alone: by the ray's direction, a bright top would show its dark sides to who looks along it.
// Divided by alpha: neither a wall's thickness nor the grid can lose energy.
vec3 volume_radiance(vec3 at, vec3 d, float diameter) {
    vec3 uvw = at / float(EDGE);
    float level = max(0.0, log2(diameter));
    COUNT(VOLUME_TEXELS, 3u * trilinear_texels(level));
    vec3 w = d * d;
    vec4 x = d.x < 0.0 ? textureLod(volume_3, uvw, level) : textureLod(volume_0, uvw, level);
    vec4 y = d.y < 0.0 ? textureLod(volume_4, uvw, level) : textureLod(volume_1, uvw, level);
    vec4 z = d.z < 0.0 ? textureLod(volume_5, uvw, level) : textureLod(volume_2, uvw, level);
    vec4 v = x * w.x + y * w.y + z * w.z;
    return v.rgb / max(v.a, 1e-4);
}

// Leaves along unit d from a surface with normal `facet`: rgb = stored radiance of what it meets, a = 1 − what is open.
// `aperture`: tangent of the half angle that the ray stands for.
vec4 trace_gather_ray(vec3 position, vec3 facet, vec3 d, float aperture) {
    // A shading normal's hemisphere reaches below the facet: what would go there is mirrored up.
    d -= 2.0 * min(dot(d, facet), 0.0) * facet;
    vec3 origin = position + facet * RAY_START;
    vec3 through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_ALPHA) ? MOST_PASSED : 1u) && going; i++) {
        RayHit hit = trace_ray(origin, d, least);
        bool met = hit.triangle != 0u;
        COUNT(TRIANGLES, met ? 1u : 0u);
        COUNT(MATERIALS, met ? 1u : 0u);
        Triangle t = triangles[max(hit.triangle, 1u) - 1u];
        vec3 m = normalize(triangle_normal(t.vertices[0].position, t.vertices[1].position, t.vertices[2].position));
        bool dark = dot(m, d) > 0.0 && (materials[t.material].flags & MATERIAL_DOUBLE_SIDED) == 0u;
        float distance = met ? hit.distance : 0.0;
        vec3 radiance = volume_radiance(origin + d * distance, dot(m, d) > 0.0 ? m : -m, 2.0 * aperture * distance);
        vec3 passed = feature(FEATURE_ALPHA) && t.translucent != 0u ? triangle_transmittance(t, hit.uv) : vec3(0.0);
        sum += met && !dark ? through * (1.0 - passed) * radiance : vec3(0.0);
        through *= met ? passed : vec3(1.0);
        bool spent = brightest(through) < SPENT;
        through = spent ? vec3(0.0) : through;
        going = met && !spent;
        least = hit.distance;
    }
    return vec4(sum, 1.0 - (through.r + through.g + through.b) / 3.0);
}
