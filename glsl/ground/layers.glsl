// Clearcoat, sheen, film, brushed grain and light from the far side, as ground/brdf.glsl adds them to a surface.

#include "common/thin_film.glsl"
#include "ground/surface.glsl"

const float COAT_F0 = 0.04; // of index 1.5

bool has_film(Surface s) {
    return feature(FEATURE_IRIDESCENCE) && s.finish.film > 0.0;
}

bool is_brushed(Surface s) {
    return feature(FEATURE_ANISOTROPY) && s.finish.along > 0.0;
}

// Share of light that the coat reflects to a viewer under the cosine nv to its normal.
float coat_share(Surface s, float nv) {
    return feature(FEATURE_CLEARCOAT) ? s.finish.coat * schlick(COAT_F0, 1.0, nv) : 0.0;
}

// Share that the sheen takes from what lies below it, by the more slanting of two cosines.
float sheen_share(Surface s, float nv, float nl) {
    float most = brightest(s.finish.sheen);
    return feature(FEATURE_SHEEN) && most > 0.0
        ? most * min(max(sheen_albedo(s.finish, nv), sheen_albedo(s.finish, nl)), 1.0)
        : 0.0;
}

// Share of light from all around that the sheen takes from the layers below it.
float sheen_share(Surface s, float nv) {
    float most = brightest(s.finish.sheen);
    return feature(FEATURE_SHEEN) && most > 0.0 ? most * sheen_taken(s.finish, nv) : 0.0;
}

// Fresnel under the film at a microfacet that light meets under this cosine; w: what is left for what lies under it.
vec4 film_fresnel(Surface s, float cosine) {
    Finish f = s.finish;
    vec3 dielectric =
        mix(schlick(f.film_f0, s.coat_f90, cosine), film_reflectance(f.film_ior, f.film_nm, f.film_f0, cosine), f.film);
    vec3 metal = mix(schlick(f.film_metal.rgb, 1.0, cosine),
        film_reflectance(f.film_ior, f.film_nm, f.film_metal.rgb, cosine), f.film);
    return vec4(mix(dielectric, metal, f.film_metal.w), 1.0 - brightest(dielectric));
}

// The reflectance at normal incidence for which Schlick's formula gives `fresnel` under this cosine.
vec3 f0_for(vec3 fresnel, float f90, float cosine) {
    float grazing = min(pow(1.0 - cosine, 5.0), 0.9);
    return clamp((fresnel - f90 * grazing) / (1.0 - grazing), vec3(0.0), vec3(1.0));
}

// The surface without its film: reflectances that give the same under this cosine.
Surface without_film(Surface s, float nv) {
    if (has_film(s)) {
        vec4 fresnel = film_fresnel(s, nv);
        s.f0 = f0_for(fresnel.rgb, s.f90, nv);
        s.coat_f0 = f0_for(vec3(1.0 - fresnel.w), s.coat_f90, nv).x;
        s.finish.film = 0.0;
    }
    return s;
}

// D · V of GGX with two roughnesses (KHR_materials_anisotropy).
float brushed_lobe(Surface s, vec3 v, vec3 l, vec3 h, float nv, float nl, float nh) {
    vec3 t = s.finish.grain;
    vec3 b = cross(s.normal, t);
    vec2 a = max(vec2(s.finish.along, s.finish.across), vec2(1e-3));
    vec2 th = vec2(dot(h, t), dot(h, b)) / a;
    float e = dot(th, th) + nh * nh;
    float to_viewer = nv + length(vec3(a * vec2(dot(v, t), dot(v, b)), nv));
    float to_light = nl + length(vec3(a * vec2(dot(l, t), dot(l, b)), nl));
    return 1.0 / (PI * a.x * a.y * e * e * max(to_viewer * to_light, 1e-7));
}

// Where a single look along the mirror's way goes: a brushed surface's is bent to the middle of its long lobe.
vec3 mirrored(Surface s, vec3 view) {
    vec3 n = s.normal;
    if (is_brushed(s)) {
        vec3 b = cross(n, s.finish.grain);
        // The normal that faces the viewer across the grain's long direction; between it and n by how long the lobe is.
        vec3 facing = cross(cross(b, view), b);
        float bend = clamp((s.finish.along - s.finish.across) * (1.0 - s.finish.across), 0.0, 1.0);
        n = dot(facing, facing) > 1e-6 ? normalize(mix(n, normalize(facing), 0.5 * bend)) : n;
    }
    return reflect(-view, n);
}

// The other side of the same sheet.
Surface far_side(Surface s) {
    s.normal = -s.normal;
    s.facet = -s.facet;
    return s;
}

bool sends_through(Surface s) {
    return feature(FEATURE_DIFFUSE_TRANSMISSION) && any(greaterThan(s.finish.diffused, vec3(0.0)));
}

// Whether light from all around its side reaches a viewer, other than mirrored.
bool scatters(Surface s) {
    return any(greaterThan(s.diffuse, vec3(0.0)))
        || (feature(FEATURE_SHEEN) && any(greaterThan(s.finish.sheen, vec3(0.0))));
}

// The coat as a surface of its own.
Surface coat_of(Surface s) {
    Surface coat = s;
    coat.normal = s.finish.coat_normal;
    coat.roughness = s.finish.coat_roughness;
    coat.f0 = vec3(COAT_F0 * s.finish.coat);
    coat.f90 = s.finish.coat;
    coat.diffuse = vec3(0.0);
    coat.transmitted = vec3(0.0);
    coat.transmission = 0.0;
    coat.thickness_m = 0.0;
    coat.finish = NO_FINISH;
    return coat;
}
