// glTF 2.0, appendix B: Lambert and GGX with Schlick's Fresnel. π stands here and nowhere else.

#include "common/albedo.glsl"
#include "ground/surface.glsl"

const float MIN_ALPHA = 1e-3; // roughness 0.03: a mirror's highlight of a point light has no finite value

struct Brdf {
    vec3 diffuse;
    vec3 specular;
};

// Towards l, looking from v; unit vectors.
Brdf brdf(Surface s, vec3 v, vec3 l) {
    Brdf f = Brdf(s.diffuse / PI, vec3(0.0));
    float nl = max(dot(s.normal, l), 0.0);
    if (s.f90 > 0.0 || any(greaterThan(s.f0, vec3(0.0)))) {
        vec3 h = normalize(l + v);
        float nv = max(abs(dot(s.normal, v)), 1e-4);
        float nh = clamp(dot(s.normal, h), 0.0, 1.0);
        float vh = clamp(dot(v, h), 0.0, 1.0);
        float alpha = max(s.roughness * s.roughness, MIN_ALPHA);
        float a2 = alpha * alpha;
        float d = nh * nh * (a2 - 1.0) + 1.0;
        float ggx = a2 / (PI * d * d);
        float smith = nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2);
        vec3 fresnel = schlick(s.f0, s.f90, vh);
        f.diffuse *= 1.0 - schlick(s.coat_f0, s.coat_f90, vh);
        f.specular = fresnel * (ggx * 0.5 / max(smith, 1e-7));
    }
    return f;
}

// BRDF × cos θ, with a share of its specular part.
vec3 brdf_cos(Surface s, vec3 v, vec3 l, float specular) {
    Brdf f = brdf(s, v, l);
    return (f.diffuse + specular * f.specular) * max(dot(s.normal, l), 0.0);
}

// Shares of light from all around that go towards a viewer.
struct Lobes {
    vec3 specular;
    float rest; // what is left for the transmitted part
    float diffuse; // and for the diffuse one: less, since rough microfacets mask much of what Fresnel takes from it
};

// Towards a viewer that sees the surface under the cosine nv.
Lobes lobes_at(Surface s, float nv) {
    vec3 specular = specular_albedo(s.f0, s.f90, s.roughness, nv);
    float coat = specular_albedo(vec3(s.coat_f0), s.coat_f90, s.roughness, nv).x;
    return Lobes(specular, 1.0 - coat, diffuse_share(s.coat_f0, s.coat_f90, nv));
}

Lobes lobes_towards(Surface s, vec3 view) {
    return lobes_at(s, max(dot(s.normal, view), 0.0));
}

// A surface as a viewer sees it.
struct Viewed {
    vec3 view; // unit, towards the viewer
    Lobes lobes;
    bool back; // the side against the winding
    float bend; // how far the normal turns over half a pixel, radians
    vec3 gathered; // E/π of its diffuse light, stored radiance
};

// Share of a lamp's, or the sky's bright part's, reflection that points on it find; the rest is one mirrored ray's, which
// finds all of it in what is smooth, where points miss the lobe.
float lamps_in_lobe(float roughness) {
    return smoothstep(0.15, 0.35, roughness);
}

// What a surface sends to a viewer: a method's look-up adds to it.
struct Outgoing {
    vec3 direct; // radiance
    vec3 indirect; // stored radiance: × frame.scale
};
