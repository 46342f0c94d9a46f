//! Exact rays that find what list items send, shared among neighbours.
//!
//! Every list item is lit, one for all that are alike. A ray that hits a triangle reads the light of the item that stands for
//! it where it was hit, front or back: no volume stands between, so nothing mixes through a wall. For a second bounce items
//! gather along rays themselves. With all bounces each pass gathers what the one before left; once that has settled, rays go
//! other ways in every pass, items are lit at other points, and the mean of the passes is the light.

pub mod inspect;

use super::bounces::{BounceDesc, PerBounce};
use super::{CoarseLight, Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cells::LIT_COUNTS;
use crate::ground::constants::{LIT_ALIKE, constants, with};
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Recorder, ZoneKind};

pub use crate::settings::methods::rays::Settings;

/// Value of the constant `BOUNCES` for all: more than a ray meets.
const ALL_BOUNCES: u32 = 64;

/// Sums that tell whether feedback has settled: of 4³ blocks of the grid, 64 bits each (`glsl/gi/rays/sums.comp`).
const SUMS_BYTES: u64 = 4 * 4 * 4 * 8;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems)];

pub struct Lighting {
    light: PerBounce<Light>,
    share: Compute,
    feedback: Option<Feedback>,
    constants: [Constant; 4],
}

/// The pass that lights the items.
struct Light {
    pipeline: Compute,
    label: &'static str,
}

/// What only `bounces = all` needs.
struct Feedback {
    carry: Compute,
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
            nested: true,
            lit_items: true,
            alike: true,
            split: true,
            lobe_words: 2,
            kept_direct_light: settings.bounces.volumes() > 1,
            seen_lights: true,
            carried_light: all,
            mean_passes: all.then_some(settings.of.rays.passes),
            diffuse: true,
            gathers_lobes: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        if settings.bounces == Bounces::All { vec![("light sums", SUMS_BYTES)] } else { vec![] }
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, counts } = *maker;
        let own = &settings.of.rays;
        let look_up = look_up_constants(settings, counts.lists[0].boxes);
        let of_items = [
            ("DIFFUSE_RAYS", own.bounce.into()),
            ("LAMP_POINTS", settings.lights.voxel_lamp_points.into()),
            ("LIT", LIT_ALIKE.into()),
        ];
        let items = with(with(constants(settings, features), &look_up), &of_items);
        let compute = |label, shader, constants: &[_]| Compute::new(context, &ComputeDesc { label, shader, constants });
        let light = |BounceDesc { bounce, gathers, direct }| {
            let label = ["shade 1", "shade 2"][bounce];
            let shader = if gathers { "gi/rays/light.comp LOOK_UP" } else { "gi/rays/light.comp" };
            Ok(Light { pipeline: compute(label, shader, &with(items.clone(), &[("DIRECT", direct.into())]))?, label })
        };
        let all = settings.bounces == Bounces::All;
        let share = if all { "gi/rays/share_items.comp FEEDBACK" } else { "gi/rays/share_items.comp" };
        let feedback = || {
            Ok(Feedback {
                carry: compute("carry", "gi/rays/carry.comp", &items)?,
                sum: compute("sums", "gi/rays/sums.comp", &items)?,
                sums: Buffer::new(context, "light sums", SUMS_BYTES, BufferKind::Device)?,
            })
        };
        Ok(Self {
            share: compute("share items", share, &items)?,
            light: PerBounce::new(settings.bounces, settings.bounces.volumes() > 1, light)?,
            feedback: all.then(feedback).transpose()?,
            constants: look_up,
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        match (&self.feedback, &self.light.again) {
            (Some(feedback), Some(again)) if update.history => {
                // Everything is lit directly and by what it saw before;
                if update.lists {
                    feedback.carry(r, ground);
                }
                self.light(r, ground, again, update.averages);
            }
            // or directly alone.
            _ => self.light(r, ground, &self.light.first, false),
        }
        // Then once more; with feedback only where lists are new: what was not in its voxel before has been dark until now.
        if let Some(second) = self.light.second.as_ref().filter(|_| self.feedback.is_none() || update.lists) {
            self.light(r, ground, second, false);
        }
        if let Some(feedback) = self.feedback.as_ref().filter(|_| update.measured) {
            feedback.sum(r, ground);
        }
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, ground: &'a Ground) -> Vec<Bind<'a>> {
        let lists = ground.base();
        vec![
            Bind::buffer("item_parts", &lists.item_parts),
            Bind::buffer("seen_lights", &lists.seen_lights),
            Bind::buffer("direct_light", &lists.direct_light),
            self.seen_lobes(ground),
        ]
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.feedback.as_ref().map(|feedback| CoarseLight::Sums(&feedback.sums))
    }
}

impl Lighting {
    /// The lobes that rays see. With feedback a pass reads those of the one before while it writes its own; without, no pass does both.
    fn seen_lobes<'a>(&self, ground: &'a Ground) -> Bind<'a> {
        let lists = ground.base();
        Bind::buffer("seen_lobes", if self.feedback.is_some() { &lists.seen_lobes } else { &lists.item_lobes })
    }

    /// Lights the items of the lists, and lets neighbours share. `averages`: items gather what others send themselves, as the pass
    /// before left it where lists keep the light of those before them, which nothing asks for while they stay. Reads: lists,
    /// triangles, materials, lights, lamps, kept direct light, seen lights. Writes: item lights, kept direct light, seen lights.
    fn light(&self, r: &mut Recorder, ground: &Ground, pass: &Light, averages: bool) {
        let lists = ground.base();
        let gathered = if averages { &lists.last_seen_lights } else { &lists.seen_lights };
        r.zone(pass.label, ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the lists and what is gathered from were written
            let mut binds = ground.item_binds();
            binds.push(Bind::buffer("seen_lights", gathered));
            binds.push(self.seen_lobes(ground));
            lists.cells.light_items(r, &pass.pipeline, binds);
        });
        r.zone("share items", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the items are lit
            let mut binds = vec![
                Bind::buffer("frame", &ground.frame),
                Bind::buffer("triangles", &ground.triangles),
                Bind::buffer("list_items", &lists.items),
                Bind::buffer("heads", &lists.heads),
                Bind::buffer("item_lights", &lists.item_lights),
                Bind::buffer("item_parts", &lists.item_parts),
            ];
            if self.feedback.is_some() {
                binds.push(Bind::buffer("own_lights", &lists.last_seen_lights));
                binds.push(Bind::buffer("item_lobes", &lists.item_lobes));
                binds.push(self.seen_lobes(ground));
            }
            over_lit_items(r, ground, &self.share, binds);
        });
    }
}

impl Feedback {
    /// New lists take over the light of those before them.
    fn carry(&self, r: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        let binds = vec![
            Bind::buffer("frame", &ground.frame),
            Bind::buffer("triangles", &ground.triangles),
            Bind::buffer("list_items", &lists.items),
            Bind::buffer("item_parts", &lists.item_parts),
            Bind::buffer("last_heads", &lists.last_heads),
            Bind::buffer("last_items", &lists.last_items),
            Bind::buffer("last_parts", &lists.last_item_parts),
            Bind::buffer("last_lights", &lists.last_seen_lights),
            Bind::buffer("seen_lobes", &lists.seen_lobes),
        ];
        r.zone("carry", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the items that are lit were chosen
            over_lit_items(r, ground, &self.carry, binds);
        });
    }

    fn sum(&self, r: &mut Recorder, ground: &Ground) {
        let binds = vec![Bind::buffer("list_items", &ground.base().items), Bind::buffer("light_sums", &self.sums)];
        r.zone("sums", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the light was written, the sums before may have been read
            r.fill(&self.sums, 0, SUMS_BYTES, 0);
            r.full_barrier(); // they are 0
            over_lit_items(r, ground, &self.sum, binds);
        });
    }
}

/// All constants that the method declares, and the ground's `BOXES`.
pub fn look_up_constants(settings: &AllSettings, boxes: u32) -> [Constant; 4] {
    let own = &settings.of.rays;
    let bounces = if settings.bounces == Bounces::All { ALL_BOUNCES } else { settings.bounces.volumes() };
    [
        ("DIFFUSE_RAYS", own.diffuse.into()),
        ("LOBE_RAYS", own.glossy.into()),
        ("BOUNCES", bounces.into()),
        ("BOXES", boxes.into()),
    ]
}

/// A thread per lit item. `binds`: besides the lists of items and their light.
fn over_lit_items<'a>(r: &mut Recorder, ground: &'a Ground, pipeline: &Compute, mut binds: Vec<Bind<'a>>) {
    let lists = ground.base();
    binds.push(Bind::buffer("lit_items", &lists.lit_items));
    binds.push(Bind::buffer("seen_lights", &lists.seen_lights));
    lists.cells.dispatch(r, pipeline, binds, LIT_COUNTS);
}
