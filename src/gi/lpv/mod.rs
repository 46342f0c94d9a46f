//! Light propagation volumes: surfaces become virtual point lights in a coarse grid, whose light travels from cell to cell.
//!
//! Kaplanyan and Dachsbacher, "Cascaded Light Propagation Volumes for Real-Time Indirect Illumination", 2010; the steps as in
//! Doghramachi, "Rasterized Voxel-Based Dynamic Global Illumination", GPU Pro 4, listing 7.3. `docs/lpv.md` says what differs.

mod cascades;
mod settings;

use std::sync::Arc;

use glam::Vec3;

use super::{CoarseLight, Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cells::LIT_COUNTS;
use crate::ground::constants::{DIRECT, DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ, LAMP_POINTS, with};
use crate::ground::grid::GridPlace;
use crate::ground::layout::{CellCount, shared};
use crate::ground::lists::Lists;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

pub use settings::{Apply, Injection, KEYS, Lobe, Occlusion, Settings, Sum};

pub const PASS_UNITS: &[(&str, PassUnit)] = &[];

/// Threads along each side of a workgroup of the passes over all cells.
const GROUP: u32 = 4;
/// Light in a cell: the flux and three moments, each of red, green, blue and sky, f32.
const FIELD_BYTES: u64 = 4 * 16;
const BLOCKERS_BYTES: u64 = 16;

shared! {
    /// Push constants: which grid, and where it lies among the base grid's voxels.
    LpvPush { offset: [f32; 3], scale: f32, cascade: u32, first: u32 }
}

pub struct Lighting {
    first: Light,
    /// The first bounce with the last frame's light to gather from; absent unless `bounces = all`.
    again: Option<Light>,
    second: Option<Light>,
    inject: Compute,
    propagate: Compute,
    /// The light that travels, of one grid: each step reads one and writes the other.
    travelling: [Buffer; 2],
    blockers: Buffer,
    /// For each grid its place; as look-ups want it.
    places: Buffer,
    /// What the steps of each bounce added up, grid by grid.
    sums: Vec<Buffer>,
    settings: Settings,
    base_edge: u32,
    constants: Vec<(u32, u32)>,
}

/// The pass that lights list items.
struct Light {
    pipeline: Compute,
    gathers: bool,
}

impl Gi for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let middle = Vec3::splat(0.5 * settings.voxels as f32);
        Wants {
            grids: cascades::places(&settings.of.lpv, settings.voxels, middle),
            lit_grids: true,
            diffuse: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        let own = &settings.of.lpv;
        let cells = u64::from(own.edge).pow(3);
        let grids = u64::from(own.cascades);
        let mut rows = vec![
            ("travelling light", 2 * cells * FIELD_BYTES),
            ("blockers", grids * cells * BLOCKERS_BYTES),
            ("cascade places", grids * size_of::<[f32; 4]>() as u64),
        ];
        let sums = ["first bounce's sum", "second bounce's sum"];
        rows.extend(sums[..settings.bounces.volumes() as usize].iter().map(|name| (*name, grids * cells * FIELD_BYTES)));
        rows
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.lpv;
        let constants = own_constants(own);
        let items = with(crate::ground::constants::constants(settings, features), &constants);
        let items = with(items, &[(LAMP_POINTS, settings.lights.voxel_lamp_points)]);
        let two = settings.bounces.volumes() > 1;
        let direct = if two { DIRECT_KEPT } else { DIRECT_FOUND };
        let compute = |label, shader, constants: &[_]| Compute::new(context, &ComputeDesc { label, shader, constants });
        let light = |gathers, direct| -> Result<Light> {
            let shader = if gathers { "gi/lpv/light.comp LOOK_UP" } else { "gi/lpv/light.comp" };
            let pipeline = compute("light", shader, &with(items.clone(), &[(DIRECT, direct)]))?;
            Ok(Light { pipeline, gathers })
        };
        let plan = Self::plan(settings);
        let buffer = |name: &str| {
            let bytes = plan.iter().find(|row| row.0 == name).expect("every buffer stands in the plan").1;
            Buffer::new(context, name, bytes, BufferKind::Device)
        };
        let half = |context: &Arc<Context>| {
            let bytes = u64::from(own.edge).pow(3) * FIELD_BYTES;
            Buffer::new(context, "travelling light", bytes, BufferKind::Device)
        };
        let sums = ["first bounce's sum", "second bounce's sum"];
        Ok(Self {
            first: light(false, direct)?,
            again: (settings.bounces == Bounces::All).then(|| light(true, direct)).transpose()?,
            second: two.then(|| light(true, DIRECT_READ)).transpose()?,
            inject: compute("inject", "gi/lpv/inject.comp", &constants)?,
            propagate: compute("propagate", "gi/lpv/propagate.comp", &constants)?,
            travelling: [half(context)?, half(context)?],
            blockers: buffer("blockers")?,
            places: buffer("cascade places")?,
            sums: sums[..settings.bounces.volumes() as usize].iter().map(|name| buffer(name)).collect::<Result<_>>()?,
            settings: own.clone(),
            base_edge: settings.voxels,
            constants,
        })
    }

    fn grids(&self, eye: Vec3) -> Vec<GridPlace> {
        cascades::places(&self.settings, self.base_edge, eye)
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        let [first, rest @ ..] = &self.sums[..] else { return };
        if update.lists {
            let places: Vec<[f32; 4]> = further(ground).map(|lists| lists.place.from_base()).collect();
            r.full_barrier(); // the frame before read them
            r.update(&self.places, 0, &places);
        }
        match (&self.again, rest) {
            // Every item is lit directly and, with all bounces, by what the last frame left,
            (Some(again), [second]) if update.history => self.bounce(r, ground, again, [second, first]),
            // or directly alone; what it sends starts to travel.
            _ => self.bounce(r, ground, &self.first, [first, first]),
        }
        if let (Some(light), [second]) = (&self.second, rest) {
            // Every item is lit once more, with what arrived.
            self.bounce(r, ground, light, [first, second]);
        }
    }

    fn constants(&self) -> &[(u32, u32)] {
        &self.constants
    }

    fn binds(&self) -> Vec<Bind<'_>> {
        self.sums.last().map_or_else(Vec::new, |sum| self.look_up(sum))
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.sums.last().map(CoarseLight::Buffer)
    }
}

impl Lighting {
    /// One bounce: items are lit, with what is in `from` where the pass gathers, and their light travels and adds up in `to`.
    fn bounce(&self, r: &mut Recorder, ground: &Ground, light: &Light, [from, to]: [&Buffer; 2]) {
        let bounce = usize::from(std::ptr::eq(to, self.sums.last().unwrap_or(to)) && self.sums.len() > 1);
        let zone = |names: [&'static str; 2]| names[bounce];
        r.zone(zone(["light 1", "light 2"]), ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the lists, and the sum that is gathered from, were written
            for (cascade, lists) in further(ground).enumerate() {
                let mut binds = ground.binds();
                if light.gathers {
                    binds.extend(self.look_up(from));
                }
                binds.extend([
                    Bind::buffer("direct_light", &lists.direct_light),
                    Bind::buffer("item_lights", &lists.item_lights),
                    Bind::buffer("grid_items", &lists.items),
                    Bind::buffer("cell_counts", &lists.cells.counts),
                ]);
                let offset = u64::from(LIT_COUNTS) * size_of::<CellCount>() as u64;
                let push = push_of(lists, cascade, false);
                let binds = light.pipeline.select(&binds);
                r.dispatch_indirect(&light.pipeline, &binds, &push, (&lists.cells.counts, offset));
            }
        });
        // The coarsest first: its sum is what comes into the finer ones.
        r.zone(zone(["propagate 1", "propagate 2"]), ZoneKind::Compute, 0, |r| {
            for (cascade, lists) in further(ground).enumerate().collect::<Vec<_>>().into_iter().rev() {
                self.travel(r, ground, (cascade, lists), to);
            }
        });
    }

    /// What a grid's items send is injected, travels, and adds up in `sum`.
    fn travel(&self, r: &mut Recorder, ground: &Ground, (cascade, lists): (usize, &Lists), sum: &Buffer) {
        let groups = [self.settings.edge / GROUP; 3];
        r.full_barrier(); // the items are lit
        let binds = [
            Bind::buffer("triangles", &ground.triangles),
            Bind::buffer("materials", &ground.scene.materials),
            Bind::buffer("item_lights", &lists.item_lights),
            Bind::buffer("grid_items", &lists.items),
            Bind::buffer("grid_heads", &lists.heads),
            Bind::buffer("blockers", &self.blockers),
            Bind::buffer("new_light", &self.travelling[0]),
        ];
        r.dispatch(&self.inject, &self.inject.select(&binds), &push_of(lists, cascade, false), groups);
        for step in 0..self.settings.steps() {
            r.full_barrier(); // the step before wrote
            let (old, new) = (&self.travelling[step as usize % 2], &self.travelling[(step as usize + 1) % 2]);
            let binds = [
                Bind::buffer("sums", sum),
                Bind::buffer("blockers", &self.blockers),
                Bind::buffer("cascades", &self.places),
                Bind::buffer("old_light", old),
                Bind::buffer("new_light", new),
            ];
            let push = push_of(lists, cascade, step == 0);
            r.dispatch(&self.propagate, &self.propagate.select(&binds), &push, groups);
        }
    }

    /// A sum to be looked up.
    fn look_up<'a>(&'a self, sum: &'a Buffer) -> Vec<Bind<'a>> {
        vec![
            Bind::buffer("sums", sum),
            Bind::buffer("blockers", &self.blockers),
            Bind::buffer("cascades", &self.places),
        ]
    }
}

/// The lists of the method's own grids, the finest first.
fn further(ground: &Ground) -> impl Iterator<Item = &Lists> {
    ground.lists[1..].iter()
}

fn push_of(lists: &Lists, cascade: usize, first: bool) -> LpvPush {
    let [x, y, z, scale] = lists.place.from_base();
    LpvPush { offset: [x, y, z], scale, cascade: cascade as u32, first: u32::from(first) }
}

/// Constants of `glsl/gi/lpv/constants.glsl`.
fn own_constants(own: &Settings) -> Vec<(u32, u32)> {
    let lobe = match own.lobe {
        Lobe::Cosine => 0,
        Lobe::Even => 1,
    };
    let occlusion = match own.occlusion {
        Occlusion::None => 0,
        Occlusion::Sh => 1,
        Occlusion::Sheets => 2,
    };
    vec![
        (32, own.edge),
        (33, own.cascades),
        (34, lobe),
        (35, occlusion),
        (36, u32::from(own.sum == Sum::Apart)),
        (37, u32::from(own.injection == Injection::Front)),
        (38, u32::from(own.apply == Apply::Flux)),
    ]
}
