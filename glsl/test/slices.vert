#version 460
#extension GL_ARB_shader_viewport_layer_array : require

layout(location = 0) out flat uint layer;

// One full-screen triangle per layer.
void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    gl_Position = vec4(corner, 0.5, 1.0);
    gl_Layer = gl_InstanceIndex;
    layer = gl_InstanceIndex;
}
