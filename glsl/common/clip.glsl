// A triangle clipped to a voxel (Sutherland and Hodgman), for the coverage fill.

const int MAX_CORNERS = 9; // 3 + one for each of the six planes

// Area (voxel² ) and middle of the part of the triangle inside the unit cube about `center`.
// Where nothing is left (a touching triangle), the area is 0 and the middle the corner nearest to the cube.
void clip_to_voxel(vec3 a, vec3 b, vec3 c, vec3 center, out float area, out vec3 middle) {
    vec3 corners[MAX_CORNERS];
    vec3 kept[MAX_CORNERS];
    int count = 3;
    corners[0] = a - center;
    corners[1] = b - center;
    corners[2] = c - center;
    middle = center + clamp((corners[0] + corners[1] + corners[2]) / 3.0, vec3(-0.5), vec3(0.5));
    area = 0.0;
    for (int plane = 0; plane < 6; plane++) {
        int axis = plane >> 1;
        float side = (plane & 1) == 0 ? 1.0 : -1.0;
        int left = 0;
        for (int i = 0; i < count; i++) {
            vec3 p = corners[i];
            vec3 q = corners[i + 1 == count ? 0 : i + 1];
            float dp = 0.5 - side * p[axis];
            float dq = 0.5 - side * q[axis];
            if (dp >= 0.0 && left < MAX_CORNERS) {
                kept[left++] = p;
            }
            if ((dp >= 0.0) != (dq >= 0.0) && left < MAX_CORNERS) {
                kept[left++] = mix(p, q, dp / (dp - dq));
            }
        }
        count = left;
        for (int i = 0; i < count; i++) {
            corners[i] = kept[i];
        }
    }
    vec3 weighted = vec3(0.0);
    for (int i = 1; i + 1 < count; i++) {
        float part = 0.5 * length(cross(corners[i] - corners[0], corners[i + 1] - corners[0]));
        area += part;
        weighted += part * (corners[0] + corners[i] + corners[i + 1]) / 3.0;
    }
    if (area > 0.0) {
        middle = center + weighted / area;
    }
}
