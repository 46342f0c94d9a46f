// Areas that block light in a cell: those of the surfaces that look along +x +y +z −x −y −z (doubleSided ones look both
// ways), projected along the axes and over a face, at most 1; and the zeroth band of blocking in two bands.

struct Blockers {
    vec3 up; // looks along +x +y +z
    vec3 down;
    float even; // ¼ of the area of one-sided surfaces, ½ of doubleSided ones
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

// Shares that pass into a cell, travelling along +x +y +z and −x −y −z.
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

// Along an axis, whatever way the surface looks.
vec3 across(Blockers b) {
    return max(b.up, b.down);
}
