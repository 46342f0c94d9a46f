// Parameters of six material extensions: rows of four words after the texture levels, for materials that have them.
// Twin: src/ground/finish.rs.

#include "common/sheen.glsl"
#include "ground/texture.glsl"

struct Finish {
    vec3 coat_normal; // unit, on the visible side
    float coat; // covered share
    float coat_roughness;
    vec3 sheen;
    float sheen_roughness;
    uint sheen_table; // first row of the albedo table of a white sheen
    vec3 grain; // along the larger roughness, in the plane of the normal, unit
    float along; // GGX's α along the grain; 0: isotropic
    float across;
    float film; // share
    float film_ior;
    float film_nm;
    vec3 film_f0; // of the dielectric under the film
    vec4 film_metal; // of the metal under the film, with its share in w
    vec3 diffused; // albedo of light that is scattered to the far side
    float through; // its share of the diffuse part
};

const Finish NO_FINISH = Finish(vec3(0.0, 0.0, 1.0), 0.0, 1.0, vec3(0.0), 1.0, 0u, vec3(0.0), 0.0, 0.0, 0.0, 1.0, 0.0,
    vec3(0.0), vec4(0.0), vec3(0.0), 0.0);

const uint FINISH_CLEARCOAT = 0u; // slots
const uint FINISH_CLEARCOAT_ROUGHNESS = 1u;
const uint FINISH_CLEARCOAT_NORMAL = 2u;
const uint FINISH_SHEEN_COLOR = 3u;
const uint FINISH_SHEEN_ROUGHNESS = 4u;
const uint FINISH_ANISOTROPY = 5u;
const uint FINISH_IRIDESCENCE = 6u;
const uint FINISH_IRIDESCENCE_THICKNESS = 7u;
const uint FINISH_DIFFUSE_TRANSMISSION = 8u;
const uint FINISH_DIFFUSE_TRANSMISSION_COLOR = 9u;
const uint FINISH_SLOTS = 10u;
const uint FINISH_FACTOR_ROWS = 5u;
const uint SHEEN_STEPS = 32u;
const float SHEEN_ROUGHNESS_MIN = 0.07;

uvec4 finish_words(uint row) {
    COUNT(TEXTURE_RECORDS, 1u);
    TextureLevel words = texture_levels[row];
    return uvec4(words.x, words.y, words.width, words.height);
}

vec4 finish_row(uint row) {
    return uintBitsToFloat(finish_words(row));
}

// Texels of all slots at the point; white without a texture. This is a loop, because drivers would inline the filter
// for every slot.
void read_finish_texels(uint first, vec4 uv, Footprint footprint, out vec4 texels[FINISH_SLOTS]) {
    for (uint slot = 0u; slot < FINISH_SLOTS; slot++) {
        texels[slot] = vec4(1.0);
    }
    for (uint slot = 0u; slot < (feature(FEATURE_FINISH_TEXTURES) ? FINISH_SLOTS : 0u); slot++) {
        uint row = first + FINISH_FACTOR_ROWS + 3u * slot;
        uvec4 a = finish_words(row);
        if (a.z > 0u) {
            uvec4 b = finish_words(row + 1u);
            vec4 c = finish_row(row + 2u);
            TextureSlot t = TextureSlot(a.x, a.y, a.z, a.w, b.x, vec4(uintBitsToFloat(b.yzw), c.x), c.yz);
            bool srgb = slot == FINISH_SHEEN_COLOR || slot == FINISH_DIFFUSE_TRANSMISSION_COLOR;
            texels[slot] = sample_slot(t, uv, footprint, srgb);
        }
    }
}

float sheen_table_at(uint table, uint word) {
    return finish_row(table + word / 4u)[word % 4u];
}

// A value of the table that begins at that word.
float sheen_table(Finish f, uint first, float nv) {
    vec2 at = clamp(vec2((f.sheen_roughness - SHEEN_ROUGHNESS_MIN) / (1.0 - SHEEN_ROUGHNESS_MIN), sqrt(max(nv, 0.0))),
                  0.0, 1.0)
        * float(SHEEN_STEPS);
    uvec2 low = min(uvec2(at), uvec2(SHEEN_STEPS - 1u));
    vec2 part = at - vec2(low);
    uint here = first + low.x * (SHEEN_STEPS + 1u) + low.y;
    uint next = here + SHEEN_STEPS + 1u;
    return mix(mix(sheen_table_at(f.sheen_table, here), sheen_table_at(f.sheen_table, here + 1u), part.y),
        mix(sheen_table_at(f.sheen_table, next), sheen_table_at(f.sheen_table, next + 1u), part.y), part.x);
}

// The share of uniform light from all directions that a white sheen reflects to a viewer; above 1 near grazing if
// smooth.
float sheen_albedo(Finish f, float nv) {
    return sheen_table(f, 0u, nv);
}

// The share that it keeps from the layers below.
float sheen_taken(Finish f, float nv) {
    return sheen_table(f, (SHEEN_STEPS + 1u) * (SHEEN_STEPS + 1u), nv);
}

// A normal or direction of the tangent frame about n; n without one.
vec3 from_tangent_frame(vec3 n, vec4 tangent, vec3 local) {
    vec3 bitangent = cross(n, tangent.xyz) * (tangent.w < 0.0 ? -1.0 : 1.0);
    vec3 d = tangent.xyz * local.x + bitangent * local.y + n * local.z;
    float d_length = length(d);
    return d_length > 1e-6 ? d / d_length : n;
}

// `n` is the interpolated normal of the front, and `normal` the shading normal.
Finish evaluate_finish(
    Material m, vec4 uv, Footprint footprint, vec3 n, vec4 tangent, vec3 normal, float side, float roughness) {
    Finish f = NO_FINISH;
    f.coat_normal = n * side;
    uint first = m.flags >> MATERIAL_FINISH_SHIFT;
    if (first == 0u) {
        return f;
    }
    vec4 texels[FINISH_SLOTS];
    read_finish_texels(first, uv, footprint, texels);
    vec4 coat = finish_row(first);
    vec4 sheen = finish_row(first + 1u);
    vec4 grain = finish_row(first + 2u);
    vec4 film = finish_row(first + 3u);
    vec4 diffused = finish_row(first + 4u);
    if (feature(FEATURE_CLEARCOAT)) {
        f.coat = coat.x * texels[FINISH_CLEARCOAT].r;
        f.coat_roughness = coat.y * texels[FINISH_CLEARCOAT_ROUGHNESS].g;
        if (feature(FEATURE_TANGENTS) && coat.z != 0.0) {
            vec3 bump = texels[FINISH_CLEARCOAT_NORMAL].xyz * 2.0 - 1.0;
            f.coat_normal = from_tangent_frame(n, tangent, vec3(bump.xy * coat.z, bump.z)) * side;
        }
    }
    if (feature(FEATURE_SHEEN)) {
        f.sheen = sheen.rgb * texels[FINISH_SHEEN_COLOR].rgb;
        f.sheen_roughness = max(sheen.a * texels[FINISH_SHEEN_ROUGHNESS].a, SHEEN_ROUGHNESS_MIN);
        f.sheen_table = finish_words(first + 4u).w;
    }
    if (feature(FEATURE_ANISOTROPY) && coat.w > 0.0) {
        vec4 texel = texels[FINISH_ANISOTROPY];
        bool textured = feature(FEATURE_FINISH_TEXTURES)
            && finish_words(first + FINISH_FACTOR_ROWS + 3u * FINISH_ANISOTROPY).z > 0u;
        vec2 own = textured ? texel.rg * 2.0 - 1.0 : vec2(1.0, 0.0);
        own = dot(own, own) > 1e-8 ? normalize(own) : vec2(1.0, 0.0);
        own = vec2(grain.x * own.x - grain.y * own.y, grain.y * own.x + grain.x * own.y);
        float strength = coat.w * texel.b;
        vec3 d = from_tangent_frame(n, tangent, vec3(own, 0.0));
        d -= normal * dot(normal, d);
        f.across = roughness * roughness;
        f.along = dot(d, d) > 1e-6 ? mix(f.across, 1.0, strength * strength) : 0.0;
        f.grain = d / max(length(d), 1e-3);
    }
    if (feature(FEATURE_IRIDESCENCE)) {
        f.film_ior = film.x;
        f.film_nm = mix(film.y, film.z, texels[FINISH_IRIDESCENCE_THICKNESS].g);
        f.film = f.film_nm > 0.0 ? grain.w * texels[FINISH_IRIDESCENCE].r : 0.0;
    }
    if (feature(FEATURE_DIFFUSE_TRANSMISSION)) {
        f.through = film.w * texels[FINISH_DIFFUSE_TRANSMISSION].a;
        f.diffused = f.through * diffused.rgb * texels[FINISH_DIFFUSE_TRANSMISSION_COLOR].rgb;
    }
    return f;
}
