//! Exact rays that find what list items send, shared among neighbours.
//!
//! Every list item is lit, one for all that are alike. A ray that hits a triangle reads the light of the item that stands for
//! it where it was hit, front or back: no volume stands between, so nothing mixes through a wall. For a second bounce items
//! gather along rays themselves. With all bounces each pass gathers what the one before left; once that has settled, rays go
//! other ways in every pass, items are lit at other points, and the mean of the passes is the light.

mod settings;

use super::bounces::{BounceDesc, PerBounce};
use super::{CoarseLight, Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cells::LIT_COUNTS;
use crate::ground::constants::{DIRECT, LAMP_POINTS, LIT, constants, with};
use crate::ground::layout::CellCount;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Recorder, ZoneKind};

pub use settings::{KEYS, Settings};

/// Constants of `glsl/gi/rays/constants.glsl`.
const DIFFUSE_RAYS: u32 = 32;
const LOBE_RAYS: u32 = 33;

/// Sums that tell whether feedback has settled: of 4³ blocks of the grid, 64 bits each (`glsl/gi/rays/sums.comp`).
const SUMS_BYTES: u64 = 4 * 4 * 4 * 8;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems)];

pub struct Lighting {
    bounces: Bounces,
    light: PerBounce<Light>,
    feedback: Option<Feedback>,
    constants: [(u32, u32); 2],
}

/// The pass that lights the items.
struct Light {
    pipeline: Compute,
    label: &'static str,
}

/// What only `bounces = all` needs.
struct Feedback {
    carry: Compute,
    mean: Compute,
    sum: Compute,
    sums: Buffer,
}

impl Gi for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let all = settings.bounces == Bounces::All;
        Wants {
            lists: true,
            rays: true,
            cells: true,
            lit_items: true,
            alike: true,
            kept_direct_light: settings.bounces.volumes() > 1,
            seen_lights: settings.bounces.volumes() > 1,
            carried_light: all,
            mean_passes: all.then_some(settings.of.rays.passes),
            diffuse: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        if settings.bounces == Bounces::All { vec![("light sums", SUMS_BYTES)] } else { vec![] }
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.rays;
        let items = [(DIFFUSE_RAYS, own.bounce), (LAMP_POINTS, settings.lights.voxel_lamp_points), (LIT, 1)];
        let items = with(constants(settings, features), &items);
        let compute = |label, shader, constants: &[_]| Compute::new(context, &ComputeDesc { label, shader, constants });
        let light = |BounceDesc { bounce, gathers, direct }| {
            let label = ["shade 1", "shade 2"][bounce];
            let shader = if gathers { "gi/rays/light.comp LOOK_UP" } else { "gi/rays/light.comp" };
            Ok(Light { pipeline: compute(label, shader, &with(items.clone(), &[(DIRECT, direct)]))?, label })
        };
        let feedback = || {
            Ok(Feedback {
                carry: compute("carry", "gi/rays/carry.comp", &items)?,
                mean: compute("mean", "gi/rays/mean.comp", &items)?,
                sum: compute("sums", "gi/rays/sums.comp", &items)?,
                sums: Buffer::new(context, "light sums", SUMS_BYTES, BufferKind::Device)?,
            })
        };
        Ok(Self {
            bounces: settings.bounces,
            light: PerBounce::new(settings.bounces, settings.bounces.volumes() > 1, light)?,
            feedback: (settings.bounces == Bounces::All).then(feedback).transpose()?,
            constants: [(DIFFUSE_RAYS, own.diffuse), (LOBE_RAYS, own.glossy)],
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        if let Some(feedback) = &self.feedback {
            return self.feed_back(r, ground, update, feedback);
        }
        // Items are lit directly; then once more, with what they gather of that.
        let lists = ground.base();
        let lights = [&lists.item_lights, &lists.seen_lights];
        let bounces = self.bounces.volumes() as usize;
        self.light.each(&lights[..bounces], false, |light, from, to| light.record(r, ground, from.copied(), to));
    }

    fn constants(&self) -> &[(u32, u32)] {
        &self.constants
    }

    fn binds<'a>(&'a self, ground: &'a Ground) -> Vec<Bind<'a>> {
        let lists = ground.base();
        let lights = if self.bounces.volumes() > 1 { &lists.seen_lights } else { &lists.item_lights };
        vec![Bind::buffer("item_parts", &lists.item_parts), Bind::buffer("seen_lights", lights)]
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.feedback.as_ref().map(|feedback| CoarseLight::Sums(&feedback.sums))
    }
}

impl Lighting {
    /// A pass of feedback: another bounce of everything.
    fn feed_back(&self, r: &mut Recorder, ground: &Ground, update: &Update, feedback: &Feedback) {
        let lists = ground.base();
        let (fresh, seen) = (&lists.item_lights, &lists.seen_lights);
        match (&self.light.again, &self.light.second) {
            (Some(again), Some(second)) if update.history => {
                if update.lists {
                    feedback.carry(r, ground);
                }
                again.record(r, ground, Some(seen), fresh);
                feedback.mean(r, ground, update.share);
                if update.lists {
                    // What stands in a voxel where it did not stand before has been dark until now.
                    second.record(r, ground, Some(seen), fresh);
                    feedback.mean(r, ground, update.share);
                }
            }
            _ => {
                self.light.first.record(r, ground, None, fresh);
                feedback.mean(r, ground, 1.0);
            }
        }
        if update.measured {
            feedback.sum(r, ground);
        }
    }
}

impl Light {
    /// Lights the items of the lists. Reads: lists, triangles, materials, lights, lamps, kept direct light, `from`: what the
    /// items sent before. Writes: `to`, kept direct light.
    fn record(&self, r: &mut Recorder, ground: &Ground, from: Option<&Buffer>, to: &Buffer) {
        let lists = ground.base();
        r.zone(self.label, ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the lists and what is gathered from were written
            let mut binds = ground.binds();
            binds.extend([
                Bind::buffer("direct_light", &lists.direct_light),
                Bind::buffer("item_parts", &lists.item_parts),
                Bind::buffer("lit_items", &lists.lit_items),
                Bind::buffer("item_lights", to),
            ]);
            binds.extend(from.map(|lights| Bind::buffer("seen_lights", lights)));
            lists.cells.dispatch_items(r, &self.pipeline, binds);
        });
    }
}

impl Feedback {
    /// New lists take over the light of those before them.
    fn carry(&self, r: &mut Recorder, ground: &Ground) {
        let last = &ground.base().last;
        let binds = [
            Bind::buffer("triangles", &ground.triangles),
            Bind::buffer("list_items", &ground.base().items),
            Bind::buffer("last_heads", &last.heads),
            Bind::buffer("last_items", &last.items),
            Bind::buffer("last_parts", &last.item_parts),
            Bind::buffer("last_lights", &last.seen_lights),
        ];
        r.zone("carry", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the items that are lit were chosen
            over_lit_items(r, ground, &self.carry, &binds, &());
        });
    }

    /// The newest light becomes a `share` of the mean.
    fn mean(&self, r: &mut Recorder, ground: &Ground, share: f32) {
        let binds = [Bind::buffer("item_lights", &ground.base().item_lights)];
        r.zone("mean", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the items are lit
            over_lit_items(r, ground, &self.mean, &binds, &share);
        });
    }

    fn sum(&self, r: &mut Recorder, ground: &Ground) {
        let binds = [Bind::buffer("list_items", &ground.base().items), Bind::buffer("light_sums", &self.sums)];
        r.zone("sums", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the light was written, the sums before may have been read
            r.fill(&self.sums, 0, SUMS_BYTES, 0);
            r.full_barrier(); // they are 0
            over_lit_items(r, ground, &self.sum, &binds, &());
        });
    }
}

/// A thread per lit item. `binds`: besides the lists of items and their light.
fn over_lit_items<'a, P: bytemuck::Pod>(
    r: &mut Recorder,
    ground: &'a Ground,
    pipeline: &Compute,
    binds: &[Bind<'a>],
    push: &P,
) {
    let lists = ground.base();
    let mut binds = binds.to_vec();
    binds.extend([
        Bind::buffer("lit_items", &lists.lit_items),
        Bind::buffer("seen_lights", &lists.seen_lights),
        Bind::buffer("cell_counts", &lists.cells.counts),
    ]);
    let offset = u64::from(LIT_COUNTS) * size_of::<CellCount>() as u64;
    r.dispatch_indirect(pipeline, &pipeline.select(&binds), push, (&lists.cells.counts, offset));
}
