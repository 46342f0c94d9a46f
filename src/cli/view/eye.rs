//! The eye, which keys and mouse move.

use glam::{DQuat, DVec3};
use twobounce::scene::{DEFAULT_FOV_DEGREES, Projection, View};

/// Position and target of the view, with the same numbers as `--eye`, `--target`, `--up` and `--fov`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Position in metres.
    pub eye: DVec3,
    pub target: DVec3,
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov: f64,
}

/// The minimum angle between the line of sight and the vertical in radians.
const LEAST_TO_VERTICAL: f64 = 0.02;

impl Eye {
    /// An eye with the view `view`, whose target is `distance` metres away; orthographic views become perspective ones.
    pub fn of_view(view: &View, distance: f64) -> Self {
        let fov = match view.projection {
            Projection::Perspective { fov, .. } => f64::from(fov).to_degrees(),
            Projection::Orthographic { .. } => f64::from(DEFAULT_FOV_DEGREES),
        };
        // A roll is kept until the eye rotates.
        Self { eye: view.eye, target: view.eye + view.forward * distance, up: view.up, fov }
    }

    /// The view, as the command line makes it from its flags.
    pub fn view(&self) -> View {
        View::look_at(self.eye, self.target, self.up, self.fov.to_radians() as f32)
    }

    fn forward(&self) -> DVec3 {
        (self.target - self.eye).normalize_or(DVec3::NEG_Z)
    }

    /// Moves by metres to the right, up, and ahead.
    pub fn walk(&mut self, by: DVec3) {
        let forward = self.forward();
        let right = forward.cross(DVec3::Y).normalize_or(DVec3::X);
        let step = right * by.x + DVec3::Y * by.y + forward * by.z;
        (self.eye, self.target) = (self.eye + step, self.target + step);
    }

    /// Rotates the view: radians to the left and up.
    pub fn turn(&mut self, left: f64, up: f64) {
        self.target = self.eye + self.turned(left, up);
    }

    /// Moves around the target: radians to the left and up.
    pub fn orbit(&mut self, left: f64, up: f64) {
        self.eye = self.target - self.turned(left, up);
    }

    /// The rotated direction to the target; the view becomes upright.
    fn turned(&mut self, left: f64, up: f64) -> DVec3 {
        self.up = DVec3::Y;
        let forward = DQuat::from_rotation_y(left) * self.forward();
        let height = forward.angle_between(DVec3::Y);
        let to = (height - up).clamp(LEAST_TO_VERTICAL, std::f64::consts::PI - LEAST_TO_VERTICAL);
        let right = forward.cross(DVec3::Y).normalize_or(DVec3::X);
        (DQuat::from_axis_angle(right, height - to) * forward).normalize() * self.eye.distance(self.target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_and_orbiting_keep_the_distance_and_stop_below_the_zenith() {
        let mut eye = Eye { eye: DVec3::new(0.0, 1.0, 5.0), target: DVec3::Y, up: DVec3::Y, fov: 45.0 };
        eye.orbit(0.7, 9.0);
        assert!((eye.eye.distance(DVec3::Y) - 5.0).abs() < 1e-12, "{eye:?}");
        assert!(eye.forward().y > 0.999 && eye.forward().y < 1.0);
        eye.turn(-0.4, -0.3);
        assert!(((eye.target - eye.eye).length() - 5.0).abs() < 1e-12);
        let before = eye.eye;
        eye.walk(DVec3::new(0.0, 0.0, 2.0));
        assert!((eye.eye - before - eye.forward() * 2.0).length() < 1e-12);
    }
}
