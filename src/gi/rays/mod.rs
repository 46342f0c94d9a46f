//! Exact rays that read the cached light of list items.
//!
//! Every list item is lit, or one item for each group of a voxel's similar triangles. A ray that hits a triangle reads
//! the light of the item at the hit point, for the side that it hits: there is no volume between, so no light mixes
//! through a wall. For a second bounce, items gather along rays too. With all bounces, each pass gathers the light of
//! the previous one. Once that has settled, every pass uses other rays and other points on items, and the mean of the
//! passes is the light.

pub mod inspect;

use super::bounces::{BounceDesc, PerBounce};
use super::light_sums::{self, LightSums};
use super::{CoarseLight, IndirectMethod, Maker, OnDemand, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cells::{LIT_COUNTS, SECOND_COUNTS};
use crate::ground::constants::{DIRECT_READ, LIT_GROUPED, constants, with};
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Buffer, Compute, ComputeDesc, Constant, Recorder, ZoneKind};

pub use crate::settings::methods::rays::Settings;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems)];

pub struct Lighting {
    light: PerBounce<Light>,
    /// The pass that requests the light that the second bounce reads, for light on demand.
    asks: Option<Light>,
    feedback: Option<Feedback>,
    constants: [Constant; 4],
}

/// A pass that lights items, or requests the light that they gather.
struct Light {
    pipeline: Compute,
    label: &'static str,
    bounce: usize,
}

/// Resources that only `bounces = all` needs.
struct Feedback {
    carry: Compute,
    sums: LightSums,
}

impl IndirectMethod for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let all = settings.bounces == Bounces::All;
        Wants {
            lists: true,
            rays: true,
            cells: true,
            nested: true,
            lit_items: true,
            indexed: true,
            grouped: true,
            split: true,
            demand: !all,
            lobe_words: 2,
            kept_direct_light: settings.bounces.stored() > 1,
            seen_lights: settings.bounces.stored() > 1,
            carried_light: all,
            mean_passes: all.then_some(settings.of.rays.passes),
            diffuse: true,
            gathers_lobes: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        if settings.bounces == Bounces::All { vec![light_sums::ROW] } else { vec![] }
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, counts } = *maker;
        let own = &settings.of.rays;
        let look_up = look_up_constants(settings, counts.lists[0].boxes);
        let of_items = [
            ("DIFFUSE_RAYS", own.bounce.into()),
            ("LAMP_POINTS", settings.lights.voxel_lamp_points.into()),
            ("LIT", LIT_GROUPED.into()),
        ];
        let items = with(with(constants(settings, features), &look_up), &of_items);
        let compute = |label, shader, constants: &[_]| Compute::new(context, &ComputeDesc { label, shader, constants });
        let all = settings.bounces == Bounces::All;
        let second = with(items.clone(), &[("LISTED", if all { LIT_COUNTS } else { SECOND_COUNTS }.into())]);
        let light = |BounceDesc { bounce, gathers, direct }| {
            let label = ["shade 1", "shade 2"][bounce];
            let shader = if gathers { "gi/rays/light.comp LOOK_UP" } else { "gi/rays/light.comp" };
            let items = if bounce == 1 { &second } else { &items };
            let constants = with(items.clone(), &[("DIRECT", direct.into())]);
            Ok(Light { pipeline: compute(label, shader, &constants)?, label, bounce })
        };
        let asks = || {
            let constants = with(second.clone(), &[("DIRECT", DIRECT_READ.into())]);
            let label = "ask 2";
            Ok(Light { pipeline: compute(label, "gi/rays/light.comp LOOK_UP ASKS", &constants)?, label, bounce: 1 })
        };
        let feedback = || {
            Ok(Feedback {
                carry: compute("carry", "gi/rays/carry.comp", &items)?,
                sums: LightSums::new(context, "gi/rays/sums.comp", &items)?,
            })
        };
        Ok(Self {
            light: PerBounce::new(settings.bounces, settings.bounces.stored() > 1, light)?,
            asks: (settings.bounces == Bounces::Two).then(asks).transpose()?,
            feedback: all.then(feedback).transpose()?,
            constants: look_up,
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        let Some(feedback) = &self.feedback else {
            let asked = &ground.base().asked_items;
            r.full_barrier(); // the previous frame requested light
            r.fill(asked, 0, asked.bytes(), 0);
            return;
        };
        match &self.light.again {
            Some(again) if update.history => {
                // Everything is lit directly and by the light of the previous frame.
                if update.lists {
                    feedback.carry(r, ground);
                }
                self.light(r, ground, again);
            }
            // Everything is lit directly.
            _ => self.light(r, ground, &self.light.first),
        }
        // It is lit once more if the lists are new, because items without a predecessor are still dark.
        if let Some(second) = self.light.second.as_ref().filter(|_| update.lists) {
            self.light(r, ground, second);
        }
        if update.measured {
            feedback.sum(r, ground);
        }
    }

    fn on_demand(&self) -> Option<&dyn OnDemand> {
        self.feedback.is_none().then_some(self)
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, ground: &'a Ground) -> Vec<Bind<'a>> {
        let lists = ground.base();
        let mut binds = vec![
            Bind::buffer("item_parts", &lists.item_parts),
            Bind::buffer("cell_counts", &lists.cells.counts),
            Bind::buffer("seen_lights", &lists.item_lights),
            Bind::buffer("direct_light", &lists.direct_light),
            Bind::buffer("seen_lobes", &lists.item_lobes),
        ];
        binds.extend(lists.ask_binds());
        binds
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.feedback.as_ref().map(|feedback| feedback.sums.coarse())
    }
}

impl Lighting {
    /// The light and the lobes of the previous bounce, which items gather. With feedback these buffers are
    /// double-buffered; otherwise no pass both reads and writes lobes.
    fn gathered<'a>(&self, ground: &'a Ground) -> [Bind<'a>; 2] {
        let lists = ground.base();
        let lobes = if self.feedback.is_some() { &lists.seen_lobes } else { &lists.item_lobes };
        [Bind::buffer("seen_lights", &lists.seen_lights), Bind::buffer("seen_lobes", lobes)]
    }

    /// Splits and lights the listed items, bounce by bounce.
    fn light_listed(&self, r: &mut Recorder, ground: &Ground) {
        ground.split(r, LIT_COUNTS);
        self.light(r, ground, &self.light.first);
        if let Some(second) = &self.light.second {
            self.light(r, ground, second);
        }
    }

    /// Runs a thread per item of the pass `light`. `written` receives the light of items.
    fn over_items(&self, r: &mut Recorder, ground: &Ground, light: &Light, written: &Buffer) {
        let lists = ground.base();
        let all = light.bounce == 0 || self.feedback.is_some();
        let (listed, entry) = if all { (&lists.lit_items, LIT_COUNTS) } else { (&lists.second_items, SECOND_COUNTS) };
        let mut binds = ground.item_binds(listed, written);
        binds.extend(self.gathered(ground));
        binds.extend(lists.ask_binds());
        lists.cells.light_items(r, &light.pipeline, binds, entry);
    }

    /// Lights the items of the lists. Reads: lists, triangles, materials, lights, lamps, kept direct light, the light
    /// of the previous bounce. Writes: item lights, kept direct light.
    fn light(&self, r: &mut Recorder, ground: &Ground, pass: &Light) {
        let lists = ground.base();
        r.zone(pass.label, ZoneKind::Compute, lists.item_lights.bytes(), |r| {
            r.full_barrier(); // the lists and the gathered light were written
            // With feedback, the second pass reads a copy of the light that the first one wrote.
            let is_read_next = self.feedback.is_none() && self.light.second.is_some() && pass.bounce == 0;
            let written = if is_read_next { &lists.seen_lights } else { &lists.item_lights };
            self.over_items(r, ground, pass, written);
            if let Some(feedback) = &self.feedback {
                feedback.hand_over(r, ground);
            }
        });
    }
}

impl OnDemand for Lighting {
    fn begin(&self, r: &mut Recorder, ground: &Ground) {
        r.full_barrier(); // the items that were requested before are lit
        ground.base().cells.empty_items(r);
    }

    fn light_asked(&self, r: &mut Recorder, ground: &Ground) {
        if let Some(asks) = &self.asks {
            ground.split(r, SECOND_COUNTS);
            r.zone(asks.label, ZoneKind::Compute, ground.base().asked_bytes(), |r| {
                r.full_barrier(); // twins were listed
                self.over_items(r, ground, asks, &ground.base().item_lights);
            });
        }
        self.light_listed(r, ground);
    }

    fn light_all(&self, r: &mut Recorder, ground: &Ground) {
        self.begin(r, ground);
        ground.ask_all(r);
        if self.light.second.is_some() {
            ground.split(r, SECOND_COUNTS);
        }
        self.light_listed(r, ground);
    }
}

impl Feedback {
    /// Makes the light of this pass the input of the next one.
    fn hand_over(&self, r: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        r.full_barrier(); // the items are lit
        r.copy(&lists.item_lights, &lists.seen_lights);
        r.copy(&lists.item_lobes, &lists.seen_lobes);
    }

    /// Carries light from the previous lists to the new ones.
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
        r.zone("carry", ZoneKind::Compute, lists.seen_lights.bytes(), |r| {
            r.full_barrier(); // the lit items were chosen
            over_lit_items(r, ground, &self.carry, binds);
        });
    }

    fn sum(&self, r: &mut Recorder, ground: &Ground) {
        self.sums.record(r, |r, pass, sums| {
            over_lit_items(r, ground, pass, vec![Bind::buffer("list_items", &ground.base().items), sums]);
        });
    }
}

/// All constants that the method declares, and the ground's `BOXES`.
pub fn look_up_constants(settings: &AllSettings, boxes: u32) -> [Constant; 4] {
    let own = &settings.of.rays;
    [
        ("DIFFUSE_RAYS", own.diffuse.into()),
        ("LOBE_RAYS", own.glossy.into()),
        ("BOUNCES", settings.bounces.limit().into()),
        ("BOXES", boxes.into()),
    ]
}

/// Runs a thread per lit item. `binds` are in addition to the lists of items and their light.
fn over_lit_items<'a>(r: &mut Recorder, ground: &'a Ground, pipeline: &Compute, mut binds: Vec<Bind<'a>>) {
    let lists = ground.base();
    binds.push(Bind::buffer("lit_items", &lists.lit_items));
    binds.push(Bind::buffer("seen_lights", &lists.seen_lights));
    lists.cells.dispatch(r, pipeline, binds, LIT_COUNTS);
}
