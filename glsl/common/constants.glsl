// Specialisation constants: src/gi/cones/constants.rs is their twin.

layout(constant_id = 0) const uint EDGE = 64u; // voxels
layout(constant_id = 1) const uint CONE_SET = 1u; // 0: 1, 1: 5, 2: 6a, 3: 6b, 4: 16, 5: cosine-distributed
layout(constant_id = 10) const uint CONE_COUNT = 5u; // of the set
layout(constant_id = 2) const uint FILL = 0u;
layout(constant_id = 3) const uint WEIGHTS = 0u;
layout(constant_id = 4) const uint SHADOWS = 0u;
layout(constant_id = 5) const uint ROUGHNESS_FIT = 0u;
layout(constant_id = 6) const uint PRINTED = 0u; // bit k: row Dk of the ledger as printed
layout(constant_id = 7) const uint BOUNCE = 0u; // what gathers: 0 nothing to gather from, 1 a volume is there
layout(constant_id = 8) const uint FEATURES = 0u; // what the scene asks for

layout(constant_id = 11) const uint BLEND = 0u; // 0: over, 1: sum

layout(constant_id = 12) const uint GATHER = 0u;
layout(constant_id = 13) const uint EMITTERS = 0u;
layout(constant_id = 14) const uint EMITTER_SAMPLES = 16u;

layout(constant_id = 15) const uint GATHER_SCALE = 1u; // pixels of the image per gathered one
layout(constant_id = 16) const uint INTERLEAVE = 1u; // pixels along the side of a square whose directions differ

layout(constant_id = 17) const uint SPECULAR = 0u; // as GATHER
layout(constant_id = 18) const uint REFRACTION = 0u;
layout(constant_id = 19) const uint SPECULAR_RAYS = 8u; // of a lobe, at most
layout(constant_id = 21) const uint SHADOW_RAYS = 1u; // per light with an extent; 20 is the tests'

layout(constant_id = 22) const uint DIRECT = 0u; // of the voxels' direct light

layout(constant_id = 23) const uint LIT = 0u; // which of a voxel's triangles are lit: 0 each, 1 one for all that are alike

const uint LIT_ALIKE = 1u;

const uint DIRECT_AGAIN = 0u; // every shading pass finds it
const uint DIRECT_KEEP = 1u; // finds it, and keeps it for the next pass
const uint DIRECT_READ = 2u; // takes what was kept

const uint BRICK = 4u; // voxels along the edge of a brick

const uint GATHER_RAYS = 1u; // 0: cones
const uint EMITTERS_SAMPLED = 1u; // 0: through cones

const uint COSINE_SETS = 5u;

const uint FILL_UNIFORM = 0u;
const uint FILL_FACING = 1u;
const uint FILL_COVERAGE = 2u;
const uint FILL_SIDED = 3u;

const uint WEIGHTS_D2 = 0u;
const uint WEIGHTS_NORM1 = 1u;
const uint WEIGHTS_ABS = 2u;
const uint WEIGHTS_EXTINCTION = 3u;

const uint SHADOWS_NONE = 0u;
const uint SHADOWS_CONES = 1u;
const uint SHADOWS_RAYS = 2u;

const uint FEATURE_ALPHA = 2u; // masks, blending or transmission: what a shadow ray may pass through
const uint FEATURE_SPECULAR = 4u;
const uint FEATURE_TRANSMISSION = 8u;
const uint FEATURE_JITTER = 16u;
const uint FEATURE_MASK = 32u; // something may be discarded
const uint FEATURE_FIRST_BOUNCE_SHADOWS = 64u;
const uint FEATURE_BLEND = 128u;
const uint FEATURE_DIRECT_PER_PIXEL = 65536u; // bits 8 to 15: see slot_in_use

bool printed(uint row) {
    return (PRINTED & (1u << row)) != 0u;
}

bool feature(uint bit) {
    return (FEATURES & bit) != 0u;
}

// Bits 8 to 15 of FEATURES: some material has a texture in that slot.
bool slot_in_use(uint slot) {
    return (FEATURES & (256u << slot)) != 0u;
}

const float LARGEST_STORED = 65504.0; // of an f16
const uint LIT_COUNTS = 15u; // of CellCounts: what follows the levels is of the lists' items that are lit
const uint MOST_GROUPS = 65535u; // of 64 threads, what every device takes in one dispatch; threads go on beyond
const float PI = 3.14159265358979;
const float GOLDEN_ANGLE = 2.39996323; // of a sunflower's seeds
