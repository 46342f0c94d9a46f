// Attributes of a recorded triangle's corners except positions: a sequence of words with only those that the scene's
// materials read. Twin: src/ground/attributes.rs.

#include "ground/constants.glsl"
#include "ground/layout.glsl"

struct Attributes {
    mat3 normals; // columns: a corner each
    vec4 tangents[3];
    vec4 uvs[3]; // set 0, set 1
    vec4 colors[3];
};

uint tangent_words() {
    // A single condition: glslang treats a choice by two constants as a constant whose condition it computes later.
    return (FEATURES & (256u << SLOT_NORMAL | FEATURE_TANGENTS)) == 0u ? 0u : 4u;
}

uint uv_words() {
    return (FEATURES & (FEATURE_TEXTURES | FEATURE_FINISH_TEXTURES)) == 0u ? 0u : feature(FEATURE_SECOND_UV) ? 4u : 2u;
}

// A colour is 4 × f16.
uint color_words() {
    return feature(FEATURE_COLORS) ? 2u : 0u;
}

// The first words of a corner's normal, tangent, uv and colour.
uint corner_place(uint triangle, uint corner) {
    return (3u * triangle + corner) * (3u + tangent_words() + uv_words() + color_words());
}
