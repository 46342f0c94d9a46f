// Of the image and its further layers.
//! fragment
//! with AOVS

layout(location = 0) out vec4 out_beauty;
#ifdef AOVS
layout(location = 1) out vec4 out_direct;
layout(location = 2) out vec4 out_indirect;
layout(location = 3) out vec4 out_normal;
layout(location = 4) out vec4 out_albedo;
layout(location = 5) out vec4 out_ao_depth_diffuse;
#endif
