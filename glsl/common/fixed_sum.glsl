// Sums that do not depend on the order of their terms, in 32.32 fixed point: the GPU determines the order of a list,
// and the image must not depend on it. Terms are ≥ 0 and, in stored radiance, ≤ 65,504: 65,536 of them fit, and the
// smallest f16 is 256 units. Signed terms use two's complement, so half as many fit.

struct FixedSum {
    uvec4 whole;
    uvec4 parts;
};

FixedSum fixed_zero() {
    return FixedSum(uvec4(0u), uvec4(0u));
}

void fixed_add(inout FixedSum sum, vec4 term) {
    vec4 whole = floor(term);
    // A negative term slightly below a whole number may be rounded up to it.
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
