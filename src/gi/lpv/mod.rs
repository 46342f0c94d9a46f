//! Light propagation volumes: surfaces become virtual point lights in a coarse grid, whose light travels from cell to
//! cell.
//!
//! Kaplanyan and Dachsbacher, "Cascaded Light Propagation Volumes for Real-Time Indirect Illumination", 2010; the steps
//! follow Doghramachi, "Rasterized Voxel-Based Dynamic Global Illumination", GPU Pro 4, listing 7.3.
//! `docs/notes/lpv.md` lists the differences.

mod field;

use glam::Vec3;

use super::bounces::{BounceDesc, PerBounce};
use super::cascades::{self, Cascades, further};
use super::{CoarseLight, IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::{Error, Result};
use crate::ground::Ground;
use crate::ground::cells::LIT_COUNTS;
use crate::ground::constants::with;
use crate::ground::grid::GridPlace;
use crate::ground::layout::{ListCount, shared};
use crate::ground::lists::Lists;
use crate::ground::memory_plan::{MemoryRow, bytes_of};
use crate::settings::Settings as AllSettings;
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Image, Recorder, ZoneKind};
use field::{Field, FieldDesc};

pub use crate::settings::methods::lpv::{Lobe, Occlusion, Settings};

pub const PASS_UNITS: &[(&str, PassUnit)] = &[];

/// Threads of a workgroup of the passes over all cells, and of a step of beams.
const GROUP: [u32; 3] = [4; 3];
const BEAMS_GROUP: [u32; 3] = [16, 4, 1];
/// Bytes of blockers per cell, as `glsl/gi/lpv/blockers.glsl` packs them.
const BLOCKERS_BYTES: u64 = 16;
const PASSAGES_BYTES: u64 = 12;
/// Images of a sum in look-ups.
const SUM_PARTS: usize = 6;

/// Labels of the sums over propagation steps for each bounce.
const SUM_NAMES: [&str; 2] = ["first bounce's sum", "second bounce's sum"];

shared! {
    /// Push constants: the number of the grid, and its place in voxels of the base grid.
    LpvPush { offset: [f32; 3], scale: f32, cascade: u32 }
}

pub struct Lighting {
    light: PerBounce<LightPass>,
    inject: Compute,
    passages: Compute,
    first_step: Compute,
    propagate: Compute,
    /// The travelling light of one grid: each step reads one field and writes the other.
    travelling: [Field; 2],
    blockers: Buffer,
    /// The share of light that passes into each cell, for each direction of travel along the axes.
    passages_into: Buffer,
    /// The place of each grid, for look-ups.
    places: Buffer,
    /// The sum over the propagation steps of each bounce, grid by grid.
    sums: Vec<Field>,
    settings: Settings,
    base_edge: u32,
    constants: Vec<Constant>,
}

/// The pass that lights list items.
struct LightPass {
    pipeline: Compute,
    /// The bounce, 0 or 1.
    bounce: usize,
}

impl IndirectMethod for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let middle = Vec3::splat(0.5 * settings.voxels as f32);
        Wants {
            grids: cascades::places(nested(&settings.of.lpv, settings.voxels), middle),
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
            ("travelling light", 2 * travelling(own).bytes()),
            ("blockers", grids * cells * BLOCKERS_BYTES),
            ("passages", grids * cells * PASSAGES_BYTES),
            ("cascade places", grids * size_of::<[f32; 4]>() as u64),
        ];
        let names = &SUM_NAMES[..settings.bounces.stored() as usize];
        rows.extend(names.iter().map(|name| (*name, sum_of(own, name).bytes())));
        rows
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.lpv;
        if own.lobe == Lobe::Beam && own.occlusion == Occlusion::Sh {
            return Err(Error::Usage(
                "lpv.occlusion = sh blocks lobes, not beams: set lpv.lobe to cosine, or lpv.occlusion to sheets or none".into(),
            ));
        }
        let constants = constants(own);
        let items = with(crate::ground::constants::constants(settings, features), &constants);
        let items = with(items, &[("LAMP_POINTS", settings.lights.voxel_lamp_points.into())]);
        let compute = |label, shader, constants: &[_]| Compute::new(context, &ComputeDesc { label, shader, constants });
        let light = |BounceDesc { bounce, gathers, direct }| {
            let shader = if gathers { "gi/lpv/light.comp LOOK_UP" } else { "gi/lpv/light.comp" };
            let pipeline = compute("light", shader, &with(items.clone(), &[("DIRECT", direct.into())]))?;
            Ok(LightPass { pipeline, bounce })
        };
        let [inject, propagate] = match own.lobe {
            Lobe::Beam => ["gi/lpv/inject.comp BEAMS", "gi/lpv/propagate_beams.comp"],
            _ => ["gi/lpv/inject.comp", "gi/lpv/propagate.comp"],
        };
        let plan = Self::plan(settings);
        let buffer = |name: &str| Buffer::new(context, name, bytes_of(&plan, name), BufferKind::Device);
        let sums = &SUM_NAMES[..settings.bounces.stored() as usize];
        Ok(Self {
            light: PerBounce::new(settings.bounces, settings.bounces.stored() > 1, light)?,
            inject: compute("inject", inject, &constants)?,
            passages: compute("passages", "gi/lpv/passages.comp", &constants)?,
            first_step: compute("propagate", propagate, &with(constants.clone(), &[("FIRST_STEP", true.into())]))?,
            propagate: compute("propagate", propagate, &constants)?,
            travelling: [Field::new(context, &travelling(own))?, Field::new(context, &travelling(own))?],
            blockers: buffer("blockers")?,
            passages_into: buffer("passages")?,
            places: buffer("cascade places")?,
            sums: sums.iter().map(|name| Field::new(context, &sum_of(own, name))).collect::<Result<_>>()?,
            settings: own.clone(),
            base_edge: settings.voxels,
            constants,
        })
    }

    fn grids(&self, eye: Vec3) -> Vec<GridPlace> {
        cascades::places(nested(&self.settings, self.base_edge), eye)
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        if update.lists {
            let places: Vec<[f32; 4]> = further(ground).map(|lists| lists.place.from_base()).collect();
            r.full_barrier(); // the previous frame read them
            r.update(&self.places, 0, &places);
        }
        // Every item is lit; its light travels and is summed up.
        let steps = self.settings.steps(update.sky);
        self.light.each(&self.sums, update.history, |light, from, to| {
            let lit = further(ground).map(|lists| lists.item_lights.bytes()).sum();
            r.zone(["light 1", "light 2"][light.bounce], ZoneKind::Compute, lit, |r| {
                r.full_barrier(); // the lists, and the sum of the look-up, were written
                for (cascade, lists) in further(ground).enumerate() {
                    let mut binds = ground.binds();
                    binds.extend(from.into_iter().flat_map(|sum| self.look_up(sum)));
                    binds.extend([
                        Bind::buffer("direct_light", &lists.direct_light),
                        Bind::buffer("item_lights", &lists.item_lights),
                        Bind::buffer("grid_items", &lists.items),
                        Bind::buffer("cell_counts", &lists.cells.counts),
                    ]);
                    let offset = u64::from(LIT_COUNTS) * size_of::<ListCount>() as u64;
                    let push = push_of(lists, cascade);
                    let binds = light.pipeline.select(&binds);
                    r.dispatch_indirect(&light.pipeline, &binds, &push, lists.cells.counts.at(offset));
                }
            });
            let sum = sum_of(&self.settings, "");
            // The coarsest grid comes first, because its sum enters the finer ones.
            r.zone(["propagate 1", "propagate 2"][light.bounce], ZoneKind::Compute, sum.bytes(), |r| {
                for (cascade, lists) in further(ground).enumerate().collect::<Vec<_>>().into_iter().rev() {
                    self.travel(r, ground, &Cascade { index: cascade, lists, steps }, to);
                }
            });
        });
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        self.sums.last().map_or_else(Vec::new, |sum| self.look_up(sum))
    }

    fn images(&self) -> Vec<&Image> {
        self.sums.iter().flat_map(|sum| &sum.parts).collect()
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.sums.last().map(|sum| CoarseLight::Full(&sum.parts[0]))
    }
}

/// A grid whose light is propagated.
#[derive(Clone, Copy)]
struct Cascade<'a> {
    /// Its index, the finest first.
    index: usize,
    lists: &'a Lists,
    /// The number of propagation steps.
    steps: u32,
}

impl Lighting {
    /// Injects the light of a grid's items, propagates it, and adds every step to `sum`.
    fn travel(&self, r: &mut Recorder, ground: &Ground, cascade: &Cascade, sum: &Field) {
        let Cascade { index, lists, steps } = *cascade;
        let groups = |group: [u32; 3]| group.map(|threads| self.settings.edge / threads);
        r.full_barrier(); // the items are lit
        let mut binds = vec![
            Bind::buffer("triangles", &ground.triangles),
            Bind::buffer("materials", &ground.scene.materials),
            Bind::buffer("item_lights", &lists.item_lights),
            Bind::buffer("grid_items", &lists.items),
            Bind::buffer("grid_heads", &lists.heads),
            Bind::buffer("blockers", &self.blockers),
        ];
        binds.extend([self.travelling[0].stored("new_light"), Bind::buffer("frame", &ground.frame)]);
        let push = push_of(lists, index);
        r.dispatch(&self.inject, &self.inject.select(&binds), &push, groups(GROUP));
        if self.settings.occlusion == Occlusion::Sheets {
            r.full_barrier(); // the blockers are known
            let binds = [Bind::buffer("blockers", &self.blockers), Bind::buffer("passages", &self.passages_into)];
            r.dispatch(&self.passages, &binds, &push, groups(GROUP));
        }
        let step_group = if self.settings.lobe == Lobe::Beam { BEAMS_GROUP } else { GROUP };
        for step in 0..steps {
            r.full_barrier(); // the previous step wrote
            let (old, new) = (&self.travelling[step as usize % 2], &self.travelling[(step as usize + 1) % 2]);
            let mut binds = vec![
                Bind::buffer("blockers", &self.blockers),
                Bind::buffer("passages", &self.passages_into),
                Bind::buffer("cascades", &self.places),
            ];
            binds.extend([old.read("old_light", old.parts.len()), new.stored("new_light"), sum.stored("sums")]);
            binds.push(Bind::buffer("frame", &ground.frame));
            let pipeline = if step == 0 { &self.first_step } else { &self.propagate };
            r.dispatch(pipeline, &pipeline.select(&binds), &push, groups(step_group));
            r.end_step();
        }
    }

    /// Bindings of a sum for look-ups.
    fn look_up<'a>(&'a self, sum: &'a Field) -> Vec<Bind<'a>> {
        vec![
            Bind::buffer("blockers", &self.blockers),
            Bind::buffer("cascades", &self.places),
            sum.read("sums", SUM_PARTS),
        ]
    }
}

fn nested(own: &Settings, base_edge: u32) -> Cascades {
    Cascades { edge: own.edge, count: own.cascades, base_edge }
}

fn push_of(lists: &Lists, cascade: usize) -> LpvPush {
    let [x, y, z, scale] = lists.place.from_base();
    LpvPush { offset: [x, y, z], scale, cascade: cascade as u32 }
}

/// The travelling light of one grid.
fn travelling(own: &Settings) -> FieldDesc<'static> {
    let parts = if own.lobe == Lobe::Beam { 2 } else { 4 };
    FieldDesc { label: "travelling light", parts, edge: own.edge, grids: 1 }
}

/// The sum over propagation steps, of all grids.
fn sum_of<'a>(own: &Settings, label: &'a str) -> FieldDesc<'a> {
    let parts = if own.lobe == Lobe::Beam { SUM_PARTS } else { 4 };
    FieldDesc { label, parts, edge: own.edge, grids: own.cascades }
}

/// All constants that the method declares.
pub fn constants(own: &Settings) -> Vec<Constant> {
    vec![
        ("LPV_EDGE", own.edge.into()),
        ("CASCADES", own.cascades.into()),
        ("LOBE", own.lobe.into()),
        ("OCCLUSION", own.occlusion.into()),
        ("SUM", own.sum.into()),
        ("INJECTION", own.injection.into()),
        ("APPLY", own.apply.into()),
        ("SHARPNESS", own.sharpness.into()),
        ("FIRST_STEP", false.into()),
    ]
}
