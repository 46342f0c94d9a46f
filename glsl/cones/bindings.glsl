// What shading reads: the frame, the scene and the lists. Volumes apart (volumes.glsl).

layout(set = 0, binding = 0, scalar) readonly buffer FrameBuffer { Frame frame; };
layout(set = 0, binding = 1, scalar) readonly buffer GlobalsBuffer { Globals globals; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Heads { uint heads[]; };
layout(set = 0, binding = 38, scalar) readonly buffer Clearance { uint clearance[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Emitters { Emitter emitters[]; };
layout(set = 0, binding = 37, scalar) readonly buffer EmitterNodes { EmitterNode emitter_nodes[]; };
layout(set = 0, binding = 8, scalar) readonly buffer TextureEntries { TextureEntry texture_entries[]; };
layout(set = 0, binding = 9, scalar) readonly buffer TextureLevels { TextureLevel texture_levels[]; };
layout(set = 0, binding = 10) uniform sampler2DArray atlas_linear;
layout(set = 0, binding = 11) uniform sampler2DArray atlas_srgb;
