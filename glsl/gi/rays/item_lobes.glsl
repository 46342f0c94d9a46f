// The lobe that a lit item sends of direct light.

layout(set = 0, binding = 57, scalar) buffer ItemLobes { uvec4 item_lobes[]; }; // per list item and side

// Stored radiance towards o of a surface with normal n.
vec3 lobe_light(uvec4 packed, vec3 n, vec3 o) {
    vec2 rg = unpackHalf2x16(packed.x);
    vec2 b90 = unpackHalf2x16(packed.y);
    vec2 xy = unpackHalf2x16(packed.z);
    vec2 za = unpackHalf2x16(packed.w);
    vec3 l = vec3(xy, za.x);
    float nl = max(dot(n, l), 1e-3);
    float nv = max(dot(n, o), 1e-3);
    vec3 h = normalize(l + o);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    float vh = clamp(dot(o, h), 0.0, 1.0);
    float a2 = za.y * za.y;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float smith = nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2);
    float lobe = a2 / (3.14159265 * d * d) * 0.5 / max(smith, 1e-7);
    float m = 1.0 - vh;
    float m5 = m * m * m * m * m;
    vec3 f0 = vec3(rg, b90.x);
    return (f0 + (vec3(b90.y) - f0) * m5) * lobe;
}
