// Recorded triangles: positions in voxels of the base grid, and the attributes of their corners.
//! with DRAWN

#include "common/count.glsl"
#include "common/triangle_box.glsl"
#include "ground/attributes.glsl"
#include "ground/record_draw.glsl"

layout(scalar) buffer GlobalsBuffer { Globals globals; };
layout(scalar) buffer Triangles { Triangle triangles[]; };
layout(scalar) writeonly buffer AttributeWords { uint attribute_words[]; };
layout(scalar) writeonly buffer Slots { uint slots[]; };

void write_word(inout uint place, float value) {
    attribute_words[place++] = floatBitsToUint(value);
}

void write_corner(uint slot, uint number, Corner corner) {
    triangles[slot].corners[number] = corner.position;
    uint place = corner_place(slot, number);
    for (int k = 0; k < 3; k++) {
        write_word(place, corner.normal[k]);
    }
    // A mirrored node reverses the handedness of tangents.
    corner.tangent.w = draw.mirrored != 0u ? -corner.tangent.w : corner.tangent.w;
    for (int k = 0; k < int(tangent_words()); k++) {
        write_word(place, corner.tangent[k]);
    }
    for (int k = 0; k < int(uv_words()); k++) {
        write_word(place, corner.uv[k]);
    }
    if (color_words() > 0u) {
        attribute_words[place] = packHalf2x16(corner.color.xy);
        attribute_words[place + 1u] = packHalf2x16(corner.color.zw);
    }
}

// The slot of one more triangle, which is counted even if there is no room.
uint take_slot() {
    uint slot = atomicAdd(globals.vertex_count, 3u) / 3u;
    if (slot >= uint(triangles.length())) {
        atomicAdd(globals.triangle_overflow, 1u);
    }
    return slot;
}

// All members of a triangle except its corners. `number` is that of the triangle in its mesh.
void write_triangle(uint slot, uint number) {
    triangles[slot].material = draw.material;
    uint source = draw.first_source + number;
    triangles[slot].source = source;
    triangles[slot].translucent = draw.translucent;
    if (source < uint(slots.length())) {
        // Rays find triangles by their source, and the image draws blended ones in another order.
        slots[source] = slot + 1u;
    }
}

// A mirrored node reverses the winding.
uint corner_number(uint i) {
    return draw.mirrored != 0u ? 2u - i : i;
}
