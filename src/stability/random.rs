//! Random scenes: nested boxes, slivers, triangles without area, tiny and huge parts, every kind of material and of
//! light. A seed gives the same scene on every machine.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec3, Vec3, Vec4};

use super::scenes::{add_lamp, add_plaster, add_shell};
use super::stage::Stage;
use crate::scene::ties::mixed;
use crate::scene::{Alpha, LightKind, Material, Mesh, Scene, View};

/// Pseudo-random numbers by SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        let number = mixed(self.0);
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        number
    }

    /// A number from 0 to 1.
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    fn between(&mut self, least: f32, most: f32) -> f32 {
        least + (most - least) * self.unit()
    }

    /// A number with a log-uniform distribution.
    fn decades(&mut self, least: f32, most: f32) -> f32 {
        (self.between(least.ln(), most.ln())).exp()
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    fn color(&mut self, most: f32) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * most
    }

    /// A point in a cube of this half side.
    fn point(&mut self, half: f32) -> Vec3 {
        Vec3::new(self.between(-half, half), self.between(-half, half), self.between(-half, half))
    }

    fn place(&mut self, half: f32) -> DAffine3 {
        let axis = (self.point(1.0) + Vec3::new(0.0, 0.01, 0.0)).as_dvec3().normalize();
        let angle = TAU * f64::from(self.unit());
        DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, angle), self.point(half).as_dvec3())
    }

    fn material(&mut self) -> Material {
        let plain = Material { double_sided: self.below(2) == 0, ..Material::lambert("chance", self.color(0.9)) };
        match self.below(8) {
            0 => Material { metallic: 1.0, roughness: self.unit(), ..plain },
            1 => Material { specular: 1.0, roughness: self.unit(), ..plain },
            2 => Material { transmission: self.unit(), specular: 1.0, roughness: 0.0, ..plain },
            3 => Material { alpha: Alpha::Blend, base_color: self.color(0.9).extend(self.unit()), ..plain },
            4 => Material { alpha: Alpha::Mask(0.5), base_color: self.color(0.9).extend(self.unit()), ..plain },
            5 => Material { base_color: Vec4::ONE, ..plain },
            _ => plain,
        }
    }
}

/// The scene of a seed, within a cube of half side 1.
pub fn stage(seed: u64) -> Stage {
    let mut random = Random(seed);
    let mut scene = Scene::empty(&format!("seed {seed}"));
    // Two in three are in a room, so that light meets many surfaces.
    let closed = random.below(3) > 0;
    if closed {
        let walls = add_plaster(&mut scene, random.color(0.9));
        add_shell(&mut scene, walls, [0.95; 3]);
    }
    for _ in 0..=random.below(8) {
        add_part(&mut scene, &mut random);
    }
    add_lights(&mut scene, &mut random, closed);
    let eye = if closed { random.point(0.6) } else { random.point(1.0).normalize_or(Vec3::Z) * 3.0 }.as_dvec3();
    let target = random.point(0.3).as_dvec3();
    let fov = if closed { 80f32 } else { 40.0 };
    Stage { scene, reach: 1.0, view: View::look_at(eye, target, DVec3::Y, fov.to_radians()) }
}

/// A number that is added to the compared means: a thousandth of the light of a lamp of 1.
const FAINT: f64 = 1e-3;
/// The share of the reference's values that must be below the bound. The others are lamps smaller than a pixel, which
/// samples find by chance.
const BOUNDED: f64 = 0.98;
const BOUND: f32 = 4.0;

/// The bound of the reference's values; larger ones count as this.
pub fn bound(truth: &[[f32; 3]]) -> f32 {
    let mut values: Vec<f32> = truth.iter().flatten().copied().collect();
    values.sort_unstable_by(f32::total_cmp);
    BOUND * values[(BOUNDED * (values.len() - 1) as f64) as usize]
}

/// The mean of an image's values, limited to `bound`, plus a faint one, so that a black view shows leaks by their
/// visibility.
pub fn level(image: &[[f32; 3]], bound: f32) -> f64 {
    image.iter().flatten().map(|value| f64::from(value.min(bound))).sum::<f64>() / (3 * image.len()) as f64 + FAINT
}

fn add_part(scene: &mut Scene, random: &mut Random) {
    let material = random.material();
    let material = scene.add_material(material);
    let mesh = match random.below(6) {
        // Nested boxes.
        0 => {
            let half = Vec3::new(random.between(0.1, 0.5), random.between(0.1, 0.5), random.between(0.1, 0.5));
            scene.add_mesh(
                Mesh::cuboid("inner", material, -0.5 * half, 0.5 * half, random.below(2) == 0),
                DAffine3::IDENTITY,
            );
            Mesh::cuboid("outer", material, -half, half, false)
        }
        // They have any size down to a tenth of a millimetre.
        1 => {
            let half = Vec3::splat(random.decades(1e-4, 0.5));
            Mesh::cuboid("box", material, -half, half, false)
        }
        // Slivers.
        2 => {
            let sliver = |random: &mut Random| {
                let (a, b) = (random.point(0.5), random.point(0.5));
                let width = random.decades(1e-7, 1e-2);
                [a, b, b + random.point(width)]
            };
            let slivers: Vec<_> = (0..20).map(|_| sliver(random)).collect();
            Mesh::triangles("slivers", material, &slivers)
        }
        // Triangles without area, and duplicates.
        3 => {
            let (a, b, c) = (random.point(0.6), random.point(0.6), random.point(0.6));
            Mesh::triangles("degenerate", material, &[[a; 3], [a, b, a], [a, b, c], [a, b, c], [a, (a + b) * 0.5, b]])
        }
        // Separate triangles.
        4 => {
            let triangles: Vec<_> =
                (0..50).map(|_| [random.point(0.7), random.point(0.7), random.point(0.7)]).collect();
            Mesh::triangles("loose", material, &triangles)
        }
        // A triangle far larger than the volume.
        _ => {
            let side = random.decades(2.0, 1e3);
            Mesh::quad("huge", material, Vec3::new(-0.5 * side, 0.0, -0.5 * side), Vec3::Z * side, Vec3::X * side)
        }
    };
    // They are stacked, because at equal depth the visible one would be random.
    let huge = scene.meshes.iter().filter(|mesh| mesh.name == "huge").count() as f64;
    let place = if mesh.name == "huge" {
        DAffine3::from_translation(DVec3::NEG_Y * (0.9 + 0.01 * huge))
    } else {
        random.place(0.4)
    };
    scene.add_mesh(mesh, place);
}

/// Adds one to three lights of any kind, and in the open a sky, so that nothing is black.
fn add_lights(scene: &mut Scene, random: &mut Random, closed: bool) {
    for _ in 0..=random.below(3) {
        let place = random.place(0.6);
        let color = Vec3::splat(0.2) + random.color(1.0);
        let outer = random.between(0.2, 1.2);
        match random.below(4) {
            0 => scene.add_light(LightKind::Point, color, place),
            1 => scene.add_light(LightKind::Spot { inner: 0.5 * outer, outer }, color * 3.0, place),
            2 if !closed => scene.add_light(LightKind::Directional, color, place),
            _ => {
                let side = random.decades(0.01, 0.5);
                add_lamp(scene, 0.5 / (side * side), side, place)
            }
        };
    }
    if closed {
        // One light is in the room, even if others are hidden.
        scene.add_light(LightKind::Point, Vec3::splat(0.3), DAffine3::from_translation(DVec3::new(0.8, 0.8, 0.8)));
    } else {
        scene.sky = Vec3::splat(random.between(0.1, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_in_a_pixel_counts_little() {
        let mut image = vec![[1.0; 3]; 100];
        let even = level(&image, bound(&image));
        assert!((even - 1.001).abs() < 1e-6);
        image[7] = [1e6; 3];
        assert_eq!(bound(&image), 4.0);
        assert!((level(&image, bound(&image)) / even - 1.03).abs() < 1e-3);
    }

    #[test]
    fn a_seed_is_a_scene() {
        let [a, b, c] = [3, 3, 4].map(|seed| stage(seed).scene);
        assert_eq!(a.triangle_count(), b.triangle_count());
        assert_eq!(format!("{:?}", a.lights), format!("{:?}", b.lights));
        assert_ne!(format!("{:?}", a.lights), format!("{:?}", c.lights));
    }

    #[test]
    fn every_kind_occurs_and_all_is_finite() {
        let scenes: Vec<Scene> = (0..200).map(|seed| stage(seed).scene).collect();
        let kinds = ["outer", "box", "slivers", "degenerate", "loose", "huge", "lamp"];
        for kind in kinds {
            assert!(scenes.iter().any(|scene| scene.meshes.iter().any(|mesh| mesh.name == kind)), "{kind}");
        }
        let lights = || scenes.iter().flat_map(|scene| &scene.lights);
        assert!(lights().any(|light| matches!(light.kind, LightKind::Spot { .. })));
        assert!(lights().any(|light| light.kind == LightKind::Directional));
        for scene in &scenes {
            assert!(scene.meshes.iter().flat_map(|mesh| &mesh.positions).all(|p| p.is_finite()));
            assert!(scene.has_light());
        }
    }
}
