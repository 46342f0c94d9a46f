#version 460
// One triangle over the whole image, for each instance.

layout(location = 0) flat out uint out_instance;

void main() {
    out_instance = uint(gl_InstanceIndex);
    gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
