// An index from triangle and voxel to list item: a hash table with open addressing, which is at most two thirds full.
// It follows the heads of all voxels' lists, because devices bind few buffers at once. The result does not depend on
// the order in which items were added.

#include "common/count.glsl"
#include "ground/bindings.glsl"

const uint INDEX_FIRST = (1u + BOXES) * EDGE * EDGE * EDGE; // among the heads; entries are items, 1-based; 0: free

// The size of the table, a power of two; 0 if a method makes none.
uint index_places() {
    return uint(heads.length()) - INDEX_FIRST;
}

// The first index of an item in the table.
uint index_place(uint triangle, uint voxel) {
    // Odd numbers near 2³² divided by the golden ratio and by √2, and a final mix of the high bits into the low ones.
    uint hash = (triangle * 0x9e3779b1u) ^ (voxel * 0xb504f333u);
    hash = (hash ^ hash >> 15u) * 0x85ebca77u;
    return (hash ^ hash >> 13u) & index_places() - 1u;
}

uint index_after(uint place) {
    return place + 1u & index_places() - 1u;
}

#ifdef WRITES_HEADS
// Adds an item, 1-based.
void enter_item(uint item, uint triangle, uint voxel) {
    uint place = index_place(triangle, voxel);
    bool entered = false;
    for (uint k = 0u; k < index_places() && !entered; k++) {
        entered = atomicCompSwap(heads[INDEX_FIRST + place], 0u, item) == 0u;
        COUNT(HEADS, 1u);
        place = index_after(place);
    }
}
#endif

// The item of a recorded triangle in a voxel, 1-based; 0 if there is none.
uint item_in(uint triangle, uint voxel) {
    uint found = 0u;
    uint place = index_place(triangle, voxel);
    uint item = heads[INDEX_FIRST + place];
    COUNT(HEADS, 1u);
    for (uint k = 0u; k < index_places() && item != 0u; k++) {
        ListItem entry = list_items[item - 1u];
        bool is_it = entry.triangle == triangle && entry.voxel == voxel;
        COUNT(LIST_ITEMS, 1u);
        COUNT(HEADS, is_it ? 0u : 1u);
        found = is_it ? item : 0u;
        place = index_after(place);
        item = is_it ? 0u : heads[INDEX_FIRST + place];
    }
    return found;
}
