#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Deforms the vertices of one mesh: morph targets first, then the mean of its joints' matrices. Twin:
// src/scene/deform.rs.

#include "common/count.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer DeformWords { uint deform_words[]; };
layout(scalar) readonly buffer DeformPose { float deform_pose[]; };
layout(scalar) writeonly buffer SceneVertices { uint scene_vertices[]; };

const uint HAS_TANGENTS = 1u;
const uint FLAT = 2u;
const uint BASE_WORDS = 9u; // position, normal, tangent without its sign

layout(push_constant, scalar) uniform Push {
    uint first_word; // of the mesh: undeformed vertices, then targets, then influences
    uint vertices;
    uint targets; // position, normal and tangent of each vertex, target by target
    uint influences; // of each vertex: joint, weight
    uint first_weight; // in the pose
    uint first_joint;
    uint first_vertex; // word of the scene's vertices
    uint vertex_words;
    uint flags;
} push;

struct Deformed {
    vec3 position;
    vec3 normal;
    vec3 tangent;
};

vec3 read3(uint place) {
    COUNT(WORDS, 3u);
    return uintBitsToFloat(uvec3(deform_words[place], deform_words[place + 1u], deform_words[place + 2u]));
}

Deformed morphed(uint v) {
    uint place = push.first_word + BASE_WORDS * v;
    Deformed sum = Deformed(read3(place), read3(place + 3u), read3(place + 6u));
    for (uint target = 0u; target < push.targets; target++) {
        float weight = deform_pose[push.first_weight + target];
        if (weight != 0.0) {
            place += BASE_WORDS * push.vertices;
            sum.position += weight * read3(place);
            sum.normal += weight * read3(place + 3u);
            sum.tangent += weight * read3(place + 6u);
        } else {
            place += BASE_WORDS * push.vertices;
        }
    }
    return sum;
}

vec4 row(uint joint, uint i) {
    uint place = push.first_joint + 12u * joint + 4u * i;
    return vec4(deform_pose[place], deform_pose[place + 1u], deform_pose[place + 2u], deform_pose[place + 3u]);
}

vec3 linear(mat3 rows, vec3 v) {
    return vec3(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v));
}

// The vector is scaled first, so that no square overflows or vanishes.
vec3 unit_or(vec3 v, vec3 other) {
    vec3 a = abs(v);
    float largest = max(a.x, max(a.y, a.z));
    return largest > 0.0 && !isinf(largest) ? normalize(v / largest) : other;
}

Deformed deformed(uint v) {
    Deformed vertex = morphed(v);
    if (push.influences > 0u) {
        vec4 rows[3] = vec4[3](vec4(0.0), vec4(0.0), vec4(0.0));
        uint place = push.first_word + BASE_WORDS * push.vertices * (1u + push.targets) + 2u * push.influences * v;
        COUNT(WORDS, 2u * push.influences);
        for (uint i = 0u; i < push.influences; i++) {
            uint joint = deform_words[place + 2u * i];
            float weight = uintBitsToFloat(deform_words[place + 2u * i + 1u]);
            for (uint r = 0u; r < 3u; r++) {
                rows[r] += weight * row(joint, r);
            }
        }
        mat3 m = mat3(rows[0].xyz, rows[1].xyz, rows[2].xyz); // columns of this are rows of the joint's
        vertex.position = linear(m, vertex.position) + vec3(rows[0].w, rows[1].w, rows[2].w);
        // The inverse transpose up to a positive factor.
        vertex.normal = linear(mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])), vertex.normal);
        vertex.tangent = linear(m, vertex.tangent);
    }
    return vertex;
}

void write3(uint place, vec3 value) {
    for (uint k = 0u; k < 3u; k++) {
        scene_vertices[place + k] = floatBitsToUint(value[k]);
    }
}

void main() {
    for (uint v = gl_GlobalInvocationID.x; v < push.vertices; v += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint base = push.first_word + BASE_WORDS * v;
        Deformed vertex = deformed(v);
        vec3 normal = vertex.normal;
        if ((push.flags & FLAT) != 0u) {
            uint first = v - v % 3u;
            vec3 a = deformed(first).position;
            normal = cross(deformed(first + 1u).position - a, deformed(first + 2u).position - a);
        }
        uint place = push.first_vertex + push.vertex_words * v;
        write3(place, vertex.position);
        write3(place + 3u, unit_or(normal, read3(base + 3u)));
        if ((push.flags & HAS_TANGENTS) != 0u) {
            write3(place + 6u, unit_or(vertex.tangent, read3(base + 6u))); // the sign is unchanged
        }
    }
}
