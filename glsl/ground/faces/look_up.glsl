// The seven values of a volume: light along rays that travel along +x +y +z −x −y −z, and the isotropic average.

#include "common/count.glsl"
#include "ground/constants.glsl"

uniform sampler3D volume_0;
uniform sampler3D volume_1;
uniform sampler3D volume_2;
uniform sampler3D volume_3;
uniform sampler3D volume_4;
uniform sampler3D volume_5;
uniform sampler3D volume_6;

// The three faces that are visible along a direction.
struct Faces {
    vec4 x;
    vec4 y;
    vec4 z;
};

// `at` is in voxels; `level` 0 is the finest.
Faces look_up_faces(vec3 at, vec3 d, float level) {
    COUNT(VOLUME_TEXELS, 3u * trilinear_texels(level));
    vec3 uvw = at / float(EDGE);
    return Faces(d.x < 0.0 ? textureLod(volume_3, uvw, level) : textureLod(volume_0, uvw, level),
        d.y < 0.0 ? textureLod(volume_4, uvw, level) : textureLod(volume_1, uvw, level),
        d.z < 0.0 ? textureLod(volume_5, uvw, level) : textureLod(volume_2, uvw, level));
}

vec4 mix_faces(Faces f, vec3 weights) {
    return f.x * weights.x + f.y * weights.y + f.z * weights.z;
}
