// The transform and data of a recorded mesh. The shaders of a raster define DRAWN and receive it as push constants;
// others set it.
//! with DRAWN

struct RecordDraw {
    vec4 rows[3]; // voxel_from_object
    vec3 normal_rows[3]; // its inverse transpose
    uint material;
    uint first_source;
    uint mirrored;
    uint translucent;
    uint first_index;
    int vertex_offset;
    uint triangles; // of the mesh
};

#ifdef DRAWN
layout(push_constant, scalar) uniform Push {
    RecordDraw draw;
};
#else
RecordDraw draw;
#endif

struct Corner {
    vec3 position;
    vec3 normal;
    vec4 tangent;
    vec4 uv; // set 0, set 1
    vec4 color;
};

vec3 unit(vec3 v) {
    float l = length(v);
    return l > 0.0 ? v / l : v;
}

vec3 in_voxels(vec3 position) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(draw.rows[0], p), dot(draw.rows[1], p), dot(draw.rows[2], p));
}

// The transform from object space to voxels.
Corner in_voxels(Corner corner) {
    vec3 n = corner.normal;
    vec3 t = corner.tangent.xyz;
    corner.position = in_voxels(corner.position);
    corner.normal = unit(vec3(dot(draw.normal_rows[0], n), dot(draw.normal_rows[1], n), dot(draw.normal_rows[2], n)));
    corner.tangent.xyz = unit(vec3(dot(draw.rows[0].xyz, t), dot(draw.rows[1].xyz, t), dot(draw.rows[2].xyz, t)));
    return corner;
}
