#version 460
#extension GL_ARB_shader_viewport_layer_array : require
// Shading and mips, layered form: one triangle over the screen per slice; the instance is the layer.

layout(location = 0) flat out int out_layer;

void main() {
    gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 0.5, 1.0);
    gl_Layer = gl_InstanceIndex;
    out_layer = gl_InstanceIndex;
}
