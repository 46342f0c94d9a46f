#version 460

// Passes triangles on, with the layer that the vertex shader cannot hand over itself.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
layout(location = 0) in flat uint layer[];
layout(location = 0) out flat uint out_layer;

void main() {
    for (int i = 0; i < 3; i++) {
        gl_Position = gl_in[i].gl_Position;
        gl_Layer = int(layer[0]);
        out_layer = layer[0];
        EmitVertex();
    }
}
