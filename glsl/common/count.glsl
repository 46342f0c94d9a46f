// Counts the reads of a shader if COUNTING is set, as on a device that was opened for counting (`twobounce profile`).
// Otherwise the driver gets a shader without any of this. Twin: src/profile/counts.rs. This file is included before
// main.

layout(constant_id) const bool COUNTING = false; // set by src/vk/pipeline/desc.rs

const uint CONE_STEPS = 0u; // diffuse, specular and refraction cones
const uint SHADOW_STEPS = 1u; // shadow cones
const uint RAY_STEPS = 2u; // from node to node of a tree
const uint VOLUME_TEXELS = 3u;
const uint ATLAS_TEXELS = 4u;
const uint TEXTURE_RECORDS = 5u; // TextureEntry or TextureLevel
const uint HEADS = 6u;
const uint LIST_ITEMS = 7u;
const uint TRIANGLES = 8u; // whole records
const uint CORNERS = 9u; // the position of one vertex
const uint MATERIALS = 10u;
const uint LIGHTS = 11u;
const uint SCENE_VERTICES = 12u;
const uint LAMP_RECORDS = 13u; // pieces of sampled lamps
const uint WORDS = 14u; // all other reads
const uint RAYS_CUT = 15u; // rays that the driver ended early
const uint RAYS_BEGUN = 16u; // rays started in a tree of triangles
const uint INVOCATIONS = 17u; // threads, vertices or fragments
const uint KINDS = 18u;

buffer Counts { uint counted[]; }; // per kind: low word, high word

uint tally[KINDS];

#define COUNT(kind, n) \
    if (COUNTING) tally[kind] += (n)
// This also runs before a discard, after which main does not continue.
#define COUNT_ALL() \
    if (COUNTING) add_counts()

// Texels of one trilinear look-up.
uint trilinear_texels(float level) {
    return fract(level) == 0.0 ? 8u : 16u;
}

void add_counts() {
    for (uint kind = 0u; kind < KINDS; kind++) {
        if (tally[kind] != 0u) {
            uint before = atomicAdd(counted[2u * kind], tally[kind]);
            if (before + tally[kind] < before) {
                atomicAdd(counted[2u * kind + 1u], 1u);
            }
        }
    }
}

void counted_main();

void main() {
    if (COUNTING) {
        for (uint kind = 0u; kind < KINDS; kind++) {
            tally[kind] = 0u;
        }
        tally[INVOCATIONS] = 1u;
    }
    counted_main();
    COUNT_ALL();
}

#define main counted_main
