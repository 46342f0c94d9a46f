// The BSDF of a surface without approximations: glTF 2.0, appendix B, and its extensions. The base has four lobes:
// diffuse reflection, specular reflection, specular transmission and diffuse transmission. A layer of sheen covers the
// base, and a clear coat covers both. GGX lobes below MIN_ALPHA are perfect mirrors. Light that passes a smooth thin
// wall is not scattered: see straight_through.

#include "common/color.glsl"
#include "common/directions.glsl"
#include "common/lobe.glsl"
#include "common/sheen.glsl"
#include "ground/layers.glsl"
#include "ground/surface.glsl"

// The BSDF of a surface for one direction of view. The z axis of a basis is the shading normal.
struct Scatterer {
    mat3 basis; // columns: tangent, bitangent, the shading normal
    vec3 facet; // unit, on the viewer's side
    vec3 view; // unit, towards the viewer, in `basis`
    vec2 alphas; // GGX α along the x and y axes of `basis`
    bool is_mirror; // whether the GGX lobes of the base are perfect mirrors
    bool refracts; // whether it bounds a volume
    float ior; // refractive index of the far side divided by that of the viewer's side
    vec3 transmitted; // albedo of specular transmission before Fresnel
    vec4 chances; // probabilities of the base's lobes, in the order given above
    mat3 coat_basis; // columns: tangent, bitangent, the coat's normal
    vec3 coat_view; // unit, towards the viewer, in `coat_basis`
    float coat_alpha; // GGX α of the coat
    float coat; // share of light that the coat reflects towards the viewer
    float coat_chance; // probability of the coat's lobe
    float sheen_chance; // probability of sheen; the base has the rest
};

const float LEAST_CHANCE = 0.05; // least weight of a present lobe, before the normalisation to probabilities

// Whether the material bounds a volume, which refracts and attenuates light.
bool is_volume(Material m) {
    bool lets_light_in = m.transmission > 0.0;
    if (feature(FEATURE_DIFFUSE_TRANSMISSION) && m.flags >> MATERIAL_FINISH_SHIFT != 0u) {
        lets_light_in = lets_light_in || finish_row((m.flags >> MATERIAL_FINISH_SHIFT) + 3u).w > 0.0;
    }
    return lets_light_in && m.thickness_m > 0.0;
}

// Bends a shading normal that faces away from the viewer until it faces the viewer.
vec3 bent_towards(vec3 normal, vec3 facet, vec3 view) {
    const float LEAST = 1e-3;
    float c = dot(normal, view);
    vec3 bent = normalize(normal + view * max(LEAST - c, 0.0));
    return c >= LEAST ? normal : dot(bent, view) > 0.0 ? bent : facet;
}

// xyz: Fresnel reflectance of a microfacet. w: the share of light left for the diffuse lobes and for transmission.
// `cosine` is that of the angle of incidence on the viewer's side.
vec4 fresnel_at(Surface s, Scatterer b, float cosine) {
    float c = clamp(cosine, 0.0, 1.0);
    float sine2 = b.ior < 1.0 && b.refracts ? (1.0 - c * c) / (b.ior * b.ior) : 1.0 - c * c;
    c = sqrt(max(1.0 - sine2, 0.0)); // in air
    vec4 found = vec4(schlick(s.f0, s.f90, c), 1.0 - schlick(s.coat_f0, s.coat_f90, c));
    if (has_film(s)) {
        found = film_fresnel(s, c);
    }
    return sine2 < 1.0 || !b.refracts || b.ior >= 1.0 ? found : vec4(1.0, 1.0, 1.0, 0.0);
}

// GGX density of normals at h, in the basis of the normal. h.z is positive.
float normal_density(vec2 alphas, vec3 h) {
    vec3 e = vec3(h.xy / alphas, h.z);
    float q = dot(e, e);
    return 1.0 / (PI * alphas.x * alphas.y * q * q);
}

// Density per steradian of the reflection of `view` at visible normals. h is the half vector.
float mirrored_density(vec2 alphas, vec3 view, vec3 h) {
    return normal_density(alphas, h) * lobe_masking(alphas, view) / (4.0 * view.z);
}

// Share of the base's scattered light that passes the sheen and the coat. `cosine` is that between the direction of
// light and the base's normal.
float layers_leave(Surface s, Scatterer b, float cosine) {
    return feature(FEATURE_LAYERS) ? (1.0 - sheen_share(s, b.view.z, cosine)) * (1.0 - b.coat) : 1.0;
}

// Prepares the BSDF. `view`: unit, towards the viewer. `inside`: the viewer is within the volume that the surface
// bounds.
Scatterer scatterer(Surface s, vec3 view, bool refracts, bool inside) {
    Scatterer b;
    vec3 normal = s.normal;
    if (!slot_in_use(SLOT_NORMAL)) {
        normal = dot(normal, s.facet) > 0.0 ? normal : s.facet;
    }
    normal = bent_towards(normal, s.facet, view);
    b.basis = tangent_frame(normal);
    b.alphas = vec2(s.roughness * s.roughness);
    if (is_brushed(s)) {
        vec3 x = s.finish.grain - normal * dot(normal, s.finish.grain);
        if (dot(x, x) > 1e-12) {
            x = normalize(x);
            b.basis = mat3(x, cross(normal, x), normal);
        }
        b.alphas = vec2(s.finish.along, s.finish.across);
    }
    b.is_mirror = b.alphas.x < MIN_ALPHA;
    b.alphas = max(b.alphas, vec2(1e-4));
    b.facet = s.facet;
    b.view = view * b.basis;
    b.view.z = max(b.view.z, 1e-6);
    b.refracts = refracts;
    float ior = max(s.ior, 1.0);
    b.ior = inside ? 1.0 / ior : ior;
    b.transmitted = feature(FEATURE_TRANSMISSION) ? s.albedo * s.transmission : vec3(0.0);
    b.coat_basis = b.basis;
    b.coat_view = b.view;
    b.coat_alpha = 1.0;
    b.coat = 0.0;
    b.coat_chance = 0.0;
    b.sheen_chance = 0.0;

    // The probability of a lobe is about proportional to its albedo. Every present lobe has a least probability, since
    // its albedo may be larger away from the mirror direction.
    vec4 fresnel = fresnel_at(s, b, b.view.z);
    bool reflects = s.f90 > 0.0 || refracts || any(greaterThan(s.f0, vec3(0.0)));
    vec3 diffused = feature(FEATURE_DIFFUSE_TRANSMISSION) ? s.finish.diffused : vec3(0.0);
    vec4 there = vec4(brightest(s.diffuse), reflects ? 1.0 : 0.0,
        refracts || !b.is_mirror ? brightest(b.transmitted) : 0.0, brightest(diffused));
    vec4 albedos = vec4(there.x * fresnel.w, brightest(fresnel.rgb), there.z * fresnel.w, there.w * fresnel.w);
    float albedo = dot(albedos, vec4(1.0));
    // A perfect mirror scatters into one direction alone, so its albedo there is exact.
    vec4 least = LEAST_CHANCE * there * vec4(1.0, b.is_mirror ? 0.0 : 1.0, b.is_mirror ? 0.0 : 1.0, 1.0);
    vec4 chances = max(albedos, least) * vec4(greaterThan(there, vec4(0.0)));
    float sum = dot(chances, vec4(1.0));
    b.chances = sum > 0.0 ? chances / sum : vec4(0.0);

    bool layered = !(refracts && inside);
    if (feature(FEATURE_CLEARCOAT) && layered && s.finish.coat > 0.0) {
        vec3 coat_normal = bent_towards(s.finish.coat_normal, s.facet, view);
        b.coat_basis = tangent_frame(coat_normal);
        b.coat_view = view * b.coat_basis;
        b.coat_view.z = max(b.coat_view.z, 1e-6);
        b.coat_alpha = s.finish.coat_roughness * s.finish.coat_roughness;
        b.coat = coat_share(s, min(b.coat_view.z, 1.0));
    }
    if (feature(FEATURE_LAYERS) && layered) {
        float sheen = feature(FEATURE_SHEEN) ? brightest(s.finish.sheen) : 0.0;
        float sheen_weight = sheen > 0.0 ? max(sheen * min(sheen_albedo(s.finish, b.view.z), 1.0), LEAST_CHANCE) : 0.0;
        float base_weight = sum > 0.0 ? max(albedo, LEAST_CHANCE) : 0.0;
        float all = b.coat + (1.0 - b.coat) * (base_weight + sheen_weight);
        b.coat_chance = all > 0.0 ? b.coat / all : 0.0;
        b.sheen_chance = all > 0.0 ? (1.0 - b.coat) * sheen_weight / all : 0.0;
    }
    return b;
}

// Removes the layers of a surface whose volume contains the viewer: they lie on its outer side.
Surface without_outer_layers(Surface s, bool refracts, bool inside) {
    if (feature(FEATURE_LAYERS) && refracts && inside) {
        s.finish.coat = 0.0;
        s.finish.sheen = vec3(0.0);
    }
    return s;
}

// Share of light that passes a smooth thin wall without a change of direction.
vec3 straight_through(Surface s, Scatterer b) {
    bool passes = feature(FEATURE_TRANSMISSION) && b.is_mirror && !b.refracts;
    return passes ? b.transmitted * (fresnel_at(s, b, b.view.z).w * layers_leave(s, b, b.view.z)) : vec3(0.0);
}

// Reflection towards l, a unit vector in `basis`. rgb: BSDF × cosine. w: density per steradian of a path's choice of l.
vec4 scattered_above(Surface s, Scatterer b, vec3 l) {
    vec3 h = normalize(b.view + l);
    vec4 fresnel = fresnel_at(s, b, dot(b.view, h));
    float even = l.z / PI;
    vec4 sum = vec4(s.diffuse * (fresnel.w * even), b.chances.x * even);
    if (!b.is_mirror && b.chances.y > 0.0) {
        float density = mirrored_density(b.alphas, b.view, h);
        sum += vec4(fresnel.rgb * (density * lobe_masking(b.alphas, l)), b.chances.y * density);
    }
    return sum;
}

// Rough specular transmission, as scattered_above. Through a thin wall it is the reflected lobe, mirrored to the far
// side. Into a volume it is refracted (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007).
vec4 transmitted_below(Surface s, Scatterer b, vec3 l) {
    vec3 above = vec3(l.xy, -l.z);
    vec3 h = normalize(b.refracts ? b.view + b.ior * l : b.view + above);
    h = h.z < 0.0 ? -h : h;
    float to_view = dot(b.view, h);
    float to_light = dot(l, h);
    float density = mirrored_density(b.alphas, b.view, h);
    float squeezed = 1.0;
    if (b.refracts) {
        float scale = to_view + b.ior * to_light;
        density = 4.0 * density * to_view * b.ior * b.ior * -to_light / max(scale * scale, 1e-20);
        squeezed = 1.0 / (b.ior * b.ior); // refraction scales radiance
    }
    bool sends = h.z > 0.0 && to_view > 0.0 && (!b.refracts || to_light < 0.0);
    float left = fresnel_at(s, b, to_view).w;
    vec4 found =
        vec4(b.transmitted * (left * density * lobe_masking(b.alphas, above) * squeezed), b.chances.z * density);
    return sends ? found : vec4(0.0);
}

// Transmission towards l, as scattered_above.
vec4 scattered_below(Surface s, Scatterer b, vec3 l) {
    vec4 sum = vec4(0.0);
    if (feature(FEATURE_TRANSMISSION) && !b.is_mirror && b.chances.z > 0.0) {
        sum += transmitted_below(s, b, l);
    }
    if (feature(FEATURE_DIFFUSE_TRANSMISSION) && b.chances.w > 0.0) {
        // The Fresnel term uses the half vector of the mirrored direction of light: the specification names none.
        vec3 above = vec3(l.xy, -l.z);
        float left = fresnel_at(s, b, dot(b.view, normalize(b.view + above))).w;
        sum += vec4(s.finish.diffused * left, b.chances.w) * (above.z / PI);
    }
    return sum;
}

// rgb: BSDF × |cosine| towards unit d, without perfect mirrors. w: density per steradian with which a path takes d.
vec4 scattering(Surface s, Scatterer b, vec3 d) {
    vec3 l = d * b.basis;
    bool above = dot(b.facet, d) > 0.0;
    bool agrees = above == l.z > 0.0; // else light would leak through the facet
    vec4 sum = vec4(0.0);
    if (agrees && l.z > 0.0) {
        sum = scattered_above(s, b, l);
    }
    if (feature(FEATURE_TRANSMISSION | FEATURE_DIFFUSE_TRANSMISSION)) {
        if (agrees && l.z < 0.0) {
            sum = scattered_below(s, b, l);
        }
    }
    if (feature(FEATURE_LAYERS)) {
        sum *= vec4(vec3(layers_leave(s, b, min(abs(l.z), 1.0))), max(1.0 - b.coat_chance - b.sheen_chance, 0.0));
        if (feature(FEATURE_SHEEN) && b.sheen_chance > 0.0 && agrees && l.z > 0.0) {
            float nh = clamp(normalize(b.view + l).z, 0.0, 1.0);
            float lobe = sheen_lobe(s.finish.sheen_roughness, b.view.z, l.z, nh) * l.z;
            vec3 color = s.finish.sheen / max(sheen_albedo(s.finish, b.view.z), 1.0);
            sum += vec4(color * (lobe * (1.0 - b.coat)), b.sheen_chance * l.z / PI);
        }
        vec3 of_coat = d * b.coat_basis;
        bool coated = b.coat_chance > 0.0 && b.coat_alpha >= MIN_ALPHA && of_coat.z > 0.0 && above;
        if (feature(FEATURE_CLEARCOAT) && coated) {
            vec2 alphas = vec2(b.coat_alpha);
            float density = mirrored_density(alphas, b.coat_view, normalize(b.coat_view + of_coat));
            sum += vec4(vec3(b.coat * density * lobe_masking(alphas, of_coat)), b.coat_chance * density);
        }
    }
    return sum;
}

// A sampled direction of scattering.
struct Scattered {
    bool any; // whether the path goes on
    vec3 way; // unit
    vec3 weight; // BSDF × |cosine| divided by the density
    float density; // per steradian; 0: a perfect mirror
    float squeezed; // factor on radiance by refraction
};

// Samples the BSDF. `lobe` and `u` are random numbers for the lobe and for the direction in it.
Scattered scatter(Surface s, Scatterer b, float lobe, vec2 u) {
    float layers = b.coat_chance + b.sheen_chance;
    bool of_coat = lobe < b.coat_chance;
    bool of_sheen = !of_coat && lobe < layers;
    float left = clamp((lobe - layers) / max(1.0 - layers, 1e-6), 0.0, 0.99999994);
    vec4 ends = vec4(b.chances.x, b.chances.x + b.chances.y, 1.0 - b.chances.w, 1.0);
    bool even = of_sheen || !of_coat && left < ends.x;
    bool even_below = !of_sheen && !of_coat && b.chances.w > 0.0 && left >= ends.z;
    bool transmits = !of_coat && !even && !even_below && b.chances.z > 0.0 && left >= ends.y;
    bool is_mirror = of_coat ? b.coat_alpha < MIN_ALPHA : !even && !even_below && b.is_mirror;

    vec3 view = of_coat ? b.coat_view : b.view;
    mat3 basis = of_coat ? b.coat_basis : b.basis;
    vec3 h = is_mirror ? vec3(0.0, 0.0, 1.0) : visible_normal(of_coat ? vec2(b.coat_alpha) : b.alphas, view, u);
    float cosine = clamp(dot(view, h), 0.0, 1.0);
    vec3 l = 2.0 * cosine * h - view;
    Scattered to;
    to.squeezed = 1.0;
    bool possible = l.z > 0.0;
    if (feature(FEATURE_TRANSMISSION) && transmits) {
        l = vec3(l.xy, -l.z);
        if (b.refracts) {
            float sine2 = (1.0 - cosine * cosine) / (b.ior * b.ior);
            possible = sine2 < 1.0;
            l = h * (cosine / b.ior - sqrt(max(1.0 - sine2, 0.0))) - view / b.ior;
            to.squeezed = 1.0 / (b.ior * b.ior);
        }
        possible = possible && l.z < 0.0;
    }
    if (even || even_below) {
        l = cosine_sample(u);
        l.z *= even ? 1.0 : -1.0;
        possible = true;
    }
    to.way = normalize(basis * l);
    bool there = of_coat || of_sheen || dot(b.chances, vec4(1.0)) > 0.0;
    vec4 f = is_mirror ? vec4(0.0) : scattering(s, b, to.way);
    to.density = f.w;
    to.weight = f.rgb / max(f.w, 1e-30);
    to.any = there && possible && f.w > 0.0;
    if (is_mirror) {
        vec4 fresnel = fresnel_at(s, b, view.z);
        vec3 of_lobe = of_coat ? vec3(b.coat / max(b.coat_chance, 1e-6))
                               : (transmits ? b.transmitted * (fresnel.w * to.squeezed / max(b.chances.z, 1e-6))
                                            : fresnel.rgb / max(b.chances.y, 1e-6));
        to.weight = of_coat ? of_lobe : of_lobe * (layers_leave(s, b, abs(l.z)) / max(1.0 - layers, 1e-6));
        bool agrees = dot(b.facet, to.way) > 0.0 == l.z > 0.0;
        to.any = there && possible && agrees && (of_coat || (transmits ? b.chances.z : b.chances.y) > 0.0);
        to.density = 0.0;
    }
    return to;
}
