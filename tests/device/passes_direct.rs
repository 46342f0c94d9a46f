//! Direct light and its exact shadows against closed forms: a floor under a spot, a point and a directional light, in
//! the shadow of a square, opaque or with a half that is masked or clear, and under many lamps; the Cornell box with a
//! point light against its path-traced image; and the layer that marks diffuse surfaces, and their share of light,
//! against the path tracer's.

use crate::gpu;

use std::path::Path;

use crate::traced::film;
use glam::{DAffine3, DQuat, DVec3, Vec3, Vec4};
use gpu::twins::lamps::triangle_irradiance;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::metrics;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::{
    Alpha, LightKind, LoadOptions, Material, Mesh, Mip, Projection, Scene, Texture, TextureImage, TextureRef, View,
    Wrap,
};
use twobounce::settings::{Bounces, Settings};

const SIZE: u32 = 96;
/// The image's side in metres.
const HALF: f64 = 1.0;
const ALBEDO: f64 = 0.5;
/// The blocker: a square at this height, metres.
const HEIGHT: f64 = 1.0;
const BLOCKER: [f64; 4] = [-0.3, 0.25, -0.2, 0.4];
const SPOT_INNER: f64 = 0.2;
const SPOT_OUTER: f64 = 0.45;

/// Exact shadows over a grid of `voxels`³.
fn exact(voxels: u32) -> Settings {
    let settings = Settings { voxels, bounces: Bounces::One, ..Settings::corrected() };
    gpu::with(settings, &["lights.shadows=rays", "cones.first_bounce_shadows=true"])
}

#[derive(Clone, Copy, Debug)]
enum Lamp {
    Point,
    Spot,
    Directional,
}

impl Lamp {
    fn position(self) -> DVec3 {
        DVec3::new(0.15, 2.0, -0.1)
    }

    /// The kind of light.
    fn direction(self) -> DVec3 {
        match self {
            Self::Directional => DVec3::new(0.3, -1.0, 0.2).normalize(),
            _ => DVec3::NEG_Y,
        }
    }

    fn kind(self) -> LightKind {
        match self {
            Self::Point => LightKind::Point,
            Self::Spot => LightKind::Spot { inner: SPOT_INNER as f32, outer: SPOT_OUTER as f32 },
            Self::Directional => LightKind::Directional,
        }
    }

    /// Irradiance of an unblocked floor point, and the direction to the light.
    fn irradiance(self, p: DVec3) -> (f64, DVec3) {
        if let Self::Directional = self {
            return (3.0 * -self.direction().y, -self.direction());
        }
        let to = self.position() - p;
        let d = to.normalize();
        let falloff = match self {
            Self::Spot => {
                let (inner, outer) = (SPOT_INNER.cos(), SPOT_OUTER.cos());
                ((d.y - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2)
            }
            _ => 1.0,
        };
        (3.0 * falloff * d.y / to.length_squared(), d)
    }
}

/// Material of the half of the blocker with u > ½.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Half {
    Opaque,
    /// By an alpha mask.
    Hole,
    /// Clear, where the other half is metal by a texture.
    Glass,
}

fn scene(lamp: Lamp, half: Half) -> Scene {
    let mut scene = Scene::empty("floor");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(ALBEDO as f32)));
    let mut leaf = Material { double_sided: true, ..Material::lambert("leaf", Vec3::ONE) };
    if half != Half::Opaque {
        // Alpha 1 and 0; metalness, which is the blue channel, likewise.
        let rgba = vec![255, 255, 255, 255, 255, 255, 0, 0];
        scene.images.push(TextureImage { name: "half".into(), width: 2, height: 1, rgba });
        let wrap = [Wrap::Clamp; 2];
        scene.textures.push(Texture { image: 0, wrap, mag_linear: false, min_linear: false, mip: Mip::None });
    }
    let texture = Some(TextureRef { texture: 0, uv_set: 0, transform: Default::default() });
    match half {
        Half::Opaque => (),
        Half::Hole => (leaf.alpha, leaf.base_color_texture) = (Alpha::Mask(0.5), texture),
        Half::Glass => (leaf.transmission, leaf.metallic, leaf.metallic_roughness_texture) = (1.0, 1.0, texture),
    }
    let leaf = scene.add_material(leaf);
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    let [x0, x1, z0, z1] = BLOCKER.map(|v| v as f32);
    let blocker =
        Mesh::quad("blocker", leaf, Vec3::new(x0, HEIGHT as f32, z0), Vec3::X * (x1 - x0), Vec3::Z * (z1 - z0));
    scene.add_mesh(blocker, DAffine3::IDENTITY);
    let turn = DQuat::from_rotation_arc(DVec3::NEG_Z, lamp.direction());
    scene.add_light(lamp.kind(), Vec3::splat(3.0), DAffine3::from_rotation_translation(turn, lamp.position()));
    scene
}

/// Radiance of a floor point.
fn radiance(lamp: Lamp, half: Half, p: DVec3) -> f64 {
    let (irradiance, d) = lamp.irradiance(p);
    let at = p + d * (HEIGHT / d.y);
    let [x0, x1, z0, z1] = BLOCKER;
    let last = if half == Half::Opaque { x1 } else { (x0 + x1) / 2.0 };
    let blocked = (x0..last).contains(&at.x) && (z0..z1).contains(&at.z);
    if blocked { 0.0 } else { ALBEDO / std::f64::consts::PI * irradiance }
}

/// The image's mean over each pixel's area, 16×16 points.
fn expected(lamp: Lamp, half: Half, view: &View) -> Vec<[f32; 3]> {
    const POINTS: u32 = 16;
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(POINTS * SIZE) * 2.0 - 1.0;
    let mut pixels = vec![0.0; (SIZE * SIZE) as usize];
    for y in 0..POINTS * SIZE {
        for x in 0..POINTS * SIZE {
            let p = view.eye + (view.right() * at(x) - view.up * at(y)) * HALF;
            let sum = &mut pixels[(y / POINTS * SIZE + x / POINTS) as usize];
            *sum += radiance(lamp, half, DVec3::new(p.x, 0.0, p.z)) / f64::from(POINTS * POINTS);
        }
    }
    pixels.iter().map(|&v| [v as f32; 3]).collect()
}

#[test]
fn lights_and_shadows_are_the_closed_forms() {
    let context = gpu::context();
    let projection = Projection::Orthographic { half_height: HALF as f32, near: 0.01, far: 10.0 };
    // From below the blocker, looking down.
    let view = View { eye: DVec3::Y * 0.5, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    for lamp in [Lamp::Point, Lamp::Spot, Lamp::Directional] {
        for half in [Half::Opaque, Half::Hole, Half::Glass] {
            let scene = scene(lamp, half);
            let settings = exact(32);
            let image = gpu::render_layers(&context, &scene, &settings, SIZE, view, vec![Aov::Direct]).read();
            let direct = image.get(Aov::Direct).expect("asked for").to_vec();
            let truth = expected(lamp, half, &view);
            let found = metrics(&direct, &truth, "the floor").expect("images of one size");
            // Four samples of a pixel represent the area that a shadow's edge cuts.
            let right = (found.energy - 1.0).abs() < 0.003 && found.rel < 0.01;
            assert!(right, "{lamp:?}, {half:?}: energy {}, rel {}", found.energy, found.rel);
        }
    }
    // The purpose of the test: light passes the leaf's hole.
    let [opaque, hole] = [Half::Opaque, Half::Hole].map(|half| radiance(Lamp::Directional, half, shaded()));
    assert!(hole > 0.0 && opaque == 0.0);
}

/// A floor point whose ray to the directional light passes the half of the blocker that may be open.
fn shaded() -> DVec3 {
    let through = DVec3::new(BLOCKER[1] - 0.05, HEIGHT, 0.1);
    let d = Lamp::Directional.direction();
    through + d * (HEIGHT / -d.y)
}

#[test]
fn the_cornell_box_has_the_path_traced_direct_light() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/truth/cornell-point");
    let scene = Scene::load(&folder.join("cornell-point.glb"), &LoadOptions::default()).expect("the scene loads");
    let (truth, _) = Layers::read_exr(&folder.join("direct.exr")).expect("the image is there");
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let settings = exact(32);
    // The reference at twice the size, averaged: sixteen samples for each of its pixels.
    let image = gpu::render_layers(&gpu::context(), &scene, &settings, 2 * truth.width, view, vec![Aov::Direct]).read();
    let direct = image.get(Aov::Direct).expect("asked for");
    let width = truth.width as usize;
    let halved: Vec<[f32; 3]> = (0..width * width)
        .map(|i| {
            let corner = 2 * (i / width * 2 * width + i % width);
            let four = [corner, corner + 1, corner + 2 * width, corner + 2 * width + 1].map(|k| Vec3::from(direct[k]));
            (four.into_iter().sum::<Vec3>() / 4.0).into()
        })
        .collect();
    let found = metrics(&halved, truth.beauty(), "direct light").expect("images of one size");
    // The tolerance covers samples at edges, and the reference's own noise of 0.3 %.
    assert!((found.energy - 1.0).abs() < 0.003 && found.rel < 0.01, "energy {}, rel {}", found.energy, found.rel);
}

#[test]
fn what_hangs_right_below_a_light_casts_its_shadow() {
    let mut scene = Scene::empty("a leaf below a light");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(ALBEDO as f32)));
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    // A voxel is 0.15 m: the leaf lies half of one below the light.
    let leaf = scene.add_material(Material { double_sided: true, ..Material::lambert("leaf", Vec3::ONE) });
    let corner = Vec3::new(-0.5, 1.93, -0.5);
    scene.add_mesh(Mesh::quad("leaf", leaf, corner, Vec3::X, Vec3::Z), DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::splat(3.0), DAffine3::from_translation(DVec3::Y * 2.0));
    let projection = Projection::Orthographic { half_height: HALF as f32, near: 0.01, far: 10.0 };
    let view = View { eye: DVec3::Y * 0.5, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    let settings = exact(32);
    let image = gpu::render_layers(&gpu::context(), &scene, &settings, 16, view, vec![Aov::Direct]).read();
    assert!(image.get(Aov::Direct).expect("asked for").iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn veils_hide_what_lies_behind_them_in_any_order() {
    // Red, green and blue; each hides half of the light behind it; from the back to the front.
    let colors = [Vec3::X, Vec3::Y, Vec3::Z];
    let expected = colors.iter().fold(Vec3::ZERO, |behind, color| 0.5 * behind + 0.5 * color);
    let projection = Projection::Orthographic { half_height: 0.5, near: 0.01, far: 10.0 };
    let view = View { eye: DVec3::Z * 5.0, forward: DVec3::NEG_Z, up: DVec3::Y, projection };
    let settings = exact(16);
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        let mut scene = Scene::empty("veils");
        for k in order {
            let veil = Material { unlit: true, alpha: Alpha::Blend, ..Material::lambert("veil", colors[k]) };
            let veil = scene.add_material(Material { base_color: colors[k].extend(0.5), ..veil });
            let corner = Vec3::new(-1.0, -1.0, k as f32);
            scene.add_mesh(Mesh::quad("veil", veil, corner, 2.0 * Vec3::X, 2.0 * Vec3::Y), DAffine3::IDENTITY);
        }
        let image = gpu::render_from(&gpu::context(), &scene, &settings, 8, view).read();
        for (i, p) in image.beauty().iter().enumerate() {
            let off = (Vec3::from(*p) - expected).abs().max_element();
            assert!(off < 1e-3, "{order:?}: pixel {i} shows {p:?}, not {expected}");
        }
    }
}

/// A square that hides half of the light behind it and emits one colour.
fn add_veil(scene: &mut Scene, color: Vec3, corner: Vec3, along: Vec3) {
    let veil = Material { unlit: true, double_sided: true, alpha: Alpha::Blend, ..Material::lambert("veil", color) };
    let veil = scene.add_material(Material { base_color: color.extend(0.5), ..veil });
    scene.add_mesh(Mesh::quad("veil", veil, corner, along, 2.0 * Vec3::Y), DAffine3::IDENTITY);
}

/// The colours of the columns of an image with an edge of 8 pixels, seen from the front, 1 m to both sides.
fn columns_of_veils(scene: &Scene) -> Vec<Vec3> {
    let projection = Projection::Orthographic { half_height: 1.0, near: 0.01, far: 10.0 };
    let view = View { eye: DVec3::Z * 5.0, forward: DVec3::NEG_Z, up: DVec3::Y, projection };
    let image = gpu::render_from(&gpu::context(), scene, &exact(16), 8, view).read();
    let rows: Vec<&[[f32; 3]]> = image.beauty().chunks(8).collect();
    (0..8).map(|x| rows.iter().map(|row| Vec3::from(row[x])).sum::<Vec3>() / 8.0).collect()
}

/// There are far more fragments than the list first holds.
#[test]
fn forty_shuffled_veils_are_sorted() {
    const VEILS: u32 = 40;
    let color = |place: u32| Vec3::new((place % 2) as f32, (place % 3) as f32 / 2.0, (place % 5) as f32 / 4.0);
    let mut scene = Scene::empty("veils");
    for k in 0..VEILS {
        let place = k * 17 % VEILS;
        add_veil(&mut scene, color(place), Vec3::new(-1.0, -1.0, place as f32 / 20.0), 2.0 * Vec3::X);
    }
    let expected = (0..VEILS).fold(Vec3::ZERO, |behind, place| 0.5 * behind + 0.5 * color(place));
    for column in columns_of_veils(&scene) {
        assert!((column - expected).abs().max_element() < 1e-3, "{column} is not {expected}");
    }
}

/// No order of triangles is right for both sides.
#[test]
fn veils_that_cross_hide_each_other_on_one_side_each() {
    let mut scene = Scene::empty("veils");
    add_veil(&mut scene, Vec3::X, Vec3::new(-1.0, -1.0, -1.0), Vec3::new(2.0, 0.0, 2.0));
    add_veil(&mut scene, Vec3::Y, Vec3::new(-1.0, -1.0, 1.0), Vec3::new(2.0, 0.0, -2.0));
    for (x, column) in columns_of_veils(&scene).into_iter().enumerate() {
        let (near, far) = if x < 4 { (Vec3::Y, Vec3::X) } else { (Vec3::X, Vec3::Y) };
        let expected = 0.5 * near + 0.25 * far;
        assert!((column - expected).abs().max_element() < 1e-3, "column {x}: {column} is not {expected}");
    }
}

/// The lamps over a floor: squares in a grid, metres.
const TILES: i32 = 12;
const TILE: f32 = 0.1;
const APART: f32 = 0.3;
const TILE_HEIGHT: f32 = 0.2;

#[test]
fn light_close_to_one_of_many_lamps_is_even() {
    let mut scene = Scene::empty("a floor under many lamps");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(ALBEDO as f32)));
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    let corner = |k: i32| (k as f32 - 0.5 * (TILES - 1) as f32) * APART - 0.5 * TILE;
    let tiles: Vec<[Vec3; 3]> = (0..TILES * TILES)
        .flat_map(|k| {
            let a = Vec3::new(corner(k % TILES), TILE_HEIGHT, corner(k / TILES));
            let (b, c, d) = (a + Vec3::X * TILE, a + (Vec3::X + Vec3::Z) * TILE, a + Vec3::Z * TILE);
            [[a, b, c], [a, c, d]]
        })
        .collect();
    scene.add_mesh(Mesh::triangles("lamps", lamp, &tiles), DAffine3::IDENTITY);

    const EDGE: u32 = 32;
    let projection = Projection::Orthographic { half_height: HALF as f32, near: 0.01, far: 10.0 };
    let view = View { eye: DVec3::Y * 0.1, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    let settings = exact(32);
    let settings = gpu::with(settings, &["lights.lamps=sampled", "lights.lamp_points=16", "image.samples=1"]);
    let rendered = gpu::render_layers(&gpu::context(), &scene, &settings, EDGE, view, vec![Aov::Direct]).read();
    let at = |k: u32| (2.0 * f64::from(k) + 1.0) / f64::from(EDGE) - 1.0;
    let truth: Vec<[f32; 3]> = (0..EDGE * EDGE)
        .map(|i| {
            let p = view.eye + (view.right() * at(i % EDGE) - view.up * at(i / EDGE)) * HALF;
            let p = DVec3::new(p.x, 0.0, p.z);
            let from = |tile: &[Vec3; 3]| triangle_irradiance(&tile.map(|corner| corner.as_dvec3() - p), DVec3::Y);
            [(ALBEDO / std::f64::consts::PI * tiles.iter().map(from).sum::<f64>()) as f32; 3]
        })
        .collect();
    let found =
        metrics(rendered.get(Aov::Direct).expect("asked for"), &truth, "the floor").expect("images of one size");
    // Noise of sixteen points on 288 pieces.
    let right = (found.energy - 1.0).abs() < 0.01 && found.rel < 0.1;
    assert!(right, "energy {}, rel {}", found.energy, found.rel);
}

/// Stripes side by side before a grey wall or nothing, and the diffuse share of each.
const STRIPES: usize = 8;

fn stripes() -> (Scene, [f32; STRIPES]) {
    let lambert = || Material { double_sided: true, ..Material::lambert("stripe", Vec3::splat(0.5)) };
    let metal = |metallic| Material { metallic, ..lambert() };
    let glass = |transmission, roughness, specular| Material { transmission, roughness, specular, ..lambert() };
    let veil = |alpha| Material { alpha: Alpha::Blend, base_color: Vec4::new(0.5, 0.5, 0.5, alpha), ..metal(1.0) };
    let stripes = [
        (lambert(), 1.0),
        (metal(1.0), 0.0),
        (metal(0.25), 0.75),
        // One is smooth and nearly clear, one scatters.
        (glass(1.0, 0.0, 0.0), 0.0),
        (glass(0.5, 0.6, 1.0), 0.5),
        (veil(0.25), 0.75),
        (Material { unlit: true, ..lambert() }, 0.0),
    ];
    let mut scene = Scene::empty("stripes");
    let mut shares = [0.0; STRIPES];
    for (i, (material, share)) in stripes.into_iter().enumerate() {
        let material = scene.add_material(material);
        let corner = Vec3::new(i as f32 - STRIPES as f32 / 2.0, -4.0, 0.0);
        scene.add_mesh(Mesh::quad("stripe", material, corner, Vec3::X, 8.0 * Vec3::Y), DAffine3::IDENTITY);
        shares[i] = share;
    }
    let grey = scene.add_material(lambert());
    let wall = Mesh::quad("wall", grey, Vec3::new(-4.0, -4.0, -0.01), 7.0 * Vec3::X, 8.0 * Vec3::Y);
    scene.add_mesh(wall, DAffine3::IDENTITY);
    (scene, shares)
}

/// Without a bounce.
fn traced(scene: &Scene, view: &View, size: u32, samples: u32, aovs: &[Aov]) -> Layers {
    let (depth, stop) = (Depth::Bounces(0), Stop::Samples(samples));
    let options = Options { width: size, height: size, depth, stop, seed: 0, occlusion: false };
    film(scene, view, &options).layers(aovs)
}

#[test]
fn the_diffuse_layer_is_the_path_tracers() {
    let (scene, shares) = stripes();
    // A stripe is four pixels wide.
    let size = 4 * STRIPES as u32;
    let view = View::look_at(DVec3::Z * 10.0, DVec3::ZERO, DVec3::Y, 2.0 * 0.4f32.atan());
    let settings = exact(16);
    let aovs = [Aov::Depth, Aov::Diffuse];
    let image = gpu::render_layers(&gpu::context(), &scene, &settings, size, view, aovs.to_vec()).read();
    let truth = traced(&scene, &view, size, 256, &aovs);
    for (name, layers, tolerance) in [("device", image, 1e-3), ("path tracer", truth, 0.02)] {
        let diffuse = layers.get(Aov::Diffuse).expect("asked for");
        for (stripe, share) in shares.iter().enumerate() {
            for x in [4 * stripe + 1, 4 * stripe + 2] {
                let column = (0..size as usize).map(|y| diffuse[y * size as usize + x]);
                let mean: f32 = column.clone().map(|p| p[0]).sum::<f32>() / size as f32;
                assert!((mean - share).abs() < tolerance, "{name}: {mean} in stripe {stripe}, {share} expected");
                assert!(column.clone().all(|p| p[0] == p[1] && p[1] == p[2]), "{name}: three channels differ");
                let exact = *share == 0.0 || *share == 1.0;
                assert!(!exact || column.clone().all(|p| p[0] == *share), "{name}: stripe {stripe} is noisy");
            }
        }
        // The layer shares its image with others.
        let depth = layers.get(Aov::Depth).expect("asked for");
        assert!((depth[1][0] - 10.0).abs() < 0.02 && depth[size as usize - 2][0] == f32::INFINITY, "{name}");
    }
}

#[test]
fn metal_and_transmission_each_take_their_share_of_diffuse_light() {
    const ALBEDO: f32 = 0.5;
    const SIZE: u32 = 8;
    let context = gpu::context();
    let view = View::look_at(DVec3::Z * 2.0, DVec3::ZERO, DVec3::Y, 0.1);
    let settings = exact(16);
    for (metallic, transmission) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5), (0.25, 0.75), (0.5, 1.0)] {
        let mut scene = Scene::empty("a part metal, a part glass");
        // Light from a direction that a smooth surface mirrors past the viewer: only the diffuse part remains.
        let surface =
            Material { metallic, transmission, roughness: 0.1, ..Material::lambert("both", Vec3::splat(ALBEDO)) };
        let surface = scene.add_material(surface);
        let wall = Mesh::quad("wall", surface, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
        scene.add_mesh(wall, DAffine3::IDENTITY);
        let from = DVec3::new(1.0, 0.0, 1.0).normalize();
        let turn = DAffine3::from_quat(DQuat::from_rotation_arc(DVec3::NEG_Z, -from));
        scene.add_light(LightKind::Directional, Vec3::splat(std::f32::consts::PI), turn);
        let expected = ALBEDO * (1.0 - metallic) * (1.0 - transmission) * from.z as f32;
        let image = gpu::render_layers(&context, &scene, &settings, SIZE, view, vec![Aov::Direct]).read();
        for (name, layers) in [("device", image), ("path tracer", traced(&scene, &view, SIZE, 16, &[Aov::Direct]))] {
            let found = layers.get(Aov::Direct).expect("asked for")[(SIZE * SIZE + SIZE) as usize / 2][0];
            // The tolerance covers the rest of the lobe at 22°.
            let near = (found - expected).abs() < 0.003 * expected + 0.001 * ALBEDO;
            assert!(near, "{name}, metallic {metallic}, transmission {transmission}: {found} is not {expected}");
        }
    }
}
