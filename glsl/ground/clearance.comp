#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Clearance, last step: what clearance.glsl says, a thread per word of a row.

#include "ground/constants.glsl"
#include "ground/clearance_code.glsl"
#include "ground/clearance_scratch.glsl"

layout(set = 0, binding = 5, scalar) writeonly buffer Clearance { uint clearance[]; };

// The bits of a word and those at the ends of its neighbours.
struct Bits {
    uint before;
    uint here;
    uint after;
};

// Every bit also `radius` places further, both ways.
uint spread(Bits bits, uint radius) {
    uint wide = bits.here;
    for (uint k = 1u; k <= radius; k++) {
        wide |= bits.here << k | bits.before >> (32u - k) | bits.here >> k | bits.after << (32u - k);
    }
    return wide;
}

void main() {
    int word = int(gl_GlobalInvocationID.x);
    if (word >= ROW_WORDS) {
        return;
    }
    int along = word % WORDS_PER_ROW;
    int y = word / WORDS_PER_ROW % int(EDGE);
    int z = word / WORDS_PER_ROW / int(EDGE);
    int reaches[WORD_VOXELS / BRICK];
    int least = MOST_REACH;
    COUNT(WORDS, uint(WORD_VOXELS) / BRICK);
    for (int k = 0; k < WORD_VOXELS / int(BRICK); k++) {
        reaches[k] = int(scratch[brick_entry(1, ivec3(along * WORD_VOXELS / int(BRICK) + k, y / int(BRICK), z / int(BRICK)))]);
        least = min(least, reaches[k]);
    }
    // Voxels that have one that lists something no further than that: none where the bricks say so.
    uint within[MOST_NEAR] = uint[MOST_NEAR](0u, 0u, 0u, 0u);
    Bits bits = Bits(0u, 0u, 0u);
    for (int radius = 0; radius < (least > 1 ? 0 : MOST_NEAR); radius++) {
        // The rows that this radius adds.
        int side = 2 * radius + 1;
        for (int k = 0; k < side * side; k++) {
            ivec2 d = ivec2(k % side, k / side) - radius;
            if (max(abs(d.x), abs(d.y)) == radius) {
                bits.before |= row_bits(along - 1, y + d.x, z + d.y);
                bits.here |= row_bits(along, y + d.x, z + d.y);
                bits.after |= row_bits(along + 1, y + d.x, z + d.y);
            }
        }
        within[radius] = spread(bits, uint(radius));
    }
    for (int first = 0; first < WORD_VOXELS; first += 8) {
        uint codes = 0u;
        for (int k = first; k < first + 8; k++) {
            uint bit = uint(k);
            uint found = (within[0] >> bit & 1u) + (within[1] >> bit & 1u) + (within[2] >> bit & 1u) + (within[3] >> bit & 1u);
            int reach = reaches[k / int(BRICK)];
            int code = found == 0u && reach > 1 ? reach + MOST_NEAR - 1 : MOST_NEAR - int(found);
            codes |= uint(code) << (uint(k - first) * 4u);
        }
        clearance[(word * WORD_VOXELS + first) / 8] = codes;
    }
}
