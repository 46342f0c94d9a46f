//! Irradiance probes with visibility: a grid of points, each of which sends rays all around and keeps, for every
//! direction, the light of a hemisphere and how far it sees. A surface weighs the eight probes about it by whether they
//! see it.
//!
//! Majercik, Guertin, Nowrouzezahrai and McGuire, "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance
//! Fields", 2019, and Majercik, Marrs, Spjut and McGuire, "Scaling Probe-Based Real-Time Dynamic Global Illumination for
//! Production", 2021. `docs/notes/probes.md` says what differs.

pub mod constants;
pub mod ways;

use glam::{DQuat, Vec3};

use super::cascades::{self, Cascades};
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
/// Bytes of a probe's texels of light and of distances, borders included (`glsl/gi/probes/grid.glsl`).
const LIGHT_BYTES: u64 = 10 * 10 * 16;
const DISTANCES_BYTES: u64 = 18 * 18 * 8;
/// Sums that tell whether feedback has settled: of 4³ blocks of the grid, 64 bits each (`glsl/gi/probes/sums.comp`).
const SUMS_BYTES: u64 = 4 * 4 * 4 * 8;
/// What every device binds as one buffer.
const MOST_BYTES: u64 = 128 << 20;
/// Names of the light of each bounce that is stored.
const LIGHTS: [&str; 2] = ["probe light", "first probe light"];

shared! {
    /// Where a grid of probes stands; lengths in voxels of the base grid.
    ProbeGrid { corner: [f32; 3], spacing: f32, first: [i32; 3] }

    /// A probe: its place in voxels, its state, and its cell, counted from the base grid's corner.
    Probe { position: [f32; 3], state: u32, cell: [i32; 3] }

    /// What a ray of a probe found; the distance in voxels.
    ProbeRay { light: [f32; 3], open: f32, distance: f32 }

    /// Push constants: the first probe, the step of the pass that places probes (of the pass that blends, whether
    /// distances stay), and whether they hold what a pass before left.
    ProbesPush { first: u32, step: u32, known: u32 }
}

/// Light of the pass before: there is none; a share of it stays; none of it stays.
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
    /// Finds direct light alone.
    direct: Compute,
    /// Adds what the pass before left in the probes; absent with one bounce.
    bounced: Option<Compute>,
    blend: Compute,
    sum: Compute,
    grids: Buffer,
    probes: Buffer,
    distances: Buffer,
    /// Light of all bounces; with two of them behind it that of the first.
    lights: Vec<Buffer>,
    ways: Buffer,
    rays: Buffer,
    felt: Buffer,
    sums: Buffer,
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
            ("light sums", SUMS_BYTES),
        ];
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
        // A ray that meets several surfaces keeps the sum of what they send, of which no direct light is read.
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
            sum: compute("sums", "gi/probes/sums.comp", &lit)?,
            grids: buffer("probe grids")?,
            probes: buffer("probes")?,
            distances: buffer("probe distances")?,
            lights: LIGHTS[..stored(settings.bounces)].iter().map(|name| buffer(name)).collect::<Result<_>>()?,
            ways: buffer("probe directions")?,
            rays: buffer("probe rays")?,
            felt: buffer("felt distances")?,
            sums: buffer("light sums")?,
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
        // Light that is waited for is shown by no frame: nothing of it need be smooth from frame to frame.
        let lags = self.settings.hysteresis > 0.0 && !update.measured;
        let turned = update.mean_pass > 0 || lags;
        let mut ways = ways::ways(self.settings.rays, ways::turn(if turned { update.passes } else { 0 }));
        ways.extend(ways::ways(FEELERS, DQuat::IDENTITY));
        r.full_barrier(); // the pass before read them
        r.update(&self.ways, 0, &ways);
        if update.lists {
            self.place(r, ground, update.known);
        }
        let (names, to) = (["trace 1", "blend 1"], self.lights.len() - 1);
        let first = Pass { trace: &self.direct, names, to, history: NONE, lights_alone: false };
        // With all bounces, what rays meet reflects the light of the pass before; it is known where there was one.
        match &self.bounced {
            Some(again) if self.bounces == Bounces::All && update.history => {
                self.light(r, ground, &Pass { trace: again, to: 0, history: if lags { BLENDED } else { REPLACED }, ..first });
            }
            // Otherwise the first bounce is lit directly,
            _ => self.light(r, ground, &first),
        }
        // and the second one by the first.
        if let Some(second) = self.bounced.as_ref().filter(|_| self.bounces == Bounces::Two) {
            let names = ["trace 2", "blend 2"];
            self.light(r, ground, &Pass { trace: second, names, to: 0, history: NONE, lights_alone: true });
        }
        if update.measured {
            self.sum(r);
        }
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        self.look_up(0)
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        (self.bounces == Bounces::All).then_some(CoarseLight::Sums(&self.sums))
    }
}

/// A pass over all probes.
struct Pass<'a> {
    trace: &'a Compute,
    /// Of its two parts.
    names: [&'static str; 2],
    /// The light that it fills.
    to: usize,
    /// Whether that holds the light of the pass before, and what becomes of it.
    history: u32,
    /// Whether the rays met what those of the pass before met, so that distances stay.
    lights_alone: bool,
}

impl Lighting {
    /// Puts the probes where the surfaces of this frame ask for them. `known`: they hold what a frame before left.
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
            r.full_barrier(); // the step before wrote
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
                // The last look tells which probes ended in a solid.
                let last = round == self.settings.relocations;
                if last && !self.settings.classify {
                    break;
                }
                r.full_barrier(); // the probes stand elsewhere
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

    /// Sends the rays of all probes, and brings what they find into the texels.
    fn light(&self, r: &mut Recorder, ground: &Ground, pass: &Pass) {
        let [trace, blend] = pass.names;
        let all = probes(&self.settings);
        r.zone(trace, ZoneKind::Compute, self.rays.bytes(), |r| {
            r.full_barrier(); // the probes stand where they stand, and their light was written
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

    fn sum(&self, r: &mut Recorder) {
        let binds = [
            Bind::buffer("probes", &self.probes),
            Bind::buffer("probe_light", &self.lights[0]),
            Bind::buffer("light_sums", &self.sums),
        ];
        r.zone("sums", ZoneKind::Compute, SUMS_BYTES, |r| {
            r.full_barrier(); // the light was written, the sums before may have been read
            r.fill(&self.sums, 0, SUMS_BYTES, 0);
            r.full_barrier(); // they are 0
            let groups = [probes(&self.settings).div_ceil(64), 1, 1];
            r.dispatch(&self.sum, &self.sum.select(&binds), &(), groups);
        });
    }

    fn of_rays(&self) -> [Bind<'_>; 2] {
        [Bind::buffer("probe_ways", &self.ways), Bind::buffer("probe_rays", &self.rays)]
    }

    /// What a look-up binds. `light`: which of the lights counts as that of all bounces.
    fn look_up(&self, light: usize) -> Vec<Bind<'_>> {
        vec![
            Bind::buffer("probes", &self.probes),
            Bind::buffer("probe_grids", &self.grids),
            Bind::buffer("probe_distances", &self.distances),
            Bind::buffer("probe_light", &self.lights[light]),
            Bind::buffer("first_light", self.lights.last().unwrap_or(&self.sums)),
        ]
    }
}

/// Of all grids.
fn probes(own: &Settings) -> u32 {
    own.cascades * own.edge.pow(3)
}

/// Lights that are stored: two bounces have one each, all bounces share one.
fn stored(bounces: Bounces) -> usize {
    if bounces == Bounces::Two { 2 } else { 1 }
}

fn nested(own: &Settings, base_edge: u32) -> Cascades {
    Cascades { edge: own.edge, count: own.cascades, base_edge }
}

/// The lists of the method's own grids, the finest first.
fn further(ground: &Ground) -> impl Iterator<Item = &Lists> {
    ground.lists[1..].iter()
}

fn grid_of(lists: &Lists) -> ProbeGrid {
    let GridPlace { corner, voxel, .. } = lists.place;
    ProbeGrid { corner, spacing: voxel, first: corner.map(|c| (c / voxel).round() as i32) }
}
