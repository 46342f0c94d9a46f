// A point on a triangle, and its material evaluated there (glTF 2.0, appendix B, and the KHR_materials_* extensions).
#include "common/color.glsl"
#include "common/triangle_box.glsl"
#include "ground/attributes.glsl"
#include "ground/finish.glsl"
#include "ground/texture.glsl"

struct Surface {
    vec3 position; // voxels
    vec3 normal; // unit shading normal of the visible side
    vec3 facet; // unit geometric normal of that side
    vec3 diffuse; // albedo of the Lambertian part
    vec3 f0;
    float f90;
    // The brightest channel of the dielectric part alone, which takes its share from the diffuse and transmitted parts.
    float coat_f0;
    float coat_f90;
    float roughness;
    float opacity; // 1 − the share that alpha blending lets through
    vec3 transmitted; // tint of transmission; 0 without transmission
    float transmission;
    vec3 emitted; // radiance
    float ior;
    float thickness_m;
    vec3 albedo; // base colour
    float diffuse_share; // share that is neither metal nor transmitting
    bool unlit;
    Finish finish;
};

float word_at(uint place) {
    return uintBitsToFloat(attribute_words[place]);
}

vec2 word_pair(uint place) {
    return vec2(word_at(place), word_at(place + 1u));
}

vec3 normal_at(uint corner) {
    return vec3(word_pair(corner), word_at(corner + 2u));
}

vec4 tangent_at(uint corner) {
    return tangent_words() > 0u ? vec4(word_pair(corner + 3u), word_pair(corner + 5u)) : vec4(0.0);
}

vec4 uv_at(uint corner) {
    uint place = corner + 3u + tangent_words();
    return vec4(uv_words() > 0u ? word_pair(place) : vec2(0.0), uv_words() > 2u ? word_pair(place + 2u) : vec2(0.0));
}

vec4 color_at(uint corner) {
    uint place = corner + 3u + tangent_words() + uv_words();
    return color_words() > 0u
        ? vec4(unpackHalf2x16(attribute_words[place]), unpackHalf2x16(attribute_words[place + 1u]))
        : vec4(1.0);
}

// For the recorded triangle with that index.
Attributes attributes_of(uint triangle) {
    uint a = corner_place(triangle, 0u);
    uint b = corner_place(triangle, 1u);
    uint c = corner_place(triangle, 2u);
    return Attributes(mat3(normal_at(a), normal_at(b), normal_at(c)),
        vec4[3](tangent_at(a), tangent_at(b), tangent_at(c)), vec4[3](uv_at(a), uv_at(b), uv_at(c)),
        vec4[3](color_at(a), color_at(b), color_at(c)));
}

vec4 between(vec4 corners[3], vec3 weights) {
    return corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
}

// This is a macro, like `slot_in_use`.
#define has_slot(m, slot) (slot_in_use(slot) && (m).slots[slot].level_count > 0u)

// In voxels of the base grid.
mat3 corners_of(Triangle t) {
    return mat3(t.corners[0], t.corners[1], t.corners[2]);
}

// The change of uv per unit of length of `corners`, along two orthogonal directions in the triangle's plane.
Footprint footprint_over(Attributes attributes, mat3 corners) {
    vec3 e1 = corners[1] - corners[0];
    vec3 e2 = corners[2] - corners[0];
    float l1 = max(length(e1), 1e-20);
    vec3 x = e1 / l1;
    float sx = dot(e2, x);
    float sy = max(length(e2 - sx * x), 1e-20);
    Footprint footprint;
    for (int set = 0; set < 2; set++) {
        vec4 d1 = attributes.uvs[1] - attributes.uvs[0];
        vec4 d2 = attributes.uvs[2] - attributes.uvs[0];
        vec2 u = (set == 0 ? d1.xy : d1.zw) / l1;
        vec2 v = ((set == 0 ? d2.xy : d2.zw) - u * sx) / sy;
        footprint.uv[set] = mat2(u, v);
    }
    return footprint;
}

// Base colour and alpha for blending and masks.
vec4 base_color(Material m, vec4 uv, vec4 color, Footprint footprint) {
    vec4 base = m.base_color * color;
    if (has_slot(m, SLOT_BASE_COLOR)) {
        base *= sample_slot(m.slots[SLOT_BASE_COLOR], uv, footprint, true);
    }
    return base;
}

// A factor that equals the cutoff, with a texture of ones, is not a hole: filtering rounds by less than this.
const float ALPHA_ROUNDING = 1e-5;

float surface_alpha(Material m, float alpha) {
    if ((m.flags & MATERIAL_MASK) != 0u) {
        return alpha < m.alpha_cutoff - ALPHA_ROUNDING ? 0.0 : 1.0;
    }
    return (m.flags & MATERIAL_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
}

// Beer's law: the share that remains after a distance in the material, per channel.
vec3 attenuation(Material m, float way_m) {
    return m.attenuation_distance_m < 1e30
        ? pow(max(m.attenuation_color, vec3(1e-6)), vec3(way_m / m.attenuation_distance_m))
        : vec3(1.0);
}

// `weights` are barycentric. `back` says whether the side against the winding is visible.
Surface evaluate_surface(Triangle t, Attributes attributes, vec3 weights, Footprint footprint, bool back) {
    Material m = materials[t.material];
    COUNT(MATERIALS, 1u);
    vec4 uv = between(attributes.uvs, weights);
    vec4 base = base_color(m, uv, between(attributes.colors, weights), footprint);
    Surface s;
    vec3 a = t.corners[0];
    s.position = a * weights.x + t.corners[1] * weights.y + t.corners[2] * weights.z;
    s.facet = normalize(triangle_normal(a, t.corners[1], t.corners[2]));
    vec3 n = attributes.normals[0] * weights.x + attributes.normals[1] * weights.y + attributes.normals[2] * weights.z;
    float n_length = length(n);
    n = n_length > 1e-6 ? n / n_length : s.facet;
    vec3 smooth_normal = n;
    if (has_slot(m, SLOT_NORMAL)) {
        vec4 tangent = between(attributes.tangents, weights);
        vec3 tn = sample_slot(m.slots[SLOT_NORMAL], uv, footprint, false).xyz * 2.0 - 1.0;
        tn.xy *= m.normal_scale;
        vec3 bitangent = cross(n, tangent.xyz) * (tangent.w < 0.0 ? -1.0 : 1.0);
        vec3 mapped = tangent.xyz * tn.x + bitangent * tn.y + n * tn.z;
        float mapped_length = length(mapped);
        n = mapped_length > 1e-6 ? mapped / mapped_length : n;
    }
    float side = back ? -1.0 : 1.0;
    s.normal = n * side;
    s.facet *= side;

    float metallic = m.metallic;
    s.roughness = m.roughness;
    if (has_slot(m, SLOT_METALLIC_ROUGHNESS)) {
        vec4 mr = sample_slot(m.slots[SLOT_METALLIC_ROUGHNESS], uv, footprint, false);
        s.roughness *= mr.g;
        metallic *= mr.b;
    }
    float specular = m.specular;
    if (has_slot(m, SLOT_SPECULAR)) {
        specular *= sample_slot(m.slots[SLOT_SPECULAR], uv, footprint, false).a;
    }
    vec3 specular_color = m.specular_color;
    if (has_slot(m, SLOT_SPECULAR_COLOR)) {
        specular_color *= sample_slot(m.slots[SLOT_SPECULAR_COLOR], uv, footprint, true).rgb;
    }
    s.transmission = m.transmission;
    if (has_slot(m, SLOT_TRANSMISSION)) {
        s.transmission *= sample_slot(m.slots[SLOT_TRANSMISSION], uv, footprint, false).r;
    }
    s.transmission *= 1.0 - metallic;
    s.thickness_m = m.thickness_m;
    if (has_slot(m, SLOT_THICKNESS)) {
        s.thickness_m *= sample_slot(m.slots[SLOT_THICKNESS], uv, footprint, false).g;
    }
    s.emitted = m.emissive;
    if (has_slot(m, SLOT_EMISSIVE)) {
        s.emitted *= sample_slot(m.slots[SLOT_EMISSIVE], uv, footprint, true).rgb;
    }
    float ior_f0 = (m.ior - 1.0) / (m.ior + 1.0);
    vec3 dielectric_f0 = min(ior_f0 * ior_f0 * specular_color, vec3(1.0)) * specular;
    s.f0 = mix(dielectric_f0, base.rgb, metallic);
    s.f90 = mix(specular, 1.0, metallic);
    s.coat_f0 = brightest(dielectric_f0);
    s.coat_f90 = specular;
    s.diffuse_share = 1.0 - metallic - s.transmission; // s.transmission is a share of the non-metallic part
    s.diffuse = base.rgb * s.diffuse_share;
    s.transmitted = base.rgb * s.transmission;
    s.opacity = surface_alpha(m, base.a);
    s.ior = m.ior;
    s.albedo = base.rgb;
    s.unlit = (m.flags & MATERIAL_UNLIT) != 0u;
    if (s.unlit) {
        s.emitted = base.rgb;
        s.diffuse = vec3(0.0);
        s.diffuse_share = 0.0;
        s.transmitted = vec3(0.0);
        s.transmission = 0.0;
        s.f0 = vec3(0.0);
        s.f90 = 0.0;
        s.coat_f0 = 0.0;
        s.coat_f90 = 0.0;
    } else if (s.thickness_m > 0.0 && !feature(FEATURE_POINTS)) {
        // The stated thickness of the material is used as the distance through it.
        s.transmitted *= attenuation(m, s.thickness_m);
    }
    s.finish = NO_FINISH;
    if (feature(FEATURE_FINISH) && !s.unlit) {
        vec4 tangent = between(attributes.tangents, weights);
        s.finish = evaluate_finish(m, uv, footprint, smooth_normal, tangent, s.normal, side, s.roughness);
        if (feature(FEATURE_DIFFUSE_TRANSMISSION)) {
            s.diffuse *= 1.0 - s.finish.through;
            bool stated = s.thickness_m > 0.0 && !feature(FEATURE_POINTS);
            s.finish.diffused *= s.diffuse_share * (stated ? attenuation(m, s.thickness_m) : vec3(1.0));
        }
        s.finish.film_f0 = dielectric_f0;
        s.finish.film_metal = vec4(base.rgb, metallic);
        if (feature(FEATURE_ANISOTROPY) && s.finish.along > 0.0) {
            // A single roughness for both is their geometric mean.
            s.roughness = sqrt(sqrt(s.finish.along * s.finish.across));
        }
    }
    return s;
}
