//! A studio for a scene without light: an environment with softboxes, a directional light, and a ground that receives
//! shadows.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::sky::{Panorama, middle, solid_angle};
use super::{Bounds, LightKind, Material, Mesh, Scene, View};

/// Irradiance of the directional light: a white surface that faces it reflects 1/√2 of radiance.
const IRRADIANCE: f64 = PI * FRAC_1_SQRT_2;
/// Tangent of the directional light's half angle, 3°.
const LIGHT_RADIUS: f32 = 0.05;
/// Reflectance of the ground.
const ALBEDO: f32 = 0.5;
/// Half the side of the ground over the radius of the scene. Beyond it the environment shows the ground's radiance.
const GROUND_SIDE: f64 = 8.0;
/// The ground's depth below the scene over the scene's radius, so that a face at the bottom of a model stays in front
/// of it.
const GROUND_BELOW: f64 = 1e-3;
/// Radiance of the walls, above the horizon and straight up.
const WALLS: [f64; 2] = [0.45, 0.3];
/// Sine of the elevation at which the radiance of the ground has changed to that of the walls.
const SWEEP: f64 = 0.35;
/// Radiance below the horizon without a ground: at the horizon and straight down.
const DARK_FLOOR: [f64; 2] = [0.3, 0.1];
/// Texels of the environment.
const SIZE: [usize; 2] = [256, 128];

/// A rectangle of light at infinity with soft edges.
struct Softbox {
    /// Unit, from the scene.
    towards: DVec3,
    /// Tangents of the half angles, across and up.
    half: [f64; 2],
    radiance: f64,
}

impl Softbox {
    /// Its contribution to the radiance from the unit direction d, between 0 and 1, with smooth edges.
    fn at(&self, d: DVec3) -> f64 {
        let ahead = d.dot(self.towards);
        if ahead <= 0.0 {
            return 0.0;
        }
        let across = DVec3::Y.cross(self.towards).try_normalize().unwrap_or(DVec3::X);
        let up = self.towards.cross(across);
        let inside = |axis: DVec3, half: f64| smooth_step((1.1 - (d.dot(axis) / ahead / half).abs()) / 0.2);
        self.radiance * inside(across, self.half[0]) * inside(up, self.half[1])
    }
}

/// A smooth step from 0 to 1 with zero slope at both ends.
fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The environment of a view.
struct Environment {
    boxes: [Softbox; 3],
    /// Radiance of the ground far from the scene, if there is a ground.
    ground: Option<f64>,
}

impl Environment {
    /// `light` is the direction in which the directional light shines.
    fn new(view: &View, light: DVec3) -> Self {
        let level = |d: DVec3| (d - DVec3::Y * d.y).try_normalize();
        // A view straight down or up uses its own up vector for the horizon.
        let ahead = level(view.forward).or_else(|| level(view.up)).unwrap_or(DVec3::NEG_Z);
        let right = ahead.cross(DVec3::Y);
        let at = |side: f64, up: f64, forward: f64| (side * right + up * DVec3::Y + forward * ahead).normalize();
        let boxes = [
            Softbox { towards: -light, half: [0.5, 0.5], radiance: 3.0 },
            // One strip is at the right, and one is high behind the scene.
            Softbox { towards: at(1.0, 0.45, -0.3), half: [0.16, 0.6], radiance: 2.0 },
            Softbox { towards: at(-0.3, 1.1, 0.9), half: [0.7, 0.16], radiance: 2.0 },
        ];
        Self { boxes, ground: None }
    }

    /// Radiance from the unit direction d.
    fn at(&self, d: DVec3) -> f64 {
        let mix = |ends: [f64; 2], t: f64| ends[0] + (ends[1] - ends[0]) * t;
        if d.y < 0.0 {
            return self.ground.unwrap_or_else(|| mix(DARK_FLOOR, -d.y));
        }
        let walls = mix(WALLS, d.y);
        let horizon = self.ground.unwrap_or(DARK_FLOOR[0]);
        mix([horizon, walls], smooth_step(d.y / SWEEP)) + self.boxes.iter().map(|softbox| softbox.at(d)).sum::<f64>()
    }

    /// Irradiance on the ground.
    fn irradiance(&self) -> f64 {
        let texel = |i: usize| {
            let (x, y) = (i % SIZE[0], i / SIZE[0]);
            let d = middle(x, y, SIZE);
            self.at(d) * d.y.max(0.0) * solid_angle(SIZE[0], SIZE[1], y)
        };
        (0..SIZE[0] * SIZE[1]).map(texel).sum()
    }
}

impl Scene {
    /// Adds a studio for `view`: an environment, a directional light from the upper left behind the viewer, and with
    /// `ground` a floor below `bounds`, the bounds of the scene. The environment below the horizon has the radiance of
    /// the floor, so that the floor's edge is invisible. Returns a sentence about the additions. Existing poses do not
    /// include them.
    pub fn add_studio(&mut self, view: &View, bounds: Bounds, ground: bool) -> String {
        let direction = (view.forward + 0.5 * view.right() - view.up).normalize();
        let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction);
        let irradiance = Vec3::splat(IRRADIANCE as f32);
        let light = self.add_light(LightKind::Directional, irradiance, DAffine3::from_quat(rotation));
        self.lights[light].name = "studio light".into();
        self.lights[light].radius = LIGHT_RADIUS;
        let mut environment = Environment::new(view, direction);
        if ground {
            // The environment near the horizon depends weakly on the ground's radiance, so the error shrinks to a tenth
            // in each step.
            for _ in 0..12 {
                let all = environment.irradiance() + IRRADIANCE * (-direction.y).max(0.0);
                environment.ground = Some(f64::from(ALBEDO) / PI * all);
            }
            self.add_ground(bounds);
        }
        let radiance = |i: usize| Vec3::splat(environment.at(middle(i % SIZE[0], i / SIZE[0], SIZE)) as f32);
        let radiance = (0..SIZE[0] * SIZE[1]).map(radiance).collect();
        self.set_sky_map(Panorama { width: SIZE[0], height: SIZE[1], radiance }, 1.0, 0.0);
        let DVec3 { x, y, z } = direction;
        let below = if ground {
            ", and a ground; --default-light off leaves all out, --ground off the ground"
        } else {
            "; --default-light off leaves both out"
        };
        format!(
            "added a studio: softboxes, a directional light of irradiance {IRRADIANCE:.3} towards ({x:.3}, {y:.3}, {z:.3}), from \
             the upper left behind the camera{below}"
        )
    }

    /// Adds a grey floor below `bounds`, the bounds of the scene, or at the origin if they are empty.
    pub fn add_ground(&mut self, bounds: Bounds) {
        let radius = bounds.radius();
        let half = (GROUND_SIDE * radius) as f32;
        let down = 0.5 * bounds.size().y + GROUND_BELOW * radius;
        let place = bounds.center() - DVec3::Y * down;
        let material = self.add_material(Material::lambert("ground", Vec3::splat(ALBEDO)));
        let corner = Vec3::new(-half, 0.0, -half);
        let quad = Mesh::quad("ground", material, corner, 2.0 * half * Vec3::Z, 2.0 * half * Vec3::X);
        self.add_mesh(quad, DAffine3::from_translation(place));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ground's radiance is its albedo over π times its irradiance, integrated here over other directions than the
    /// map's texels.
    #[test]
    fn below_the_horizon_lies_the_radiance_of_the_ground() {
        let view = View::look_at(DVec3::new(1.0, 1.5, 3.0), DVec3::ZERO, DVec3::Y, 0.8);
        let mut scene = Scene::empty("studio");
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
        let said = scene.add_studio(&view, bounds, true);
        assert!(said.contains("irradiance 2.221") && said.contains("--ground off"), "{said}");
        let light = scene.pose(None, 0.0).lights[0].direction;
        // From the upper left behind the camera: it shines right, down and away.
        assert!(light.dot(view.right()) > 0.0 && light.y < 0.0 && light.dot(view.forward) > 0.0);
        const SIDE: usize = 400;
        // Squares of a disc, projected to the hemisphere, are cosine-weighted.
        let disc = |i: usize| ((i as f64 + 0.5) / SIDE as f64 - 0.5) * 2.0;
        let squares = (0..SIDE * SIDE).map(|i| (disc(i % SIDE), disc(i / SIDE)));
        let inside = squares.filter(|(x, z)| x * x + z * z < 1.0);
        let towards = |(x, z): (f64, f64)| scene.sky_towards(DVec3::new(x, (1.0 - x * x - z * z).sqrt(), z)).x;
        let sum: f64 = inside.map(|at| f64::from(towards(at))).sum();
        let irradiance = sum * 4.0 / (SIDE * SIDE) as f64 + IRRADIANCE * -light.y;
        let expected = f64::from(ALBEDO) / PI * irradiance;
        for d in [DVec3::NEG_Y, DVec3::new(1.0, -0.02, 0.3).normalize(), DVec3::new(0.2, -0.5, -1.0).normalize()] {
            let found = f64::from(scene.sky_towards(d).x);
            assert!((found / expected - 1.0).abs() < 0.01, "{found}, expected {expected}");
        }
        assert!(scene.check().is_ok());
        assert!(scene.sky_lights().next().is_none(), "softboxes are dim enough to be found by directions");
        assert!(scene.bounds(None).min.y < bounds.min.y && scene.bounds(None).min.y > bounds.min.y - 0.01);
    }

    #[test]
    fn a_scene_without_triangles_has_its_ground_at_the_origin() {
        let mut scene = Scene::empty("empty");
        scene.add_ground(scene.bounds(None));
        let [instance] = scene.pose(None, 0.0).world_from_instance[..] else { panic!("one instance") };
        assert!(instance.translation.length() < 0.01, "{instance}");
    }
}
