#version 460
#extension GL_GOOGLE_include_directive : require
//! with DILATED
// Voxelise: projects the triangle along its dominant axis and dilates it by half a pixel, so that every pixel that it
// touches gets a fragment. Too many pixels do, so the fragment shader tests each voxel exactly. If the hardware
// rasterises conservatively, the dilation only covers its snapping. With DILATED the fragment shader receives and tests
// the dilated triangle, as in the talk.

#include "ground/constants.glsl"
#include "common/dominant_axis.glsl"
#include "common/triangle_box.glsl"

layout(triangles) in;
layout(triangle_strip, max_vertices = 4) out;

layout(location = 0) in vec3 in_position[];
layout(location = 1) flat in uint in_triangle[];

layout(location = 0) flat out uint out_triangle;
layout(location = 1) flat out uint out_axis;
layout(location = 2) flat out vec3 out_normal;
#ifdef DILATED
layout(location = 3) flat out vec3 out_dilated[4]; // a strip in the triangle's plane
#endif

layout(constant_id) const uint HARDWARE = 0u; // 1: every touched pixel gets a fragment without dilation

// Half a pixel, and a margin for the rasteriser's snapping to 1/256 pixel: exactly 0.5 loses 0.5 % of the pairs.
// Outlines at least twice as wide as the margin keep an area after snapping; devices may drop those without area.
const float DILATION = HARDWARE != 0u ? 0.01 : 0.51;

vec3 normal;
uint axis;

#ifdef DILATED
vec3 in_plane(vec2 pixel) {
    uint u = (axis + 1u) % 3u;
    uint v = (axis + 2u) % 3u;
    vec3 p = in_position[0];
    p[axis] -= dot(vec2(normal[u], normal[v]) / normal[axis], pixel - vec2(p[u], p[v]));
    p[u] = pixel.x;
    p[v] = pixel.y;
    return p;
}
#endif

// A strip of three or four corners.
void emit(vec2 corners[4], int count) {
    for (int i = 0; i < count; i++) {
        gl_Position = vec4(corners[i] * (2.0 / float(EDGE)) - 1.0, 0.5, 1.0);
        out_triangle = in_triangle[0];
        out_axis = axis;
        out_normal = normal;
#ifdef DILATED
        for (int k = 0; k < 4; k++) {
            out_dilated[k] = in_plane(corners[min(k, count - 1)]);
        }
#endif
        EmitVertex();
    }
    EndPrimitive();
}

// Half the extent of the pixel's square along a unit direction.
float support(vec2 d) {
    return DILATION * (abs(d.x) + abs(d.y));
}

void main() {
    vec3 low = min(in_position[0], min(in_position[1], in_position[2]));
    vec3 high = max(in_position[0], max(in_position[1], in_position[2]));
    if (any(lessThan(high, vec3(-1.0))) || any(greaterThan(low, vec3(float(EDGE) + 1.0)))) {
        return; // all of it is outside, like most triangles of a small box
    }
    normal = triangle_normal(in_position[0], in_position[1], in_position[2]);
    axis = dominant_axis(normal);
    vec2 p[3];
    for (int i = 0; i < 3; i++) {
        p[i] = across(in_position[i], axis);
    }
    if (normal[axis] < 0.0) {
        vec2 swap = p[1];
        p[1] = p[2];
        p[2] = swap;
    }

    // A box around the triangle, aligned with its longest edge: always conservative, and tight for needles.
    vec2 along = p[1] - p[0];
    vec2 e1 = p[2] - p[1];
    vec2 e2 = p[0] - p[2];
    along = dot(e1, e1) > dot(along, along) ? e1 : along;
    along = dot(e2, e2) > dot(along, along) ? e2 : along;
    float longest = length(along);
    along = longest > 0.0 ? along / longest : vec2(1.0, 0.0);
    vec2 across = vec2(-along.y, along.x);
    vec3 a = vec3(dot(along, p[0]), dot(along, p[1]), dot(along, p[2]));
    vec3 c = vec3(dot(across, p[0]), dot(across, p[1]), dot(across, p[2]));
    float a0 = min(a.x, min(a.y, a.z)) - support(along);
    float a1 = max(a.x, max(a.y, a.z)) + support(along);
    float c0 = min(c.x, min(c.y, c.z)) - support(across);
    float c1 = max(c.x, max(c.y, c.z)) + support(across);
    float box_area = (a1 - a0) * (c1 - c0);

    // The triangle with its edges moved outwards (Hasselgren et al., GPU Gems 2, ch. 42): smaller than the box unless
    // an angle is sharp.
    vec2 outward[3];
    float offset[3];
    bool good = true;
    for (int i = 0; i < 3; i++) {
        vec2 edge = p[(i + 1) % 3] - p[i];
        float l = length(edge);
        good = good && l > 1e-3;
        outward[i] = vec2(edge.y, -edge.x) / max(l, 1e-20);
        offset[i] = dot(outward[i], p[i]) + support(outward[i]);
    }
    vec2 corner[4];
    for (int i = 0; i < 3; i++) {
        int j = (i + 2) % 3;
        float det = cross2(outward[j], outward[i]);
        good = good && det > 1e-2;
        corner[i] = vec2(offset[j] * outward[i].y - offset[i] * outward[j].y,
                        offset[i] * outward[j].x - offset[j] * outward[i].x)
            / max(det, 1e-20);
    }
    float triangle_area = 0.5 * cross2(corner[1] - corner[0], corner[2] - corner[0]);
    if (good && triangle_area > 0.0 && triangle_area < box_area) {
        emit(corner, 3);
    } else if (HARDWARE != 0u) {
        // One triangle around the box: with two, both would touch the pixels along their common edge.
        vec2 last = along * a0 + across * (2.0 * c1 - c0);
        emit(vec2[4](along * a0 + across * c0, along * (2.0 * a1 - a0) + across * c0, last, last), 3);
    } else {
        emit(vec2[4](along * a0 + across * c0, along * a1 + across * c0, along * a0 + across * c1,
                 along * a1 + across * c1),
            4);
    }
}
