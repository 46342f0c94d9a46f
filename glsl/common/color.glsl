// The largest of a colour's three channels.

float brightest(vec3 c) {
    return max(c.r, max(c.g, c.b));
}
