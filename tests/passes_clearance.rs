//! How far around every voxel nothing is listed, against its twin. That rays find the same with it as without, the tests of
//! light against closed forms and the path tracer hold.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use glam::{DVec3, Vec3};
use gpu::twins::cells::clearance_codes;
use scenes::{Random, add, triangle};
use twobounce::scene::{Material, Scene};
use twobounce::settings::{Bounces, Settings};
use twobounce::vk::download;

/// Which of a clearance's codes occur in a scene of crumbs about `centers`, after the device's were held against the twin's.
fn checked(edge: u32, centers: &[DVec3]) -> Vec<u32> {
    let mut random = Random::new(u64::from(edge));
    let crumbs: Vec<_> = centers.iter().map(|&center| triangle(&mut random, center, 0.4)).collect();
    let mut scene = Scene::empty("crumbs");
    add(&mut scene, &crumbs, Material::lamp("lamp", Vec3::ONE));
    let mut settings = Settings { voxels: edge, bounces: Bounces::One, ..Settings::fast() };
    settings.grid.center = Some([f64::from(edge) / 2.0; 3]);
    settings.grid.side = Some(f64::from(edge));
    let context = gpu::context();
    let renderer = gpu::render(&context, &scene, &settings, 8);
    let mut occupied = vec![false; edge.pow(3) as usize];
    gpu::listed_pairs(&context, &renderer).iter().for_each(|pair| occupied[pair.0 as usize] = true);
    assert!(occupied.contains(&true));
    let words: Vec<u32> = download(&context, &renderer.ground().base().clearance).expect("clearance");
    let found: Vec<u32> = (0..edge.pow(3)).map(|voxel| words[voxel as usize / 8] >> (voxel % 8 * 4) & 15).collect();
    let expected = clearance_codes(&occupied, edge);
    for (voxel, (found, expected)) in found.iter().zip(&expected).enumerate() {
        assert_eq!(found, expected, "{edge}³, voxel {voxel}");
    }
    (0..16).filter(|code| found.contains(code)).collect()
}

#[test]
fn every_voxel_knows_how_far_nothing_is_listed() {
    // A row of bits that is shorter than a word, one that fills it, and one of two words.
    for (edge, crumbs) in [(16, 6), (32, 20), (64, 20)] {
        let mut random = Random::new(7);
        let centers: Vec<_> = (0..crumbs).map(|_| 1.0 + random.point() * f64::from(edge - 2)).collect();
        let codes = checked(edge, &centers);
        assert!(codes.starts_with(&[0, 1, 2, 3, 4]) && codes.len() > 5 || edge == 16, "{edge}³: {codes:?}");
    }
}

#[test]
fn what_is_far_away_is_known_as_far_as_is_looked() {
    let codes = checked(128, &[DVec3::splat(1.5), DVec3::new(126.5, 126.5, 1.5)]);
    assert_eq!(codes, (0..16).collect::<Vec<_>>());
}
