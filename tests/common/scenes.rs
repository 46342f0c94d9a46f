//! Random numbers and random triangles. Every test file uses a part of this.
#![allow(dead_code)]

use glam::{DAffine3, DVec3};
use twobounce::scene::{Material, Mesh, Scene};

/// Random numbers in [0,1) that are equal on all machines (Knuth's 64-bit congruential generator, upper bits).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A random point in [0,1)³.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// A random point on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.point() * 2.0 - 1.0;
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

/// Adds triangles of one material, positions in metres.
pub fn add(scene: &mut Scene, triangles: &[[DVec3; 3]], material: Material) {
    let material = scene.add_material(material);
    let triangles: Vec<_> = triangles.iter().map(|t| t.map(|p| p.as_vec3())).collect();
    scene.add_mesh(Mesh::triangles("triangles", material, &triangles), DAffine3::IDENTITY);
}

/// A triangle with its corners in a cube of `size` about `center`, rounded to f32.
pub fn triangle(random: &mut Random, center: DVec3, size: f64) -> [DVec3; 3] {
    std::array::from_fn(|_| (center + (random.point() - 0.5) * size).as_vec3().as_dvec3())
}
