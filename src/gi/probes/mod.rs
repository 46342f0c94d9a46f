//! Irradiance probes with visibility: each point of a grid traces rays in all directions. It stores, for every
//! direction, the light of a hemisphere and the distance to surfaces. A surface point weighs the eight probes about it
//! by their visibility.
//!
//! Majercik, Guertin, Nowrouzezahrai and McGuire, "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance
//! Fields", 2019, and Majercik, Marrs, Spjut and McGuire, "Scaling Probe-Based Real-Time Dynamic Global Illumination
//! for Production", 2021. `docs/notes/probes.md` lists the differences.

pub mod constants;
pub mod ways;

use glam::{DQuat, Vec3};

use super::cascades::{self, Cascades, further};
use super::light_sums::{self, LightSums};
use super::{CoarseLight, IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::ground::Ground;
use crate::ground::constants::{DIRECT_FOUND, DIRECT_READ, Features, with};
use crate::ground::grid::GridPlace;
use crate::ground::layout::shared;
use crate::ground::lists::Lists;
use crate::ground::memory_plan::{MemoryRow, bytes_of};
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Recorder, ZoneKind};
use crate::{Error, Result};
use constants::constants;

pub use crate::settings::methods::probes::Settings;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[];

/// Rays by which a probe finds its place: `FEELERS` in `glsl/gi/probes/feelers.glsl`.
pub const FEELERS: u32 = 32;
/// Bytes of a probe's texels of light and of distances, including borders (`glsl/gi/probes/grid.glsl`).
const LIGHT_BYTES: u64 = 10 * 10 * 16;
const DISTANCES_BYTES: u64 = 18 * 18 * 8;
/// The size of a storage buffer that every device can bind, bytes.
const MOST_BYTES: u64 = 128 << 20;
/// Labels of the buffers of light: the first for all bounces, the second for the first bounce alone.
const LIGHTS: [&str; 2] = ["probe light", "first probe light"];

shared! {
    /// The place of a grid of probes: least corner, spacing, and first cell. Lengths are in voxels of the base grid.
    ProbeGrid { corner: [f32; 3], spacing: f32, first: [i32; 3] }

    /// A probe: its position in voxels, its state, and its cell, counted from the base grid's corner.
    Probe { position: [f32; 3], state: u32, cell: [i32; 3] }

    /// The result of a probe's ray: stored radiance, transmittance to the sky, and distance in voxels.
    ProbeRay { light: [f32; 3], open: f32, distance: f32 }

    /// Push constants: the index of the first probe, the step, and the state of the light of an earlier pass. The step
    /// is that of the pass that places probes; for the pass that blends, 1 leaves distances as they are.
    ProbesPush { first: u32, step: u32, known: u32 }
}

/// State of the light of the pass before: there is none; a share of it stays; new light replaces it.
const NONE: u32 = 0;
const BLENDED: u32 = 1;
const REPLACED: u32 = 2;
/// Steps of the pass that places probes.
const START: u32 = 0;
const MOVE: u32 = 1;
const CLASSIFY: u32 = 2;

pub struct Lighting {
    place: Compute,
    feel: Compute,
    /// Traces rays for direct light alone.
    direct: Compute,
    /// Traces rays that also reflect the probes' light of the pass before; absent with one bounce.
    bounced: Option<Compute>,
    blend: Compute,
    grids: Buffer,
    probes: Buffer,
    distances: Buffer,
    /// Light of all bounces; with two bounces, a second buffer holds that of the first bounce.
    lights: Vec<Buffer>,
    ways: Buffer,
    rays: Buffer,
    felt: Buffer,
    /// Absent unless the light feeds back.
    sums: Option<LightSums>,
    settings: Settings,
    bounces: Bounces,
    base_edge: u32,
    constants: Vec<Constant>,
}

impl IndirectMethod for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let own = &settings.of.probes;
        Wants {
            rays: true,
            grids: cascades::places(nested(own, settings.voxels), Vec3::splat(0.5 * settings.voxels as f32)),
            mean_passes: (settings.bounces == Bounces::All).then_some(own.passes),
            diffuse: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        let own = &settings.of.probes;
        let probes = u64::from(probes(own));
        let mut rows = vec![
            ("probe grids", u64::from(own.cascades) * size_of::<ProbeGrid>() as u64),
            ("probes", probes * size_of::<Probe>() as u64),
            ("probe distances", probes * DISTANCES_BYTES),
            ("probe directions", u64::from(own.rays + FEELERS) * size_of::<[f32; 3]>() as u64),
            ("probe rays", probes * u64::from(own.rays) * size_of::<ProbeRay>() as u64),
            ("felt distances", probes * u64::from(FEELERS) * 4),
        ];
        rows.extend((settings.bounces == Bounces::All).then_some(light_sums::ROW));
        rows.extend(LIGHTS[..stored(settings.bounces)].iter().map(|name| (*name, probes * LIGHT_BYTES)));
        rows
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.probes;
        let plan = Self::plan(settings);
        if let Some((name, bytes)) = plan.iter().find(|row| row.1 > MOST_BYTES) {
            return Err(Error::Usage(format!(
                "{} probes of {} rays need {} MiB for the {name}, and {} MiB are the most: set probes.edge, probes.cascades or \
                 probes.rays lower",
                probes(own),
                own.rays,
                bytes >> 20,
                MOST_BYTES >> 20
            )));
        }
        let own_constants = constants(settings);
        let lit = with(crate::ground::constants::constants(settings, features), &own_constants);
        let lit = with(lit, &[("LAMP_POINTS", settings.lights.voxel_lamp_points.into())]);
        let compute = |label, shader, constants: &[_]| Compute::new(context, &ComputeDesc { label, shader, constants });
        // A ray that passes surfaces stores the sum of their light, from which direct light cannot be read again.
        let passing = features.has(Features::BLEND) || features.has(Features::TRANSMISSION);
        let feeds = settings.bounces == Bounces::All;
        let direct = if feeds || passing { DIRECT_FOUND } else { DIRECT_READ };
        let bounced = || compute("trace", "gi/probes/trace.comp LOOK_UP", &with(lit.clone(), &[("DIRECT", direct.into())]));
        let buffer = |name: &str| Buffer::new(context, name, bytes_of(&plan, name), BufferKind::Device);
        Ok(Self {
            place: compute("place", "gi/probes/place.comp", &lit)?,
            feel: compute("place", "gi/probes/feel.comp", &lit)?,
            direct: compute("trace", "gi/probes/trace.comp", &lit)?,
            bounced: (settings.bounces.stored() > 1).then(bounced).transpose()?,
            blend: compute("blend", "gi/probes/blend.comp", &lit)?,
            grids: buffer("probe grids")?,
            probes: buffer("probes")?,
            distances: buffer("probe distances")?,
            lights: LIGHTS[..stored(settings.bounces)].iter().map(|name| buffer(name)).collect::<Result<_>>()?,
            ways: buffer("probe directions")?,
            rays: buffer("probe rays")?,
            felt: buffer("felt distances")?,
            sums: feeds.then(|| LightSums::new(context, "gi/probes/sums.comp", &lit)).transpose()?,
            settings: own.clone(),
            bounces: settings.bounces,
            base_edge: settings.voxels,
            constants: own_constants,
        })
    }

    fn grids(&self, eye: Vec3) -> Vec<GridPlace> {
        cascades::places(nested(&self.settings, self.base_edge), eye)
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        // No frame shows light that is still settling, so it need not be smooth from frame to frame.
        let lags = self.settings.hysteresis > 0.0 && !update.measured;
        let turned = update.mean_pass > 0 || lags;
        let mut ways = ways::ways(self.settings.rays, ways::turn(if turned { update.passes } else { 0 }));
        ways.extend(ways::ways(FEELERS, DQuat::IDENTITY));
        r.full_barrier(); // the pass before may still read them
        r.update(&self.ways, 0, &ways);
        if update.lists {
            self.place(r, ground, update.known);
        }
        let (names, to) = (["trace 1", "blend 1"], self.lights.len() - 1);
        let first = Pass { trace: &self.direct, names, to, history: NONE, lights_alone: false };
        // With all bounces, surfaces reflect the light of the pass before, where there was one.
        match &self.bounced {
            Some(again) if self.bounces == Bounces::All && update.history => {
                self.light(r, ground, &Pass { trace: again, to: 0, history: if lags { BLENDED } else { REPLACED }, ..first });
            }
            // Otherwise the first bounce reflects direct light.
            _ => self.light(r, ground, &first),
        }
        // The second bounce reflects the light of the first.
        if let Some(second) = self.bounced.as_ref().filter(|_| self.bounces == Bounces::Two) {
            let names = ["trace 2", "blend 2"];
            self.light(r, ground, &Pass { trace: second, names, to: 0, history: NONE, lights_alone: true });
        }
        if let Some(sums) = self.sums.as_ref().filter(|_| update.measured) {
            self.sum(r, sums);
        }
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        self.look_up(0)
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.sums.as_ref().map(LightSums::coarse)
    }
}

/// A pass over all probes.
struct Pass<'a> {
    trace: &'a Compute,
    /// Labels of its two parts, tracing and blending.
    names: [&'static str; 2],
    /// Index of the buffer of light that it writes.
    to: usize,
    /// State of the light of the pass before in that buffer: NONE, BLENDED or REPLACED.
    history: u32,
    /// Whether distances stay, because the rays are those of the pass before.
    lights_alone: bool,
}

impl Lighting {
    /// Places the probes for the surfaces of this frame. `known`: they hold the light of an earlier frame.
    fn place(&self, r: &mut Recorder, ground: &Ground, known: bool) {
        let grids: Vec<ProbeGrid> = further(ground).map(grid_of).collect();
        let per_grid = self.settings.edge.pow(3);
        let common = [
            Bind::buffer("probes", &self.probes),
            Bind::buffer("probe_grids", &self.grids),
            Bind::buffer("probe_ways", &self.ways),
            Bind::buffer("felt_distances", &self.felt),
        ];
        let step = |r: &mut Recorder, step: u32| {
            r.full_barrier(); // the step before wrote the probes
            for (number, lists) in (0..).zip(further(ground)) {
                let mut binds = common.to_vec();
                binds.push(Bind::buffer("grid_heads", &lists.heads));
                let push = ProbesPush { first: number * per_grid, step, known: known.into() };
                r.dispatch(&self.place, &self.place.select(&binds), &push, [per_grid.div_ceil(64), 1, 1]);
            }
        };
        r.zone("place", ZoneKind::Compute, self.probes.bytes(), |r| {
            r.full_barrier(); // the frame before read them
            r.update(&self.grids, 0, &grids);
            step(r, START);
            for round in 0..=self.settings.relocations {
                // The last rays tell which probes lie within a solid.
                let last = round == self.settings.relocations;
                if last && !self.settings.classify {
                    break;
                }
                r.full_barrier(); // the probes have moved
                let mut binds = ground.binds();
                binds.extend(common.clone());
                let binds = self.feel.select(&binds);
                r.in_parts(probes(&self.settings), 64, |r, part| {
                    let push = ProbesPush { first: part.start, step: 0, known: 0 };
                    r.dispatch(&self.feel, &binds, &push, [1, part.end - part.start, 1]);
                });
                step(r, if last { CLASSIFY } else { MOVE });
            }
        });
    }

    /// Traces the rays of all probes, and filters the results into the texels.
    fn light(&self, r: &mut Recorder, ground: &Ground, pass: &Pass) {
        let [trace, blend] = pass.names;
        let all = probes(&self.settings);
        r.zone(trace, ZoneKind::Compute, self.rays.bytes(), |r| {
            r.full_barrier(); // the places and the light of the probes were written
            let mut binds = ground.binds();
            binds.extend(self.look_up(self.lights.len() - 1));
            binds.extend(self.of_rays());
            let binds = pass.trace.select(&binds);
            r.in_parts(all, 64, |r, part| {
                let push = ProbesPush { first: part.start, step: 0, known: 0 };
                let groups = [self.settings.rays.div_ceil(64), part.end - part.start, 1];
                r.dispatch(pass.trace, &binds, &push, groups);
            });
        });
        let light = &self.lights[pass.to];
        r.zone(blend, ZoneKind::Compute, light.bytes() + self.distances.bytes(), |r| {
            r.full_barrier(); // the rays were written
            let mut binds = vec![
                Bind::buffer("frame", &ground.frame),
                Bind::buffer("probes", &self.probes),
                Bind::buffer("probe_grids", &self.grids),
                Bind::buffer("probe_distances", &self.distances),
                Bind::buffer("probe_light", light),
            ];
            binds.extend(self.of_rays());
            let binds = self.blend.select(&binds);
            r.in_parts(all, 64, |r, part| {
                let push = ProbesPush { first: part.start, step: pass.lights_alone.into(), known: pass.history };
                r.dispatch(&self.blend, &binds, &push, [part.end - part.start, 1, 1]);
            });
        });
    }

    fn sum(&self, r: &mut Recorder, sums: &LightSums) {
        sums.record(r, |r, pass, sums| {
            let binds =
                [Bind::buffer("probes", &self.probes), Bind::buffer("probe_light", &self.lights[0]), sums];
            r.dispatch(pass, &pass.select(&binds), &(), [probes(&self.settings).div_ceil(64), 1, 1]);
        });
    }

    fn of_rays(&self) -> [Bind<'_>; 2] {
        [Bind::buffer("probe_ways", &self.ways), Bind::buffer("probe_rays", &self.rays)]
    }

    /// Bindings of a look-up. `light`: index of the buffer that stands for the light of all bounces.
    fn look_up(&self, light: usize) -> Vec<Bind<'_>> {
        vec![
            Bind::buffer("probes", &self.probes),
            Bind::buffer("probe_grids", &self.grids),
            Bind::buffer("probe_distances", &self.distances),
            Bind::buffer("probe_light", &self.lights[light]),
            Bind::buffer("first_light", &self.lights[self.lights.len() - 1]),
        ]
    }
}

/// The number of probes of all grids.
fn probes(own: &Settings) -> u32 {
    own.cascades * own.edge.pow(3)
}

/// The number of buffers of light: one for each of two bounces, otherwise one in total.
fn stored(bounces: Bounces) -> usize {
    if bounces == Bounces::Two { 2 } else { 1 }
}

fn nested(own: &Settings, base_edge: u32) -> Cascades {
    Cascades { edge: own.edge, count: own.cascades, base_edge }
}

fn grid_of(lists: &Lists) -> ProbeGrid {
    let GridPlace { corner, voxel, .. } = lists.place;
    ProbeGrid { corner, spacing: voxel, first: corner.map(|c| (c / voxel).round() as i32) }
}
