//! Reflections, glass, penumbrae and ambient occlusion against the path tracer, on scenes made for them
//! (`tests/common/gloss.rs`), and the page with their errors: `docs/notes/specular.md`. Where an image changed for the
//! better, TWOBOUNCE_WRITE_DOCS=1 with TWOBOUNCE_TEST_MORE=1 writes the page again.

use crate::gloss;
use crate::gpu;
use crate::more;

use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::traced::film;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{Metrics, metrics};
use twobounce::measure::timing::Spread;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::finish::{Clearcoat, Finish};
use twobounce::scene::{LightKind, Material, Mesh, Scene, Still, View};
use twobounce::settings::Settings;

const SIZE: u32 = 64;
const SAMPLES: u32 = 192;
const LAYERS: [Aov; 4] = [Aov::Direct, Aov::Indirect, Aov::Ao, Aov::Albedo];

/// Settings of every row besides the preset `cones`: the rows measure gloss.
const BASE: [&str; 2] = ["voxels=64", "lights.lamp_points=16"];

fn settings(changes: &[&str]) -> Settings {
    let mut settings = Settings::cones();
    BASE.iter().chain(changes).for_each(|change| settings.set(change).expect("a setting"));
    settings
}

fn view(scene: &Scene) -> View {
    scene.view(&scene.pose(None, 0.0), 0)
}

/// The reference of full light. It is kept between runs where TWOBOUNCE_CACHE names a folder.
fn truth(scene: &Scene, depth: Depth) -> Layers {
    let (view, stop) = (view(scene), Stop::Samples(SAMPLES));
    let options = Options { width: SIZE, height: SIZE, depth, stop, seed: 0, occlusion: true };
    let film = if std::env::var_os("TWOBOUNCE_CACHE").is_some() {
        let pose = scene.pose(None, 0.0);
        let of = Still::new(scene, &pose, &view);
        Cache::of_user().render(of, &options, &|_| {}, &AtomicBool::new(false)).expect("a reference")
    } else {
        film(scene, &view, &options)
    };
    assert_eq!(film.rejected(), 0, "samples that are not finite");
    film.layers(&LAYERS)
}

fn image(scene: &Scene, settings: &Settings) -> Layers {
    gpu::render_layers(&gpu::context(), scene, settings, SIZE, view(scene), LAYERS.to_vec()).read()
}

/// The metrics of the pixels of `layer` for which `counts` holds.
fn over(image: &Layers, truth: &Layers, layer: Aov, counts: impl Fn(usize) -> bool) -> Metrics {
    let pick = |l: &Layers| -> Vec<[f32; 3]> {
        let pixels = l.get(layer).expect("a layer");
        pixels.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, p)| *p).collect()
    };
    let (a, b) = (pick(image), pick(truth));
    assert!(a.len() > 20 && a.iter().flatten().all(|v| v.is_finite()), "{} pixels", a.len());
    metrics(&a, &b, "reference").expect("light")
}

/// Whether a pixel's middle shows a ball at `center`, without its rim.
fn shows(scene: &Scene, pixel: usize, center: DVec3, radius: f64) -> bool {
    let view = view(scene);
    let twobounce::scene::Projection::Perspective { fov, .. } = view.projection else { unreachable!("perspective") };
    let at = |i: usize| ((i as f64 + 0.5) / f64::from(SIZE) * 2.0 - 1.0) * (f64::from(fov) / 2.0).tan();
    let (x, y) = (at(pixel % SIZE as usize), at(pixel / SIZE as usize));
    let d = (view.forward + view.right() * x - view.up * y).normalize();
    let to = center - view.eye;
    to.cross(d).length() < 0.93 * radius
}

/// The part of a scene's image that is compared with the reference.
#[derive(Clone, Copy, Debug)]
enum Region {
    /// One of the row's spheres.
    Sphere(usize),
    Ball,
    Pane,
    /// The reflections of two mirrors in each other.
    Mirrors,
    /// The direct light of the whole image.
    Direct,
    /// The open share of the hemisphere.
    Ao,
}

impl Region {
    fn over(self, scene: &Scene, image: &Layers, truth: &Layers) -> Metrics {
        let ball = |center: DVec3, radius: f64| over(image, truth, Aov::Beauty, |i| shows(scene, i, center, radius));
        match self {
            Self::Sphere(i) => ball(DVec3::new(gloss::SPHERES[i][0], gloss::SPHERES[i][1], 0.0), gloss::SPHERE_RADIUS),
            Self::Ball => ball(gloss::BALL.as_dvec3(), gloss::BALL_RADIUS.into()),
            Self::Pane => ball(DVec3::Z, 0.4),
            Self::Mirrors => ball(DVec3::ZERO, 0.4),
            Self::Direct => over(image, truth, Aov::Direct, |_| true),
            // A part in which a whole wall is visible.
            Self::Ao => over(image, truth, Aov::Ao, |i| truth.get(Aov::Albedo).expect("a layer")[i][0] > 0.49),
        }
    }
}

const CONES: &[&str] = &[];
const GGX: &[&str] = &["cones.roughness_fit=ggx"];
const ONE_RAY: &[&str] = &["method=rays", "rays.diffuse=32", "rays.glossy=1"];
const RAYS: &[&str] = &["method=rays", "rays.diffuse=32", "rays.glossy=8"];
const ALL: &[&str] = &["method=rays", "rays.diffuse=32", "rays.glossy=8", "bounces=all"];
const MANY_RAYS: &[&str] = &["method=rays", "rays.diffuse=32", "rays.glossy=32"];

struct GlossScene {
    name: &'static str,
    scene: Scene,
    depth: Depth,
    parts: &'static [Region],
    /// The tested settings, with the largest mean `rel` of the parts, and the largest deviation of the energy.
    tries: &'static [(&'static [&'static str], f64, f64)],
}

const SPHERES: &[Region] =
    &[Region::Sphere(0), Region::Sphere(1), Region::Sphere(2), Region::Sphere(3), Region::Sphere(4), Region::Sphere(5)];

/// Every subject. All tolerances cover the reference's noise (1 to 3 %) and edges, which cones and rays see once per
/// pixel and the reference once per path.
fn subjects() -> Vec<GlossScene> {
    let full = |name, scene, parts, tries| GlossScene { name, scene, depth: Depth::Full, parts, tries };
    // Two bounces of the room, directly and in the mirror.
    let row = |name, metal, tries| GlossScene {
        depth: Depth::Bounces(2),
        ..full(name, gloss::spheres(metal), SPHERES, tries)
    };
    vec![
        // The rest: squares of the room are 10 voxels and in the mirrors a pixel or less; the volume blurs their edges.
        // One ray represents a whole lobe, as a cone does, and no cone leans down as a rough lobe does.
        row(
            "metal",
            true,
            &[
                (CONES, 0.21, 0.05),
                (GGX, 0.21, 0.05),
                (ONE_RAY, 0.25, 0.06),
                (RAYS, 0.17, 0.05),
                (MANY_RAYS, 0.145, 0.05),
            ],
        ),
        // Eight rays of each sphere's lobe: .987 of the energy on llvmpipe, .969 on an NVIDIA H200.
        row("lacquer", false, &[(CONES, 0.15, 0.03), (RAYS, 0.13, 0.04)]),
        // A pixel is one ray here, and has edges of the wall's squares.
        GlossScene {
            depth: Depth::Bounces(2),
            ..full("two mirrors", gloss::two_mirrors(), &[Region::Mirrors], &[(RAYS, 0.12, 0.03)])
        },
        full("two mirrors, all bounces", gloss::two_mirrors(), &[Region::Mirrors], &[(ALL, 0.15, 0.03)]),
        // Light that glass reflects inside is approximated by the light that is seen through it; here the room is
        // black. A frosted ball is frosted where light enters and smooth where it leaves.
        full("glass ball", gloss::glass_ball(1.5, 0.0), &[Region::Ball], &[(CONES, 0.45, 0.03), (RAYS, 0.17, 0.07)]),
        full("ball of ior 1", gloss::glass_ball(1.0, 0.0), &[Region::Ball], &[(CONES, 0.25, 0.08), (RAYS, 0.12, 0.02)]),
        full("frosted ball", gloss::glass_ball(1.5, 0.3), &[Region::Ball], &[(CONES, 0.41, 0.22), (RAYS, 0.22, 0.16)]),
        full("thin pane", gloss::thin_pane(0.0), &[Region::Pane], &[(CONES, 0.15, 0.02), (RAYS, 0.12, 0.02)]),
        full(
            "penumbra of 0 m",
            gloss::penumbra(0.0),
            &[Region::Direct],
            &[(CONES, 0.04, 0.01), (&["lights.shadows=method"], 0.13, 0.08)],
        ),
        full(
            "penumbra of 0.1 m",
            gloss::penumbra(0.1),
            &[Region::Direct],
            &[(CONES, 0.06, 0.02), (&["lights.shadow_rays=16"], 0.04, 0.02), (&["lights.shadows=method"], 0.14, 0.08)],
        ),
        full(
            "penumbra of 0.25 m",
            gloss::penumbra(0.25),
            &[Region::Direct],
            &[(CONES, 0.11, 0.02), (&["lights.shadow_rays=16"], 0.045, 0.02), (&["lights.shadows=method"], 0.15, 0.06)],
        ),
        full(
            "corner",
            gloss::corner(),
            &[Region::Ao],
            &[(CONES, 0.07, 0.04), (&["method=rays", "rays.diffuse=64"], 0.04, 0.02)],
        ),
    ]
}

/// Subjects of `make test`: a glossy lobe, a mirror in a mirror, glass, a penumbra, occlusion.
const SHORT: [&str; 5] = ["lacquer", "two mirrors", "glass ball", "penumbra of 0.1 m", "corner"];

const HEAD: &str = "# Mirrors, glass, penumbrae and occlusion against the truth

This note compares mirrors, glass, penumbrae and ambient occlusion with the path tracer, for readers who look for the
error of single effects. `tests/device/passes_gloss.rs` measures and checks it (`make test` five of the scenes,
`make test-more` all), and writes it with
`TWOBOUNCE_TEST_MORE=1 TWOBOUNCE_WRITE_DOCS=1 cargo test --release --test device passes_gloss`.

The scenes are in `tests/common/gloss.rs`:

- six spheres of metal or black lacquer with roughness 0, 0.2, 0.4, 0.6, 0.8 and 1, in a checkered room with a lamp;
- a glass ball and a thin pane before a checkered wall;
- two mirrors at a right angle, which show a checkered wall behind the camera;
- a block over a floor, lit by a light of the stated radius;
- a block in a corner under a uniform sky.

*64×64 pixels, 64³ voxels, preset `cones`, 16 points on lamps, and the settings of the row, on llvmpipe. `rel` is the
error of the part of the image that the row is about; rows of spheres have a number for each sphere. `energy` is the
mean over that of the reference, over all spheres. Smaller `rel` is better, and `energy` is best at 1.*

| scene | settings | rel | energy |
|---|---|---|---|
";

#[test]
fn gloss_is_as_close_as_its_page_says() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/notes/specular.md");
    let written = std::fs::read_to_string(&page).unwrap_or_default();
    let mut lines = Vec::new();
    let mut wrong = Vec::new();
    // Every subject would trace two million paths more and exercise no further pass.
    let subjects = subjects().into_iter().filter(|subject| more::all() || SHORT.contains(&subject.name));
    for GlossScene { name, scene, depth, parts, tries } in subjects {
        let truth = truth(&scene, depth);
        for (changes, most_rel, most_energy) in tries {
            let image = image(&scene, &settings(changes));
            let found: Vec<Metrics> = parts.iter().map(|part| part.over(&scene, &image, &truth)).collect();
            let mean = |of: fn(&Metrics) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
            let (rel, energy) = (mean(|m| m.rel), mean(|m| m.energy));
            let each: Vec<String> = found.iter().map(|m| format!("{:.2}", m.rel)).collect();
            let named =
                if changes.is_empty() { "as the preset".to_owned() } else { format!("`{}`", changes.join(" ")) };
            lines.push((
                format!("| {name} | {named} |"),
                found.iter().map(|m| m.rel).chain([energy]).collect::<Vec<_>>(),
            ));
            let line = format!("{} {} | {energy:.2} |", lines[lines.len() - 1].0, each.join(" "));
            println!("{line}  ({rel:.3} in the mean)");
            if rel > *most_rel || (energy - 1.0).abs() > *most_energy {
                wrong.push(format!("{line} {rel:.3} in the mean: at most {most_rel} and {most_energy} off"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    if !gpu::context().is_cpu {
        return; // the page has one device's numbers
    }
    if std::env::var_os("TWOBOUNCE_WRITE_DOCS").is_some() {
        let cells = |(start, values): &(String, Vec<f64>)| {
            let text: Vec<String> = values.iter().map(|v| format!("{v:.2}")).collect();
            let (energy, each) = text.split_last().expect("an energy");
            format!("{start} {} | {energy} |\n", each.join(" "))
        };
        let table: String = lines.iter().map(cells).collect();
        std::fs::write(&page, format!("{HEAD}{table}")).expect("the page can be written");
        return;
    }
    assert!(
        written.starts_with(HEAD) && (!more::all() || written[HEAD.len()..].lines().count() == lines.len()),
        "docs/notes/specular.md is of other rows"
    );
    let rows: HashMap<&str, Vec<f64>> = written[HEAD.len()..].lines().map(read_line).collect();
    for (start, values) in &lines {
        let stated = rows.get(start.as_str()).unwrap_or_else(|| panic!("docs/notes/specular.md lacks {start}"));
        for (stated, value) in stated.iter().zip(values) {
            // Rounding to a hundredth, and small differences of drivers in filtering and rasterisation.
            assert!(
                (stated - value).abs() < 0.02,
                "docs/notes/specular.md is stale: {start} {stated} is {value:.3} now"
            );
        }
    }
}

/// The start of a line's numbers, and the numbers.
fn read_line(line: &str) -> (&str, Vec<f64>) {
    let (start, numbers) = line.match_indices('|').nth(2).map(|(i, _)| line.split_at(i + 1)).expect("four cells");
    (start, numbers.split([' ', '|']).filter(|t| !t.is_empty()).map(|t| t.parse().expect("a number")).collect())
}

#[test]
fn no_extreme_of_a_material_makes_nan() {
    for (ior, roughness) in [(1.0, 1.0), (2.4, 0.0), (2.4, 1.0), (0.0, 0.5)] {
        let scene = gloss::glass_ball(ior, roughness);
        for changes in [CONES, RAYS] {
            let changes = [&["voxels=16"], changes].concat();
            let image = image(&scene, &settings(&changes));
            assert!(image.beauty().iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "ior {ior}, {roughness}");
        }
    }
}

/// A rough, black floor, a sun ten degrees above it, and the grey wall at the floor's far end.
fn sun_over_a_rough_floor() -> Scene {
    let mut scene = Scene::empty("a sun over a rough floor");
    let floor = Material { specular: 1.0, roughness: 0.65, ..Material::lambert("floor", Vec3::ZERO) };
    let wall = Material::lambert("wall", Vec3::splat(0.5));
    let quads = [(floor, Vec3::Z * 4.0, Vec3::X * 4.0), (wall, Vec3::X * 4.0, Vec3::Y * 2.0)];
    for (material, u, v) in quads {
        let material = scene.add_material(material);
        scene.add_mesh(Mesh::quad("quad", material, Vec3::new(-2.0, 0.0, -2.0), u, v), DAffine3::IDENTITY);
    }
    let turn = DQuat::from_rotation_x(-10f64.to_radians()); // a light shines along its -Z
    scene.add_light(LightKind::Directional, Vec3::ONE, DAffine3::from_quat(turn));
    let (eye, target) = (DVec3::new(0.0, 1.0, 1.0), DVec3::new(0.0, 1.0, -2.0));
    scene.add_camera(&View::look_at(eye, target, DVec3::Y, 32f32.to_radians()));
    scene
}

/// Half of the floor's outgoing light goes on towards the wall, in a lobe. Evenly scattered, as list items send it, it
/// would be a fraction of that.
#[test]
fn a_rough_floor_sends_grazing_light_onwards() {
    let scene = sun_over_a_rough_floor();
    let mut settings = Settings::default();
    ["voxels=32", "bounces=1"].iter().for_each(|change| settings.set(change).expect("a setting"));
    let indirect =
        |image: &Layers| image.get(Aov::Indirect).expect("asked for").iter().map(|p| f64::from(p[1])).sum::<f64>();
    let energy = indirect(&image(&scene, &settings)) / indirect(&truth(&scene, Depth::Bounces(1)));
    // The reference's noise, and the few bits of stored directions and roughness.
    assert!((energy - 1.0).abs() < 0.03, "{energy}");
}

/// A floor with that roughness, as a dielectric or a metal, and a square lamp of half a metre this many metres above
/// it; far above, `far` rows of as many small lamps.
fn lamp_above_a_floor(roughness: f32, metallic: f32, height: f32, far: usize) -> Scene {
    let mut scene = Scene::empty("a lamp above a floor");
    let floor = Material { roughness, metallic, specular: 1.0, ..Material::lambert("floor", Vec3::splat(0.5)) };
    let lamp = Material { emissive: Vec3::splat(10.0), ..Material::lambert("lamp", Vec3::ZERO) };
    let quads = [
        (floor, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0),
        (lamp, Vec3::new(-0.25, height, -0.25), Vec3::X * 0.5, Vec3::Z * 0.5),
    ];
    let [_, lamp] = quads.map(|(material, corner, u, v)| {
        let material = scene.add_material(material);
        scene.add_mesh(Mesh::quad("quad", material, corner, u, v), DAffine3::IDENTITY);
        material
    });
    for (i, k) in (0..far).flat_map(|i| (0..far).map(move |k| (i, k))) {
        let corner = Vec3::new(-1.5 + 0.6 * i as f32, 2.2, -1.5 + 0.6 * k as f32);
        let quad = Mesh::quad("far", lamp, corner, Vec3::X * 0.1, Vec3::Z * 0.1);
        scene.add_mesh(quad, DAffine3::IDENTITY);
    }
    let (eye, target) = (DVec3::new(0.0, 1.2, 2.4), DVec3::new(0.0, 0.0, 0.6));
    scene.add_camera(&View::look_at(eye, target, DVec3::Y, 40f32.to_radians()));
    scene
}

/// Points on lamps and rays of the lobe together find a lamp's reflection: no part twice, none lost, and no pixel far
/// too bright.
#[test]
fn a_lamps_reflection_in_a_floor_is_whole_and_without_sparks() {
    // The tolerance is larger where a pixel has one ray for a narrow lobe, on a metal, which has nothing gathered, and
    // close to the lamp.
    let cases = [
        (0.1, 0.0, 1.0, 0, 3.0),
        (0.2, 0.0, 1.0, 0, 2.5),
        (0.2, 1.0, 1.0, 0, 3.0),
        (0.5, 1.0, 1.0, 0, 2.5),
        (0.3, 1.0, 0.15, 0, 5.0),
        (0.5, 0.0, 0.15, 0, 5.0),
        (0.3, 0.0, 0.25, 6, 2.2),
        (0.4, 1.0, 0.25, 6, 7.0),
    ];
    for (roughness, metallic, height, far, most) in cases {
        let scene = lamp_above_a_floor(roughness, metallic, height, far);
        let (view, stop) = (view(&scene), Stop::Samples(1024));
        let options = Options { width: SIZE, height: SIZE, depth: Depth::Bounces(0), stop, seed: 0, occlusion: false };
        let truth = film(&scene, &view, &options).layers(&[Aov::Direct]);
        let direct = |changes: &[&str]| {
            let mut settings = Settings::default();
            ["voxels=32", "bounces=1"].iter().chain(changes).for_each(|c| settings.set(c).expect("a setting"));
            image(&scene, &settings).get(Aov::Direct).expect("asked for").to_vec()
        };
        let truth = truth.get(Aov::Direct).expect("asked for");
        let ratio = |image: &[[f32; 3]], i: usize| f64::from(image[i][1]) / f64::from(truth[i][1]);
        // Pixels beside the lamp itself and dark places, whose reference few paths determine, are left out.
        let median = Spread::of_values(truth.iter().map(|p| f64::from(p[1]))).median;
        let counts: Vec<usize> = (0..truth.len()).filter(|i| f64::from(truth[*i][1]) > 0.1 * median).collect();
        let one = direct(&[]);
        let worst = counts.iter().map(|i| ratio(&one, *i)).fold(0.0, f64::max);
        let sum = |image: &[[f32; 3]]| counts.iter().map(|i| f64::from(image[*i][1])).sum::<f64>();
        let energy = sum(&direct(&["image.passes=16"])) / sum(truth);
        let case = format!("roughness {roughness}, metallic {metallic}, {height} m, {far}² others");
        println!("{case}: worst {worst:.3}, energy {energy:.4}");
        assert!(worst < most, "{case}: a pixel is {worst:.2} times too bright");
        assert!((energy - 1.0).abs() < 0.02, "{case}: {energy}");
    }
}

/// A mirror opposite a white wall, in a closed room lit by a lamp at the ceiling.
fn room_with_a_mirror() -> Scene {
    let mut scene = Scene::empty("a room with a mirror");
    let white = scene.add_material(Material { double_sided: true, ..Material::lambert("white", Vec3::splat(0.7)) });
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::lambert("mirror", Vec3::splat(0.95)) };
    let mirror = scene.add_material(mirror);
    let lamp = Material { emissive: Vec3::splat(10.0), ..Material::lambert("lamp", Vec3::ZERO) };
    let lamp = scene.add_material(lamp);
    scene.add_mesh(Mesh::cuboid("room", white, -Vec3::ONE, Vec3::ONE, true), DAffine3::IDENTITY);
    for (material, corner, u, v) in [
        (mirror, Vec3::new(-0.8, -0.8, -0.98), Vec3::X * 1.6, Vec3::Y * 1.6),
        (lamp, Vec3::new(-0.2, 0.98, -0.2), Vec3::X * 0.4, Vec3::Z * 0.4),
    ] {
        scene.add_mesh(Mesh::quad("quad", material, corner, u, v), DAffine3::IDENTITY);
    }
    scene.add_camera(&View::look_at(DVec3::new(0.3, 0.1, 0.2), DVec3::new(0.0, 0.0, -1.0), DVec3::Y, 1.0));
    scene
}

/// Every pass over the image has light of its own: the spots that few directions leave on a mirrored wall disappear as
/// passes add up. With one light for all passes they would stay.
#[test]
fn spots_in_a_mirror_go_as_passes_add_up() {
    let scene = room_with_a_mirror();
    let (view, stop) = (view(&scene), Stop::Samples(1024));
    let options = Options { width: SIZE, height: SIZE, depth: Depth::Bounces(2), stop, seed: 0, occlusion: false };
    let truth = film(&scene, &view, &options).layers(&[Aov::Direct]);
    let [one, eight] = [1, 8].map(|passes| {
        let passes = format!("image.passes={passes}");
        let mut settings = Settings::default();
        ["voxels=32", &passes].iter().for_each(|change| settings.set(change).expect("a setting"));
        image(&scene, &settings)
    });
    let error = |image: &Layers, truth: &Layers| over(image, truth, Aov::Beauty, |_| true).rel;
    let (before, after, spots) = (error(&one, &truth), error(&eight, &truth), error(&one, &eight));
    println!("{before} {after} {spots}");
    // The rest is light that voxels of a sixteenth of the room blur.
    assert!(after < 0.9 * before && spots > 0.025, "{before} {after} {spots}");
}

/// Nothing is gathered for a smooth metal, so rays find what a rough coat over it reflects, with or without layers
/// beside the image.
#[test]
fn a_rough_coat_over_a_smooth_metal_keeps_its_light() {
    let mut scene = Scene::empty("a coated floor");
    let clearcoat = Clearcoat { factor: 1.0, roughness: 0.9, ..Clearcoat::default() };
    let finish = Some(Box::new(Finish { clearcoat, ..Finish::default() }));
    let metal = Material { metallic: 1.0, roughness: 0.0, finish, ..Material::lambert("coated", Vec3::ZERO) };
    let metal = scene.add_material(metal);
    let floor = Mesh::quad("floor", metal, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    scene.sky = Vec3::ONE;
    scene.add_camera(&View::look_at(DVec3::new(0.0, 1.0, 1.0), DVec3::ZERO, DVec3::Y, 0.7));
    let mut settings = Settings::default();
    settings.set("voxels=32").expect("a setting");
    let truth = truth(&scene, Depth::Full);
    let bare = gpu::render_layers(&gpu::context(), &scene, &settings, SIZE, view(&scene), vec![]).read();
    let image = image(&scene, &settings);
    assert!(image.beauty() == bare.beauty(), "layers change the image");
    // A coat is approximated (docs/materials.md): one of this roughness is 11 % too dark. With gathered light instead
    // of rays it is black.
    let energy = over(&image, &truth, Aov::Beauty, |_| true).energy;
    assert!((energy - 1.0).abs() < 0.13, "{energy}");
}
