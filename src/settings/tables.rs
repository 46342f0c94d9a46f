//! The tables that all methods share.

use super::{Center, Conservative, DirectLight, GatherResolution, LampLight, Range, Shadows, auto, names, table};

table! {
    /// Place and size of the grid.
    GridSettings as "grid" {
        center: Center = Center::Scene, in "metres", Range::Center(1e9);
        "centre of the cube that the grid fills; auto: the centre of the scene's bounds; camera: the camera, with rays, where the side is \
         given";
        "nothing; camera: lists are made anew now and then while it moves";
        #[serde(with = "auto")]
        side: Option<f64> = None, in "metres", Range::NumberOrAuto(1e-6, 1e9);
        "side of that cube; auto: the scene's longest side plus the margin. What is outside sends no light, but with rays: there voxels are \
         four times as large in the next cube, and so on, five times at most";
        "nothing; larger: coarser voxels";
        // Not a whole number, so that the walls of box-shaped scenes do not lie on voxel boundaries.
        margin: f64 = 2.5, in "voxels" rare, Range::Number(0.0, 7.0);
        "empty border when the side is auto";
        "coarser voxels";
        conservative: Conservative = Conservative::Compute, in "choice" rare, names!(Conservative);
        "how triangles are recorded and every voxel that one touches is found: by compute passes, by the talk's geometry shaders, or by \
         these and VK_EXT_conservative_rasterization, where a device has it: the same lists";
        "geometry-shader: lists take as long (a box) to 4.7 times as long (small triangles); hardware has not been run yet";
    }

    /// Direct light and its shadows.
    LightSettings as "lights" {
        shadows: Shadows = Shadows::Rays, in "choice", names!(Shadows);
        "how lights are shadowed: not at all, by the method (the talk's shadow cones), or by exact rays";
        "a ray or a cone per light, pixel and shaded voxel side";
        // With `shadows = rays`; one ray goes to the light's middle.
        shadow_rays: u32 = 4, in "rays", Range::Whole(1, 64);
        "shadow rays to each light with a radius: 1 gives hard shadows, more give penumbrae, with noise only there";
        "a ray each per pixel and voxel side, where a light has a radius; at least one per sample";
        lamps: LampLight = LampLight::Sampled, in "choice", names!(LampLight);
        "how emissive surfaces light the scene: gathered by the method alone, or sampled as area lights with exact shadows";
        "sampled: lamp_points rays per pixel, voxel_lamp_points per voxel side";
        lamp_points: u32 = 8, in "points", Range::Whole(1, 256);
        "points on lamps per pixel; noise only in penumbrae, and where there are more lamps than points";
        "a ray each";
        voxel_lamp_points: u32 = 4, in "points" rare, Range::Whole(1, 256);
        "points on lamps per voxel side";
        "a ray each";
    }

    /// The final image.
    ImageSettings as "image" {
        samples: u32 = 4, in "samples per pixel", Range::OneOf(&[1, 4]);
        "samples for the edges of surfaces; indirect light is found once per pixel and surface";
        "4: colour and depth ×4 in memory, direct light up to ×4";
        direct: DirectLight = DirectLight::Samples, in "choice", names!(DirectLight);
        "where direct light and its shadows are computed: at every sample, so that edges of shadows are as smooth as those of surfaces, or once per pixel and surface";
        "samples: image.samples shadow rays per pixel and light; frames take 1.05 (atrium) to 1.9 (a box) times as long";
        gather_resolution: GatherResolution = GatherResolution::Half, in "choice", names!(GatherResolution);
        "where diffuse light is gathered: at every pixel, or at every second or fourth, upsampled by depth and normals";
        "half: a quarter of the gathers";
        interleave: u32 = 4, in "pixels", Range::OneOf(&[1, 2, 4]);
        "side of the square in which every gathered pixel (or voxel) has its own directions; neighbours share results \
         where depth and normals agree";
        "a filter of (n + 1)² texels; fewer directions per pixel give the same light";
        passes: u32 = 1, in "passes", Range::Whole(1, 4096);
        "passes over the image, each along other rays and moved within a pixel, whose mean is shown; with bounces = all they come ever nearer to the truth, and render says how near";
        "a gather and an image each; lists and the voxels' light are made once";
    }
}

impl ImageSettings {
    /// Whether diffuse light is gathered apart from the image.
    pub fn gathers_apart(&self) -> bool {
        self.gather_resolution.scale() > 1 || self.interleave > 1
    }
}
