//! The base of all methods: the scene on the device, recorded triangles, their lists, exact rays, lamps, direct light,
//! and the image. Its shaders are in `glsl/ground/`.

pub mod atlas;
pub mod attributes;
pub mod boxes;
pub mod cell_passes;
pub mod cells;
pub mod constants;
mod counts;
pub mod deform;
pub mod expected_items;
pub mod finish;
pub mod grid;
pub mod grid_choice;
pub mod image;
pub mod item_groups;
pub mod lamps;
pub mod layout;
pub mod lists;
pub mod memory_plan;
pub mod record;
mod reset;
pub mod scene_on_gpu;
pub mod tree;
pub mod uniforms;
pub mod volume;
pub mod voxelise;
pub mod wants;

use std::sync::Arc;

use glam::Vec3;

use crate::scene::sky::SkyMap;
use crate::scene::{Pose, Scene};
use crate::settings::Conservative;
use crate::vk::{self, Bind, Buffer, BufferKind, Context, Format, Recorder};
use crate::{Error, Result};
use cells::Cells;
use constants::{Features, LIT_EACH, LIT_GROUPED};
pub use counts::Counts;
use grid::{Grid, GridPlace};
use item_groups::ItemGroups;
use lists::{Lists, array, grow};
use memory_plan::{MemoryRow, bytes_of};
use record::Record;
use scene_on_gpu::SceneOnGpu;
use tree::Tree;
use tree::queries::QueryPlan;
use voxelise::Voxelise;
use wants::Wants;

/// The maximum number of workgroups along an axis that every device supports.
const MOST_GROUPS: u32 = 65535;

/// The description from which a [`Ground`] is made.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundDesc {
    pub grid: Grid,
    /// Requests of the method and of direct light.
    pub wants: Wants,
    pub features: Features,
    pub counts: Counts,
    /// The sky's map, which is uploaded once.
    pub sky_map: Option<Arc<SkyMap>>,
}

impl GroundDesc {
    /// Whether a ground made for `self` can be used for `needed` as well.
    pub fn serves(&self, needed: &Self) -> bool {
        let (had, asked) = (&self.counts, &needed.counts);
        let fits = asked.lights <= had.lights && asked.lamps <= had.lamps && asked.blended == had.blended;
        fits && *needed == Self { counts: asked.clone(), ..self.clone() }
    }
}

/// Buffers and passes that all methods use.
pub struct Ground {
    pub desc: GroundDesc,
    /// The scene as bindings for shading.
    pub scene: Arc<SceneOnGpu>,
    pub frame: Buffer,
    pub lights: Buffer,
    pub lamps: Buffer,
    pub lamp_nodes: Buffer,
    /// The recorded triangles, with positions in voxels of the base grid.
    pub triangles: Buffer,
    /// Attributes of the triangles at their corners, except positions.
    pub attributes: Buffer,
    /// The bounding volume hierarchy, for rays.
    pub tree: Tree,
    /// For each source, 1 + the index of its recorded triangle, for rays and for blended triangles.
    pub slots: Buffer,
    /// Sources of the blended triangles.
    blended: Buffer,
    /// The lists of every grid, the base grid first.
    pub lists: Vec<Lists>,
    record: Record,
    makers: Vec<ListMakers>,
    groups: Option<ItemGroups>,
}

/// The passes that make one grid's lists; `None` if they were not requested.
struct ListMakers {
    voxelise: Option<Voxelise>,
    cells: Option<Cells>,
}

impl Ground {
    /// # Errors
    /// The device lacks a requested feature, there is too little memory, or the device is lost.
    pub fn new(context: &Arc<Context>, of: &Scene, scene: Arc<SceneOnGpu>, desc: GroundDesc) -> Result<Self> {
        let GroundDesc { grid, wants, features, counts, .. } = &desc;
        check_geometry_shader(context, wants.conservative)?;
        let constants_of = |edge: u32, grouped| {
            [
                ("FEATURES", features.0.into()),
                ("EDGE", edge.into()),
                ("LIT", if grouped { LIT_GROUPED } else { LIT_EACH }.into()),
                ("BOXES", grid.boxes.into()),
            ]
        };
        let base = constants_of(grid.edge, wants.grouped);
        let plan = shared_plan(wants, counts);
        let buffer = |name: &str| Buffer::new(context, name, bytes_of(&plan, name), BufferKind::Device);
        let places = || std::iter::once(GridPlace::base(grid.edge)).chain(wants.grids.iter().copied());
        let mut lists = Vec::new();
        let mut makers = Vec::new();
        for (index, (place, capacity)) in places().zip(&counts.lists).enumerate() {
            let wants = wants_of_grid(wants, index);
            let constants = constants_of(place.edge, wants.grouped);
            lists.push(Lists::new(context, place, &wants, *capacity)?);
            let voxelise = || match wants.sampled {
                Some(samples) => Voxelise::by_samples(context, &constants, samples),
                None => Voxelise::new(context, &constants, &wants),
            };
            makers.push(ListMakers {
                voxelise: wants.lists.then(voxelise).transpose()?,
                cells: wants.cells.then(|| Cells::new(context, &constants)).transpose()?,
            });
        }
        let frame = buffer("frame")?;
        if let Some(map) = &desc.sky_map {
            vk::upload_at(context, &frame, size_of::<layout::Frame>() as u64, &map.words)?;
        }
        let blended = buffer("blended triangles")?;
        vk::upload_at(context, &blended, 0, &scene.blended)?;
        Ok(Self {
            frame,
            lights: buffer("lights")?,
            lamps: buffer("lamps")?,
            lamp_nodes: buffer("lamp nodes")?,
            triangles: buffer("triangles")?,
            attributes: buffer("triangles' attributes")?,
            tree: if features.has(Features::QUERY) {
                Tree::queried(context, &base, of, &scene)?
            } else {
                Tree::new(context, &base, wants.rays.then(|| scene.trees.of_scene(of)))?
            },
            slots: buffer("slots")?,
            blended,
            record: Record::new(context, &base, wants.conservative, &scene)?,
            groups: wants.grouped.then(|| ItemGroups::new(context, &base, wants)).transpose()?,
            desc,
            scene,
            lists,
            makers,
        })
    }

    /// The lists of the base grid.
    pub fn base(&self) -> &Lists {
        &self.lists[0]
    }

    /// Moves the further grids, and the boxes of the base grid around a point in its voxels. Returns whether any moved,
    /// so that its lists must be rebuilt.
    pub fn place_grids(&mut self, places: &[GridPlace], about: Vec3) -> bool {
        let corners = boxes::corners(self.desc.grid.edge, self.desc.grid.boxes, about);
        let mut moved = self.lists[0].boxes != corners;
        self.lists[0].boxes = corners;
        for (lists, place) in self.lists[1..].iter_mut().zip(places) {
            moved |= lists.place != *place;
            lists.place = *place;
        }
        moved
    }

    /// Exchanges the current and the previous lists.
    pub fn swap_lists(&mut self) {
        for (index, lists) in self.lists.iter_mut().enumerate() {
            lists.swap(&wants_of_grid(&self.desc.wants, index));
        }
    }

    /// Records the scene in a pose and makes all lists.
    pub fn record_lists(&self, r: &mut Recorder, pose: &Pose) {
        // Counters and lists start empty.
        self.reset(r);
        // Skins and morph targets move vertices.
        self.scene.deform(r, pose);
        // The scene's triangles are recorded in the world.
        self.record.record(r, self, &self.scene, pose);
        // The bounding volume hierarchy is fitted to them, for rays.
        self.tree.record(r, self, pose);
        for (lists, makers) in self.lists.iter().zip(&self.makers) {
            // Every voxel lists the triangles that touch it.
            if let Some(voxelise) = &makers.voxelise {
                voxelise.record(r, "voxelise", self, lists);
            }
            // The occupied voxels and their parents are listed, so that other voxels need not be visited.
            if let Some(cells) = &makers.cells {
                cells.record(r, lists);
            }
        }
        // One item is chosen for each group of similar triangles, and items that another surface cuts become two.
        if let Some(groups) = &self.groups {
            groups.record(r, self);
        }
    }

    /// Splits those items of the list `entry` that another surface cuts.
    pub fn split(&self, r: &mut Recorder, entry: u32) {
        if let Some(groups) = &self.groups {
            groups.split(r, self, entry);
        }
    }

    /// Requests the light of all items, with light on demand.
    pub fn ask_all(&self, r: &mut Recorder) {
        if let Some(groups) = &self.groups {
            groups.ask_all(r, self);
        }
    }

    /// Makes the base grid's lists again, as the talk does for its second bounce (D29).
    pub fn relist(&self, r: &mut Recorder) {
        self.base().reset(r);
        if let Some(voxelise) = &self.makers[0].voxelise {
            voxelise.record(r, "voxelise 2", self, self.base());
        }
    }

    /// Replaces buffers that are too small for `counts`.
    ///
    /// # Errors
    /// Too little memory.
    pub fn grow(&mut self, context: &Arc<Context>, counts: Counts) -> Result<()> {
        let triangles = u64::from(counts.triangle_capacity);
        grow(context, &mut self.triangles, triangles * size_of::<layout::Triangle>() as u64)?;
        grow(context, &mut self.attributes, triangles * 12 * u64::from(counts.corner_words))?;
        for (index, (lists, capacity)) in self.lists.iter_mut().zip(&counts.lists).enumerate() {
            lists.grow(context, &wants_of_grid(&self.desc.wants, index), *capacity)?;
        }
        self.desc.counts = counts;
        Ok(())
    }

    /// Bindings that every shading pass reads (`glsl/ground/bindings.glsl`).
    pub fn binds(&self) -> Vec<Bind<'_>> {
        let (lists, scene) = (self.base(), &self.scene);
        let mut binds = vec![
            Bind::buffer("frame", &self.frame),
            Bind::buffer("globals", &lists.globals),
            Bind::buffer("triangles", &self.triangles),
            Bind::buffer("list_items", &lists.items),
            Bind::buffer("heads", &lists.heads),
            Bind::buffer("materials", &scene.materials),
            Bind::buffer("lights", &self.lights),
            Bind::buffer("lamps", &self.lamps),
            Bind::buffer("lamp_nodes", &self.lamp_nodes),
            Bind::buffer("attribute_words", &self.attributes),
            Bind::buffer("texture_levels", &scene.texture_levels),
            Bind::image("atlas_linear", scene.atlas.view(), &scene.texel_sampler),
            Bind::image("atlas_srgb", scene.atlas.view_as(Format::R8G8B8A8_SRGB), &scene.texel_sampler),
            Bind::buffer("slots", &self.slots),
        ];
        binds.extend(self.tree.binds());
        binds
    }

    /// Bindings of passes that light list items: [`Self::binds`], and the buffers of items. `listed` holds the items
    /// that they light, and `item_lights` receives the light.
    pub fn item_binds<'a>(&'a self, listed: &'a Buffer, item_lights: &'a Buffer) -> Vec<Bind<'a>> {
        let lists = self.base();
        let mut binds = self.binds();
        binds.extend([
            Bind::buffer("direct_light", &lists.direct_light),
            Bind::buffer("item_lights", item_lights),
            Bind::buffer("item_parts", &lists.item_parts),
            Bind::buffer("item_samples", &lists.item_samples),
            Bind::buffer("item_lobes", &lists.item_lobes),
            Bind::buffer("lit_items", listed),
        ]);
        binds
    }

    /// Bindings of passes over the image: [`Self::binds`], and the blended triangles.
    pub fn image_binds(&self) -> Vec<Bind<'_>> {
        let mut binds = self.binds();
        binds.push(Bind::buffer("blended_sources", &self.blended));
        binds
    }
}

/// Refuses a device without geometry shaders.
///
/// # Errors
/// The device has none, and `conservative` needs them.
fn check_geometry_shader(context: &Context, conservative: Conservative) -> Result<()> {
    if context.geometry_shader || conservative == Conservative::Compute {
        return Ok(());
    }
    Err(Error::Device(format!(
        "grid.conservative = {conservative} needs geometry shaders, which {} does not offer: set grid.conservative to compute, or choose \
         another device or preset",
        context.name
    )))
}

/// Requests for a further grid: lists, and if it is lit, its own lists of cells and lit items.
fn wants_of_grid(wants: &Wants, index: usize) -> Wants {
    let lit = wants.lit_grids;
    let conservative = wants.conservative;
    let further =
        Wants { conservative, lists: true, cells: lit, lit_items: lit, kept_direct_light: lit, ..Wants::default() };
    if index == 0 { wants.clone() } else { further }
}

/// Workgroups of `size` threads for at least `threads` threads, along two axes; at least one.
fn over_threads(threads: u32, size: u32) -> [u32; 3] {
    let groups = threads.div_ceil(size).max(1);
    let x = groups.min(MOST_GROUPS);
    [x, groups.div_ceil(x), 1]
}

/// Memory that all grids share.
fn shared_plan(wants: &Wants, counts: &Counts) -> Vec<MemoryRow> {
    let slots = if wants.rays || counts.blended > 0 { counts.triangles } else { 1 };
    let mut rows = vec![
        ("frame", array::<layout::Frame>(1) + array::<u32>(counts.sky_words)),
        ("lights", array::<layout::Light>(counts.lights)),
        ("lamps", array::<layout::Lamp>(counts.lamps)),
        ("lamp nodes", array::<layout::LampNode>(lamps::node_count(counts.lamps))),
        ("triangles", array::<layout::Triangle>(counts.triangle_capacity)),
        ("triangles' attributes", array::<[u32; 3]>(counts.triangle_capacity) * u64::from(counts.corner_words)),
        ("slots", array::<u32>(slots)),
        ("blended triangles", array::<u32>(counts.blended)),
        record::plan(wants.conservative, counts.instances),
    ];
    rows.extend(counts.query.as_ref().map_or_else(|| counts.tree.plan(), QueryPlan::plan));
    rows
}

/// Memory of every resource of [`Ground::new`] for a base grid of edge `edge`.
pub fn plan(edge: u32, wants: &Wants, counts: &Counts) -> Vec<MemoryRow> {
    let mut rows = shared_plan(wants, counts);
    let edges = std::iter::once(edge).chain(wants.grids.iter().map(|place| place.edge));
    for (index, (edge, capacity)) in edges.zip(&counts.lists).enumerate() {
        rows.extend(lists::plan(edge, &wants_of_grid(wants, index), *capacity));
    }
    rows
}
