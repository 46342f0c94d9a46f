//! What changes from frame to frame, as the shaders read it: camera, lights and starts, all in voxels.

use glam::{DMat4, DVec3, Vec3};

use crate::gi::volume::Volume;
use crate::layout;
use crate::scene::{LightKind, Pose, Projection, Scene, View};
use crate::settings::Settings;

/// How many of each thing the buffers hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    pub triangles: u32,
    pub items: u32,
    pub cells: u32,
}

/// Everything of a frame but the scene's own data.
pub struct FrameInputs<'a> {
    pub scene: &'a Scene,
    pub view: &'a View,
    pub settings: &'a Settings,
    pub volume: &'a Volume,
    pub scale: f32,
    /// Pixels.
    pub size: (u32, u32),
    pub capacities: Capacities,
    pub frame_index: u32,
    /// Pieces of lamps, and whether they are chosen through the tree.
    pub emitters: (u32, bool),
}

/// The `Frame` buffer.
pub fn frame(inputs: &FrameInputs) -> layout::Frame {
    let FrameInputs { scene, view, settings, volume, capacities, .. } = *inputs;
    let camera = CameraInVoxels::new(view, volume, inputs.size);
    let start = &settings.start;
    layout::Frame {
        clip_from_voxel: camera.clip_from_voxel.as_mat4().to_cols_array_2d(),
        eye: camera.eye.as_vec3().into(),
        voxel_m: volume.voxel_m as f32,
        forward: camera.forward.as_vec3().into(),
        orthographic: u32::from(camera.orthographic),
        right_per_ndc: camera.right_per_ndc.as_vec3().into(),
        scale: inputs.scale,
        down_per_ndc: camera.down_per_ndc.as_vec3().into(),
        light_count: scene.lights.len() as u32,
        sky: scene.sky.into(),
        frame_index: inputs.frame_index,
        image_size: [inputs.size.0 as f32, inputs.size.1 as f32],
        triangle_capacity: capacities.triangles,
        item_capacity: capacities.items,
        cell_capacity: capacities.cells,
        samples: settings.image.samples,
        diffuse_start_normal: start.diffuse_normal,
        diffuse_start_along: start.diffuse_along,
        specular_start_normal: start.specular_normal,
        specular_start_along: start.specular_along,
        refraction_start_normal: start.refraction_normal,
        refraction_start_along: start.refraction_along,
        shadow_start_normal: start.shadow_normal,
        shadow_start_along: start.shadow_along,
        shadow_end: start.shadow_end,
        shadow_step: settings.shadow.step,
        cone_step: settings.step,
        shadow_aperture: settings.shadow.half_angle.map_or(-1.0, |degrees| degrees.to_radians().tan()),
        cone_aperture: settings.aperture,
        exit_margin: settings.exit_margin,
        emitter_count: inputs.emitters.0,
        emitter_tree: u32::from(inputs.emitters.1),
    }
}

/// A view in voxels; Vulkan's clip space: y down, depth 1 at the near plane and 0 far away.
struct CameraInVoxels {
    eye: DVec3,
    forward: DVec3,
    orthographic: bool,
    right_per_ndc: DVec3,
    down_per_ndc: DVec3,
    clip_from_voxel: DMat4,
}

impl CameraInVoxels {
    fn new(view: &View, volume: &Volume, size: (u32, u32)) -> Self {
        let eye = volume.voxel_from_world().transform_point3(view.eye);
        let forward = view.forward.normalize();
        let right = forward.cross(view.up).normalize();
        let down = forward.cross(right);
        let aspect = f64::from(size.0) / f64::from(size.1);
        let (half_height, near_m, far_m, orthographic) = match view.projection {
            Projection::Perspective { fov, near, far } => ((f64::from(fov) / 2.0).tan(), near, far, false),
            Projection::Orthographic { half_height, near, far } => {
                (f64::from(half_height) / volume.voxel_m, near, far, true)
            }
        };
        let near = f64::from(near_m) / volume.voxel_m;
        let far = f64::from(far_m) / volume.voxel_m;
        // Rows of view_from_voxel, scaled so that the image's edge is at 1.
        let x = right / (half_height * aspect);
        let y = down / half_height;
        let row = |axis: DVec3, offset: f64| axis.extend(offset - axis.dot(eye));
        // depth = a + b·z (orthographic), or (a·z + b)/z: 1 at near, 0 at far.
        let (z_row, w_row) = if orthographic {
            let range = if far.is_finite() { far - near } else { 1e7 };
            (row(-forward / range, (near + range) / range), DVec3::ZERO.extend(1.0))
        } else if far.is_finite() {
            let a = -near / (far - near);
            (row(forward * a, near * far / (far - near)), row(forward, 0.0))
        } else {
            (DVec3::ZERO.extend(near), row(forward, 0.0))
        };
        let rows = DMat4::from_cols(row(x, 0.0), row(y, 0.0), z_row, w_row);
        Self {
            eye,
            forward,
            orthographic,
            right_per_ndc: right * half_height * aspect,
            down_per_ndc: down * half_height,
            clip_from_voxel: rows.transpose(),
        }
    }
}

/// The `Lights` buffer's contents.
pub fn lights(scene: &Scene, pose: &Pose, volume: &Volume) -> Vec<layout::Light> {
    let voxel_from_world = volume.voxel_from_world();
    scene
        .lights
        .iter()
        .zip(&pose.lights)
        .map(|(light, posed)| {
            let (kind, scale, offset) = match light.kind {
                LightKind::Point => (0, 0.0, 1.0),
                LightKind::Spot { inner, outer } => {
                    // KHR_lights_punctual's own formula.
                    let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
                    (1, scale, -outer.cos() * scale)
                }
                LightKind::Directional => (2, 0.0, 1.0),
            };
            let radius = match light.kind {
                LightKind::Directional => light.radius,
                _ => (f64::from(light.radius) / volume.voxel_m) as f32,
            };
            layout::Light {
                position: voxel_from_world.transform_point3(posed.position).as_vec3().into(),
                kind,
                direction: posed.direction.as_vec3().into(),
                range_m: light.range.min(f32::MAX),
                intensity: light.intensity.max(Vec3::ZERO).into(),
                radius,
                spot_scale: scale,
                spot_offset: offset,
            }
        })
        .collect()
}
