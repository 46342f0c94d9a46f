// Method `none`: no light comes from elsewhere. See docs of `Gi` in src/gi/mod.rs for what a look-up answers.

const bool FINDS_LAMPS = false;

vec4 look_up_diffuse(Surface s, uvec3 place) {
    return vec4(0.0, 0.0, 0.0, 1.0);
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
}
