//! The tables of settings that all methods share.

use super::{Center, Conservative, DirectLight, GatherResolution, LampLight, Range, Shadows, auto, names, table};

table! {
    /// Place and size of the grid.
    GridSettings as "grid" {
        center: Center = Center::Scene, in "metres", Range::Center(1e9);
        "centre of the grid's cube; auto: the centre of the scene; camera: follows the camera (method rays with grid.side)";
        "no time; camera: lists are rebuilt from time to time while it moves";
        #[serde(with = "auto")]
        side: Option<f64> = None, in "metres", Range::NumberOrAuto(1e-6, 1e9);
        "side of the grid's cube; auto: the longest side of the scene plus the margin. Surfaces outside reflect no light, except with rays, which add larger cubes";
        "no time cost; a larger cube means larger voxels";
        // The margin is not a whole number, so that the walls of box-shaped scenes do not lie on voxel boundaries.
        margin: f64 = 2.5, in "voxels" rare, Range::Number(0.0, 7.0);
        "empty border if the side is auto";
        "coarser voxels";
        conservative: Conservative = Conservative::Compute, in "choice" rare, names!(Conservative);
        "voxelisation: compute passes, the talk's geometry shaders, or VK_EXT_conservative_rasterization; the lists are the same";
        "geometry-shader: lists take as long (a box) to 4.7 times as long (small triangles); hardware has not been run yet";
    }

    /// Direct light and its shadows.
    LightSettings as "lights" {
        shadows: Shadows = Shadows::Rays, in "choice", names!(Shadows);
        "shadows of lights: none, by the method (the talk's shadow cones), or by exact rays";
        "a ray or a cone per light, pixel and shaded voxel side";
        // This has an effect with `shadows = rays`; the single ray goes to the light's middle.
        shadow_rays: u32 = 4, in "rays", Range::Whole(1, 64);
        "shadow rays to each light with a radius: 1 gives hard shadows, more give noisy penumbrae";
        "a ray per pixel and voxel side; at least one per sample";
        lamps: LampLight = LampLight::Sampled, in "choice", names!(LampLight);
        "light of emissive surfaces: gathered by the method, or sampled as area lights with exact shadows";
        "sampled: lamp_points rays per pixel, voxel_lamp_points per voxel side";
        lamp_points: u32 = 8, in "points", Range::Whole(1, 256);
        "sampled points on lamps per pixel; noise in penumbrae, and with more lamps than points";
        "a ray each";
        voxel_lamp_points: u32 = 4, in "points" rare, Range::Whole(1, 256);
        "sampled points on lamps per voxel side";
        "a ray each";
    }

    /// The final image.
    ImageSettings as "image" {
        samples: u32 = 4, in "samples per pixel", Range::OneOf(&[1, 4]);
        "samples for edges of surfaces; indirect light is evaluated once per pixel and surface";
        "4: colour and depth ×4 in memory, direct light up to ×4";
        direct: DirectLight = DirectLight::Samples, in "choice", names!(DirectLight);
        "direct light per sample, with smooth edges of shadows, or once per pixel and surface";
        "samples: image.samples shadow rays per pixel and light; frames take 1.05 (atrium) to 1.9 (a box) times as long";
        gather_resolution: GatherResolution = GatherResolution::Half, in "choice", names!(GatherResolution);
        "resolution of gathered diffuse light: every pixel, or every second or fourth, upsampled by depth and normals";
        "half: a quarter of the gathers";
        interleave: u32 = 4, in "pixels", Range::OneOf(&[1, 2, 4]);
        "side of the square of gathered pixels (or voxels) with different directions; neighbours share results where depth and normals agree";
        "a filter of (n + 1)² texels; fewer directions per pixel give the same light";
        passes: u32 = 1, in "passes", Range::Whole(1, 4096);
        "passes with other rays and subpixel offsets, which are averaged";
        "a gather and an image pass each; lists and the light of voxels are made once";
    }
}

impl ImageSettings {
    /// Whether diffuse light is gathered in a pass before the image.
    pub fn gathers_apart(&self) -> bool {
        self.gather_resolution.scale() > 1 || self.interleave > 1
    }
}
