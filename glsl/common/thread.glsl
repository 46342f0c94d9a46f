// The number of a thread in a dispatch along two axes (`over_threads` in src/ground/mod.rs), with workgroups of 64
// threads along one axis.

// gl_WorkGroupSize is 1 until the size is declared.
layout(local_size_x = 64) in;

uint thread() {
    uint group = gl_WorkGroupID.x + gl_NumWorkGroups.x * gl_WorkGroupID.y;
    return group * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}
