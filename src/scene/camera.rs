//! Views: from a camera's node, from an eye and a target, or around a scene.

use glam::{DAffine3, DVec3};

use super::{Bounds, Pose, Projection, Scene, View};

/// Vertical field of view where nothing else is said, degrees.
const DEFAULT_FOV_DEGREES: f32 = 45.0;
/// The near plane over the distance to what is looked at.
const NEAR_PART: f64 = 1e-3;

impl View {
    /// From `eye` to `target`, `fov` radians vertically. An `up` along the line of sight is replaced by another; a target
    /// at the eye means −Z.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, fov: f32) -> Self {
        let distance = (target - eye).length();
        let near = if distance > 0.0 { distance * NEAR_PART } else { NEAR_PART };
        let projection = Projection::Perspective { fov, near: near as f32, far: f32::INFINITY };
        Self::from_axes(eye, target - eye, up, projection)
    }

    /// A view from the front, a little from above and the right, that shows all of `bounds` in any image at least as
    /// wide as high.
    pub fn framing(bounds: Bounds) -> Self {
        let fov = DEFAULT_FOV_DEGREES.to_radians();
        let radius = 0.5 * bounds.size().length();
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let distance = radius / f64::from(0.5 * fov).sin();
        let eye = bounds.center() + DVec3::new(0.35, 0.3, 1.0).normalize() * distance;
        Self::look_at(eye, bounds.center(), DVec3::Y, fov)
    }

    /// The view of a camera whose node lies at `world_from_camera`. Scales and shears of the node do not matter: it looks
    /// along −Z, with +Y as nearly up as a right angle allows.
    pub fn from_node(world_from_camera: DAffine3, projection: Projection) -> Self {
        let axes = world_from_camera.matrix3;
        Self::from_axes(world_from_camera.translation, -axes.z_axis, axes.y_axis, projection)
    }

    fn from_axes(eye: DVec3, forward: DVec3, up: DVec3, projection: Projection) -> Self {
        let forward = forward.try_normalize().unwrap_or(DVec3::NEG_Z);
        let across = forward.cross(up.normalize_or_zero());
        // Below a millionth the direction of the cross product is mostly rounding.
        let right = if across.length() > 1e-6 { across.normalize() } else { forward.any_orthonormal_vector() };
        Self { eye, forward, up: right.cross(forward), projection }
    }

    /// To the right in the image; unit.
    pub fn right(&self) -> DVec3 {
        self.forward.cross(self.up)
    }
}

impl Scene {
    /// What camera number `camera` sees at `pose`.
    pub fn view(&self, pose: &Pose, camera: usize) -> View {
        View::from_node(pose.world_from_camera[camera], self.cameras[camera].projection)
    }
}
