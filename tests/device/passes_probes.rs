//! The method `probes`: functions and passes on the device against their twin. `probes.rs` tests the method as a whole.

use crate::gpu;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, DVec4, IVec2, IVec3, Vec3, Vec4};
use gpu::twins::probes as twin;
use twin::{DISTANCE_SIDE, LIGHT_SIDE};
use twobounce::gi::probes::{FEELERS, Probe, ProbeGrid, ProbeRay, ProbesPush, constants, ways};
use twobounce::ground::constants::with;
use twobounce::ground::layout;
use twobounce::settings::Settings;
use twobounce::vk::*;

use crate::scenes::Random;

/// The functions in the order of their numbers in the shader `glsl/test/probes.comp`.
#[derive(Clone, Copy)]
enum Function {
    Texel,
    About,
    Weights,
    Cell,
    Light,
}

/// Three vectors: the inputs or the outputs of one evaluation.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Arguments([[f32; 4]; 3]);

impl Arguments {
    fn of(a: Vec4, b: Vec4, c: Vec4) -> Self {
        Self([a.into(), b.into(), c.into()])
    }
}

const EDGE: i32 = 4;
const FRESH: u32 = 2;
const ACTIVE: u32 = 1;

fn settings(changes: &[&str]) -> Settings {
    gpu::with(Settings::probes(), &[&["probes.edge=4", "probes.rays=64", "voxels=16"], changes].concat())
}

/// The constants of the ground and of the method. `others` replace those of equal names.
fn constants_of(settings: &Settings, others: &[Constant]) -> Vec<Constant> {
    let ground = twobounce::ground::constants::constants(settings, Default::default());
    with(with(ground, &constants::constants(settings)), others)
}

/// Buffers on the device with the probes of a grid.
struct Held {
    probes: Buffer,
    grids: Buffer,
    distances: Buffer,
    light: Buffer,
}

/// A grid without light, whose probes are at the middles of their cells.
fn empty_grid() -> twin::Grid {
    let spacing = 4.0;
    let first = IVec3::new(-1, 2, 5);
    let mut grid = twin::Grid { edge: EDGE, corner: first.as_dvec3() * spacing, spacing, first, probes: vec![] };
    let dark = twin::Probe {
        position: DVec3::ZERO,
        active: true,
        light: twin::map(LIGHT_SIDE, |_| DVec4::ZERO),
        distances: twin::map(DISTANCE_SIDE, |_| DVec2::new(10.0, 100.0)),
    };
    grid.probes = vec![dark; (EDGE * EDGE * EDGE) as usize];
    for local in cells() {
        let cell = grid.first + local;
        let index = grid.index(cell);
        grid.probes[index].position = (cell.as_dvec3() + 0.5) * spacing;
    }
    grid
}

fn cells() -> impl Iterator<Item = IVec3> {
    (0..EDGE.pow(3)).map(|k| IVec3::new(k % EDGE, k / EDGE % EDGE, k / (EDGE * EDGE)))
}

fn place(grid: &twin::Grid) -> ProbeGrid {
    ProbeGrid { corner: grid.corner.as_vec3().into(), spacing: grid.spacing as f32, first: grid.first.into() }
}

fn held(c: &Arc<Context>, grid: &twin::Grid) -> Held {
    let mut probes = vec![Probe::zeroed(); grid.probes.len()];
    for local in cells() {
        let cell = grid.first + local;
        let probe = &grid.probes[grid.index(cell)];
        let state = if probe.active { ACTIVE } else { 0 };
        probes[grid.index(cell)] = Probe { position: probe.position.as_vec3().into(), state, cell: cell.into() };
    }
    let light: Vec<[f32; 4]> = grid.probes.iter().flat_map(|p| &p.light).map(|l| l.as_vec4().into()).collect();
    let distances: Vec<[f32; 2]> = grid.probes.iter().flat_map(|p| &p.distances).map(|d| d.as_vec2().into()).collect();
    Held {
        probes: upload(c, "probes", &probes).expect("an upload"),
        grids: upload(c, "probe grids", &[place(grid)]).expect("an upload"),
        distances: upload(c, "probe distances", &distances).expect("an upload"),
        light: upload(c, "probe light", &light).expect("an upload"),
    }
}

impl Held {
    fn binds<'a>(&'a self, frame: &'a Buffer) -> Vec<Bind<'a>> {
        vec![
            Bind::buffer("frame", frame),
            Bind::buffer("probes", &self.probes),
            Bind::buffer("probe_grids", &self.grids),
            Bind::buffer("probe_distances", &self.distances),
            Bind::buffer("probe_light", &self.light),
        ]
    }
}

fn dispatch(c: &Arc<Context>, pipeline: &Compute, binds: &[Bind<'_>], push: &impl Pod, groups: [u32; 3]) {
    let mut recorder = Recorder::new(c, RecorderOptions::default()).expect("a recorder");
    recorder.zone("test", ZoneKind::Compute, 0, |r| r.dispatch(pipeline, &pipeline.select(binds), push, groups));
    recorder.finish().expect("a dispatch");
    assert_eq!(c.take_validation_messages(), Vec::<String>::new());
}

fn evaluate(function: Function, inputs: &[Arguments], grid: &twin::Grid) -> Vec<Vec4> {
    let all = evaluate_all(function, inputs, grid);
    all.iter().map(|y| Vec4::from(y.0[0])).collect()
}

fn evaluate_all(function: Function, inputs: &[Arguments], grid: &twin::Grid) -> Vec<Arguments> {
    evaluate_with(function, inputs, grid, &[])
}

fn evaluate_with(function: Function, inputs: &[Arguments], grid: &twin::Grid, others: &[Constant]) -> Vec<Arguments> {
    let c = &gpu::context();
    let constants = with(constants_of(&settings(&[]), others), &[("FUNCTION", (function as u32).into())]);
    let desc = ComputeDesc { label: "probes", shader: "test/probes.comp", constants: &constants };
    let pipeline = Compute::new(c, &desc).expect("a pipeline");
    let frame = upload(c, "frame", &[layout::Frame { scale: 1.0, voxel_m: 1.0, ..Zeroable::zeroed() }]);
    let (frame, held) = (frame.expect("an upload"), held(c, grid));
    let input = upload(c, "inputs", inputs).expect("an upload");
    let output = upload(c, "outputs", &vec![Arguments([[f32::MAX; 4]; 3]); inputs.len()]).expect("an upload");
    let mut binds = held.binds(&frame);
    binds.push(Bind::buffer("first_light", &held.light));
    binds.extend([Bind::buffer("inputs", &input), Bind::buffer("outputs", &output)]);
    let count = inputs.len() as u32;
    dispatch(c, &pipeline, &binds, &count, [count.div_ceil(64), 1, 1]);
    download(c, &output).expect("outputs")
}

/// Every texel of the border is written once, by the texel of its direction, so that filtering is continuous across the
/// edges.
#[test]
fn the_border_is_the_map_beyond_its_edges() {
    for side in [LIGHT_SIDE, DISTANCE_SIDE] {
        let texels: Vec<IVec2> = (0..side * side).map(|k| IVec2::new(k % side, k / side)).collect();
        let inputs: Vec<_> = texels
            .iter()
            .map(|t| Arguments::of(t.as_vec2().extend(side as f32).extend(0.0), Vec4::ZERO, Vec4::ZERO))
            .collect();
        let mut written = vec![0; ((side + 2) * (side + 2)) as usize];
        for (texel, y) in texels.iter().zip(evaluate_all(Function::Texel, &inputs, &empty_grid())) {
            let way = Vec4::from(y.0[0]).truncate().as_dvec3();
            let expected = twin::texel_way(*texel, side);
            assert!(way.abs_diff_eq(expected, 1e-6), "{texel} of {side}: {way} is not {expected}"); // rounding of f32
            written[twin::texel_index(*texel, side)] += 1;
            let copies = y.0[0][3] as u32;
            let border = [[y.0[1][0], y.0[1][1]], [y.0[1][2], y.0[1][3]], [y.0[2][0], y.0[2][1]]];
            for (k, [x, y]) in border.into_iter().enumerate().filter(|(k, _)| copies & 1 << k != 0) {
                let beyond = IVec2::new(x as i32, y as i32);
                let there = twin::texel_way(beyond, side);
                assert!(way.abs_diff_eq(there, 1e-6), "copy {k} of {texel} at {beyond}: {way} is not {there}");
                written[twin::texel_index(beyond, side)] += 1;
            }
        }
        assert!(written.iter().all(|&times| times == 1), "{written:?}");
    }
}

#[test]
fn a_look_up_finds_the_four_texels_about_a_direction() {
    let mut random = Random::new(3);
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    let ways: Vec<DVec3> = axes.into_iter().chain((0..200).map(|_| random.direction())).collect();
    let inputs: Vec<_> = ways.iter().map(|d| Arguments::of(d.as_vec3().extend(8.0), Vec4::ZERO, Vec4::ZERO)).collect();
    for (way, y) in ways.iter().zip(evaluate(Function::About, &inputs, &empty_grid())) {
        // The bilinear mean of the four texels' directions is near the direction of the look-up.
        let (first, part) = (y.x as i32, DVec2::new(f64::from(y.y), f64::from(y.z)));
        let corner = IVec2::new(first % (LIGHT_SIDE + 2), first / (LIGHT_SIDE + 2)) - 1;
        assert!(corner.min_element() >= -1 && corner.max_element() < LIGHT_SIDE && part.min_element() >= 0.0);
        assert!(part.max_element() <= 1.0, "{way}: {part}");
        let at = corner.as_dvec2() + part;
        let place = (at + 0.5) * (2.0 / f64::from(LIGHT_SIDE)) - 1.0;
        let there = twin::way_at(place);
        assert!(there.abs_diff_eq(*way, 1e-5), "{way}: {there}"); // rounding of f32 on a map of ten texels
    }
}

#[test]
fn weights_are_their_formulas() {
    let numbers: Vec<[f64; 5]> = {
        let mut random = Random::new(4);
        (0..200)
            .map(|_| {
                let mean = 1.0 + 3.0 * random.unit();
                [
                    2.0 * random.unit() - 1.0,
                    random.unit(),
                    mean,
                    mean * mean * (1.0 + 0.2 * random.unit()),
                    6.0 * random.unit(),
                ]
            })
            .collect()
    };
    let inputs: Vec<_> = numbers
        .iter()
        .map(|[c, w, mean, square, distance]| {
            let [c, w, facet] = [*c, *w, *w - 0.5].map(|x| x as f32);
            let behind = f32::from(c > 0.5);
            Arguments::of(
                Vec4::new(c, w, facet, behind),
                Vec4::new(*mean as f32, *square as f32, *distance as f32, 0.0),
                Vec4::ZERO,
            )
        })
        .collect();
    for (n, y) in numbers.iter().zip(evaluate(Function::Weights, &inputs, &empty_grid())) {
        let expected = [
            n[0].max(0.0).powi(50),
            twin::facing_weight(n[0], n[1] - 0.5, n[0] > 0.5),
            twin::crushed(n[1]),
            twin::seen_weight(DVec2::new(n[2], n[3]), n[4]),
        ];
        for (got, expected) in y.to_array().into_iter().zip(expected) {
            // The tolerance is the rounding of a difference of two squares in f32, up to 16, divided by a variance of a
            // tenth.
            assert!((f64::from(got) - expected).abs() < 2e-4, "{n:?}: {y} is not {expected:?}");
        }
    }
}

/// A moving grid keeps the probes of the cells that stay in it, on both sides of the origin.
#[test]
fn cells_keep_their_probes() {
    let firsts = [IVec3::ZERO, IVec3::new(-3, 5, 11), IVec3::new(2, -8, -1)];
    for first in firsts {
        let inputs: Vec<_> = cells()
            .map(|local| {
                let cell = (first + local).as_vec3();
                Arguments::of(cell.extend(0.0), first.as_vec3().extend(0.0), Vec4::ZERO)
            })
            .collect();
        for (local, y) in cells().zip(evaluate(Function::Cell, &inputs, &empty_grid())) {
            assert_eq!(y.truncate(), (first + local).as_vec3());
        }
    }
}

/// A grid of probes with random light, distances, offsets and states.
fn random_grid(random: &mut Random) -> twin::Grid {
    let mut grid = empty_grid();
    for probe in &mut grid.probes {
        probe.position += 0.4 * grid.spacing * random.direction();
        probe.active = random.unit() < 0.8;
        let (a, b, c) = (random.direction(), random.direction(), 3.0 * random.unit());
        // The border holds the texels of the map, as on the device.
        probe.light = twin::map(LIGHT_SIDE, |d| DVec4::new(2.0 + d.dot(a), 1.0 + d.dot(b), c, 0.5 + 0.5 * d.x));
        probe.distances = twin::map(DISTANCE_SIDE, |d| {
            let mean = 4.0 + 2.0 * d.dot(b);
            DVec2::new(mean, mean * mean * 1.1)
        });
    }
    grid
}

#[test]
fn the_light_at_a_point_is_its_twin() {
    let mut random = Random::new(5);
    let grid = random_grid(&mut random);
    let side = grid.spacing * f64::from(EDGE);
    let points: Vec<twin::Point> = (0..300)
        .map(|_| {
            let facet = random.direction();
            let normal = (facet + 0.3 * random.direction()).normalize();
            let position = grid.corner + side * (1.2 * random.point() - 0.1);
            twin::Point { position, normal, facet, view: random.direction() }
        })
        .collect();
    let inputs: Vec<_> = points
        .iter()
        .map(|p| {
            let vectors = [p.position, p.normal, p.view].map(DVec3::as_vec3);
            let [a, b, c] = [0, 1, 2].map(|k| vectors[k].extend(p.facet[k] as f32));
            Arguments::of(a, b, c)
        })
        .collect();
    for behind in [false, true] {
        let mut found = 0;
        for (p, got) in
            points.iter().zip(evaluate_with(Function::Light, &inputs, &grid, &[("COUNTS_BEHIND", behind.into())]))
        {
            let expected = twin::look_up(&grid, p, 0.3, behind);
            found += usize::from(expected.is_some());
            let expected = expected.unwrap_or(DVec4::ZERO);
            let got = Vec4::from(got.0[0]).as_dvec4();
            // The Chebyshev test takes the difference of two squares in f32.
            assert!(got.abs_diff_eq(expected, 1e-3), "{p:?}: {got} is not {expected}");
        }
        assert!(found > 200, "{found}");
    }
}

fn random_rays(random: &mut Random, count: u32, turn: u32) -> Vec<twin::Ray> {
    let ways = ways::ways(count, ways::turn(turn));
    let ray = |way: &[f32; 3]| twin::Ray {
        way: Vec3::from(*way).as_dvec3(),
        light: random.point(),
        open: random.unit(),
        distance: 12.0 * random.unit() - 3.0,
    };
    ways.iter().map(ray).collect()
}

/// The passes write light and distances of all texels, including borders, with and without a blend with earlier light.
#[test]
fn texels_blend_rays_as_their_twin() {
    let c = &gpu::context();
    let mut random = Random::new(6);
    let grid = random_grid(&mut random);
    let count = 64;
    for (hysteresis, pass, share, known) in
        [(0.0, 0, 1.0, 1), (0.75, 0, 1.0, 1), (0.75, 5, 0.125, 1), (0.75, 0, 1.0, 2)]
    {
        let settings = settings(&[&format!("probes.hysteresis={hysteresis}")]);
        let constants = constants_of(&settings, &[]);
        let desc = ComputeDesc { label: "blend", shader: "gi/probes/blend.comp", constants: &constants };
        let blend = Compute::new(c, &desc).expect("a pipeline");
        let held = held(c, &grid);
        let mut probes: Vec<Probe> = download(c, &held.probes).expect("probes");
        probes[3].state = ACTIVE | FRESH;
        upload_into(c, &held.probes, &probes).expect("an upload");
        let rays: Vec<Vec<twin::Ray>> = (0..grid.probes.len()).map(|_| random_rays(&mut random, count, 7)).collect();
        let flat: Vec<ProbeRay> = rays
            .iter()
            .flatten()
            .map(|r| ProbeRay { light: r.light.as_vec3().into(), open: r.open as f32, distance: r.distance as f32 })
            .collect();
        let frame = layout::Frame { scale: 1.0, light_pass: pass, light_share: share, ..Zeroable::zeroed() };
        let frame = upload(c, "frame", &[frame]).expect("an upload");
        let ways = upload(c, "ways", &ways::ways(count, ways::turn(7))).expect("an upload");
        let flat = upload(c, "rays", &flat).expect("an upload");
        let mut binds = held.binds(&frame);
        binds.extend([Bind::buffer("probe_ways", &ways), Bind::buffer("probe_rays", &flat)]);
        let push = ProbesPush { first: 0, step: 0, known };
        dispatch(c, &blend, &binds, &push, [probes.len() as u32, 1, 1]);
        let light: Vec<[f32; 4]> = download(c, &held.light).expect("light");
        let distances: Vec<[f32; 2]> = download(c, &held.distances).expect("distances");
        let after: Vec<Probe> = download(c, &held.probes).expect("probes");
        let taken = if pass > 0 {
            f64::from(share)
        } else if known == 2 {
            1.0
        } else {
            1.0 - hysteresis
        };
        for (index, probe) in grid.probes.iter().enumerate() {
            let taken = if !probes[index].state & ACTIVE != 0 {
                0.0
            } else if index == 3 {
                1.0
            } else {
                taken
            };
            assert_eq!(after[index].state, if taken == 0.0 { 0 } else { ACTIVE });
            let (got, before) = (&light[index * 100..][..100], &probe.light);
            let expected = twin::map(LIGHT_SIDE, |n| twin::light(&rays[index], n));
            for ((got, before), new) in got.iter().zip(before).zip(expected) {
                let expected = before.lerp(new, taken);
                assert!(Vec4::from(*got).as_dvec4().abs_diff_eq(expected, 1e-5), "probe {index}: {got:?}, {expected}");
            }
            let (got, before) = (&distances[index * 324..][..324], &probe.distances);
            let expected = twin::map(DISTANCE_SIDE, |n| twin::distances(&rays[index], n, 2.6 * grid.spacing));
            for ((got, before), new) in got.iter().zip(before).zip(expected) {
                let expected = before.lerp(new, taken);
                let got = DVec2::new(f64::from(got[0]), f64::from(got[1]));
                // The tolerance is the rounding of fiftieth powers in f32, times distances up to ten.
                assert!(got.abs_diff_eq(expected, 2e-3), "probe {index}: {got}, {expected}");
            }
        }
    }
}

/// Probes about a plane wall start at the middles of cells with list items about them, and move off the wall. Those
/// that stay behind it are switched off.
#[test]
fn probes_find_their_places_as_their_twin() {
    let c = &gpu::context();
    let settings = settings(&[]);
    let constants = constants_of(&settings, &[]);
    let pipeline = |shader| Compute::new(c, &ComputeDesc { label: "place", shader, constants: &constants });
    let step = pipeline("gi/probes/place.comp").expect("a pipeline");
    let grid = empty_grid();
    let held = held(c, &grid);
    let mut ways = ways::ways(64, ways::turn(0));
    ways.extend(ways::ways(FEELERS, ways::turn(0)));
    let feelers: Vec<DVec3> = ways[64..].iter().map(|way| Vec3::from(*way).as_dvec3()).collect();
    let ways = upload(c, "ways", &ways).expect("an upload");
    // The wall's front faces +x; the wall is a little beyond the middles of the second layer of cells.
    let wall = grid.corner.x + 1.6 * grid.spacing;
    let felt = |position: DVec3| -> Vec<(DVec3, f64)> {
        let met = |way: &DVec3| {
            let distance = (wall - position.x) / way.x;
            let met = if distance <= 0.0 { 1e30 } else { distance };
            (*way, if met < 1e30 && way.x > 0.0 { -met } else { met })
        };
        feelers.iter().map(met).collect()
    };
    // The last layer of cells along x is too far from the wall's cells for a look-up.
    let heads: Vec<u32> = cells().map(|local| u32::from(local.x == 1)).collect();
    let heads = upload(c, "heads", &heads).expect("an upload");
    let felt_now = |held: &Held| {
        let probes: Vec<Probe> = download(c, &held.probes).expect("probes");
        let all: Vec<f32> =
            probes.iter().flat_map(|p| felt(Vec3::from(p.position).as_dvec3())).map(|f| f.1 as f32).collect();
        upload(c, "felt", &all).expect("an upload")
    };
    for number in [0, 1, 1, 1, 2] {
        let felt = felt_now(&held);
        let binds = [
            Bind::buffer("probes", &held.probes),
            Bind::buffer("probe_grids", &held.grids),
            Bind::buffer("probe_ways", &ways),
            Bind::buffer("felt_distances", &felt),
            Bind::buffer("grid_heads", &heads),
        ];
        dispatch(c, &step, &binds, &ProbesPush { first: 0, step: number, known: 1 }, [1, 1, 1]);
    }
    let after: Vec<Probe> = download(c, &held.probes).expect("probes");
    let mut states = std::collections::BTreeMap::new();
    for local in cells() {
        let cell = grid.first + local;
        let probe = &after[grid.index(cell)];
        let middle = (cell.as_dvec3() + 0.5) * grid.spacing;
        let asked = local.x < 3;
        let expected = if asked { twin::moved(middle, grid.spacing, 3, felt) } else { middle };
        assert!(Vec3::from(probe.position).as_dvec3().abs_diff_eq(expected, 1e-4), "{local}: {probe:?}, {expected}");
        let backs = felt(expected).iter().filter(|ray| ray.1 < 0.0).count();
        let active = asked && 10 * backs <= feelers.len();
        assert_eq!(probe.state & ACTIVE, u32::from(active), "{local}");
        assert_eq!(probe.cell, <[i32; 3]>::from(cell));
        states.insert(local.x, (active, expected.x > wall));
    }
    // For each layer along x: whether probes are active, and whether they are before the wall. Layer 0 is far behind
    // the wall. Layer 1 is a quarter of a cell behind it and moves through it. Layer 2 is before it. Layer 3 has no
    // list items near.
    let expected = [(0, (false, false)), (1, (true, true)), (2, (true, true)), (3, (false, true))];
    assert_eq!(states.into_iter().collect::<Vec<_>>(), expected);
}
