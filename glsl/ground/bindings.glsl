// What every method stands on: the frame, the scene, the lists.

#include "ground/constants.glsl"
#include "ground/layout.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer FrameBuffer {
    Frame frame;
    uint sky_words[]; // texels of the sky's map and of its levels
};
#define SKY_MAPS
layout(set = 0, binding = 1, scalar) readonly buffer GlobalsBuffer { Globals globals; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Heads { uint heads[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Lamps { Lamp lamps[]; };
layout(set = 0, binding = 9, scalar) readonly buffer LampNodes { LampNode lamp_nodes[]; };
layout(set = 0, binding = 10, scalar) readonly buffer AttributeWords { uint attribute_words[]; };
layout(set = 0, binding = 11, scalar) readonly buffer TextureLevels { TextureLevel texture_levels[]; };
layout(set = 0, binding = 12) uniform sampler2DArray atlas_linear;
layout(set = 0, binding = 13) uniform sampler2DArray atlas_srgb;
