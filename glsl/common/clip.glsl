// The part of a triangle inside a voxel, for the coverage fill: its area and centroid, without constructing the
// polygon.
//
// The area of a polygon is half the sum of p × q over the segments of its boundary. The boundary of triangle ∩ cube
// consists of the triangle's edges, clipped to the cube, and of one chord per face of the cube that the triangle
// crosses, clipped to that face. No list of corners is needed, which lavapipe would keep in memory: this is 20 times
// faster there than Sutherland and Hodgman's clipping. Ties follow their rule (a point on a face is inside).

struct Clipped {
    vec3 normal; // unit
    vec3 foot; // foot of the perpendicular from the cube's centre to the triangle's plane
    float area;
    vec3 weighted; // area × centroid
};

// Clips the range of t in the segment p + t·d to |coordinate| ≤ ½; a segment within a face's plane is inside.
void clip_slab(float p, float d, bool face_is_inside, inout vec2 range) {
    vec2 t = (vec2(-0.5, 0.5) - p) / d;
    vec2 parallel = abs(p) < 0.5 || (face_is_inside && abs(p) == 0.5) ? range : vec2(1.0, 0.0);
    range = d == 0.0 ? parallel : vec2(max(range.x, min(t.x, t.y)), min(range.y, max(t.x, t.y)));
}

void add_segment(inout Clipped sum, vec3 p, vec3 d, vec2 range) {
    if (range.x < range.y) {
        vec3 from = p + d * range.x;
        vec3 to = p + d * range.y;
        float part = 0.5 * dot(sum.normal, cross(from - sum.foot, to - sum.foot));
        sum.area += part;
        sum.weighted += part * (sum.foot + from + to) / 3.0;
    }
}

// The range of t in which the edge p + t·d is inside; empty if x ≥ y.
vec2 edge_range(vec3 p, vec3 d) {
    vec2 range = vec2(0.0, 1.0);
    clip_slab(p.x, d.x, true, range);
    clip_slab(p.y, d.y, true, range);
    clip_slab(p.z, d.z, true, range);
    return range;
}

void add_edge(inout Clipped sum, vec3 p, vec3 q) {
    add_segment(sum, p, q - p, edge_range(p, q - p));
}

// The crossing of the edge p q with a face's plane; `dp` and `dq` are distances, ≥ 0 inside. The chord runs from the
// point where the boundary leaves to the point where it returns.
// triangle's boundary leaves to where it comes back.
void cross_face(vec3 p, vec3 q, float dp, float dq, inout vec3 leaves, inout vec3 enters, inout bool crosses) {
    vec3 at = mix(p, q, dp / (dp - dq));
    if (dp >= 0.0 && dq < 0.0) {
        leaves = at;
        crosses = true;
    }
    if (dp < 0.0 && dq >= 0.0) {
        enters = at;
    }
}

// Whether the triangle lies in a plane perpendicular to that axis.
bool lies_across(vec3 a, vec3 b, vec3 c, int axis) {
    return a[axis] == b[axis] && b[axis] == c[axis];
}

// The chord on the face with `axis`'s coordinate `side` · ½: leaves + t·d, and the range of t inside the cube.
vec2 chord_range(vec3 a, vec3 b, vec3 c, int axis, float side, out vec3 leaves, out vec3 d) {
    vec3 distance = 0.5 - side * vec3(a[axis], b[axis], c[axis]);
    leaves = vec3(0.0);
    vec3 enters = vec3(0.0);
    bool crosses = false;
    cross_face(a, b, distance.x, distance.y, leaves, enters, crosses);
    cross_face(b, c, distance.y, distance.z, leaves, enters, crosses);
    cross_face(c, a, distance.z, distance.x, leaves, enters, crosses);
    d = enters - leaves;
    vec2 range = vec2(0.0, crosses ? 1.0 : 0.0);
    // A chord along an edge of the cube counts for only one of the two faces: the one that does not contain the
    // triangle.
    int u = (axis + 1) % 3;
    int v = (axis + 2) % 3;
    clip_slab(leaves[u], d[u], axis < u || lies_across(a, b, c, u), range);
    clip_slab(leaves[v], d[v], axis < v || lies_across(a, b, c, v), range);
    return range;
}

void add_chord(inout Clipped sum, vec3 a, vec3 b, vec3 c, int axis, float side) {
    vec3 leaves;
    vec3 d;
    vec2 range = chord_range(a, b, c, axis, side, leaves, d);
    add_segment(sum, leaves, d, range);
}

const int PART_CORNERS = 9; // one per segment: each begins at a corner

// Corner k of the part of the triangle inside the unit cube about the origin; false if the segment has none.
bool part_corner(int k, vec3 a, vec3 b, vec3 c, out vec3 corner) {
    vec3 from = k == 0 ? a : k == 1 ? b : c;
    vec3 d = (k == 0 ? b : k == 1 ? c : a) - from;
    vec2 range;
    if (k < 3) {
        range = edge_range(from, d);
    } else {
        range = chord_range(a, b, c, (k - 3) / 2, (k & 1) == 1 ? 1.0 : -1.0, from, d);
    }
    corner = from + range.x * d;
    return range.x < range.y;
}

// Area (voxel²) and centroid of the part of the triangle inside the unit cube about `center`. For a triangle that only
// touches the cube, the area is 0 and the centroid is the corner nearest to the cube. A triangle in a face's plane
// belongs to two voxels, and each gets half of its area.
void clip_to_voxel(vec3 a, vec3 b, vec3 c, vec3 center, out float area, out vec3 middle) {
    a -= center;
    b -= center;
    c -= center;
    vec3 n = cross(b - a, c - a);
    float twice_area = length(n);
    vec3 normal = twice_area > 0.0 ? n / twice_area : vec3(0.0);
    Clipped sum = Clipped(normal, normal * dot(normal, a), 0.0, vec3(0.0));
    add_edge(sum, a, b);
    add_edge(sum, b, c);
    add_edge(sum, c, a);
    add_chord(sum, a, b, c, 0, 1.0);
    add_chord(sum, a, b, c, 0, -1.0);
    add_chord(sum, a, b, c, 1, 1.0);
    add_chord(sum, a, b, c, 1, -1.0);
    add_chord(sum, a, b, c, 2, 1.0);
    add_chord(sum, a, b, c, 2, -1.0);
    bool shared_face = false;
    for (int axis = 0; axis < 3; axis++) {
        shared_face = shared_face || (lies_across(a, b, c, axis) && abs(a[axis]) == 0.5);
    }
    area = max(sum.area, 0.0) * (shared_face ? 0.5 : 1.0);
    middle = center + clamp(area > 1e-12 ? sum.weighted / sum.area : (a + b + c) / 3.0, vec3(-0.5), vec3(0.5));
}
