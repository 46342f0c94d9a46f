//! A scene as plain data in SI units: metres, right-handed, +Y up, linear Rec. 709 (glTF's conventions).
//!
//! [`Scene`] is independent of time; [`Scene::pose`] gives the transforms at a time. The renderer and the reference
//! take both. World positions are f64, so that a scene 10⁷ m from the origin keeps its precision.

#[cfg_attr(not(internals), doc(hidden))]
pub mod analytic;
mod animation;
mod bounds;
mod builder;
mod camera;
mod check;
pub mod deform;
pub mod finish;
mod gltf;
mod lights;
#[cfg_attr(not(internals), doc(hidden))]
pub mod sheen;
pub mod sky;
mod studio;
#[cfg_attr(not(internals), doc(hidden))]
pub mod surface;
#[cfg_attr(not(internals), doc(hidden))]
pub mod texture;
pub(crate) mod ties;

#[cfg_attr(not(internals), doc(hidden))]
pub use camera::DEFAULT_FOV_DEGREES;
pub use gltf::LoadOptions;

use std::sync::Arc;

use glam::{Affine2, DAffine3, DVec3, Vec2, Vec3, Vec4};

/// The content of one file.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The name of the file without its extension, or a name given in code.
    pub name: String,
    /// Meshes, one per glTF primitive.
    pub meshes: Vec<Mesh>,
    /// Materials; index 0 is always glTF's default material.
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<TextureImage>,
    /// The node tree, parents before children.
    pub nodes: Vec<Node>,
    pub animations: Vec<Animation>,
    /// Skins and morph targets that deform meshes.
    pub deformers: Vec<deform::Deformer>,
    /// Instances of meshes. They refer to nodes, like lights and cameras.
    pub instances: Vec<Instance>,
    pub lights: Vec<Light>,
    pub cameras: Vec<Camera>,
    /// Radiance of the sky, averaged over all directions. The sky is visible and lights the scene.
    pub sky: Vec3,
    /// The radiance that is added to the sky straight up (+Y) and subtracted straight down, at most [`Self::sky`]; 0 at
    /// the horizon.
    pub sky_gradient: Vec3,
    /// Radiance of the sky for each direction, with the mean [`Self::sky`]. [`Scene::set_sky_map`] sets both.
    pub sky_map: Option<Arc<sky::SkyMap>>,
    /// Counter-clockwise rotation of the map, seen from above, in whole turns.
    pub sky_turn: f32,
    /// Whether pixels without a surface are transparent instead of showing the sky. The sky lights the scene in both
    /// cases.
    pub sky_unseen: bool,
    /// Hash of all bytes of the file, its buffers and its images, in hexadecimal.
    pub hash: String,
    /// One sentence for everything that the loader ignored or simplified.
    pub warnings: Vec<String>,
}

/// Triangles of one material, in object space. All vertex arrays have the same length.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub name: String,
    pub positions: Vec<Vec3>,
    /// Unit length; flat normals if the file has none.
    pub normals: Vec<Vec3>,
    /// Unit length, w = ±1: the sign of the bitangent. (1,0,0,1) without a normal map.
    pub tangents: Vec<Vec4>,
    /// Two sets; zeros if absent.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear; (1,1,1,1) if absent.
    pub colors: Vec<Vec4>,
    /// 3 per triangle.
    pub indices: Vec<u32>,
    pub material: usize,
    /// Skin and morph targets that move vertices; the attributes above are those of the rest pose.
    pub deform: Option<Arc<deform::Deform>>,
}

/// glTF 2.0 metallic-roughness with the supported KHR extensions. Factors are linear.
#[derive(Clone, Debug)]
pub struct Material {
    pub name: String,
    pub base_color: Vec4,
    /// sRGB.
    pub base_color_texture: Option<TextureRef>,
    pub metallic: f32,
    pub roughness: f32,
    /// Linear: G roughness, B metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    pub normal_texture: Option<TextureRef>,
    pub normal_scale: f32,
    pub occlusion_texture: Option<TextureRef>,
    pub occlusion_strength: f32,
    /// Radiance: emissiveFactor × KHR_materials_emissive_strength.
    pub emissive: Vec3,
    /// sRGB.
    pub emissive_texture: Option<TextureRef>,
    pub alpha: Alpha,
    /// A double-sided triangle is two surfaces, each lit from its own side.
    pub double_sided: bool,
    /// KHR_materials_unlit: shows the base colour, is not lit and emits no light onto others.
    pub unlit: bool,
    pub ior: f32,
    pub specular: f32,
    /// Linear: A.
    pub specular_texture: Option<TextureRef>,
    pub specular_color: Vec3,
    /// sRGB.
    pub specular_color_texture: Option<TextureRef>,
    pub transmission: f32,
    /// Linear: R.
    pub transmission_texture: Option<TextureRef>,
    /// Metres in object space; 0 is thin-walled: transmission is not refracted.
    pub thickness: f32,
    /// Linear: G.
    pub thickness_texture: Option<TextureRef>,
    pub attenuation_color: Vec3,
    /// Metres; infinite without attenuation.
    pub attenuation_distance: f32,
    /// Clearcoat, sheen and other optional parts.
    pub finish: Option<Box<finish::Finish>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    Opaque,
    /// Alpha below the cutoff is a hole.
    Mask(f32),
    Blend,
}

impl Default for Material {
    /// glTF's default material: white, metallic 1, roughness 1.
    fn default() -> Self {
        Self {
            name: "default".into(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha: Alpha::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            thickness: 0.0,
            thickness_texture: None,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            finish: None,
        }
    }
}

/// A texture slot of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// 0 or 1, with the override of KHR_texture_transform.
    pub uv_set: usize,
    /// KHR_texture_transform; the identity if absent.
    pub transform: Affine2,
}

/// An image and its sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: usize,
    pub wrap: [Wrap; 2],
    /// Bilinear filter for magnification, else nearest texel.
    pub mag_linear: bool,
    /// Bilinear filter for minification, else nearest texel.
    pub min_linear: bool,
    pub mip: Mip,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

/// How minification uses mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mip {
    /// Level 0 only.
    None,
    Nearest,
    Linear,
}

/// 8-bit RGBA, rows from the top, as stored. The material slot decides between sRGB and linear.
#[derive(Clone, Debug, Default)]
pub struct TextureImage {
    pub name: String,
    pub width: u32,
    pub height: u32,
    /// 4 · width · height bytes.
    pub rgba: Vec<u8>,
}

#[derive(Clone, Debug)]
pub struct Node {
    pub name: String,
    /// Index into [`Scene::nodes`], less than the node's own index.
    pub parent: Option<usize>,
    pub local: Transform,
}

/// A node's own transform; `Matrix` only for nodes that are not animated.
#[derive(Clone, Copy, Debug)]
pub enum Transform {
    Matrix(DAffine3),
    Trs { translation: DVec3, rotation: glam::DQuat, scale: DVec3 },
}

/// A mesh at a node.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    pub mesh: usize,
    pub node: usize,
}

#[derive(Clone, Debug)]
pub struct Light {
    pub name: String,
    pub node: usize,
    pub kind: LightKind,
    /// Colour × intensity. Point and spot: irradiance × m² (I/d²); directional: irradiance.
    pub intensity: Vec3,
    /// Metres; infinite if the file gives none. The intensity is multiplied by glTF's window max(min(1 − (d/range)⁴,
    /// 1), 0).
    pub range: f32,
    /// Radius of the light for soft shadows, metres (`extras.radius`); 0 gives hard shadows. Directional lights: the
    /// tangent of the light's half angle.
    pub radius: f32,
}

/// The light shines along its node's −Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    Point,
    /// Half angles in radians.
    Spot {
        inner: f32,
        outer: f32,
    },
    Directional,
}

/// A camera looks along its node's −Z.
#[derive(Clone, Debug)]
pub struct Camera {
    pub name: String,
    pub node: usize,
    pub projection: Projection,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// `fov` is vertical, in radians. The aspect ratio is the image's. `far` may be infinite.
    Perspective { fov: f32, near: f32, far: f32 },
    /// `half_height` in metres.
    Orthographic { half_height: f32, near: f32, far: f32 },
}

#[derive(Clone, Debug, Default)]
pub struct Animation {
    pub name: String,
    /// Seconds.
    pub duration: f32,
    pub channels: Vec<Channel>,
    /// Channels of morph targets' weights.
    pub weights: Vec<WeightChannel>,
}

/// The weights of a node's morph targets over time.
#[derive(Clone, Debug)]
pub struct WeightChannel {
    /// Index into [`Scene::deformers`].
    pub deformer: usize,
    /// Seconds, in ascending order.
    pub times: Vec<f32>,
    /// One weight per morph target and key; for cubic splines three times as many: in-tangents, values, out-tangents.
    pub values: Vec<f32>,
    /// Morph targets.
    pub width: usize,
    pub interpolation: Interpolation,
}

/// The animations of a scene that play at the same time. If two set the same property, the later one wins.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Playback {
    /// Indices into [`Scene::animations`].
    pub animations: Vec<usize>,
    /// Whether each animation repeats; otherwise its last key stays.
    pub repeats: bool,
}

#[derive(Clone, Debug)]
pub struct Channel {
    pub node: usize,
    /// Seconds, in ascending order.
    pub times: Vec<f32>,
    pub property: Property,
    /// One value per key; for cubic splines three: in-tangent, value, out-tangent. Only rotations (x, y, z, w) use w.
    pub values: Vec<Vec4>,
    pub interpolation: Interpolation,
}

/// The part of a node's transform that a channel animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    Translation,
    Rotation,
    Scale,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// World-space transforms at one time, in the order of the scene's instances, lights and cameras.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    pub world_from_instance: Vec<DAffine3>,
    pub lights: Vec<PosedLight>,
    pub world_from_camera: Vec<DAffine3>,
    /// In the order of [`Scene::deformers`].
    pub deforms: Vec<deform::DeformPose>,
    /// The time within the animation in seconds, on which random numbers of a sequence depend.
    pub time_s: f64,
}

#[derive(Clone, Copy, Debug)]
pub struct PosedLight {
    pub position: DVec3,
    /// The direction in which the light shines (its node's −Z), unit.
    pub direction: DVec3,
}

/// A scene with a pose and a camera.
#[derive(Clone, Copy)]
pub struct Still<'a> {
    pub scene: &'a Scene,
    pub pose: &'a Pose,
    pub view: &'a View,
}

impl<'a> Still<'a> {
    pub fn new(scene: &'a Scene, pose: &'a Pose, view: &'a View) -> Self {
        Self { scene, pose, view }
    }
}

/// A camera in world space. The axes are unit and orthogonal.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub eye: DVec3,
    pub forward: DVec3,
    pub up: DVec3,
    pub projection: Projection,
}

/// An axis-aligned box in world space; empty when `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub min: DVec3,
    pub max: DVec3,
}
