// Of a colour's three channels.
#ifndef COLOR
#define COLOR

float brightest(vec3 c) {
    return max(c.r, max(c.g, c.b));
}

#endif
