// Sums that do not depend on the order of their terms, of either sign: 32.32 fixed point in two's complement. Like
// common/fixed_sum.glsl, which is for terms ≥ 0.

struct SignedSum {
    uvec4 whole;
    uvec4 parts;
};

SignedSum signed_zero() {
    return SignedSum(uvec4(0u), uvec4(0u));
}

void signed_add(inout SignedSum sum, vec4 term) {
    vec4 whole = floor(term);
    // What is hardly less than a whole number may be rounded up to it.
    uvec4 parts = uvec4(min(term - whole, vec4(0.99999994)) * 4294967296.0);
    uvec4 carry;
    sum.parts = uaddCarry(sum.parts, parts, carry);
    sum.whole += uvec4(ivec4(whole)) + carry;
}

vec4 signed_value(SignedSum sum) {
    return vec4(ivec4(sum.whole)) + vec4(sum.parts) / 4294967296.0;
}
