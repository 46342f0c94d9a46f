// Light on demand: a list item is lit only if its light is requested. The first bounce lights all requested items, and
// the second one those among them that the image reads. The order of requests does not matter.

#include "ground/counts.glsl"

layout(scalar) buffer AskedItems { uint asked_items[]; }; // per list item, bits
layout(scalar) writeonly buffer FirstItems { uint first_items[]; }; // items that the first bounce lights
layout(scalar) writeonly buffer SecondItems { uint second_items[]; }; // items that the second bounce lights

const uint ASKED_FIRST = 1u;
const uint ASKED_SECOND = 2u;
const uint ASKED_SPLIT = 4u; // cuts of the item were searched

void ask(uint item, uint bounces) {
    if ((~asked_items[item] & bounces) == 0u) {
        return;
    }
    uint asked = bounces & ~atomicOr(asked_items[item], bounces);
    if ((asked & ASKED_FIRST) != 0u) {
        first_items[take_place(LIT_COUNTS)] = item;
    }
    if ((asked & ASKED_SECOND) != 0u) {
        second_items[take_place(SECOND_COUNTS)] = item;
    }
}
