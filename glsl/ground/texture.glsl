// Texture sampling in shader code from one atlas. The weakest supported device has no bindless textures, the textures
// differ in size and samplers, and its 8-bit filtering rounds small values to zero. Therefore texels are fetched and
// filtered here in f32, identically on every device.
#include "common/count.glsl"
#include "ground/bindings.glsl"

// The change of uv along the two axes of a footprint, as columns.
struct Footprint {
    mat2 uv[2]; // per uv set
};

const Footprint POINT = Footprint(mat2[2](mat2(0.0), mat2(0.0)));

int wrap_texel(int i, int size, uint mode) {
    if (mode == 0u) {
        return i - size * int(floor(float(i) / float(size)));
    }
    if (mode == 1u) {
        int period = 2 * size;
        int j = i - period * int(floor(float(i) / float(period)));
        return j < size ? j : period - 1 - j;
    }
    return clamp(i, 0, size - 1);
}

const float MOST_PROBES = 8.0; // along an elongated footprint
// The bias of the level in favour of finer texels: two filtered levels are wider than a pixel. For a textured atrium,
// the mean |error| of base colour against the path tracer is .054, .045, .042 at 0, −½, −1, and of the whole image
// .080, .073, .075.
const float FINER = 0.5;

// The probes of a footprint: their number along its longer axis is the ratio of both axes.
struct Probes {
    uint count;
    vec2 axis; // in uv, from end to end
    float level; // level at which a probe is as wide as a texel
};

Probes probes_over(TextureSlot slot, mat2 footprint) {
    TextureLevel base = texture_levels[slot.first_level];
    vec2 size = vec2(base.width, base.height);
    float x = length(footprint[0] * size);
    float y = length(footprint[1] * size);
    float longer = max(x, y);
    float count = clamp(ceil(longer / max(min(x, y), 1.0)), 1.0, MOST_PROBES);
    return Probes(
        uint(count), x < y ? footprint[1] : footprint[0], log2(max(max(longer / count, min(x, y)), 1e-10)) - FINER);
}

// Every tap of every level is in one loop: lavapipe executes all code of a shader regardless of branches, and one pass
// through the loop is the cost of a point without this texture.
vec4 sample_texture(TextureSlot slot, vec2 uv, mat2 footprint, bool srgb) {
    COUNT(TEXTURE_RECORDS, 1u);
    uint mip = (slot.flags >> 6) & 3u;
    Probes probes = probes_over(slot, footprint);
    float level = probes.level;
    bool linear = (slot.flags & (level <= 0.0 ? 16u : 32u)) != 0u;
    level = mip == 0u ? 0.0 : clamp(level, 0.0, float(slot.level_count - 1u));
    level = mip == 1u ? floor(level + 0.5) : level;
    uint fine = uint(level);
    float coarser = level - float(fine);
    uint taps_per_level = linear ? 4u : 1u;
    uint taps = coarser > 0.0 ? 2u * taps_per_level : taps_per_level;
    vec4 sum = vec4(0.0);
    for (uint k = 0u; k < probes.count * taps; k++) {
        uint tap = k % taps;
        bool second = tap >= taps_per_level;
        COUNT(TEXTURE_RECORDS, 1u);
        COUNT(ATLAS_TEXELS, 1u);
        TextureLevel texels = texture_levels[slot.first_level + fine + (second ? 1u : 0u)];
        vec2 probe = uv + probes.axis * ((float(k / taps) + 0.5) / float(probes.count) - 0.5);
        vec2 at = probe * vec2(texels.width, texels.height) - (linear ? 0.5 : 0.0);
        ivec2 corner = ivec2(floor(at));
        bvec2 far = bvec2(linear && (tap & 1u) != 0u, linear && (tap & 2u) != 0u);
        vec2 f = linear ? at - vec2(corner) : vec2(0.0);
        vec2 share = mix(1.0 - f, f, far);
        ivec2 texel = corner + ivec2(far);
        ivec3 place = ivec3(texels.x + wrap_texel(texel.x, int(texels.width), slot.flags & 3u),
            texels.y + wrap_texel(texel.y, int(texels.height), (slot.flags >> 2) & 3u), slot.layer);
        vec4 value = srgb ? texelFetch(atlas_srgb, place, 0) : texelFetch(atlas_linear, place, 0);
        sum += share.x * share.y * (second ? coarser : 1.0 - coarser) * value;
    }
    return sum / float(probes.count);
}

vec4 sample_slot(TextureSlot slot, vec4 uv, Footprint footprint, bool srgb) {
    mat2 linear = mat2(slot.linear.xy, slot.linear.zw);
    vec2 at = slot.uv_set == 0u ? uv.xy : uv.zw;
    return sample_texture(slot, linear * at + slot.offset, linear * footprint.uv[min(slot.uv_set, 1u)], srgb);
}
