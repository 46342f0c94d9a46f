//! The description of a frame, the requests to the ground that follow from it, and the memory that the frame takes.

use crate::gi::{IndirectMethod, Wants};
use crate::ground::constants::{Features, constants, with};
use crate::ground::expected_items::{Expected, expected_items};
use crate::ground::grid::Grid;
use crate::ground::image::ImagePassDesc;
use crate::ground::image::target::{self, ImageShape};
use crate::ground::lamps::Lamps;
use crate::ground::lists::ListCapacity;
use crate::ground::memory_plan::MemoryRow;
use crate::ground::tree::groups::{TreeSize, TreesOnce};
use crate::ground::tree::queries::QueryPlan;
use crate::ground::{self, Counts, GroundDesc};
use crate::scene::{Bounds, Scene};
use crate::settings::{GatherResolution, ImageSettings, LampLight, Settings, Shadows};
use crate::{Error, Result};

/// Everything that determines a frame.
#[derive(Clone, Copy)]
pub struct FrameDesc<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The number of outputs, from [`target::outputs`].
    pub outputs: usize,
    /// Bounds of the scene over the whole animation. They determine the place of the grid.
    pub bounds: Bounds,
    /// The number of frames that may be in flight at once.
    pub slots: usize,
    /// The acceleration structure for rays, if the device's ray queries trace them.
    pub query: Option<QueryPlan>,
    /// Whether passes are made until the first light is whole: see [`super::LightRules::waits`].
    pub waits: bool,
}

impl FrameDesc<'_> {
    /// Checks that there are pixels, and checks every setting against its key.
    pub fn check(&self) -> Result<()> {
        let (width, height) = self.size;
        if width.min(height) == 0 {
            return Err(Error::Usage(format!("a frame of {width}x{height} has no pixels: ask for at least one")));
        }
        self.settings.check()
    }
}

/// The memory that [`super::Frame::new`] allocates for a grid of any edge, before any buffer grows. Without trees it is
/// a lower bound.
pub fn first_plan(desc: &FrameDesc, trees: &TreesOnce) -> impl Fn(u32) -> Vec<MemoryRow> {
    let (lamps, features) = (lamps(desc.scene, desc.settings), Features::of_scene(desc.scene));
    move |voxels| {
        let settings = Settings { voxels, ..desc.settings.clone() };
        let desc = &FrameDesc { settings: &settings, ..*desc };
        let counts = first_counts(desc, features, &lamps, trees);
        plan(&settings, features, &shape_of(desc, features), &counts)
    }
}

/// Builds the trees if `desc` needs them; the caller checks [`first_plan`] first, because trees may not fit into
/// memory.
pub fn make_trees(desc: &FrameDesc, trees: &TreesOnce) {
    if wants(desc.settings, Features::of_scene(desc.scene)).rays && desc.query.is_none() {
        trees.of_scene(desc.scene);
    }
}

pub(super) fn shape(desc: &FrameDesc) -> ImageShape {
    shape_of(desc, Features::of_scene(desc.scene))
}

fn shape_of(desc: &FrameDesc, features: Features) -> ImageShape {
    let wants = wants(desc.settings, features);
    ImageShape::new(&desc.settings.image, &wants, features.has(Features::BLEND), desc.size, desc.outputs)
}

/// Initial sizes of buffers. `features` are those of the scene.
fn first_counts(desc: &FrameDesc, features: Features, lamps: &Lamps, trees: &TreesOnce) -> Counts {
    let wants = wants(desc.settings, features);
    let query = desc.query.filter(|_| wants.rays);
    let tree = if wants.rays && query.is_none() { trees.size(desc.scene) } else { TreeSize::default() };
    // A grid that cannot be placed is refused later, when it is created.
    let grid = Grid::place(desc.bounds, desc.settings).ok();
    let expected =
        grid.map_or(Expected::default(), |grid| expected_items(desc.scene, &trees.world_from_instance, &grid));
    // A sixteenth is spare, for divided items and for walls in planes between voxels.
    let room = ((expected.items * 17.0 / 16.0) as u32).max(1 << 16);
    let list = ListCapacity { items: room, cells: 1 << 15, boxes: grid.map_or(0, |grid| grid.boxes) };
    let lists = vec![list; 1 + wants.grids.len()];
    let (width, height) = desc.size;
    let samples = width.saturating_mul(height).saturating_mul(desc.settings.image.samples);
    let lamps = lamps.count(desc.settings.lights.lamp_points);
    Counts { expected_sides: expected.sides as u32, query, ..Counts::of_scene(desc.scene, lamps, tree, lists, samples) }
}

pub(super) fn ground_desc(desc: &FrameDesc, lamps: &Lamps, trees: &TreesOnce) -> Result<GroundDesc> {
    let (scene, settings) = (desc.scene, desc.settings);
    let features = features(desc);
    let wants = wants(settings, features);
    if settings.lights.shadows == Shadows::Method && !wants.shadows {
        return Err(Error::Usage(format!(
            "lights.shadows = method: the method {} has no shadows of its own; set lights.shadows to rays or none",
            settings.method
        )));
    }
    Ok(GroundDesc {
        grid: Grid::place(desc.bounds, settings)?,
        wants,
        features,
        sky_map: scene.sky_map.clone(),
        counts: first_counts(desc, features, lamps, trees),
    })
}

/// Shader features of a frame.
fn features(desc: &FrameDesc) -> Features {
    let of = Features::of_settings(desc.scene, desc.settings);
    of.and(Features::QUERY, desc.query.is_some() && wants(desc.settings, of).rays)
}

pub(super) fn lamps(scene: &Scene, settings: &Settings) -> Lamps {
    if settings.lights.lamps == LampLight::Sampled { Lamps::new(scene) } else { Lamps::default() }
}

/// Requests to the ground that follow from settings and scene: those of the method, and those of direct light.
pub(super) fn wants(settings: &Settings, features: Features) -> Wants {
    let mut wants = Wants { conservative: settings.grid.conservative, ..settings.method.wants(settings) };
    if !features.has(Features::SPECULAR) {
        (wants.lobe_words, wants.gathers_lobes) = (0, false);
    }
    let direct = settings.lights.shadows == Shadows::Rays || settings.lights.lamps == LampLight::Sampled;
    wants.rays |= direct;
    wants
}

/// The settings with defaults for those parts of `image` that affect neither lists nor light.
pub(super) fn of_light(settings: &Settings) -> Settings {
    let (samples, gather_resolution) = (1, GatherResolution::Full);
    let image = ImageSettings { samples, gather_resolution, ..settings.image.clone() };
    Settings { image, ..settings.clone() }
}

/// Bytes of every resource of a frame, with buffers of the size `counts`. `features` are those of the scene.
pub(super) fn plan(settings: &Settings, features: Features, shape: &ImageShape, counts: &Counts) -> Vec<MemoryRow> {
    let wants = wants(settings, features);
    let mut rows = ground::plan(settings.voxels, &wants, counts);
    rows.extend(settings.method.plan(settings));
    rows.extend(target::plan(shape, (counts.blended > 0).then_some(counts.blended_samples)));
    rows
}

/// The description of the passes over the image.
pub(super) fn image_pass_desc<'a>(
    desc: &FrameDesc<'a>,
    method: &dyn IndirectMethod,
    counts: &Counts,
) -> ImagePassDesc<'a> {
    let settings = desc.settings;
    let features = features(desc);
    let links = shape(desc).gathers.is_some_and(|gathers| gathers.links);
    let of_image = with(constants(settings, features), &[("LINKED", links.into())]);
    ImagePassDesc {
        features,
        method: settings.method.name(),
        constants: with(of_image, method.constants()),
        asks: method.on_demand().is_some() && !sees_most(desc, counts),
    }
}

/// Whether requesting light takes longer than lighting everything: pixels and rays exceed a tenth of the expected
/// number of sides that send light (`docs/notes/costs.md` has the measurements).
fn sees_most(desc: &FrameDesc, counts: &Counts) -> bool {
    let (width, height) = desc.size;
    let rays = shape(desc).gathered_pixels() * u64::from(desc.settings.of.rays.diffuse);
    10 * (rays + u64::from(width) * u64::from(height)) > u64::from(counts.expected_sides)
}
