//! Views: of a camera node, from an eye and a target, or of a whole scene.

use glam::{DAffine3, DVec3};

use super::{Bounds, Pose, Projection, Scene, View};

/// Vertical field of view of the default camera, in degrees.
pub const DEFAULT_FOV_DEGREES: f32 = 45.0;
/// The direction to the default camera: from the front, slightly from above and the right.
const FRONT: DVec3 = DVec3::new(0.35, 0.3, 1.0);
/// The share of the image's width or height that the scene fills in the default view.
const FILLED: f64 = 2.0 / 3.0;
/// The distance of the near plane over that of the target.
const NEAR_PART: f64 = 1e-3;

impl View {
    /// A view from `eye` towards `target`, with a vertical field of view of `fov` radians. An `up` parallel to the line
    /// of sight is replaced, and a target at the eye is replaced by −Z.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, fov: f32) -> Self {
        let distance = (target - eye).length();
        let near = if distance > 0.0 { distance * NEAR_PART } else { NEAR_PART };
        let projection = Projection::Perspective { fov, near: near as f32, far: f32::INFINITY };
        Self::from_axes(eye, target - eye, up, projection)
    }

    /// A view from the front, slightly from above and the right, which shows all of `bounds` in an image that is at
    /// least as wide as high.
    pub fn framing(bounds: Bounds) -> Self {
        Self::framing_within(bounds, DEFAULT_FOV_DEGREES.to_radians())
    }

    /// The view of [`Self::framing`] with a vertical field of view of `fov` radians, from the distance that this
    /// requires.
    pub fn framing_within(bounds: Bounds, fov: f32) -> Self {
        let distance = bounds.radius() / f64::from(0.5 * fov).sin();
        let eye = bounds.center() + FRONT.normalize() * distance;
        Self::look_at(eye, bounds.center(), DVec3::Y, fov)
    }

    /// A view from the direction of [`Self::framing`], whose image is `aspect` times as wide as high. The larger extent
    /// of `points` in the image fills two thirds of it and is centred. `None` if no two points differ.
    pub fn filling(points: &[DVec3], fov: f32, aspect: f64) -> Option<Self> {
        let view = Self::look_at(FRONT, DVec3::ZERO, DVec3::Y, fov);
        let [right, up, forward] = [view.right(), view.up, view.forward];
        let half = (0.5 * f64::from(fov)).tan();
        // Coordinates are relative to the points, so that nothing is rounded far from the origin.
        let middle = *points.first()?;
        // From an eye at (s, −d), a point (x, z) is within the share k/half of the image if |x − s| ≤ k (z + d).
        let along = |axis: DVec3, k: f64| {
            let ends = points.iter().map(|p| *p - middle).map(|p| (p.dot(axis), k * p.dot(forward)));
            let (high, low) = ends
                .fold((f64::NEG_INFINITY, f64::INFINITY), |(high, low), (x, kz)| (high.max(x - kz), low.min(x + kz)));
            (0.5 * (high + low), (high - low) / (2.0 * k))
        };
        let (x, far_for_x) = along(right, FILLED * half * aspect);
        let (y, far_for_y) = along(up, FILLED * half);
        let depths = points.iter().map(|p| (*p - middle).dot(forward));
        let (nearest, farthest) =
            depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let back = far_for_x.max(far_for_y);
        // The distance of the eye from the middle of the depths.
        let distance = back + 0.5 * (nearest + farthest);
        (distance.is_finite() && back + nearest > 1e-6 * back.abs() && distance > 0.0).then(|| {
            let eye = middle + x * right + y * up - back * forward;
            Self::look_at(eye, eye + distance * forward, DVec3::Y, fov)
        })
    }

    /// The view of a camera node along its −Z. Scale has no effect; with shear, up is the part of +Y orthogonal to −Z.
    pub fn from_node(world_from_camera: DAffine3, projection: Projection) -> Self {
        let axes = world_from_camera.matrix3;
        Self::from_axes(world_from_camera.translation, -axes.z_axis, axes.y_axis, projection)
    }

    fn from_axes(eye: DVec3, forward: DVec3, up: DVec3, projection: Projection) -> Self {
        let forward = forward.try_normalize().unwrap_or(DVec3::NEG_Z);
        let across = forward.cross(up.normalize_or_zero());
        // Below 10⁻⁶ the direction of the cross product is mostly rounding error.
        let right = if across.length() > 1e-6 { across.normalize() } else { forward.any_orthonormal_vector() };
        Self { eye, forward, up: right.cross(forward), projection }
    }

    /// Origin and unit direction of the ray through the middle of a pixel of an image of `size`. Pixels are numbered
    /// row by row from the upper left.
    pub fn ray(&self, pixel: usize, size: (u32, u32)) -> (DVec3, DVec3) {
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        let (x, y) = ((pixel % size.0 as usize) as f64 + 0.5, (pixel / size.0 as usize) as f64 + 0.5);
        let across = self.right() * (2.0 * x / width - 1.0) * (width / height) + self.up * (1.0 - 2.0 * y / height);
        match self.projection {
            Projection::Perspective { fov, .. } => {
                (self.eye, (self.forward + (0.5 * f64::from(fov)).tan() * across).normalize())
            }
            Projection::Orthographic { half_height, .. } => (self.eye + f64::from(half_height) * across, self.forward),
        }
    }

    /// The world position of the surface at the middle of a pixel of an image of `size`. `depth` is the layer's value:
    /// metres along the view's forward axis. `None` without a surface.
    pub fn surface(&self, pixel: usize, size: (u32, u32), depth: f32) -> Option<DVec3> {
        let (from, direction) = self.ray(pixel, size);
        depth.is_finite().then(|| from + direction * (f64::from(depth) / direction.dot(self.forward)))
    }

    /// The direction of [`Self::ray`].
    pub fn direction(&self, pixel: usize, size: (u32, u32)) -> DVec3 {
        self.ray(pixel, size).1
    }

    /// The projection of the line between two world points into an image of `size`: x and y in pixels from the upper
    /// left corner. The part behind the eye is cut off; `None` if nothing remains.
    pub fn segment(&self, ends: [DVec3; 2], size: (u32, u32)) -> Option<[[f64; 2]; 2]> {
        let least = match self.projection {
            Projection::Perspective { near, .. } => f64::from(near).max(f64::MIN_POSITIVE),
            Projection::Orthographic { .. } => 0.0,
        };
        let ahead = ends.map(|end| (end - self.eye).dot(self.forward));
        if ahead[0] < least && ahead[1] < least {
            return None;
        }
        let cut = |at: usize| {
            let (own, other) = (ahead[at], ahead[1 - at]);
            if own >= least { ends[at] } else { ends[at].lerp(ends[1 - at], (least - own) / (other - own)) }
        };
        Some([cut(0), cut(1)].map(|end| self.place(end, size)))
    }

    /// The inverse of [`Self::ray`] for a point in front of the eye.
    fn place(&self, point: DVec3, (width, height): (u32, u32)) -> [f64; 2] {
        let to = point - self.eye;
        let half = match self.projection {
            Projection::Perspective { fov, .. } => (0.5 * f64::from(fov)).tan() * to.dot(self.forward),
            Projection::Orthographic { half_height, .. } => f64::from(half_height),
        };
        let (width, height) = (f64::from(width), f64::from(height));
        let (x, y) = (to.dot(self.right()) / half * height / width, to.dot(self.up) / half);
        [0.5 * (x + 1.0) * width, 0.5 * (1.0 - y) * height]
    }

    /// The direction to the right in the image, unit.
    pub fn right(&self) -> DVec3 {
        self.forward.cross(self.up)
    }
}

impl Scene {
    /// The view of camera number `camera` at `pose`.
    pub fn view(&self, pose: &Pose, camera: usize) -> View {
        View::from_node(pose.world_from_camera[camera], self.cameras[camera].projection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_pixel_looks_at_shows_in_it() {
        let up = DVec3::new(0.1, 1.0, 0.3);
        let perspective = View::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 0.5, 0.2), up, 0.9);
        let projection = Projection::Orthographic { half_height: 2.5, near: 0.0, far: 100.0 };
        let size = (64, 40);
        for view in [perspective, View { projection, ..perspective }] {
            for pixel in [0, 63, 700, 64 * 40 - 1] {
                let (from, along) = view.ray(pixel, size);
                let [near, far] = view.segment([from + along, from + 9.0 * along], size).expect("ahead");
                let middle = [(pixel % 64) as f64 + 0.5, (pixel / 64) as f64 + 0.5];
                for (found, wanted) in near.iter().chain(&far).zip(middle.iter().chain(&middle)) {
                    assert!((found - wanted).abs() < 1e-9, "{found} and {wanted}");
                }
                assert!(view.segment([from - along, from - 9.0 * along], size).is_none(), "behind the eye");
            }
        }
        // A segment that begins behind the camera is cut at the near plane.
        let aside = perspective.eye + perspective.right();
        let cut =
            perspective.segment([aside + perspective.forward, aside - perspective.forward], size).expect("a half");
        assert!(cut[1][0] > 1e3 && cut[1][0].is_finite(), "{cut:?}");
    }
}
