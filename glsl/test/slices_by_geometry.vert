#version 460

layout(location = 0) out flat uint layer;

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    gl_Position = vec4(corner, 0.5, 1.0);
    layer = gl_InstanceIndex;
}
