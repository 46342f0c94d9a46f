//! Passes 2b and 2c against their twins: level 0 of triangles that only emit, for each fill, and its mips.

use crate::gpu;

use crate::scenes::{Random, add, triangle};
use glam::{DAffine3, DVec3, IVec3, UVec3, Vec3, Vec4};
use gpu::twins::mips::mip_level;
use gpu::twins::shade::{Shaded, fill};
use gpu::twins::volume::{round_to_half, texel_index};
use gpu::twins::voxelise::{Polygon, voxelise};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;
use twobounce::gi::cones::choices::{Fill, Form};
use twobounce::scene::{LightKind, Material, Scene};
use twobounce::settings::{Bounces, Center, Settings};

const EDGE: u32 = 16;

fn settings(fill: Fill) -> Settings {
    let mut settings = Settings { voxels: EDGE, bounces: Bounces::One, ..Settings::corrected() };
    settings.of.cones.fill = fill;
    settings.grid.center = Center::Point([f64::from(EDGE) / 2.0; 3]);
    settings.grid.side = Some(f64::from(EDGE));
    settings
}

/// Triangles about three voxels large that emit, each with a colour of its own, every other one on both sides.
fn confetti() -> (Scene, Vec<[DVec3; 3]>) {
    let (mut scene, mut triangles, mut random) = (Scene::empty("confetti"), Vec::new(), Random::new(3));
    for i in 0..60 {
        let center = random.point() * 12.0 + 2.0;
        let corners = triangle(&mut random, center, 4.0);
        let lamp = Material::lamp("lamp", random.point().as_vec3());
        add(&mut scene, &[corners], Material { double_sided: i % 2 == 0, ..lamp });
        triangles.push(corners);
    }
    (scene, triangles)
}

/// Result of shading triangle `i` in `voxel`.
fn shaded(scene: &Scene, triangles: &[[DVec3; 3]], i: usize, voxel: u32, scale: f32) -> Shaded {
    let n = EDGE as i32;
    let voxel = IVec3::new(voxel as i32 % n, voxel as i32 / n % n, voxel as i32 / n / n).as_dvec3();
    let t = &triangles[i];
    let material = &scene.materials[scene.meshes[i].material];
    Shaded {
        normal: (t[1] - t[0]).cross(t[2] - t[0]).normalize().as_vec3(),
        front: material.emissive * scale,
        back: material.double_sided.then_some(material.emissive * scale),
        opacity: 1.0,
        area: Polygon::clipped(t, voxel, voxel + 1.0).area_vector().length() as f32,
    }
}

#[test]
fn every_fill_is_its_twins() {
    let (scene, triangles) = confetti();
    let exact = voxelise(&triangles, EDGE);
    let undecided: BTreeSet<u32> = exact.touching.iter().map(|p| p.0).collect();
    let mut lists: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (voxel, triangle) in &exact.certain {
        lists.entry(*voxel).or_default().push(*triangle as usize);
    }
    let context = gpu::context();
    for how in Fill::ALL {
        let renderer = gpu::render(&context, &scene, &settings(*how), 16);
        let volume = gpu::volume(&context, &renderer.frame().method.volumes()[0]);
        let scale = renderer.frame().scale;
        let mut seen = 0;
        for voxel in (0..EDGE.pow(3)).filter(|v| !undecided.contains(v)) {
            let list: Vec<Shaded> =
                lists.get(&voxel).into_iter().flatten().map(|i| shaded(&scene, &triangles, *i, voxel, scale)).collect();
            for (target, expected) in fill(&list, *how).into_iter().enumerate() {
                let got = volume.levels()[0][target][voxel as usize];
                // One unit of a half (2⁻¹⁰), and f32 clipping against f64: 2⁻²³ of a coordinate of 16, over a side of
                // 0.01.
                let tolerance = expected.abs() / 1024.0 + Vec3::splat(1e-4 * scale).extend(1e-4);
                assert!(
                    (got - expected).abs().cmple(tolerance).all(),
                    "{how} voxel {voxel} target {target}: {got} is not {expected}"
                );
            }
            seen += usize::from(!list.is_empty());
        }
        assert!(seen > 300, "{how}: {seen} voxels are a test of little");
    }
}

/// Faces for travellers along +x, −x and +y, and the isotropic one, of a doubleSided wall in the plane x = 4.5 whose
/// front faces +x. A light from +x sends 3π, one from −x 2π; the albedo is ½, so the front sends 1.5 and the back 1.
#[test]
fn a_wall_lit_on_both_sides_fills_by_hand() {
    let mut scene = Scene::empty("a wall between two lights");
    let corner = |y: f64, z: f64| DVec3::new(4.5, y, z);
    let halves = [[(0.0, 0.0), (16.0, 0.0), (16.0, 16.0)], [(0.0, 0.0), (16.0, 16.0), (0.0, 16.0)]];
    let halves = halves.map(|half| half.map(|(y, z)| corner(y, z)));
    // White has only the diffuse lobe.
    let white = Material {
        base_color: Vec4::new(0.5, 0.5, 0.5, 1.0),
        metallic: 0.0,
        specular: 0.0,
        double_sided: true,
        ..Material::default()
    };
    add(&mut scene, &halves, white);
    for (turn, strength) in [(FRAC_PI_2, 3.0), (-FRAC_PI_2, 2.0)] {
        // A light shines along its node's −z.
        let pose = DAffine3::from_rotation_y(turn);
        scene.add_light(LightKind::Directional, Vec3::splat(strength * std::f32::consts::PI), pose);
    }
    let context = gpu::context();
    for (how, expected) in [
        (Fill::Uniform, [[1.5, 1.0]; 4]),
        (Fill::Facing, [[1.0, 1.0], [1.5, 1.0], [0.0, 0.0], [1.25, 1.0]]),
        (Fill::Coverage, [[1.0, 1.0], [1.5, 1.0], [0.0, 0.0], [1.25, 1.0]]),
        (Fill::Front, [[0.0, 0.0], [1.5, 1.0], [0.0, 0.0], [1.5, 1.0]]),
    ] {
        for passes in ["cones.passes=layered", "cones.passes=cells"] {
            let renderer = gpu::render(&context, &scene, &gpu::with(settings(how), &[passes]), 16);
            let volume = gpu::volume(&context, &renderer.frame().method.volumes()[0]);
            // Off the wall's diagonal, where one triangle is listed.
            let at = texel_index(UVec3::new(4, 3, 12), EDGE);
            for (target, [radiance, alpha]) in [0, 3, 1, 6].into_iter().zip(expected) {
                let got = volume.levels()[0][target][at];
                let expected = Vec3::splat(radiance * renderer.frame().scale).extend(alpha);
                let near = (got - expected).abs().cmple(expected / 1024.0).all();
                assert!(near, "{how} {passes} target {target}: {got} is not {expected}");
            }
        }
    }
}

#[test]
fn mips_are_their_twins_in_every_form() {
    let (scene, _) = confetti();
    let context = gpu::context();
    for (d1, d2) in [(Form::Right, Form::Right), (Form::Printed, Form::Right), (Form::Right, Form::Printed)] {
        let mut settings = settings(Fill::Coverage);
        (settings.of.cones.ledger.d1, settings.of.cones.ledger.d2) = (d1, d2);
        let renderer = gpu::render(&context, &scene, &settings, 16);
        let volume = gpu::volume(&context, &renderer.frame().method.volumes()[0]);
        let mut lit = 0;
        for (fine, coarse) in volume.levels().iter().zip(&volume.levels()[1..]) {
            for (got, expected) in coarse.iter().flatten().zip(mip_level(fine, d1, d2).iter().flatten()) {
                // One unit of a half: sums of eight in another order may round differently.
                let unit = (round_to_half(*expected * (1.0 + 1.0 / 1024.0)) - *expected).abs() + 6e-8;
                assert!((*got - *expected).abs().cmple(unit).all(), "{got} is not {expected}");
                lit += usize::from(got.w > 0.0);
            }
        }
        assert!(lit > 500, "{lit} texels are a test of little");
    }
}
