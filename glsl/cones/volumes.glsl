// The seven faces of a volume: what a cone sees that travels along +x +y +z −x −y −z, and the isotropic average.
layout(set = 0, binding = 12) uniform sampler3D volume_0;
layout(set = 0, binding = 13) uniform sampler3D volume_1;
layout(set = 0, binding = 14) uniform sampler3D volume_2;
layout(set = 0, binding = 15) uniform sampler3D volume_3;
layout(set = 0, binding = 16) uniform sampler3D volume_4;
layout(set = 0, binding = 17) uniform sampler3D volume_5;
layout(set = 0, binding = 18) uniform sampler3D volume_6;
