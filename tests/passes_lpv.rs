//! Light propagation: steps on the device against their twin and against numbers worked out by hand, and the method as a whole.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use std::f64::consts::PI;
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{DAffine3, DVec3, IVec3, Vec3};
use gpu::twins::propagation::{Cell, Cells, Rules, WAYS};
use scenes::Random;
use twobounce::gi::lpv::LpvPush;
use twobounce::layers::Aov;
use twobounce::scene::{LightKind, Material, Mesh, Scene, View, analytic};
use twobounce::settings::Settings;
use twobounce::vk::*;

const EVEN: Rules = Rules { even: true, own: false };
const COSINE: Rules = Rules { even: false, own: false };

/// Steps on the device.
struct Steps {
    context: Arc<Context>,
    first: Compute,
    next: Compute,
    edge: u32,
}

impl Steps {
    fn new(context: &Arc<Context>, edge: u32, rules: Rules) -> Self {
        let pipeline = |first: u32| {
            let lobe = u32::from(rules.even);
            let constants = [(32, edge), (34, lobe), (35, 2), (36, u32::from(!rules.own)), (39, first)];
            let desc = ComputeDesc { label: "propagate", shader: "gi/lpv/propagate.comp", constants: &constants };
            Compute::new(context, &desc).expect("a pipeline")
        };
        Self { context: context.clone(), first: pipeline(1), next: pipeline(0), edge }
    }

    fn field(&self) -> [Image; 4] {
        std::array::from_fn(|_| {
            let desc = ImageDesc {
                label: "field",
                dim: ImageDim::D3,
                format: Format::R32G32B32A32_SFLOAT,
                width: self.edge,
                height: self.edge,
                depth_or_layers: self.edge,
                usage: ImageUsageFlags::SAMPLED
                    | ImageUsageFlags::STORAGE
                    | ImageUsageFlags::TRANSFER_DST
                    | ImageUsageFlags::TRANSFER_SRC,
                ..Default::default()
            };
            Image::new(&self.context, &desc).expect("an image")
        })
    }

    /// The light after so many steps, and what they added up. In every channel the same; the sky stays outside.
    fn run(&self, start: &Cells, steps: u32) -> [Cells; 2] {
        let c = &self.context;
        let (fields, sums) = ([self.field(), self.field()], self.field());
        for (part, image) in fields[0].iter().enumerate() {
            let of = |cell: &Cell| [cell.flux, cell.moment.x, cell.moment.y, cell.moment.z][part] as f32;
            let texels: Vec<[f32; 4]> = start.cells.iter().map(|cell| [of(cell), 2.0 * of(cell), 0.0, 0.0]).collect();
            upload_image(c, image, ImageRegion::level(image, 0), &texels).expect("an upload");
        }
        let pack = |[low, high]: [f64; 2]| {
            let unorm = |v: f64| (v * 65535.0).round() as u32;
            unorm(low) | unorm(high) << 16
        };
        let packed = |p: &[f64; 6]| [pack([p[0], p[1]]), pack([p[2], p[3]]), pack([p[4], p[5]])];
        let passages: Vec<[u32; 3]> = start.passages.iter().map(packed).collect();
        let passages = upload(c, "passages", &passages).expect("an upload");
        let places = upload(c, "cascades", &[[0.0f32; 4]]).expect("an upload");
        let blockers = upload(c, "blockers", &[[0u32; 4]]).expect("an upload");
        let sampler = Sampler::new(c, Filter::NEAREST, SamplerAddressMode::CLAMP_TO_EDGE).expect("a sampler");
        let mut recorder = Recorder::new(c, RecorderOptions::default()).expect("a recorder");
        recorder.zone("propagate", ZoneKind::Compute, 0, |r| {
            for step in 0..steps as usize {
                r.full_barrier();
                let (old, new) = (&fields[step % 2], &fields[(step + 1) % 2]);
                let mut binds = vec![
                    Bind::buffer("passages", &passages),
                    Bind::buffer("cascades", &places),
                    Bind::buffer("blockers", &blockers),
                ];
                for (k, part) in ["flux", "x", "y", "z"].into_iter().enumerate() {
                    let name = |kind: &str| -> &'static str { format!("{kind}_{part}").leak() };
                    binds.push(Bind::image(name("old"), old[k].view(), &sampler));
                    binds.push(Bind::storage_image(name("new"), new[k].mip_view(0)));
                    binds.push(Bind::storage_image(name("sum"), sums[k].mip_view(0)));
                }
                let pipeline = if step == 0 { &self.first } else { &self.next };
                let push = LpvPush { scale: 1.0, ..LpvPush::zeroed() };
                r.dispatch(pipeline, &pipeline.select(&binds), &push, [self.edge / 4; 3]);
            }
        });
        recorder.finish().expect("a dispatch");
        assert_eq!(c.take_validation_messages(), Vec::<String>::new());
        let read = |field: &[Image; 4]| {
            let parts: Vec<Vec<[f32; 4]>> = field.iter().map(|i| download_image(c, i, 0).expect("a field")).collect();
            let number = |part: usize, cell: usize| {
                let [red, green, ..] = parts[part][cell];
                assert!((2.0 * red - green).abs() <= 1e-5 * green.abs().max(1e-20), "channels differ: {red}, {green}");
                f64::from(red)
            };
            let cell = |k| Cell { flux: number(0, k), moment: DVec3::new(number(1, k), number(2, k), number(3, k)) };
            Cells { cells: (0..start.cells.len()).map(cell).collect(), ..start.clone() }
        };
        [read(&fields[steps as usize % 2]), read(&sums)]
    }
}

/// Light 1 in the middle cell of an empty grid.
fn one_light(edge: i32, moment: DVec3) -> (Cells, IVec3) {
    let (mut cells, middle) = (Cells::empty(edge), IVec3::splat(edge / 2));
    cells.put(middle, Cell { flux: 1.0, moment });
    (cells, middle)
}

fn near(got: f64, expected: f64, what: &str) {
    // f32, over some thirty additions.
    assert!((got - expected).abs() <= 3e-6 * expected.abs().max(0.1), "{what}: {got} is not {expected}");
}

/// Shares of a light of 1 that go ahead, to each side, and back, by the listing's solid angles: with lobes of 1 + cos θ
/// nothing is lost, with 1 + 2 cos θ cut off 0.1381 is gained.
#[test]
fn one_light_after_one_and_two_steps_is_as_by_hand() {
    let context = gpu::context();
    for (rules, [ahead, side, back], gain) in
        [(EVEN, [0.319_104_1, 0.166_666_7, 0.014_229_3], 1.0), (COSINE, [0.471_540_8, 0.166_666_7, 0.0], 1.138_207_5)]
    {
        let moment = DVec3::X * if rules.even { 1.0 } else { 2.0 };
        let (start, middle) = one_light(16, moment);
        let steps = Steps::new(&context, 16, rules);
        let [once, sum] = steps.run(&start, 1);
        for way in WAYS {
            let expected = if way == IVec3::X {
                ahead
            } else if way == IVec3::NEG_X {
                back
            } else {
                side
            };
            near(once.at(middle + way).flux, expected, "a neighbour after one step");
            near(sum.at(middle + way).flux, expected, "the sum after one step");
        }
        near(once.at(middle).flux, 0.0, "its own cell");
        near(once.total(), gain, "all cells after one step");
        let [twice, both] = steps.run(&start, 2);
        // From (ahead): flux a, and a moment along x of what went onto the opposite face, OPPOSITE (1 + |moment|) LOBE.
        let lobe = moment.length();
        let along = 22.95668 / 720.0 * (1.0 + lobe) * lobe;
        let crossing = 22.95668 / 720.0 + 4.0 * 24.26083 / 720.0 * 2.0 / 5f64.sqrt();
        near(twice.at(middle + 2 * IVec3::X).flux, ahead / 6.0 + crossing * along, "two cells ahead");
        near(both.at(middle + IVec3::Y).flux, side + twice.at(middle + IVec3::Y).flux, "both steps added up");
        if rules.even {
            near(twice.total(), 1.0, "all cells after two steps");
        }
    }
}

#[test]
fn steps_are_their_twins() {
    let context = gpu::context();
    let mut random = Random::new(11);
    for rules in [EVEN, COSINE, Rules { even: false, own: true }] {
        let mut start = Cells::empty(16);
        for cell in &mut start.cells {
            let flux = random.unit();
            *cell = Cell { flux, moment: random.direction() * flux * random.unit() };
        }
        for passage in &mut start.passages {
            // As sixteen bits hold it.
            *passage = std::array::from_fn(|_| (random.unit() * 65535.0).round() / 65535.0);
        }
        let [got, sum] = Steps::new(&context, 16, rules).run(&start, 3);
        let mut expected = start.clone();
        let mut added = Cells::empty(16);
        for _ in 0..3 {
            expected = expected.step(rules);
            for (sum, cell) in added.cells.iter_mut().zip(&expected.cells) {
                *sum = if rules.own {
                    *cell
                } else {
                    Cell { flux: sum.flux + cell.flux, moment: sum.moment + cell.moment }
                };
            }
        }
        for (got, expected) in got.cells.iter().chain(&sum.cells).zip(expected.cells.iter().chain(&added.cells)) {
            // f32, and cosines to nine digits.
            let off = (got.flux - expected.flux).abs().max((got.moment - expected.moment).abs().max_element());
            assert!(off <= 2e-5 * expected.flux.max(0.1), "{got:?} is not {expected:?}");
        }
    }
}

/// The 48 symmetries of the cube, of which the six axes are a part.
#[test]
fn an_even_light_spreads_alike_along_all_axes_and_symmetries() {
    // After an even number of steps, cells at an even number of faces' distance; the grid's border is never reached.
    let (start, middle) = one_light(16, DVec3::ZERO);
    for rules in [EVEN, COSINE] {
        let [cells, _] = Steps::new(&gpu::context(), 16, rules).run(&start, 6);
        for (x, y, z) in [(2, 0, 0), (3, 2, 1), (4, 2, 0), (2, 2, 2), (5, 1, 0)] {
            let first = cells.at(middle + IVec3::new(x, y, z));
            assert!(first.flux > 0.0);
            for [i, j, k] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                for signs in 0..8 {
                    let mut to = IVec3::ZERO;
                    for (axis, (value, bit)) in [i, j, k].into_iter().zip([(x, 1), (y, 2), (z, 4)]) {
                        to[axis] = if signs & bit != 0 { -value } else { value };
                    }
                    near(cells.at(middle + to).flux / first.flux, 1.0, "one of 48 directions");
                }
            }
        }
    }
}

/// Even lobes: light is conserved until it leaves, nothing is negative, and a thousand steps leave nothing behind.
#[test]
fn light_is_bounded_after_a_thousand_steps() {
    let steps = Steps::new(&gpu::context(), 16, EVEN);
    let (start, _) = one_light(16, DVec3::Y);
    let [cells, _] = steps.run(&start, 7);
    near(cells.total(), 1.0, "all cells before the border is reached");
    let [cells, sum] = steps.run(&start, 1000);
    for cell in cells.cells.iter().chain(&sum.cells) {
        // Rounding of f32.
        assert!(cell.moment.length() <= cell.flux * (1.0 + 1e-5), "towards some side it is negative: {cell:?}");
    }
    assert!(cells.total() < 1e-6, "{} is left", cells.total());
    // A closed box keeps what it has: 2³ cells into which nothing passes from outside, and out of which nothing goes.
    let mut closed = start.clone();
    let inside = |cell: IVec3| cell.cmpge(IVec3::splat(7)).all() && cell.cmplt(IVec3::splat(9)).all();
    for index in 0..closed.cells.len() as i32 {
        let cell = IVec3::new(index % 16, index / 16 % 16, index / 256);
        for (k, way) in WAYS.iter().enumerate() {
            closed.passages[index as usize][k] = f64::from(u8::from(inside(cell) && inside(cell - *way)));
        }
    }
    let [cells, sum] = steps.run(&closed, 1000);
    let outside = |cells: &Cells| {
        let flux = |index: i32| cells.cells[index as usize].flux;
        let place = |index: i32| IVec3::new(index % 16, index / 16 % 16, index / 256);
        (0..16i32.pow(3)).filter(|i| !inside(place(*i))).map(flux).sum::<f64>()
    };
    assert_eq!((outside(&cells), outside(&sum)), (0.0, 0.0), "sheets let something pass");
    assert!(sum.total() < 2.0, "what walls take is gone: {}", sum.total());
}

/// As printed, each step starts from the cell's own light: it grows without bound. Added up apart it does not.
#[test]
fn the_printed_sum_blows_up_and_the_mended_one_does_not() {
    let context = gpu::context();
    let (start, _) = one_light(32, DVec3::ZERO);
    let [printed, _] = Steps::new(&context, 32, Rules { even: false, own: true }).run(&start, 32);
    assert!(printed.total() > 1e5, "{}", printed.total());
    let [_, apart] = Steps::new(&context, 32, EVEN).run(&start, 32);
    // 32 steps of a light of 1, less what left.
    assert!(apart.total() <= 32.0, "{}", apart.total());
}

fn lpv(changes: &[&str]) -> Settings {
    gpu::with(Settings { voxels: 32, ..Settings::lpv() }, &[&["image.gather_resolution=full"], changes].concat())
}

/// A small plate under a sky of radiance 1: nothing but the sky, which comes in from all sides. Its front is as bright as its
/// albedo times what is open: all of the hemisphere.
#[test]
fn the_sky_arrives_whole() {
    let mut scene = Scene::empty("plate");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    let plate = Mesh::quad("plate", grey, Vec3::new(-0.02, 0.0, -0.02), Vec3::Z * 0.04, Vec3::X * 0.04);
    scene.add_mesh(plate, DAffine3::IDENTITY);
    scene.sky = Vec3::ONE;
    let view = View::look_at(DVec3::Y * 0.06, DVec3::ZERO, DVec3::Z, 20f32.to_radians());
    let settings = lpv(&["grid.side=1", "grid.center=0,0,0", "lpv.edge=16", "lpv.iterations=1000", "bounces=1"]);
    let renderer = gpu::render_layers(&gpu::context(), &scene, &settings, 8, view, vec![Aov::Ao]);
    let image = renderer.read();
    let mean = image.beauty().iter().map(|p| f64::from(p[1])).sum::<f64>() / 64.0;
    // 1000 steps of 16³ cells leave a thousandth on its way; the plate, of two thirds of a cell, takes some of its own light.
    assert!((mean / 0.5 - 1.0).abs() < 0.05, "{mean}");
}

/// Light from a closed room does not come through its walls, one-sided or not, and a room next to it stays dark.
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
        // Sixteen bits of a passage; nothing else passes.
        assert!(dark < 1e-4 * lit, "doubleSided {double_sided}: {dark} of {lit}");
        let (lit, leaked) = (mean(-1.1, &["lpv.occlusion=none"]), mean(1.1, &["lpv.occlusion=none"]));
        assert!(leaked > 1e-2 * lit, "without occlusion it must leak: {leaked} of {lit}");
    }
}

/// What a surface sends is what is injected: a wall of one metre by one that sends 2, in cells of a sixteenth of a metre.
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
    let expected = PI * 2.0 / (2.0f64 / 32.0).powi(2);
    // Clipping to the cells in f32.
    assert!((total / expected - 1.0).abs() < 1e-4, "{total} is not {expected}");
}

/// A closed box whose walls shine and reflect half: what they send arrives somewhere, so that its mean is right.
#[test]
fn a_furnace_keeps_its_energy() {
    for (bounces, expected) in [("bounces=1", 1.5), ("bounces=2", 1.75)] {
        let scene = analytic::furnace(0.5, 1.0, false);
        let view = scene.view(&scene.pose(None, 0.0), 0);
        let settings = lpv(&["lights.lamps=gathered", "lpv.iterations=128", bounces]);
        let image = gpu::render_from(&gpu::context(), &scene, &settings, 32, view).read();
        let mean = image.beauty().iter().map(|p| f64::from(p[1])).sum::<f64>() / 1024.0;
        // Cells at edges and corners hold two or three walls, and their light partly stays between them.
        assert!((mean / expected - 1.0).abs() < 0.1, "{bounces}: {mean} is not {expected}");
    }
}

/// The same image from a scene that fills the coarsest of three grids, as long as the camera's grid shows what the coarse one
/// does: light of all sides.
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
