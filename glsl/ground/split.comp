#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Split: if an opaque surface cuts an item's part of its triangle, each side of the cut sees different light. Such an
// item gets a twin: each is lit at a point that the other cannot see, and a ray takes the one that sees its hit point.
// A thread per lit item. With light on demand, a twin is requested with its item. Compared with brute force in
// tests/device/rays_items.rs.
#include "ground/constants.glsl"
#include "ground/cells.glsl"
#include "common/clip.glsl"
#include "common/count.glsl"
#include "common/dominant_axis.glsl"
#include "common/triangle_box.glsl"
#include "ground/on_plane.glsl"

const int ROW = 4;
const int GRID = ROW * ROW; // points of a part, spread evenly over its voxel
const float APART = 0.3; // distance between them in voxels
// The candidates include the part's corners, slightly moved inward: a straight cut leaves a corner on either side,
// however narrow the piece is.
const int CANDIDATES = GRID + PART_CORNERS;
const float TO_CORNER = 0.98; // as a share of the way from the centroid

vec2 candidates_at[CANDIDATES]; // voxels from the voxel's middle along the two axes after the dominant one

#include "ground/frame.glsl"
layout(scalar) buffer GlobalsBuffer { Globals globals; };
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer Heads { uint heads[]; };
layout(scalar) readonly buffer Materials { Material materials[]; };
layout(scalar) buffer ItemParts { ItemPart item_parts[]; };
layout(scalar) buffer LitItems { uint lit_items[]; };

#include "ground/ask.glsl"

#include "ground/boxes.glsl"

// Positions are in voxels of its box.
struct Part {
    uint item;
    uint voxel;
    Box box;
    float start; // offset of rays from its plane
    vec3 a, b, c;
    vec3 n; // unit
    uint axis; // its dominant one
    vec3 center;
    bool two_sided;
};

vec3 candidate(Part part, int k) {
    return on_plane(part.a, part.n, part.center, candidates_at[k]);
}

// The positions of candidates, and a bit for each that lies within the part.
uint place_candidates(Part part, vec3 middle) {
    uint inside = 0u;
    for (int k = 0; k < GRID; k++) {
        candidates_at[k] = APART * (vec2(k % ROW, k / ROW) - 0.5 * float(ROW - 1));
        inside |= in_part(part.a, part.b, part.c, part.n, part.center, candidate(part, k)) ? 1u << k : 0u;
    }
    for (int k = GRID; k < CANDIDATES; k++) {
        vec3 corner;
        bool any = part_corner(k - GRID, part.a - part.center, part.b - part.center, part.c - part.center, corner);
        vec3 at = mix(middle - part.center, corner, TO_CORNER);
        candidates_at[k] = across(at, part.axis);
        inside |= any ? 1u << k : 0u;
    }
    return inside;
}

// The intersection of triangle abc with a plane, from the heights of its corners above the plane.
bool section(vec3 heights, vec3 a, vec3 b, vec3 c, out vec3 p, out vec3 q) {
    bvec3 above = greaterThanEqual(heights, vec3(0.0));
    // The corner that is alone on its side, and the other two.
    bool a_alone = above.y == above.z;
    bool b_alone = above.x == above.z;
    vec3 own = a_alone ? a : b_alone ? b : c;
    vec3 left = a_alone ? b : b_alone ? c : a;
    vec3 right = a_alone ? c : b_alone ? a : b;
    vec3 h = a_alone ? heights : b_alone ? heights.yzx : heights.zxy;
    p = mix(own, left, h.x / (h.x - h.y));
    q = mix(own, right, h.x / (h.x - h.z));
    return !(all(above) || !any(above));
}

// The candidates, a bit each, that triangle abc hides from a point of the part. Seen along the dominant axis, the
// segment from the point to the candidate crosses the intersection of the triangle with the plane of such segments.
uint hidden_by(Part part, vec2 from, vec3 a, vec3 b, vec3 c) {
    vec3 heights = vec3(dot(part.n, a - part.a), dot(part.n, b - part.a), dot(part.n, c - part.a));
    uint hidden = 0u;
    for (float side = part.two_sided ? -1.0 : 1.0; side <= 1.0; side += 2.0) {
        vec3 p3;
        vec3 q3;
        bool meets = section(heights - side * part.start, a, b, c, p3, q3);
        vec3 off = part.center + side * part.start * part.n;
        vec2 p = across(p3 - off, part.axis);
        vec2 along = across(q3 - off, part.axis) - p;
        // A small tolerance keeps light from passing between two triangles with a common edge.
        p -= 1e-5 * along;
        along *= 1.00002;
        vec2 q = p + along;
        // All segments lie within the voxel.
        meets = meets && all(lessThan(min(p, q), vec2(0.51))) && all(greaterThan(max(p, q), vec2(-0.51)));
        float here = cross2(along, from - p);
        for (int k = 0; k < (meets ? CANDIDATES : 0); k++) {
            vec2 way = candidates_at[k] - from;
            float there = cross2(along, candidates_at[k] - p);
            bool cuts = here * there < 0.0 && cross2(way, p - from) * cross2(way, q - from) <= 0.0;
            hidden |= cuts ? 1u << k : 0u;
        }
    }
    return hidden;
}

// The candidates, a bit each, that are invisible from a point of the part on all lit sides.
uint hidden_from(Part part, vec2 from, uint candidates) {
    uint hidden = 0u;
    uint item = heads[part.voxel];
    COUNT(HEADS, 1u);
    for (uint i = 0u; i < globals.item_count && item != 0u; i++) {
        ListItem entry = list_items[item - 1u];
        bool itself = item_parts[item - 1u].lit_by == part.item;
        item = entry.next;
        uint material = triangles[entry.triangle].material;
        // Intersecting leaves would cut each other into more than two parts, and most of the visible ones would be
        // dark.
        bool opaque = is_opaque(materials[material].flags, materials[material].transmission);
        COUNT(LIST_ITEMS, 1u);
        COUNT(CORNERS, 3u);
        COUNT(WORDS, 4u);
        if (opaque && !itself) {
            mat3 corners = mat3(triangles[entry.triangle].corners[0], triangles[entry.triangle].corners[1],
                triangles[entry.triangle].corners[2]);
            corners = in_box(part.box, corners);
            hidden |= hidden_by(part, from, corners[0], corners[1], corners[2]);
        }
    }
    return hidden & candidates;
}

// The point in the nonempty mask that is farthest from `from`.
int farthest(Part part, vec3 from, uint points) {
    int best = -1;
    float most = -1.0;
    for (int k = 0; k < CANDIDATES; k++) {
        vec3 way = candidate(part, k) - from;
        float square = dot(way, way);
        bool better = (points & 1u << k) != 0u && square > most;
        best = better ? k : best;
        most = better ? square : most;
    }
    return best;
}

void split(Part part, vec3 middle) {
    uint inside = place_candidates(part, middle);
    vec2 off = across(middle - part.center, part.axis);
    uint hidden = hidden_from(part, off, inside);
    if (hidden == 0u) {
        return;
    }
    // The distance of neighbouring candidates: points between may be within a wall.
    int there = farthest(part, middle, hidden);
    uint beyond = hidden_from(part, candidates_at[there], inside);
    vec2 here = beyond == 0u ? off : candidates_at[farthest(part, candidate(part, there), beyond)];
    uint twin = atomicAdd(globals.item_count, 1u);
    if (twin >= uint(list_items.length())) {
        atomicAdd(globals.item_overflow, 1u);
        return;
    }
    ItemPart own = item_parts[part.item];
    item_parts[part.item].twin = twin + 1u;
    item_parts[part.item].anchor = packUnorm2x16(here + 0.5);
    item_parts[twin] =
        ItemPart(part.item, own.area, own.source, 0u, twin + 1u, packUnorm2x16(candidates_at[there] + 0.5));
    list_items[twin] = ListItem(list_items[part.item].triangle, 0u, part.voxel);
    if (DEMAND == 0u) {
        lit_items[take_place(LIT_COUNTS)] = twin;
    }
}

// Splits a lit item if something cuts its part.
void consider(uint item) {
    ListItem entry = list_items[item];
    Triangle t = triangles[entry.triangle];
    COUNT(LIST_ITEMS, 1u);
    COUNT(CORNERS, 3u);
    COUNT(MATERIALS, 1u);
    Part part;
    part.item = item;
    part.voxel = entry.voxel;
    part.box = box_of(part.voxel);
    part.start = ray_start_in(part.box) * part.box.scale;
    part.a = in_box(part.box, t.corners[0]);
    part.b = in_box(part.box, t.corners[1]);
    part.c = in_box(part.box, t.corners[2]);
    part.n = normalize(triangle_normal(part.a, part.b, part.c));
    part.axis = dominant_axis(part.n);
    part.center = vec3(cell_in(part.box, part.voxel)) + 0.5;
    part.two_sided = (materials[t.material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    float area;
    vec3 middle;
    clip_to_voxel(part.a, part.b, part.c, part.center, area, middle);
    if (area > 0.0) {
        split(part, middle);
    }
}

void main() {
    uint count = cell_counts[CHOSEN_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint item = lit_items[i];
        COUNT(WORDS, 2u);
        bool is_new = DEMAND == 0u || (asked_items[item] & ASKED_SPLIT) == 0u;
        if (item_parts[item].alone == 0u && item_parts[item].twin == 0u && is_new) {
            consider(item);
        }
        if (DEMAND != 0u) {
            atomicOr(asked_items[item], ASKED_SPLIT);
            uint twin = item_parts[item].twin;
            ask(twin == 0u ? item : twin - 1u, asked_items[item] & (ASKED_FIRST | ASKED_SECOND));
        }
    }
}
