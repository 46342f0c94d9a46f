// The samples that see a blended triangle: a linked list per pixel.

struct BlendedSample {
    uint next; // 1-based; 0 ends the list
    uint seen; // as in the visibility buffer
    uint covered; // a bit per sample
    float depth; // 0: infinitely far
};

layout(scalar) buffer BlendedSamples {
    uint blended_sample_count; // may exceed the capacity
    BlendedSample blended_samples[];
};
layout(scalar) buffer BlendedHeads { uint blended_heads[]; }; // per pixel that a band sees; like `next`
