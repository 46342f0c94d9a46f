// glTF 2.0, appendix B: Lambert and GGX with Schlick's Fresnel. π occurs only in this file.

#include "common/albedo.glsl"
#include "common/lobe.glsl"
#include "ground/surface.glsl"
#include "ground/layers.glsl"

// A voxel has no viewer: the specular lobe's albedo is taken at the mean cosine of Lambertian light, 2/3, and reflected
// uniformly.
const float MEAN_COSINE = 0.6666667;

struct Brdf {
    vec3 diffuse;
    vec3 specular;
    vec3 sheen;
    vec3 coat; // times the cosine to its own normal over that to the surface's normal
};

// Adds the layers over a surface, and reduces the surface's own reflection.
void add_layers(inout Brdf f, Surface s, vec3 v, vec3 l) {
    float nl = max(dot(s.normal, l), 1e-4);
    float nv = max(abs(dot(s.normal, v)), 1e-4);
    float coat_nv = max(abs(dot(s.finish.coat_normal, v)), 1e-4);
    float coat = coat_share(s, coat_nv);
    float left = (1.0 - sheen_share(s, nv, nl)) * (1.0 - coat);
    f.diffuse *= left;
    f.specular *= left;
    if (feature(FEATURE_SHEEN) && any(greaterThan(s.finish.sheen, vec3(0.0)))) {
        float nh = clamp(dot(s.normal, normalize(l + v)), 0.0, 1.0);
        f.sheen = s.finish.sheen
            * ((1.0 - coat) * sheen_lobe(s.finish.sheen_roughness, nv, nl, nh) / max(sheen_albedo(s.finish, nv), 1.0));
    }
    float coat_nl = dot(s.finish.coat_normal, l);
    if (coat > 0.0 && coat_nl > 0.0) {
        vec3 h = normalize(l + v);
        float alpha = max(s.finish.coat_roughness * s.finish.coat_roughness, MIN_ALPHA);
        float nh = clamp(dot(s.finish.coat_normal, h), 0.0, 1.0);
        f.coat = vec3(coat * ggx_lobe(alpha, nh, coat_nl, coat_nv) * coat_nl / nl);
    }
}

// Reflection towards l for a view along v; both are unit vectors.
Brdf brdf(Surface s, vec3 v, vec3 l) {
    Brdf f = Brdf(s.diffuse / PI, vec3(0.0), vec3(0.0), vec3(0.0));
    float nl = max(dot(s.normal, l), 0.0);
    if (s.f90 > 0.0 || any(greaterThan(s.f0, vec3(0.0)))) {
        vec3 h = normalize(l + v);
        float nv = max(abs(dot(s.normal, v)), 1e-4);
        float nh = clamp(dot(s.normal, h), 0.0, 1.0);
        float vh = clamp(dot(v, h), 0.0, 1.0);
        float alpha = max(s.roughness * s.roughness, MIN_ALPHA);
        vec3 fresnel = schlick(s.f0, s.f90, vh);
        float left = 1.0 - schlick(s.coat_f0, s.coat_f90, vh);
        if (has_film(s)) {
            vec4 filmed = film_fresnel(s, vh);
            fresnel = filmed.rgb;
            left = filmed.w;
        }
        float lobe = is_brushed(s) ? brushed_lobe(s, v, l, h, nv, nl, nh) : ggx_lobe(alpha, nh, nl, nv);
        f.diffuse *= left;
        f.specular = fresnel * lobe;
    }
    if (feature(FEATURE_LAYERS)) {
        add_layers(f, s, v, l);
    }
    return f;
}

// The share of the reflection of a lamp, or of the sky's bright part, that points on it find. The mirrored ray finds
// the rest, and all of it for smooth surfaces, whose lobe points miss.
float lamps_in_lobe(float roughness) {
    return smoothstep(0.15, 0.35, roughness);
}

// The α of the narrowest specular lobe of a surface; 1 without one.
float narrowest_alpha(Surface s) {
    float roughness = feature(FEATURE_SPECULAR) ? s.roughness : 1.0;
    if (feature(FEATURE_CLEARCOAT)) {
        roughness = min(roughness, s.finish.coat > 0.0 ? s.finish.coat_roughness : 1.0);
    }
    return roughness * roughness;
}

// BRDF × cos θ. With `mirrored`, single rays find the light in smooth surfaces.
vec3 brdf_cos(Surface s, vec3 v, vec3 l, bool mirrored) {
    Brdf f = brdf(s, v, l);
    float specular = mirrored ? lamps_in_lobe(s.roughness) : 1.0;
    vec3 sum = f.diffuse + specular * f.specular;
    if (feature(FEATURE_LAYERS)) {
        sum += f.sheen + (mirrored ? lamps_in_lobe(s.finish.coat_roughness) : 1.0) * f.coat;
    }
    return sum * max(dot(s.normal, l), 0.0);
}

// The shares of uniform light from all directions that reach a viewer.
struct Lobes {
    vec3 specular;
    float rest; // the remaining share for transmission
    float diffuse; // the share for diffuse light: less, because rough microfacets mask much of the Fresnel share
    vec3 sheen;
    float coat;
};

// The shares for a viewer at cosine nv to the surface, and at another cosine to its coat.
Lobes lobes_under(Surface s, float nv, float coat_nv) {
    s = without_film(s, nv);
    vec3 specular = specular_albedo(s.f0, s.f90, s.roughness, nv);
    float coat = specular_albedo(vec3(s.coat_f0), s.coat_f90, s.roughness, nv).x;
    Lobes lobes = Lobes(specular, 1.0 - coat, diffuse_share(s.coat_f0, s.coat_f90, nv), vec3(0.0), 0.0);
    if (feature(FEATURE_LAYERS)) {
        lobes.coat = coat_share(s, coat_nv);
        float left = (1.0 - sheen_share(s, nv)) * (1.0 - lobes.coat);
        lobes.specular *= left;
        lobes.rest *= left;
        lobes.diffuse *= left;
        if (feature(FEATURE_SHEEN) && any(greaterThan(s.finish.sheen, vec3(0.0)))) {
            lobes.sheen = s.finish.sheen * (min(sheen_albedo(s.finish, nv), 1.0) * (1.0 - lobes.coat));
        }
    }
    return lobes;
}

Lobes lobes_at(Surface s, float nv) {
    return lobes_under(s, nv, nv);
}

Lobes lobes_towards(Surface s, vec3 view) {
    return lobes_under(s, max(dot(s.normal, view), 0.0), abs(dot(s.finish.coat_normal, view)));
}

// A surface as seen by a viewer.
struct Viewed {
    vec3 view; // unit, towards the viewer
    Lobes lobes;
    bool back; // the side against the winding
    float bend; // change of the normal over half a pixel, radians
};

// Light that a surface sends to a viewer, to which a method's look-up adds.
struct Outgoing {
    vec3 direct; // radiance
    vec3 indirect; // stored radiance: × frame.scale
};

// The surface under its layers and film, for rays along its lobes.
Surface under_layers(Surface s, Viewed v) {
    if (feature(FEATURE_LAYERS | FEATURE_IRIDESCENCE)) {
        float nv = max(dot(s.normal, v.view), 0.0);
        s = without_film(s, nv);
        float left = (1.0 - sheen_share(s, nv, nv)) * (1.0 - v.lobes.coat);
        s.f0 *= left;
        s.f90 *= left;
        s.albedo *= left;
    }
    return s;
}

// The lobes of the coat alone.
Lobes coat_lobes(Lobes lobes) {
    return Lobes(vec3(lobes.coat), 0.0, 0.0, vec3(0.0), 0.0);
}

// The coat alone, for the same viewer.
Viewed coat_viewed(Viewed v) {
    return Viewed(v.view, coat_lobes(v.lobes), v.back, v.bend);
}
