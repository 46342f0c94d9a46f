//! Camera rays.

use glam::Vec3;

use super::geometry::Units;
use super::traversal::Ray;
use crate::scene::{Projection, View};

/// A view with a size in pixels, in units.
pub struct Camera {
    eye: Vec3,
    forward: Vec3,
    /// Vectors from the centre of the image plane to its right and upper edges; for a perspective, at distance 1.
    right: Vec3,
    up: Vec3,
    orthographic: bool,
    near: f32,
    far: f32,
    size: [f32; 2],
    metres_per_unit: f64,
}

impl Camera {
    pub fn new(view: &View, units: &Units, width: u32, height: u32) -> Self {
        let (half_height, near, far, orthographic) = match view.projection {
            Projection::Perspective { fov, near, far } => ((fov / 2.0).tan(), near, far, false),
            Projection::Orthographic { half_height, near, far } => (units.length(half_height), near, far, true),
        };
        let size = [width as f32, height as f32];
        Self {
            eye: units.point(view.eye),
            forward: view.forward.as_vec3(),
            right: view.right().as_vec3() * (half_height * size[0] / size[1]),
            up: view.up.as_vec3() * half_height,
            orthographic,
            near: units.length(near),
            far: units.length(far),
            size,
            metres_per_unit: units.size,
        }
    }

    /// The ray through a point of the image, in pixels from its upper left corner.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let across = self.right * (2.0 * x / self.size[0] - 1.0) + self.up * (1.0 - 2.0 * y / self.size[1]);
        if self.orthographic {
            return Ray { origin: self.eye + across, direction: self.forward, near: self.near, far: self.far };
        }
        let direction = (self.forward + across).normalize();
        let cos = direction.dot(self.forward);
        Ray { origin: self.eye, direction, near: self.near / cos, far: self.far / cos }
    }

    /// Distance along the forward axis, in metres, of a point at `distance` units along a ray.
    pub fn depth(&self, ray: &Ray, distance: f32) -> f64 {
        (distance * ray.direction.dot(self.forward)) as f64 * self.metres_per_unit
    }
}
