// Light on demand: a list item is lit only if something asks for its light. The first bounce lights all that are asked
// for, the second one those among them that the image reads. No outcome depends on the order of asking.

#include "ground/counts.glsl"

layout(scalar) buffer AskedItems { uint asked_items[]; }; // per list item, bits
layout(scalar) writeonly buffer FirstItems { uint first_items[]; }; // to be lit by the first bounce,
layout(scalar) writeonly buffer SecondItems { uint second_items[]; }; // and by the second one

const uint ASKED_FIRST = 1u;
const uint ASKED_SECOND = 2u;
const uint ASKED_SPLIT = 4u; // it was looked for what cuts it

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
