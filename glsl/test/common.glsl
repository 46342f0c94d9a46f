// Shared by the tests of the Vulkan layer.

struct Item {
    vec3 position;
    uint count;
    vec2 weights[2];
};
