// Counts what a shader reads, where COUNTING says so, as it does on a device that was opened to count (`twobounce
// profile`). Elsewhere nothing of this file is left in the shader that the driver gets. Twin: src/profile/counts.rs. To
// be included before main.

layout(constant_id) const bool COUNTING = false; // given by src/vk/pipeline/desc.rs

const uint CONE_STEPS = 0u; // diffuse, specular and refraction cones
const uint SHADOW_STEPS = 1u; // shadow cones
const uint RAY_STEPS = 2u; // from box to box of a tree
const uint VOLUME_TEXELS = 3u;
const uint ATLAS_TEXELS = 4u;
const uint TEXTURE_RECORDS = 5u; // TextureEntry or TextureLevel
const uint HEADS = 6u;
const uint LIST_ITEMS = 7u;
const uint TRIANGLES = 8u; // whole records
const uint CORNERS = 9u; // a vertex's position alone
const uint MATERIALS = 10u;
const uint LIGHTS = 11u;
const uint SCENE_VERTICES = 12u;
const uint LAMP_RECORDS = 13u; // pieces of sampled lamps
const uint WORDS = 14u; // whatever has no kind of its own
const uint RAYS_CUT = 15u; // by the driver, before they were over
const uint RAYS_BEGUN = 16u; // in a tree of triangles
const uint INVOCATIONS = 17u; // threads, vertices or fragments
const uint KINDS = 18u;

buffer Counts { uint counted[]; }; // per kind: low word, high word

uint tally[KINDS];

#define COUNT(kind, n) \
    if (COUNTING) tally[kind] += (n)
// Also before a discard: main does not come back from it.
#define COUNT_ALL() \
    if (COUNTING) add_counts()

// Texels behind one trilinear look-up.
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
