// The beams that travel on, to be written.

layout(set = 0, binding = 44, rgba32f) writeonly uniform image3D new_light[7]; // flux, shares

void store_new(ivec3 cell, vec4 flux, Shares shares) {
    imageStore(new_light[0], cell, flux);
    imageStore(new_light[1], cell, shares.to[0]);
    imageStore(new_light[2], cell, shares.to[1]);
    imageStore(new_light[3], cell, shares.to[2]);
    imageStore(new_light[4], cell, shares.to[3]);
    imageStore(new_light[5], cell, shares.to[4]);
    imageStore(new_light[6], cell, shares.to[5]);
}
