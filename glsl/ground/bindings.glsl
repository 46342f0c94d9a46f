// Data that every method reads: the frame, the scene, the lists. A shader that writes globals or heads defines
// WRITES_GLOBALS or WRITES_HEADS.

#include "ground/constants.glsl"
#include "ground/frame.glsl"
#include "ground/layout.glsl"

#ifdef WRITES_GLOBALS
layout(scalar) buffer GlobalsBuffer { Globals globals; };
#else
layout(scalar) readonly buffer GlobalsBuffer { Globals globals; };
#endif
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
#ifdef WRITES_HEADS
layout(scalar) buffer Heads { uint heads[]; };
#else
layout(scalar) readonly buffer Heads { uint heads[]; };
#endif
layout(scalar) readonly buffer Materials { Material materials[]; };
layout(scalar) readonly buffer Lights { Light lights[]; };
layout(scalar) readonly buffer Lamps { Lamp lamps[]; };
layout(scalar) readonly buffer LampNodes { LampNode lamp_nodes[]; };
layout(scalar) readonly buffer AttributeWords { uint attribute_words[]; };
layout(scalar) readonly buffer TextureLevels { TextureLevel texture_levels[]; };
uniform sampler2DArray atlas_linear;
uniform sampler2DArray atlas_srgb;
