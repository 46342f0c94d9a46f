// Specialisation constants of the ground; src/ground/constants.rs is their twin.

#include "common/numbers.glsl"

const uint LIT_COUNTS = 15u; // where CellCounts counts the items that are lit: after the levels
const uint CHOSEN_COUNTS = 14u; // the same before the pass that adds twins to them
const uint SECOND_COUNTS = 13u; // those among them that are lit by a second bounce, where items are asked for

layout(constant_id) const uint EDGE = 64u; // of the grid, voxels
layout(constant_id) const uint SHADOWS = 0u; // of lights
layout(constant_id) const uint FEATURES = 0u; // what the scene and the settings ask for
layout(constant_id) const uint LAMPS = 0u; // how emissive surfaces light the scene
layout(constant_id) const uint LAMP_POINTS = 16u; // per place that is lit
layout(constant_id) const uint GATHER_SCALE = 1u; // pixels of the image per gathered one, along each side
layout(constant_id) const uint INTERLEAVE = 1u; // pixels along the side of a square in which directions differ
layout(constant_id) const bool LINKED = false; // whether rays tell which gathered pixels share light
layout(constant_id) const uint SHADOW_RAYS = 1u; // per light with an extent
layout(constant_id) const uint DIRECT = 0u; // where the direct light of list items comes from
layout(constant_id) const uint LIT = 0u; // which list items are lit
layout(constant_id) const uint DEMAND = 0u; // 1: of those, the items alone that something asks for
layout(constant_id) const uint LISTED = LIT_COUNTS; // the list of items that is gone through, among the counts
layout(constant_id) const uint BOXES = 0u; // of finer voxels within the grid
layout(constant_id) const uint BLENDED = 0u; // 1: the blended triangles are drawn
layout(constant_id) const uint SAMPLES = 4u; // per pixel of the raster that measures what a triangle fills of a voxel

const uint SHADOWS_NONE = 0u;
const uint SHADOWS_METHOD = 1u;
const uint SHADOWS_RAYS = 2u;

const uint LAMPS_GATHERED = 0u; // by the method alone
const uint LAMPS_SAMPLED = 1u; // as area lights

const uint DIRECT_FOUND = 0u; // by every pass
const uint DIRECT_KEPT = 1u; // found, and kept for the next pass
const uint DIRECT_READ = 2u; // what was kept

const uint LIT_EACH = 0u;
const uint LIT_ALIKE = 1u; // one for all that are alike

const uint FEATURE_ALPHA = 2u; // masks, blending or transmission: what a shadow ray may pass through
const uint FEATURE_SPECULAR = 4u;
const uint FEATURE_TRANSMISSION = 8u;
const uint FEATURE_MASK = 32u; // something may be discarded
const uint FEATURE_BLEND = 128u;
const uint FEATURE_DIRECT_PER_PIXEL = 65536u;
const uint FEATURE_SKY_MAP = 262144u;
const uint FEATURE_SECOND_UV = 524288u; // a texture uses the second set
const uint FEATURE_COLORS = 1048576u; // some vertex is not white
const uint FEATURE_TEXTURES = 0xff00u; // bits 8 to 15: some material has a texture in that slot
// Some material has it; all of these are in ground/finish.glsl.
const uint FEATURE_CLEARCOAT = 1u << 21;
const uint FEATURE_SHEEN = 1u << 22;
const uint FEATURE_ANISOTROPY = 1u << 23;
const uint FEATURE_IRIDESCENCE = 1u << 24;
const uint FEATURE_DIFFUSE_TRANSMISSION = 1u << 25;
const uint FEATURE_LAYERS = FEATURE_CLEARCOAT | FEATURE_SHEEN;
const uint FEATURE_FINISH = FEATURE_LAYERS | FEATURE_ANISOTROPY | FEATURE_IRIDESCENCE | FEATURE_DIFFUSE_TRANSMISSION;
const uint FEATURE_FINISH_TEXTURES = 1u << 26; // one of them has a texture
const uint FEATURE_TANGENTS = 1u << 27; // one of them reads tangents
const uint FEATURE_MIRRORS = 1u << 28; // some material may be a smooth metal
const uint FEATURE_QUERY = 1u << 29; // rays are the device's own queries

const uint FEATURE_SKY_UNSEEN = 64u; // to the viewer, who sees nothing in its place
const uint FEATURE_POINTS =
    1u << 30; // textures are looked up at points, and a way through a volume is as long as it is
const uint FEATURE_DISPERSION = 1u << 31;

// Macros: a branch on them is a branch on a constant, which is cut before the driver copies functions into one another.
#define feature(bit) ((FEATURES & (bit)) != 0u)
#define slot_in_use(slot) ((FEATURES & (256u << (slot))) != 0u)

const float LARGEST_STORED = 65504.0; // of an f16
const uint ITEM_SHARES = 1024u; // of all items: what passes over them can be cut into
const uint MOST_GROUPS = 65535u; // of 64 threads, what every device takes in one dispatch; threads go on beyond
