// Push constants of the passes over probes.

layout(push_constant) uniform ProbesPush {
    uint first; // index of the first probe
    uint step; // place.comp: its step; blend.comp: 1 leaves distances as they are
    uint known; // light of an earlier pass: 0: none; 1: blended with the new light; 2: replaced by the new light
} push;
