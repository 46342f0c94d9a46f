// Sums that do not depend on the order of their terms: 32.32 fixed point. A list's order is the GPU's to choose, the
// image must not be. Terms that are ≥ 0 and, in stored radiance, ≤ 65,504: 65,536 of them fit; the smallest f16 is 256
// units. Terms of either sign, in two's complement: half as many.

struct FixedSum {
    uvec4 whole;
    uvec4 parts;
};

FixedSum fixed_zero() {
    return FixedSum(uvec4(0u), uvec4(0u));
}

void fixed_add(inout FixedSum sum, vec4 term) {
    vec4 whole = floor(term);
    // A negative term that is hardly less than a whole number may be rounded up to it.
    uvec4 parts = uvec4(min(term - whole, vec4(0.99999994)) * 4294967296.0);
    uvec4 carry;
    sum.parts = uaddCarry(sum.parts, parts, carry);
    sum.whole += uvec4(ivec4(whole)) + carry;
}

vec4 fixed_value(FixedSum sum) {
    return vec4(sum.whole) + vec4(sum.parts) / 4294967296.0;
}

vec4 fixed_signed_value(FixedSum sum) {
    return vec4(ivec4(sum.whole)) + vec4(sum.parts) / 4294967296.0;
}
