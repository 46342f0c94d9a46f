//! Light propagation: steps on the device against their twin and against numbers worked out by hand. `lpv.rs` checks
//! the method as a whole.

mod steps;

use crate::gpu;

use std::f64::consts::PI;

use crate::scenes::Random;
use bytemuck::Zeroable;
use glam::{DVec3, IVec3, Vec3};
use gpu::twins::propagation::{Cell, Cells, PUBLISHED, Rules, Texture, WAYS, as_coefficients, shares};
use steps::{Steps, pack, propagation, volume};
use twobounce::gi::lpv::{self, LpvPush};
use twobounce::ground::layout;
use twobounce::vk::*;

const LOBES: Rules = Rules::Lobes { own: false, integral: 4.0 * PI };
const OWN_LOBES: Rules = Rules::Lobes { own: true, integral: 4.0 * PI };
/// The source's settings, with the coefficients that its author published.
const PUBLISHED_LOBES: Rules = Rules::Lobes { own: true, integral: PI };
const BEAMS: Rules = Rules::Beams(0.5);

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

/// Shares of a light of 1 that go ahead, to each side, and back, by the listing's solid angles: clamped lobes gain
/// 0.1382, beams neither gain nor lose.
#[test]
fn one_light_after_one_and_two_steps_is_as_by_hand() {
    let context = gpu::context();
    for (rules, moment, [ahead, side, back], gain) in [
        (LOBES, 2.0, [0.471_540_8, 0.166_666_7, 0.0], 1.138_207_5),
        (BEAMS, 0.5, [0.603_653_5, 0.090_214_4, 0.035_488_9], 1.0),
        (BEAMS, 0.0, [1.0 / 6.0; 3], 1.0),
    ] {
        let (start, middle) = one_light(16, DVec3::X * moment);
        let steps = Steps::new(&context, 16, rules);
        let (once, _) = steps.run(&start, 1);
        let at = |field: &[f64], cell: IVec3| field[start.index(cell).expect("a cell")];
        for way in WAYS {
            let expected = if way == IVec3::X {
                ahead
            } else if way == IVec3::NEG_X {
                back
            } else {
                side
            };
            near(at(&once, middle + way), expected, "a neighbour after one step");
        }
        near(at(&once, middle), 0.0, "its own cell");
        near(once.iter().sum(), gain, "all cells after one step");
        if rules == LOBES {
            // From the cell behind: flux a, and a moment along x of twice the flux onto the opposite face.
            let opposite = 22.95668 / 720.0;
            let crossing = opposite + 4.0 * 24.26083 / 720.0 * 2.0 / 5f64.sqrt();
            let (twice, _) = steps.run(&start, 2);
            near(at(&twice, middle + 2 * IVec3::X), ahead / 6.0 + crossing * 2.0 * 3.0 * opposite, "two cells ahead");
        }
    }
}

#[test]
fn steps_are_their_twins() {
    let context = gpu::context();
    let mut random = Random::new(11);
    for rules in [LOBES, OWN_LOBES, PUBLISHED_LOBES, BEAMS, Rules::Beams(0.8)] {
        let mut start = Cells::empty(16);
        for cell in &mut start.cells {
            let flux = random.unit();
            *cell = Cell { flux, moment: random.direction() * flux * random.unit() };
        }
        for passage in &mut start.passages {
            // Rounded to sixteen bits.
            *passage = std::array::from_fn(|_| (random.unit() * 65535.0).round() / 65535.0);
        }
        let (got, sums) = Steps::new(&context, 16, rules).run(&start, 3);
        let mut light = start.clone();
        let mut added = vec![vec![0.0; start.cells.len()]; sums.len()];
        for _ in 0..3 {
            light = light.step(rules);
            for (index, cell) in light.cells.iter().enumerate() {
                let parts: Vec<f64> = match rules {
                    Rules::Lobes { .. } => vec![cell.flux, cell.moment.x, cell.moment.y, cell.moment.z],
                    Rules::Beams(sharpness) => shares(*cell, sharpness).iter().map(|s| cell.flux * s.0).collect(),
                };
                for (sum, part) in added.iter_mut().zip(parts) {
                    sum[index] = if matches!(rules, Rules::Lobes { own: true, .. }) { part } else { sum[index] + part };
                }
            }
        }
        let expected = light.cells.iter().map(|cell| cell.flux).chain(added.into_iter().flatten());
        for (got, expected) in got.into_iter().chain(sums.into_iter().flatten()).zip(expected) {
            // f32, and the cancellation in 1 + g² − 2 g cos θ where a narrow beam goes ahead.
            assert!((got - expected).abs() <= 1e-4 * expected.abs().max(0.1), "{got} is not {expected}");
        }
    }
}

/// The 48 symmetries of the cube; the six axes are a part of them.
#[test]
fn an_even_light_spreads_alike_along_all_axes_and_symmetries() {
    // After an even number of steps, cells at an even number of faces' distance; the grid's border is never reached.
    let (start, middle) = one_light(16, DVec3::ZERO);
    for rules in [LOBES, BEAMS] {
        let (cells, _) = Steps::new(&gpu::context(), 16, rules).run(&start, 6);
        let at = |cell: IVec3| cells[start.index(cell).expect("a cell")];
        for (x, y, z) in [(2, 0, 0), (3, 2, 1), (4, 2, 0), (2, 2, 2), (5, 1, 0)] {
            let first = at(middle + IVec3::new(x, y, z));
            assert!(first > 0.0);
            for [i, j, k] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                for signs in 0..8 {
                    let mut to = IVec3::ZERO;
                    for (axis, (value, bit)) in [i, j, k].into_iter().zip([(x, 1), (y, 2), (z, 4)]) {
                        to[axis] = if signs & bit != 0 { -value } else { value };
                    }
                    // f32 over six steps, added up in another order; where beams meet, their moments cancel.
                    let off = at(middle + to) / first - 1.0;
                    assert!(off.abs() < 1e-4, "one of 48 directions is off by {off}");
                }
            }
        }
    }
}

/// Beams: light is conserved until it leaves, nothing is negative, and a thousand steps leave no light in the grid.
#[test]
fn light_is_bounded_after_a_thousand_steps() {
    let steps = Steps::new(&gpu::context(), 16, BEAMS);
    let (start, _) = one_light(16, DVec3::Y * 0.3);
    let (cells, _) = steps.run(&start, 7);
    near(cells.iter().sum(), 1.0, "all cells before the border is reached");
    let (cells, sums) = steps.run(&start, 1000);
    assert!(cells.iter().chain(sums.iter().flatten()).all(|flux| *flux >= 0.0), "something is negative");
    assert!(cells.iter().sum::<f64>() < 1e-6, "something is left");
    // A closed box keeps its light: 2³ cells that no light enters or leaves.
    let mut closed = start.clone();
    let inside = |cell: IVec3| cell.cmpge(IVec3::splat(7)).all() && cell.cmplt(IVec3::splat(9)).all();
    let place = |index: usize| IVec3::new(index as i32 % 16, index as i32 / 16 % 16, index as i32 / 256);
    for index in 0..closed.cells.len() {
        for (k, way) in WAYS.iter().enumerate() {
            closed.passages[index][k] = f64::from(u8::from(inside(place(index)) && inside(place(index) - *way)));
        }
    }
    let (cells, sums) = steps.run(&closed, 1000);
    let outside =
        |field: &[f64]| field.iter().enumerate().filter(|(i, _)| !inside(place(*i))).map(|(_, flux)| flux).sum::<f64>();
    assert_eq!((outside(&cells), sums.iter().map(|sum| outside(sum)).sum::<f64>()), (0.0, 0.0), "sheets leak");
    // In every step half of the light is absorbed by the walls; the sum over the steps is the start's light over that
    // half.
    assert!(sums.iter().flatten().sum::<f64>() < 3.0, "what walls take is not gone");
}

/// A surface that faces +x fills half of a cell's face, one that faces −y a quarter. They block light that enters their
/// cell through them, from either side, and light that leaves it through a front.
#[test]
fn what_passes_into_a_cell_is_by_hand() {
    let (context, edge) = (gpu::context(), 16);
    let empty = Cells::empty(edge as i32);
    let index = |cell: IVec3| empty.index(cell).expect("a cell");
    let cell = IVec3::splat(5);
    let mut blockers = vec![[0u32; 4]; empty.cells.len()];
    blockers[index(cell)] = [pack([0.5, 0.0]), pack([0.0, 0.0]), pack([0.25, 0.0]), 0];
    let blockers = upload(&context, "blockers", &blockers).expect("an upload");
    let passages = upload(&context, "passages", &vec![[0u32; 3]; empty.cells.len()]).expect("an upload");
    let desc =
        ComputeDesc { label: "passages", shader: "gi/lpv/passages.comp", constants: &[("LPV_EDGE", edge.into())] };
    let pipeline = Compute::new(&context, &desc).expect("a pipeline");
    let mut recorder = Recorder::new(&context, RecorderOptions::default()).expect("a recorder");
    recorder.zone("passages", ZoneKind::Compute, 0, |r| {
        let binds = [Bind::buffer("blockers", &blockers), Bind::buffer("passages", &passages)];
        r.dispatch(&pipeline, &binds, &LpvPush::zeroed(), [edge / 4; 3]);
    });
    recorder.finish().expect("a dispatch");
    let packed: Vec<[u32; 3]> = download(&context, &passages).expect("passages");
    let into = |cell: IVec3, way: usize| {
        let word = packed[index(cell)][way / 2];
        f64::from(if way.is_multiple_of(2) { word & 0xffff } else { word >> 16 }) / 65535.0
    };
    for (from, way, expected) in [
        (IVec3::ZERO, 0, 0.5), // into it, along +x and −x
        (IVec3::ZERO, 3, 0.5),
        (IVec3::ZERO, 1, 0.75), // along +y and −y
        (IVec3::ZERO, 4, 0.75),
        (IVec3::ZERO, 2, 1.0),
        (IVec3::X, 0, 1.0), // out of it, along +x: away from the front
        (IVec3::NEG_X, 3, 0.5),
        (IVec3::Y, 1, 0.75),
        (IVec3::NEG_Y, 4, 1.0),
        (IVec3::Z, 2, 1.0),
    ] {
        let got = into(cell + from, way);
        assert!((got - expected).abs() < 2e-5, "into the cell at {from}, along {}: {got}", WAYS[way]);
    }
}

/// The finer of two grids has cells of half a voxel and starts at voxel (4, 2, 8), the coarser one starts at voxel (1,
/// 2, 3). Light that enters along each direction is the coarser grid's sum in that direction at the voxel beyond the
/// border.
#[test]
fn a_finer_grid_takes_in_what_the_coarser_one_has_there() {
    let (context, edge) = (gpu::context(), 16u32);
    let count = edge.pow(3) as usize;
    let coarse = |k: usize, cell: IVec3| (1000 * k as i32 + 1 + cell.x + 16 * cell.y + 256 * cell.z) as f32;
    let place = |index: usize| IVec3::new(index as i32 % 16, index as i32 / 16 % 16, index as i32 / 256);
    let sums: Vec<Image> = (0..6)
        .map(|k| {
            let texels: Vec<[f32; 4]> = (0..2 * count)
                .map(|i| if i < count { [0.0; 4] } else { [coarse(k, place(i - count)), 0.0, 0.0, 0.0] })
                .collect();
            volume(&context, edge, 2, Some(&texels))
        })
        .collect();
    let [old, new] = [0, 1].map(|_| [0, 1].map(|_| volume(&context, edge, 1, Some(&vec![[0.0; 4]; count]))));
    let corner = Vec3::new(4.0, 2.0, 8.0);
    let push = LpvPush { offset: (-2.0 * corner).into(), scale: 2.0, ..LpvPush::zeroed() };
    let [x, y, z] = push.offset;
    let places = upload(&context, "cascades", &[[x, y, z, 2.0], [-1.0, -2.0, -3.0, 1.0]]).expect("an upload");
    let passages = upload(&context, "passages", &vec![[u32::MAX; 3]; count]).expect("an upload");
    let frame = upload(&context, "frame", &[layout::Frame { scale: 1.0, ..Zeroable::zeroed() }]).expect("an upload");
    let constants = propagation(&[
        ("LPV_EDGE", edge.into()),
        ("CASCADES", 2u32.into()),
        ("LOBE", lpv::Lobe::Beam.into()),
        ("FIRST_STEP", true.into()),
        ("SHARPNESS", 0.5.into()),
    ]);
    let desc = ComputeDesc { label: "propagate", shader: "gi/lpv/propagate_beams.comp", constants: &constants };
    let pipeline = Compute::new(&context, &desc).expect("a pipeline");
    let sampler = Sampler::new(&context, Filter::NEAREST, SamplerAddressMode::CLAMP_TO_EDGE).expect("a sampler");
    let mut recorder = Recorder::new(&context, RecorderOptions::default()).expect("a recorder");
    recorder.zone("propagate", ZoneKind::Compute, 0, |r| {
        let binds = [
            Bind::buffer("passages", &passages),
            Bind::buffer("cascades", &places),
            Bind::buffer("frame", &frame),
            Bind::images("old_light", old.iter().map(Image::view), &sampler),
            Bind::storage_images("new_light", new.iter().map(|part| part.mip_view(0))),
            Bind::storage_images("sums", sums.iter().map(|part| part.mip_view(0))),
        ];
        r.dispatch(&pipeline, &pipeline.select(&binds), &push, [1, 4, 16]);
    });
    recorder.finish().expect("a dispatch");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    let flux: Vec<[f32; 4]> = download_image(&context, &new[0], 0).expect("a flux");
    for (index, flux) in flux.iter().enumerate() {
        let cell = place(index);
        let beyond = WAYS.iter().enumerate().filter(|(_, way)| {
            let from = cell - **way;
            from.min_element() < 0 || from.max_element() > 15
        });
        let comes_in = |(k, way): (usize, &IVec3)| {
            let voxel = corner + ((cell - *way).as_vec3() + 0.5) / 2.0;
            let cell = voxel.floor().as_ivec3() - IVec3::new(1, 2, 3);
            coarse(k, cell.clamp(IVec3::ZERO, IVec3::splat(15)))
        };
        let expected: f32 = beyond.map(comes_in).sum();
        assert!((flux[0] - expected).abs() <= 1e-5 * expected, "{cell}: {} is not {expected}", flux[0]);
    }
}

/// Three steps of the source's listing, in its own coefficients.
#[test]
fn published_steps_are_the_listing() {
    let mut random = Random::new(12);
    let mut start = Cells::empty(16);
    for cell in &mut start.cells {
        let flux = random.unit();
        *cell = Cell { flux, moment: random.direction() * flux * 2.0 };
    }
    let (_, sums) = Steps::new(&gpu::context(), 16, PUBLISHED_LOBES).run(&start, 3);
    let mut listing =
        Texture { edge: 16, cells: start.cells.iter().map(|c| as_coefficients(c.flux, c.moment)).collect() };
    for _ in 0..3 {
        listing = listing.step(PUBLISHED);
    }
    for (index, expected) in listing.cells.iter().enumerate() {
        let got = as_coefficients(sums[0][index], DVec3::new(sums[1][index], sums[2][index], sums[3][index]));
        for (got, expected) in got.into_iter().zip(expected) {
            // f32, and coefficients and solid angles that are published with seven digits.
            assert!((got - expected).abs() <= 1e-5 * expected.abs().max(0.1), "{got} is not {expected}");
        }
    }
}

/// Where every step starts from the cell's own light, the light grows with every step: by a quarter with the published
/// coefficients, twofold with lobes of integral 4π. Summed in a separate image it does not.
#[test]
fn sums_that_start_from_their_own_light_grow_by_what_a_step_sends_on() {
    let context = gpu::context();
    let total = |rules: Rules, moment: f64| {
        let (light, _) = Steps::new(&context, 32, rules).run(&one_light(32, DVec3::X * moment).0, 8);
        light.iter().sum::<f64>()
    };
    // A uniform light's lobes are nowhere negative, and in eight steps nothing reaches the border.
    near(total(PUBLISHED_LOBES, 0.0), 1.25f64.powi(8), "an even light, lobes of integral π");
    near(total(OWN_LOBES, 0.0), 2f64.powi(8), "an even light, lobes of integral 4π");
    // A surface's lobe is clamped; the listing by itself, in another program, gives 6.623 and 287.8.
    for (rules, expected) in [(PUBLISHED_LOBES, 6.623), (OWN_LOBES, 287.8)] {
        let got = total(rules, 2.0);
        assert!((got / expected - 1.0).abs() < 2e-4, "{got} is not {expected}");
    }
    let (_, apart) = Steps::new(&context, 32, BEAMS).run(&one_light(32, DVec3::ZERO).0, 32);
    // 32 steps of a light of 1, less what left.
    assert!(apart.iter().flatten().sum::<f64>() <= 32.0);
}

/// A wall that sends light into a room of 24 cells: as lobes 95 % of it end on that wall, as beams of mean cosine ½
/// less than two thirds, though the truth is none. The wall is an endless plane: a grid one cell wide, whose cells pass
/// light sideways to themselves.
#[test]
fn beams_cross_a_room_and_lobes_do_not() {
    let crossed = |rules: Rules, moment: f64| {
        let mut cell = vec![Cell::default(); 24];
        cell[0] = Cell { flux: 1.0, moment: DVec3::X * moment };
        let (mut far, mut back) = (0.0, 0.0);
        for _ in 0..800 {
            let mut next = vec![Cell::default(); 24];
            for (x, light) in cell.iter().enumerate() {
                // One step of a single cell, and the light that it gives its neighbours in front and behind.
                let mut alone = Cells::empty(3);
                alone.put(IVec3::ONE, *light);
                let sent = alone.step(rules);
                let give = |to: Option<&mut Cell>, lost: &mut f64, way: IVec3| {
                    let got = sent.at(IVec3::ONE + way);
                    match to {
                        Some(to) => (to.flux, to.moment) = (to.flux + got.flux, to.moment + got.moment),
                        None => *lost += got.flux,
                    }
                };
                give(next.get_mut(x + 1), &mut far, IVec3::X);
                give(x.checked_sub(1).and_then(|x| next.get_mut(x)), &mut back, IVec3::NEG_X);
                for way in [IVec3::Y, IVec3::NEG_Y, IVec3::Z, IVec3::NEG_Z] {
                    give(next.get_mut(x), &mut 0.0, way);
                }
            }
            cell = next;
        }
        far / (far + back)
    };
    let (lobes, beams) = (crossed(LOBES, 2.0), crossed(BEAMS, 0.667));
    assert!(lobes < 0.1 && beams > 0.35, "{lobes} and {beams} of a wall's light cross");
}
