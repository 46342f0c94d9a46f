// The ground's structs that are shared with the CPU. src/ground/layout.rs has their twins, and a test compares them.
// Lengths are in voxels unless a name ends in _m. Scalar block layout.

// The part of a recorded triangle that rays and voxels read; the rest is stored separately (ground/attributes.glsl).
struct Triangle {
    vec3 corners[3];
    uint material;
    uint source; // index in the scene, equal in every frame
    uint translucent; // 1: a ray may pass through
};

struct Globals {
    uint vertex_count; // 3 × recorded triangles: these four are a VkDrawIndirectCommand
    uint instance_count;
    uint first_vertex;
    uint first_instance;
    uint item_count;
    uint cell_count;
    uint triangle_overflow;
    uint item_overflow;
    uint cell_overflow;
    uint degenerate_count;
    uint blended_samples; // the maximum number for rows at once, if it exceeded the capacity
};

// The length of a list, such as the occupied cells of a level; the first three members are a VkDispatchIndirectCommand
// for its entries, 64 per group.
struct ListCount {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint count;
};

// Light of each side of a list item in stored radiance, and the share of its voxel that it fills.
struct ItemLight {
    vec3 front;
    float opacity;
    vec3 back;
    float area; // clipped to the voxel, over the area of a face
};

// For a list item: the item that is lit for it, and the part of its triangle inside the voxel, over the area of a face.
struct ItemPart {
    uint lit_by;
    float area;
    uint source; // of its triangle
    uint alone; // 1: it is lit for everything in its voxel
    uint twin; // 1-based: the item lit for the part that this one cannot see; its own for a twin; 0: none
    uint anchor; // position in its voxel at which a split item is lit, along the two axes after its dominant one
};

struct ListItem {
    uint triangle;
    uint next; // 1-based; 0 ends the list (a walk that ends on ~0 hangs on Mesa 22.3)
    uint voxel; // the voxel that lists it
};

// A texture of a material: one mip chain in the atlas.
struct TextureSlot {
    uint layer;
    uint first_level;
    uint level_count; // 0: no texture
    // Bits 0–1 wrap s, 2–3 wrap t (0 repeat, 1 mirror, 2 clamp), 4 mag linear, 5 min linear, 6–7 mip (0 none, 1
    // nearest, 2 linear).
    uint flags;
    uint uv_set;
    vec4 linear; // columns of the 2×2 part of KHR_texture_transform
    vec2 offset;
};

const uint MATERIAL_MASK = 1u;
const uint MATERIAL_BLEND = 2u;
const uint MATERIAL_DOUBLE_SIDED = 4u;
const uint MATERIAL_UNLIT = 8u;
const uint MATERIAL_FINISH_SHIFT = 4u; // above: the row where its finish begins, 0 without one

const uint SLOT_BASE_COLOR = 0u;
const uint SLOT_METALLIC_ROUGHNESS = 1u;
const uint SLOT_NORMAL = 2u;
const uint SLOT_EMISSIVE = 3u;
const uint SLOT_SPECULAR = 4u;
const uint SLOT_SPECULAR_COLOR = 5u;
const uint SLOT_TRANSMISSION = 6u;
const uint SLOT_THICKNESS = 7u;

struct Material {
    vec4 base_color;
    vec3 emissive;
    float metallic;
    float roughness;
    float normal_scale;
    float alpha_cutoff;
    float ior;
    float specular;
    vec3 specular_color;
    float transmission;
    float thickness_m;
    vec3 attenuation_color;
    float attenuation_distance_m;
    uint flags;
    TextureSlot slots[8];
};

// Whether the surface blocks all light everywhere.
bool is_opaque(uint flags, float transmission) {
    return (flags & (MATERIAL_MASK | MATERIAL_BLEND)) == 0u && transmission == 0.0;
}

const uint LIGHT_POINT = 0u;
const uint LIGHT_SPOT = 1u;
const uint LIGHT_DIRECTIONAL = 2u;
const uint LIGHT_SKY = 3u; // directional, and visible in mirrors as a part of the sky

struct Light {
    vec3 position;
    uint kind;
    vec3 direction; // unit direction in which the light shines
    float range_m;
    vec3 intensity; // irradiance × m², or irradiance
    float radius; // voxels; directional: tangent of the half angle
    float spot_scale;
    float spot_offset;
};

// A piece of an emissive triangle with constant radiance.
struct Lamp {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 radiance;
    uint two_sided;
    float shine; // of its material: see frame.lamp_shine
};

// A sphere around neighbouring pieces, their power, and a cone around their normals.
struct LampNode {
    vec3 center;
    float radius;
    vec3 axis;
    float spread_cosine; // of the half angle; −1 if a piece shines to both sides
    float power;
};

// The place of a level in its layer, in texels.
struct TextureLevel {
    uint x;
    uint y;
    uint width;
    uint height;
};

const uint MOST_BOXES = 5u;

struct Frame {
    mat4 clip_from_voxel;
    vec3 eye; // voxels
    float voxel_m;
    vec3 forward; // unit direction of the view
    uint orthographic;
    vec3 right_per_ndc; // direction (perspective) or offset in voxels (orthographic) per unit of NDC x
    float scale; // stored radiance = radiance × scale, a power of two
    vec3 down_per_ndc;
    uint light_count;
    vec3 sky; // radiance
    uint turn; // hash of the time within the animation; 0 at its start
    vec2 image_size; // pixels
    uint samples;
    uint lamp_count;
    uint lamp_tree; // 1: pieces are chosen through the tree; 0: each as often
    float lamp_shine; // the brightest channel of every piece's emission without textures × its area in voxels², summed
    uint light_pass; // number of the pass over the light, among the passes whose mean is kept
    vec3 sky_gradient; // radiance added to the sky straight up and subtracted straight down
    float light_share; // weight of the newest pass in that mean; 1: all
    float sky_scale; // radiance of an unpacked 1 of the sky's map
    float sky_most; // unpacked: lights represent the excess over this
    int sky_width; // texels
    int sky_height;
    uint sky_levels; // levels of means over cones after the map
    float sky_octaves; // how often the last of them is halved until cones are as narrow as texels
    float sky_turn; // rotation in whole turns, counter-clockwise from above
    vec2 image_shift; // shift of the random numbers of the image's places in this pass
    vec2 ndc_shift; // shift of the image in this pass
    uint image_pass; // number of the pass over the image, among the passes whose mean is shown
    vec3 boxes[MOST_BOXES]; // least corner of each box
    vec3 last_boxes[MOST_BOXES]; // the same for the previous lists
};
