// Which probes a pass goes through, and how.

layout(push_constant) uniform ProbesPush {
    uint first; // probe
    uint step; // of the pass that places probes
    uint known; // 1: the probes hold what a pass before left
} push;
