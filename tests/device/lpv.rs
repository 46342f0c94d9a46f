//! Light propagation as a whole: images of scenes whose light is known. `passes_lpv.rs` checks its steps.

use crate::gpu;
use crate::studio::asset;

use std::f64::consts::PI;

use glam::{Affine2, DAffine3, DVec3, Vec3};
use gpu::twins::propagation::{Texture as Coefficients, as_coefficients};
use twobounce::layers::Aov;
use twobounce::scene::{
    LightKind, Material, Mesh, Mip, Scene, Texture, TextureImage, TextureRef, View, Wrap, analytic,
};
use twobounce::settings::Settings;
use twobounce::vk::download_image;

fn lpv(changes: &[&str]) -> Settings {
    gpu::with(Settings { voxels: 32, ..Settings::lpv() }, &[&["image.gather_resolution=full"], changes].concat())
}

/// The image of a small plate under a sky of radiance 1.
fn plate_under_sky(changes: &[&str]) -> Vec<[f32; 3]> {
    let mut scene = Scene::empty("plate");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    let plate = Mesh::quad("plate", grey, Vec3::new(-0.02, 0.0, -0.02), Vec3::Z * 0.04, Vec3::X * 0.04);
    scene.add_mesh(plate, DAffine3::IDENTITY);
    scene.sky = Vec3::ONE;
    let view = View::look_at(DVec3::Y * 0.06, DVec3::ZERO, DVec3::Z, 20f32.to_radians());
    let settings = lpv(&[&["grid.side=1", "grid.center=0,0,0", "lpv.edge=16", "bounces=1"], changes].concat());
    gpu::render_layers(&gpu::context(), &scene, &settings, 8, view, vec![Aov::Ao]).read().beauty().to_vec()
}

/// Only the sky's light, which comes in from all sides: the radiance of the plate's front is its albedo times the open
/// share, all of the hemisphere.
#[test]
fn the_sky_arrives_whole() {
    let image = plate_under_sky(&["lpv.iterations=1000"]);
    let mean = image.iter().map(|p| f64::from(p[1])).sum::<f64>() / 64.0;
    // 1000 steps of 16³ cells leave a thousandth of the light in the grid; the plate, of two thirds of a cell, absorbs
    // some of its own light.
    assert!((mean / 0.5 - 1.0).abs() < 0.05, "{mean}");
}

/// Deep inside a room that is open to one side, the sky's light arrives by way of the walls, after more steps than one
/// per cell.
#[test]
fn under_a_sky_light_goes_twice_as_many_steps() {
    let mut scene = Scene::empty("room");
    let white = scene.add_material(Material { double_sided: true, ..Material::lambert("white", Vec3::splat(0.8)) });
    let side = 0.9;
    let mut wall = |corner: [f32; 3], u: Vec3, v: Vec3| {
        scene.add_mesh(
            Mesh::quad("wall", white, side * Vec3::from(corner) * 0.5, side * u, side * v),
            DAffine3::IDENTITY,
        );
    };
    wall([-1.0, -1.0, -1.0], Vec3::X, Vec3::Y);
    wall([-1.0, -1.0, -1.0], Vec3::X, Vec3::Z);
    wall([-1.0, 1.0, -1.0], Vec3::X, Vec3::Z);
    wall([-1.0, -1.0, -1.0], Vec3::Y, Vec3::Z);
    wall([1.0, -1.0, -1.0], Vec3::Y, Vec3::Z);
    scene.sky = Vec3::ONE;
    let view = View::look_at(DVec3::Z * 0.4, DVec3::ZERO, DVec3::Y, 60f32.to_radians());
    let image = |changes: &[&str]| {
        let settings = lpv(&[&["grid.side=1", "grid.center=0,0,0", "lpv.edge=16"], changes].concat());
        gpu::render_from(&gpu::context(), &scene, &settings, 8, view).read().beauty().to_vec()
    };
    let mean = |image: &[[f32; 3]]| image.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.len() as f64;
    let [auto, once, twice] = [&[][..], &["lpv.iterations=16"], &["lpv.iterations=32"]].map(image);
    assert_eq!(auto, twice);
    assert!(mean(&twice) > 1.02 * mean(&once), "{} and {}", mean(&twice), mean(&once));
}

/// Light of a closed room does not pass its walls, one-sided or not, and a room beside it stays dark.
#[test]
fn sheets_do_not_leak() {
    for double_sided in [false, true] {
        let mut scene = Scene::empty("two rooms");
        let wall = Material { double_sided, ..Material::lambert("wall", Vec3::splat(0.7)) };
        let wall = scene.add_material(wall);
        for x in [-2.1, 0.1] {
            let (min, max) = (Vec3::new(x, -1.0, -1.0), Vec3::new(x + 2.0, 1.0, 1.0));
            scene.add_mesh(Mesh::cuboid("room", wall, min, max, true), DAffine3::IDENTITY);
        }
        scene.add_light(LightKind::Point, Vec3::splat(5.0), DAffine3::from_translation(DVec3::new(-1.1, 0.0, 0.0)));
        let mean = |x: f64, changes: &[&str]| {
            let view = View::look_at(DVec3::new(x, 0.3, 0.9), DVec3::new(x, 0.0, -1.0), DVec3::Y, 80f32.to_radians());
            let image = gpu::render_from(&gpu::context(), &scene, &lpv(changes), 24, view).read();
            image.beauty().iter().map(|p| f64::from(p[1])).sum::<f64>() / 576.0
        };
        let (lit, dark) = (mean(-1.1, &[]), mean(1.1, &[]));
        // Areas clipped in f32 and kept in sixteen bits, in every cell of the wall; nothing else passes.
        assert!(dark < 5e-4 * lit, "doubleSided {double_sided}: {dark} of {lit}");
        let (lit, leaked) = (mean(-1.1, &["lpv.occlusion=none"]), mean(1.1, &["lpv.occlusion=none"]));
        assert!(leaked > 1e-2 * lit, "without occlusion it must leak: {leaked} of {lit}");
    }
}

/// The injected light equals the light that a surface sends: a wall of one metre by one that sends 2, in cells of a
/// sixteenth of a metre.
#[test]
fn a_wall_injects_pi_times_radiance_times_area() {
    let mut scene = Scene::empty("wall");
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(2.0)));
    let quad = Mesh::quad("wall", lamp, Vec3::new(-0.5, 0.03, -0.5), Vec3::Z, Vec3::X);
    scene.add_mesh(quad, DAffine3::from_rotation_z(0.3) * DAffine3::from_rotation_x(0.4));
    let settings = lpv(&[
        "lights.lamps=gathered",
        "grid.side=2",
        "grid.center=0,0,0",
        "lpv.iterations=1",
        "lpv.lobe=cosine",
        "lpv.occlusion=none",
        "bounces=1",
    ]);
    let context = gpu::context();
    let renderer = gpu::render(&context, &scene, &settings, 8);
    let Some(twobounce::gi::CoarseLight::Full(flux)) = renderer.frame().method.coarse_light() else {
        panic!("no flux")
    };
    let flux: Vec<[f32; 4]> = download_image(&context, flux, 0).expect("a flux");
    let total: f64 = flux.iter().map(|f| f64::from(f[0])).sum::<f64>() / f64::from(renderer.frame().scale);
    // After one step: clamped lobes along an axis have gained 0.1382, and nearly that elsewhere.
    let expected = PI * 2.0 / (2.0f64 / 32.0).powi(2);
    assert!((1.10..1.14).contains(&(total / expected)), "{total} is not {expected}");
}

/// A closed box whose walls emit, and reflect half: all sent light arrives somewhere, so that its mean is right.
#[test]
fn a_furnace_keeps_its_energy() {
    for (bounces, expected) in [("bounces=1", 1.5), ("bounces=2", 1.75)] {
        let scene = analytic::furnace(0.5, 1.0, false);
        let view = scene.view(&scene.pose(None, 0.0), 0);
        let settings = lpv(&["lights.lamps=gathered", "lpv.iterations=128", bounces]);
        let image = gpu::render_from(&gpu::context(), &scene, &settings, 32, view).read();
        let mean = image.beauty().iter().map(|p| f64::from(p[1])).sum::<f64>() / 1024.0;
        // Cells at edges and corners hold two or three walls, and part of their light stays between these.
        assert!((mean / expected - 1.0).abs() < 0.1, "{bounces}: {mean} is not {expected}");
    }
}

/// A scene that fills the coarsest of three grids gives the image of one grid, as long as the camera's grid shows the
/// coarse grid's light of all sides.
#[test]
fn cascades_agree_in_even_light() {
    let scene = analytic::furnace(0.5, 1.0, false);
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let mean = |cascades: &str| {
        let settings = lpv(&["lights.lamps=gathered", "lpv.iterations=128", "lpv.edge=16", "bounces=1", cascades]);
        let image = gpu::render_from(&gpu::context(), &scene, &settings, 32, view).read();
        image.beauty().iter().map(|p| f64::from(p[1])).sum::<f64>() / 1024.0
    };
    let (one, three) = (mean("lpv.cascades=1"), mean("lpv.cascades=3"));
    // Finer cells at edges and corners.
    assert!((three / one - 1.0).abs() < 0.1, "{three} is not {one}");
}

/// A room of side 2 whose walls, floor and block have colours of their own, and whose floor has a normal map.
fn bumpy_room() -> Scene {
    let mut scene = Scene::empty("bumpy room");
    let lean = |x: f32, y: f32| [x, y, (1.0 - x * x - y * y).sqrt()].map(|v| (127.5 + 127.5 * v).round() as u8);
    let rgba = [lean(0.5, 0.0), lean(-0.3, 0.4), lean(0.0, -0.5), lean(0.2, 0.2)]
        .into_iter()
        .flat_map(|[x, y, z]| [x, y, z, 255])
        .collect();
    scene.images.push(TextureImage { name: "bumps".into(), width: 2, height: 2, rgba });
    let wrap = [Wrap::Repeat; 2];
    scene.textures.push(Texture { image: 0, wrap, mag_linear: true, min_linear: true, mip: Mip::None });
    let bumps = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };
    let floor = Material { normal_texture: Some(bumps), ..Material::lambert("floor", Vec3::new(0.8, 0.7, 0.5)) };
    let floor = scene.add_material(floor);
    let wall = scene.add_material(Material::lambert("wall", Vec3::new(0.4, 0.6, 0.8)));
    let block = scene.add_material(Material::lambert("block", Vec3::new(0.9, 0.3, 0.2)));
    scene.add_mesh(
        Mesh::quad("floor", floor, Vec3::new(-1.0, -0.95, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0),
        DAffine3::IDENTITY,
    );
    scene.add_mesh(Mesh::cuboid("walls", wall, Vec3::NEG_ONE, Vec3::ONE, true), DAffine3::IDENTITY);
    let turned = DAffine3::from_translation(DVec3::new(0.2, -0.4, -0.3)) * DAffine3::from_rotation_y(0.5);
    scene.add_mesh(Mesh::cuboid("block", block, Vec3::splat(-0.3), Vec3::splat(0.3), false), turned);
    scene.add_light(LightKind::Point, Vec3::splat(3.0), DAffine3::from_translation(DVec3::new(-0.4, 0.6, 0.3)));
    scene
}

/// The source's page applies light per visible pixel, from a depth buffer, a buffer of perturbed normals and three
/// textures, one a colour, with four coefficients each. The test does so with the image's layers and the sums, and gets
/// the image's indirect light.
#[test]
fn printed_light_is_applied_from_depth_and_perturbed_normals() {
    let scene = bumpy_room();
    let (size, side, edge) = (64, 2.4, 32);
    let view = View::look_at(DVec3::new(0.1, 0.2, 0.95), DVec3::new(0.0, -0.5, -0.4), DVec3::Y, 90f32.to_radians());
    let settings = gpu::with(
        Settings::lpv_printed(),
        &["voxels=32", "grid.side=2.4", "grid.center=0,0,0", "image.samples=1", "bounces=1"],
    );
    let layers = vec![Aov::Indirect, Aov::Depth, Aov::Normal, Aov::Albedo];
    let renderer = gpu::render_layers(&gpu::context(), &scene, &settings, size, view, layers);
    let parts: Vec<Vec<[f32; 4]>> = renderer
        .frame()
        .method
        .images()
        .into_iter()
        .map(|part| download_image(&gpu::context(), part, 0).expect("a part of the sum"))
        .collect();
    let [flux, x, y, z] = parts.try_into().expect("four parts of one sum");
    let texture = |colour: usize| {
        let of = |part: &[[f32; 4]], cell: usize| f64::from(part[cell][colour]);
        let moment = |cell| DVec3::new(of(&x, cell), of(&y, cell), of(&z, cell));
        Coefficients {
            edge,
            cells: (0..flux.len()).map(|cell| as_coefficients(of(&flux, cell), moment(cell))).collect(),
        }
    };
    let textures: Vec<Coefficients> = (0..3).map(texture).collect();
    let image = renderer.read();
    let layer = |aov: Aov| image.get(aov).expect("a layer");
    let vector = |aov: Aov, pixel: usize| Vec3::from(layer(aov)[pixel]).as_dvec3();
    let (mut worst, mut off_facet, mut on_floor) = (0.0f64, 0, 0);
    for pixel in 0..(size * size) as usize {
        let (eye, direction) = view.ray(pixel, (size, size));
        let depth = f64::from(layer(Aov::Depth)[pixel][0]);
        let place = eye + direction * (depth / direction.dot(view.forward));
        let normal = vector(Aov::Normal, pixel);
        let shown = |off: DVec3| {
            let at = (place / side + 0.5) * f64::from(edge) + 0.5 * off;
            let light = |colour: usize| textures[colour].irradiance(at, normal) / PI;
            vector(Aov::Albedo, pixel) * DVec3::from_array([0, 1, 2].map(light)) / f64::from(renderer.frame().scale)
        };
        let (got, expected) = (vector(Aov::Indirect, pixel), shown(normal));
        worst = worst.max((got - expected).abs().max_element() / expected.max_element().max(1e-3));
        // The floor's facets look along +Y.
        if (place.y + 0.95).abs() < 1e-4 {
            on_floor += 1;
            off_facet += usize::from((got - shown(DVec3::Y)).abs().max_element() > 0.01 * got.max_element());
        }
    }
    // The device looks up in f32, and positions come from a depth in f32.
    assert!(worst < 5e-5, "{worst}");
    assert!(on_floor > 500 && off_facet > on_floor / 2, "{off_facet} of {on_floor} pixels tell normals from facets");
}

/// Both sheets of a wall that is thinner than a cell face the same room. If both received the light before them, the
/// wall would reflect up to twice its albedo, .7 here, and the light of all bounces would diverge.
#[test]
fn a_wall_of_two_sheets_mirrors_light_once() {
    let scene = asset("two-rooms.glb");
    let energy = |bounces: &str| {
        let view = scene.view(&scene.pose(None, 0.0), 0);
        let renderer = gpu::render_from(&gpu::context(), &scene, &lpv(&[bounces]), 32, view);
        renderer.read().beauty().iter().flatten().map(|v| f64::from(*v)).sum::<f64>()
    };
    let [two, all] = ["bounces=2", "bounces=all"].map(energy);
    // Light after the second bounce: at most .7, .7², … of the arriving light; much of it ends on the lamp's side.
    assert!(all > two && all < two * (1.0 + 0.7 / 0.3), "{all} of all bounces, {two} of two");
}
