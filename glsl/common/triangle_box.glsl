// Exact triangle/voxel test by separating axes (Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing", 2001).

// a·b and its rounding error, by Veltkamp's and Dekker's splitting, because Vulkan does not guarantee a fused
// multiply-add.
vec2 two_product(float a, float b) {
    precise float p = a * b;
    precise float ca = 4097.0 * a;
    precise float ah = ca - (ca - a);
    precise float al = a - ah;
    precise float cb = 4097.0 * b;
    precise float bh = cb - (cb - b);
    precise float bl = b - bh;
    precise float e = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    return vec2(p, e);
}

// a·b − c·d to about one unit in the last place, despite cancellation.
float difference_of_products(float a, float b, float c, float d) {
    vec2 ab = two_product(a, b);
    vec2 cd = two_product(c, d);
    precise float r = (ab.x - cd.x) + (ab.y - cd.y);
    return r;
}

// The normal of a triangle, not normalised. A plain cross product would lose the plane of a sliver: one that is 128
// voxels long and 0.01 wide is off by 0.1 voxel.
vec3 triangle_normal(vec3 a, vec3 b, vec3 c) {
    precise vec3 e = b - a;
    precise vec3 f = c - a;
    return vec3(difference_of_products(e.y, f.z, e.z, f.y), difference_of_products(e.z, f.x, e.x, f.z),
        difference_of_products(e.x, f.y, e.y, f.x));
}

// Whether the projections of v0, v1, v2 and of the unit cube about 0 on (u, v) ⟂ edge are disjoint, in one coordinate
// plane.
bool edge_separates(vec2 edge, vec2 v0, vec2 v1, vec2 v2) {
    precise vec3 p = vec3(edge.x * v0.y - edge.y * v0.x, edge.x * v1.y - edge.y * v1.x, edge.x * v2.y - edge.y * v2.x);
    float r = 0.5 * (abs(edge.x) + abs(edge.y));
    return min(p.x, min(p.y, p.z)) > r || max(p.x, max(p.y, p.z)) < -r;
}

bool edges_separate(vec3 e, vec3 v0, vec3 v1, vec3 v2) {
    return edge_separates(e.xy, v0.xy, v1.xy, v2.xy) || edge_separates(e.yz, v0.yz, v1.yz, v2.yz)
        || edge_separates(e.zx, v0.zx, v1.zx, v2.zx);
}

// Whether the triangle touches the closed unit cube about `center`; `normal` is from triangle_normal.
bool triangle_touches_voxel(vec3 a, vec3 b, vec3 c, vec3 normal, vec3 center) {
    precise vec3 v0 = a - center;
    precise vec3 v1 = b - center;
    precise vec3 v2 = c - center;
    vec3 low = min(v0, min(v1, v2));
    vec3 high = max(v0, max(v1, v2));
    if (any(greaterThan(low, vec3(0.5))) || any(lessThan(high, vec3(-0.5)))) {
        return false;
    }
    float distance = dot(normal, v0);
    float reach = 0.5 * (abs(normal.x) + abs(normal.y) + abs(normal.z));
    if (abs(distance) > reach) {
        return false;
    }
    return !(
        edges_separate(b - a, v0, v1, v2) || edges_separate(c - b, v0, v1, v2) || edges_separate(a - c, v0, v1, v2));
}
