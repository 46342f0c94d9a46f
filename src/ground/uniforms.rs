//! Data that changes from frame to frame: camera, lights and starts of cones, all in voxels.

use bytemuck::Zeroable;
use glam::{DMat4, DVec2, DVec3, Vec3};

use super::boxes::MOST_BOXES;
use super::grid::Grid;
use super::lamps::LampSums;
use super::layout;
use crate::scene::{LightKind, Pose, Projection, Scene, View};

/// [`layout::Light::kind`] of the sky's lights.
const SKY: u32 = 3;

/// Everything of a frame except the scene's own data.
pub struct FrameUniforms<'a> {
    pub scene: &'a Scene,
    pub view: &'a View,
    pub grid: &'a Grid,
    /// Scale from radiance to its stored value.
    pub scale: f32,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Samples per pixel.
    pub samples: u32,
    /// The time within the animation in seconds.
    pub time_s: f64,
    pub lamps: LampSums,
    /// The number of the pass over the light, among the passes whose mean is kept.
    pub light_pass: u32,
    /// The weight of this pass in the mean.
    pub light_share: f32,
    /// The number of the pass over the image, among the passes whose mean is shown.
    pub image_pass: u32,
    /// Least corners of the boxes of finer voxels: the current ones, and those of the previous lists.
    pub boxes: [[[f32; 3]; MOST_BOXES]; 2],
}

impl FrameUniforms<'_> {
    /// The struct that shaders read.
    pub fn layout(&self) -> layout::Frame {
        let image_shift = image_shift(self.image_pass);
        let ndc_shift = ndc_shift(image_shift, self.size, self.samples);
        let map = self.scene.sky_map.as_deref();
        let layout::Frame { clip_from_voxel, eye, forward, orthographic, right_per_ndc, down_per_ndc, .. } =
            self.camera(ndc_shift);
        layout::Frame {
            clip_from_voxel,
            eye,
            forward,
            orthographic,
            right_per_ndc,
            down_per_ndc,
            voxel_m: self.grid.voxel_m as f32,
            scale: self.scale,
            light_count: (self.scene.lights.len() + self.scene.sky_lights().count()) as u32,
            sky: map.map_or(self.scene.sky, |map| map.mean_of_rest).into(),
            turn: turn_at(self.time_s),
            image_size: [self.size.0 as f32, self.size.1 as f32],
            samples: self.samples,
            lamp_count: self.lamps.count,
            lamp_tree: u32::from(self.lamps.tree),
            lamp_shine: self.lamps.shine,
            light_pass: self.light_pass,
            sky_gradient: self.scene.sky_gradient.into(),
            light_share: self.light_share,
            sky_scale: map.map_or(1.0, |map| map.scale),
            sky_most: map.map_or(f32::MAX, |map| map.most.min(f32::MAX)),
            sky_width: map.map_or(0, |map| map.width as i32),
            sky_height: map.map_or(0, |map| map.height as i32),
            sky_levels: map.map_or(0, |map| map.levels as u32),
            sky_octaves: map.map_or(1.0, |map| map.octaves()),
            sky_turn: self.scene.sky_turn,
            image_shift: image_shift.as_vec2().into(),
            ndc_shift: ndc_shift.as_vec2().into(),
            image_pass: self.image_pass,
            boxes: self.boxes[0],
            last_boxes: self.boxes[1],
        }
    }

    /// The camera's fields, with a view in voxels. Vulkan's clip space has y down, depth 1 at the near plane and 0 at
    /// infinity.
    fn camera(&self, ndc_shift: DVec2) -> layout::Frame {
        let (view, grid) = (self.view, self.grid);
        let eye = grid.voxel_from_world().transform_point3(view.eye);
        let forward = view.forward.normalize();
        let right = forward.cross(view.up).normalize();
        let down = forward.cross(right);
        let aspect = f64::from(self.size.0) / f64::from(self.size.1);
        let (half_height, near_m, far_m, orthographic) = match view.projection {
            Projection::Perspective { fov, near, far } => ((f64::from(fov) / 2.0).tan(), near, far, false),
            Projection::Orthographic { half_height, near, far } => {
                (f64::from(half_height) / grid.voxel_m, near, far, true)
            }
        };
        let near = f64::from(near_m) / grid.voxel_m;
        let far = f64::from(far_m) / grid.voxel_m;
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
        let (x_row, y_row) = (row(x, 0.0) + ndc_shift.x * w_row, row(y, 0.0) + ndc_shift.y * w_row);
        let rows = DMat4::from_cols(x_row, y_row, z_row, w_row);
        layout::Frame {
            clip_from_voxel: rows.transpose().as_mat4().to_cols_array_2d(),
            eye: eye.as_vec3().into(),
            forward: forward.as_vec3().into(),
            orthographic: u32::from(orthographic),
            right_per_ndc: (right * half_height * aspect).as_vec3().into(),
            down_per_ndc: (down * half_height).as_vec3().into(),
            ..Zeroable::zeroed()
        }
    }
}

/// A seed that depends on the time; the seed of the animation's start is 0.
fn turn_at(time_s: f64) -> u32 {
    let bits = time_s.to_bits();
    (bits ^ (bits >> 32)) as u32
}

/// The shift of the random numbers of a pass over the image, in [0, 1)²; 0 for the first pass. Even and odd passes are
/// two R2 sequences (Roberts, 2018), the second with another start. Each half covers the square evenly, and their
/// difference estimates the error of both.
fn image_shift(image_pass: u32) -> DVec2 {
    let start = DVec2::new(0.2360679775, 0.6457513111) * f64::from(image_pass % 2);
    (start + f64::from(image_pass / 2) * DVec2::new(0.7548776662, 0.5698402909)).fract()
}

/// The corresponding shift of the image, within the part of a pixel that each sample represents.
fn ndc_shift(image_shift: DVec2, size: (u32, u32), samples: u32) -> DVec2 {
    let place = (image_shift + 0.5).fract() - 0.5;
    place * 2.0 / (DVec2::new(size.0.into(), size.1.into()) * f64::from(samples))
}

/// The content of the buffer `Lights`: the scene's lights, then those of the sky.
pub fn lights(scene: &Scene, pose: &Pose, grid: &Grid) -> Vec<layout::Light> {
    let voxel_from_world = grid.voxel_from_world();
    let of_scene = scene.lights.iter().zip(&pose.lights).map(|(light, posed)| {
        let (kind, scale, offset) = match light.kind {
            LightKind::Point => (0, 0.0, 1.0),
            LightKind::Spot { inner, outer } => {
                // The formula is that of KHR_lights_punctual.
                let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
                (1, scale, -outer.cos() * scale)
            }
            LightKind::Directional => (2, 0.0, 1.0),
        };
        let radius = match light.kind {
            LightKind::Directional => light.radius,
            _ => (f64::from(light.radius) / grid.voxel_m) as f32,
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
    });
    let of_sky = scene.sky_lights().map(|light| layout::Light {
        kind: SKY,
        direction: (-light.towards).as_vec3().into(),
        range_m: f32::MAX,
        intensity: light.irradiance.into(),
        radius: light.radius,
        spot_offset: 1.0,
        ..Zeroable::zeroed()
    });
    of_scene.chain(of_sky).collect()
}
