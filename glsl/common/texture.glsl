// Textures sampled by hand, from one atlas. No bindless on the floor device, no two textures of one size, samplers of every
// kind, and its 8-bit filtering rounds small values to zero: so texels are fetched and filtered here, in f32, the same everywhere.
// Needs: texture_entries[], texture_levels[], atlas_linear, atlas_srgb.

// How far uv moves, in units of uv, along the two axes of a footprint: columns.
struct Footprint {
    mat2 uv[2]; // per uv set
};

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

vec4 fetch_texel(TextureEntry entry, TextureLevel level, ivec2 texel, bool srgb) {
    ivec2 size = ivec2(level.width, level.height);
    ivec3 place = ivec3(ivec2(level.x, level.y)
        + ivec2(wrap_texel(texel.x, size.x, entry.flags & 3u), wrap_texel(texel.y, size.y, (entry.flags >> 2) & 3u)), int(entry.layer));
    return srgb ? texelFetch(atlas_srgb, place, 0) : texelFetch(atlas_linear, place, 0);
}

vec4 sample_level(TextureEntry entry, uint index, vec2 uv, bool linear, bool srgb) {
    TextureLevel level = texture_levels[entry.first_level + index];
    vec2 at = uv * vec2(level.width, level.height);
    if (!linear) {
        return fetch_texel(entry, level, ivec2(floor(at)), srgb);
    }
    at -= 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 f = at - vec2(corner);
    return mix(mix(fetch_texel(entry, level, corner, srgb), fetch_texel(entry, level, corner + ivec2(1, 0), srgb), f.x),
               mix(fetch_texel(entry, level, corner + ivec2(0, 1), srgb), fetch_texel(entry, level, corner + ivec2(1), srgb), f.x), f.y);
}

// The level at which the longer axis of the footprint is one texel.
float footprint_level(TextureEntry entry, mat2 footprint) {
    TextureLevel base = texture_levels[entry.first_level];
    vec2 size = vec2(base.width, base.height);
    vec2 x = footprint[0] * size;
    vec2 y = footprint[1] * size;
    return 0.5 * log2(max(max(dot(x, x), dot(y, y)), 1e-20));
}

vec4 sample_texture(uint index, vec2 uv, mat2 footprint, bool srgb) {
    TextureEntry entry = texture_entries[index];
    float level = footprint_level(entry, footprint);
    if (level <= 0.0) {
        return sample_level(entry, 0u, uv, (entry.flags & 16u) != 0u, srgb);
    }
    bool linear = (entry.flags & 32u) != 0u;
    uint mip = (entry.flags >> 6) & 3u;
    float last = float(entry.level_count - 1u);
    if (mip == 0u) {
        return sample_level(entry, 0u, uv, linear, srgb);
    }
    level = min(level, last);
    if (mip == 1u) {
        return sample_level(entry, uint(level + 0.5), uv, linear, srgb);
    }
    uint fine = uint(level);
    vec4 near = sample_level(entry, fine, uv, linear, srgb);
    float f = level - float(fine);
    return f == 0.0 ? near : mix(near, sample_level(entry, fine + 1u, uv, linear, srgb), f);
}
