// Clearcoat, sheen, film, brushed grain and diffuse transmission, which ground/brdf.glsl adds to a surface.

#include "common/thin_film.glsl"
#include "ground/surface.glsl"

const float COAT_F0 = 0.04; // of index 1.5

bool has_film(Surface s) {
    return feature(FEATURE_IRIDESCENCE) && s.finish.film > 0.0;
}

bool is_brushed(Surface s) {
    return feature(FEATURE_ANISOTROPY) && s.finish.along > 0.0;
}

// The share of light that the coat reflects to a viewer at cosine nv to its normal.
float coat_share(Surface s, float nv) {
    return feature(FEATURE_CLEARCOAT) ? s.finish.coat * schlick(COAT_F0, 1.0, nv) : 0.0;
}

// The share that the sheen takes from the layers below, by the more slanting of two directions.
float sheen_share(Surface s, float nv, float nl) {
    float most = brightest(s.finish.sheen);
    return feature(FEATURE_SHEEN) && most > 0.0
        ? most * min(max(sheen_albedo(s.finish, nv), sheen_albedo(s.finish, nl)), 1.0)
        : 0.0;
}

// The share of uniform light from all directions that the sheen takes from the layers below.
float sheen_share(Surface s, float nv) {
    float most = brightest(s.finish.sheen);
    return feature(FEATURE_SHEEN) && most > 0.0 ? most * sheen_taken(s.finish, nv) : 0.0;
}

// Fresnel reflectance under the film at a microfacet, for the light's cosine; w is the share for the layers below.
vec4 film_fresnel(Surface s, float cosine) {
    Finish f = s.finish;
    vec3 dielectric =
        mix(schlick(f.film_f0, s.coat_f90, cosine), film_reflectance(f.film_ior, f.film_nm, f.film_f0, cosine), f.film);
    vec3 metal = mix(schlick(f.film_metal.rgb, 1.0, cosine),
        film_reflectance(f.film_ior, f.film_nm, f.film_metal.rgb, cosine), f.film);
    return vec4(mix(dielectric, metal, f.film_metal.w), 1.0 - brightest(dielectric));
}

// The reflectance at normal incidence for which Schlick's formula gives `fresnel` at this cosine.
vec3 f0_for(vec3 fresnel, float f90, float cosine) {
    float grazing = min(pow(1.0 - cosine, 5.0), 0.9);
    return clamp((fresnel - f90 * grazing) / (1.0 - grazing), vec3(0.0), vec3(1.0));
}

// The surface without its film, with reflectances that give the same at this cosine.
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

// The direction of a single reflected ray: for a brushed surface it is bent to the middle of its long lobe.
vec3 mirrored(Surface s, vec3 view) {
    vec3 n = s.normal;
    if (is_brushed(s)) {
        vec3 b = cross(n, s.finish.grain);
        // A normal between n and the viewer's direction across the grain, depending on the length of the lobe.
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

// Whether uniform light from all directions on its side reaches a viewer other than by specular reflection.
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
