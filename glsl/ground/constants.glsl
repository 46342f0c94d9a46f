// Specialisation constants of the ground. Twin: src/ground/constants.rs.

#include "common/numbers.glsl"

const uint LIT_COUNTS = 15u; // the entry of CellCounts for lit items, after the levels
const uint CHOSEN_COUNTS = 14u; // the entry for lit items before a pass adds twins
const uint SECOND_COUNTS = 13u; // the entry for items lit by a second bounce, with light on demand

layout(constant_id) const uint EDGE = 64u; // of the grid, voxels
layout(constant_id) const uint SHADOWS = 0u; // of lights
layout(constant_id) const uint FEATURES = 0u; // features of the scene and the settings
layout(constant_id) const uint LAMPS = 0u; // how emissive surfaces light the scene
layout(constant_id) const uint LAMP_POINTS = 16u; // per lit place
layout(constant_id) const uint GATHER_SCALE = 1u; // pixels of the image per gathered one, along each side
layout(constant_id) const uint INTERLEAVE = 1u; // side in pixels of a square of different directions
layout(constant_id) const bool LINKED = false; // whether rays decide which gathered pixels share light
layout(constant_id) const uint SHADOW_RAYS = 1u; // per light with an extent
layout(constant_id) const uint DIRECT = 0u; // the source of the direct light of list items
layout(constant_id) const uint LIT = 0u; // which list items are lit
layout(constant_id) const uint DEMAND = 0u; // 1: only items whose light is requested
layout(constant_id) const uint LISTED = LIT_COUNTS; // the list of items to visit, as an entry of the counts
layout(constant_id) const uint BOXES = 0u; // of finer voxels within the grid
layout(constant_id) const uint BLENDED = 0u; // 1: blended triangles are drawn
layout(constant_id) const uint SAMPLES = 4u; // per pixel of the raster that measures voxels

const uint SHADOWS_NONE = 0u;
const uint SHADOWS_METHOD = 1u;
const uint SHADOWS_RAYS = 2u;

const uint LAMPS_GATHERED = 0u; // by the method alone
const uint LAMPS_SAMPLED = 1u; // as area lights

const uint DIRECT_FOUND = 0u; // computed by every pass
const uint DIRECT_KEPT = 1u; // computed, and kept for the next pass
const uint DIRECT_READ = 2u; // the kept light is read

const uint LIT_EACH = 0u;
const uint LIT_GROUPED = 1u; // one for each group of similar triangles

const uint FEATURE_ALPHA = 2u; // masks, blending or transmission: surfaces that shadow rays may pass
const uint FEATURE_SPECULAR = 4u;
const uint FEATURE_TRANSMISSION = 8u;
const uint FEATURE_MASK = 32u; // some fragments may be discarded
const uint FEATURE_BLEND = 128u;
const uint FEATURE_DIRECT_PER_PIXEL = 65536u;
const uint FEATURE_SKY_MAP = 262144u;
const uint FEATURE_SECOND_UV = 524288u; // a texture uses the second set
const uint FEATURE_COLORS = 1048576u; // some vertex is not white
const uint FEATURE_TEXTURES = 0xff00u; // bits 8 to 15: some material has a texture in that slot
// Some material has the feature; all of these are in ground/finish.glsl.
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
const uint FEATURE_QUERY = 1u << 29; // rays are traced by the device's ray queries

const uint FEATURE_SKY_UNSEEN = 64u; // pixels show transparency in place of the sky
const uint FEATURE_POINTS = 1u << 30; // textures are sampled at points; volumes attenuate by the exact path length
const uint FEATURE_DISPERSION = 1u << 31; // some material has dispersion

// Macros: a branch on them is a branch on a constant, which is removed before the driver inlines functions.
#define feature(bit) ((FEATURES & (bit)) != 0u)
#define slot_in_use(slot) ((FEATURES & (256u << (slot))) != 0u)

const float LARGEST_STORED = 65504.0; // the largest f16
const uint ITEM_SHARES = 1024u; // shares of all items into which passes can be split
const uint MOST_GROUPS = 65535u; // of 64 threads, the maximum on every device; threads continue with further items
