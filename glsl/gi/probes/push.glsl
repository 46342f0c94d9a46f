// Which probes a pass goes through, and how.

layout(push_constant) uniform ProbesPush {
    uint first; // probe
    uint step; // of the pass that places probes; 1: the pass that blends leaves distances as they are
    uint known; // 1: the probes hold what a pass before left; 2: which is not blended with the new light
} push;
