#version 460

layout(location = 0) in flat uint in_layer;

layout(location = 0) out vec4 coordinates;
layout(location = 1) out vec4 constant;

void main() {
    coordinates = vec4(gl_FragCoord.xy, in_layer, 1.0);
    constant = vec4(0.25);
}
