//! The cells form of shading and mips: lists of occupied cells against their twin, and volumes against the raster form's,
//! bit for bit, in a first frame and after things moved.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;
#[path = "common/studio.rs"]
mod studio;

use std::collections::BTreeSet;

use glam::{DAffine3, DVec3, Vec3};
use studio::{Studio, pose, room};
use twobounce::gi::cones::cells::parents;
use twobounce::layout::CellCount;
use twobounce::scene::{Material, Mesh, Scene};
use twobounce::settings::{Bounces, Fill, Settings, Shade, ShadeDirect, Shadows, Work};
use twobounce::vk::download;

const EDGE: u32 = 16;

/// Small sets of cones and rays: what is compared is who is shaded.
fn presets() -> [Settings; 3] {
    let small = |settings: Settings| Settings { voxels: EDGE, shading: Work::Raster, mips: Work::Raster, ..settings };
    [
        small(Settings::fast()),
        small(Settings::printed()),
        small(Settings { fill: Fill::Coverage, ..Settings::default() }),
    ]
}

#[test]
fn every_level_lists_the_parents_of_occupied_voxels() {
    let scene = room();
    let mut studio = Studio::new(&scene, &Settings { voxels: EDGE, ..Settings::fast() });
    studio.volumes(&scene.pose(None, 0.0));
    let pairs = gpu::listed_pairs(&studio.context, &studio.renderer);
    let occupied: Vec<u32> = pairs.iter().map(|p| p.0).collect();
    let lists = &studio.renderer.resources().cells;
    let counts: Vec<CellCount> = download(&studio.context, &lists.counts).expect("counts");
    let listed: Vec<u32> = download(&studio.context, &lists.parents).expect("parents");
    let twin = parents(&occupied, EDGE);
    let mut first = 0;
    for (level, expected) in twin.iter().enumerate() {
        let CellCount { groups_x, groups_y, groups_z, count } = counts[level];
        assert_eq!(count as usize, expected.len(), "level {level}");
        assert_eq!([groups_x, groups_y, groups_z], [count.div_ceil(64), 1, 1], "level {level}");
        if level > 0 {
            let found: BTreeSet<u32> = listed[first..first + count as usize].iter().copied().collect();
            assert_eq!(&found, expected, "level {level}");
            first += (EDGE as usize >> level).pow(3);
        }
    }
    assert!(twin[1].len() > 100);
}

#[test]
fn cells_give_the_rasters_bits_in_every_mixture() {
    let scene = room();
    let (here, there) = (pose(&scene, DVec3::new(1.0, 1.0, 1.0)), pose(&scene, DVec3::new(5.0, 4.0, 3.0)));
    for raster in presets() {
        let first = Studio::new(&scene, &raster).volumes(&here);
        let moved = Studio::new(&scene, &raster).volumes(&there);
        assert!(first.iter().zip(&moved).all(|(a, b)| a != b), "the box shows");
        for (shading, mips) in [(Work::Cells, Work::Cells), (Work::Cells, Work::Raster), (Work::Raster, Work::Cells)] {
            let mut studio = Studio::new(&scene, &Settings { shading, mips, ..raster.clone() });
            assert!(studio.volumes(&here) == first, "{} {shading} {mips}: first frame", raster.fill);
            assert!(studio.volumes(&there) == moved, "{} {shading} {mips}: after the box moved", raster.fill);
            assert!(studio.volumes(&here) == first, "{} {shading} {mips}: after it came back", raster.fill);
        }
    }
}

#[test]
fn lists_that_had_to_grow_leave_nothing_behind() {
    // Twelve sheets of 64² voxels: more cells than there is room for at first.
    let mut scene = Scene::empty("sheets");
    let material = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    for k in 0..12 {
        let y = f64::from(k) * 5.0 + 0.5;
        let corner = |x: f64, z: f64| DVec3::new(x, y, z).as_vec3();
        let triangles = [
            [corner(0.5, 0.5), corner(0.5, 63.5), corner(63.5, 0.5)],
            [corner(63.5, 63.5), corner(63.5, 0.5), corner(0.5, 63.5)],
        ];
        scene.add_mesh(Mesh::triangles("sheet", material, &triangles), DAffine3::IDENTITY);
    }
    let mut raster = Settings { voxels: 64, bounces: Bounces::One, ..presets()[0].clone() };
    raster.volume.center = Some([32.0; 3]);
    raster.volume.side = Some(64.0);
    let cells = Settings { shading: Work::Cells, mips: Work::Cells, ..raster.clone() };
    let pose = scene.pose(None, 0.0);
    let mut studio = Studio::new(&scene, &cells);
    let found = studio.volumes(&pose);
    let occupied = studio.renderer.render(&pose, &studio.view).expect("a frame").counters.occupied_voxels;
    assert!(occupied > 1 << 15, "{occupied} cells are not more than there is room for");
    assert!(found == Studio::new(&scene, &raster).volumes(&pose));
}

#[test]
fn direct_light_that_is_kept_is_what_would_be_found_again() {
    let scene = room();
    let (here, there) = (pose(&scene, DVec3::new(1.0, 1.0, 1.0)), pose(&scene, DVec3::new(5.0, 4.0, 3.0)));
    for (bounces, shading) in [(Bounces::Two, Work::Cells), (Bounces::Two, Work::Raster), (Bounces::All, Work::Cells)] {
        let with = |direct| {
            let shade = Shade { direct, ..Settings::fast().shade };
            Settings { voxels: EDGE, bounces, shading, shade, ..Settings::fast() }
        };
        let (again, kept) = (with(ShadeDirect::Again), with(ShadeDirect::Kept));
        assert!(kept.keeps_direct() && !again.keeps_direct());
        let (mut again, mut kept) = (Studio::new(&scene, &again), Studio::new(&scene, &kept));
        for pose in [&here, &there] {
            assert!(again.volumes(pose) == kept.volumes(pose), "{bounces} {shading}");
        }
    }
}

#[test]
fn direct_light_is_not_kept_where_the_second_bounce_would_find_another() {
    let kept = Settings::fast();
    assert!(kept.keeps_direct());
    assert!(!Settings { first_bounce_shadows: false, ..kept.clone() }.keeps_direct());
    assert!(!Settings { shadows: Shadows::Cones, ..kept.clone() }.keeps_direct());
    assert!(!Settings { bounces: Bounces::One, ..kept }.keeps_direct());
}
