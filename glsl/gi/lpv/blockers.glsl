// Blocking areas in a cell: those of surfaces that face +x +y +z −x −y −z (double-sided ones face both ways), projected
// along the axes over the area of a face, at most 1; and the zeroth band of blocking in two bands.

struct Blockers {
    vec3 up; // surfaces that face +x +y +z
    vec3 down;
    float even; // ¼ of the area of one-sided surfaces, ½ of double-sided ones
};

uvec4 pack_blockers(Blockers b) {
    return uvec4(packUnorm2x16(b.up.xy), packUnorm2x16(vec2(b.up.z, b.down.x)), packUnorm2x16(b.down.yz),
        floatBitsToUint(b.even));
}

Blockers unpack_blockers(uvec4 packed) {
    vec2 middle = unpackUnorm2x16(packed.y);
    return Blockers(vec3(unpackUnorm2x16(packed.x), middle.x), vec3(middle.y, unpackUnorm2x16(packed.z)),
        uintBitsToFloat(packed.w));
}

// Shares of light that pass into a cell, travelling along +x +y +z and −x −y −z.
struct Passage {
    vec3 up;
    vec3 down;
};

uvec3 pack_passage(Passage p) {
    return uvec3(packUnorm2x16(p.up.xy), packUnorm2x16(vec2(p.up.z, p.down.x)), packUnorm2x16(p.down.yz));
}

Passage unpack_passage(uvec3 packed) {
    vec2 middle = unpackUnorm2x16(packed.y);
    return Passage(vec3(unpackUnorm2x16(packed.x), middle.x), vec3(middle.y, unpackUnorm2x16(packed.z)));
}

// The blocking along an axis, for surfaces facing either way.
vec3 across(Blockers b) {
    return max(b.up, b.down);
}
