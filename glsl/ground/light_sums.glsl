// Sums of light over blocks of a grid: feedback has settled once they no longer change. The sums are integers, so that
// the order of additions does not matter. src/gi/light_sums.rs is the twin of the constants.

const uint BLOCKS = 4u; // along each edge
const float UNITS = 64.0; // integer units per unit of stored radiance

layout(scalar) buffer LightSums { uvec2 light_sums[]; }; // low word, high word

void add_to_block(uvec3 block, float light) {
    uint units = uint(min(light * UNITS, 4.2e9));
    uint place = block.x + BLOCKS * (block.y + BLOCKS * block.z);
    if (atomicAdd(light_sums[place].x, units) + units < units) {
        atomicAdd(light_sums[place].y, 1u);
    }
}
