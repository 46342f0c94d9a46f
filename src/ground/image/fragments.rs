//! Fragments: a list of each triangle in each pixel, so that a workgroup shades fragments from anywhere in the image. A
//! rasteriser shades quads of 2×2 pixels of one triangle, most of which are empty for small triangles. Reads: visible
//! triangles, materials, the method's light. Writes: the shaded fragments.

use std::sync::Arc;

use super::target::{COLOR_FORMAT, ImageShape};
use super::visibility::Nearest;
use super::{BandFrame, ImagePassDesc, LightReader, shader};
use crate::Result;
use crate::ground::MOST_GROUPS;
use crate::ground::constants::Features;
use crate::ground::layout::ListCount;
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, Buffer, BufferKind, Compute, ComputeDesc, Context, Image, ImageDesc, ImageUsageFlags, ImageView, Recorder,
};

/// Bytes of a fragment in the list, and of its entries in the queues.
pub const FRAGMENT_BYTES: u64 = 2 * 8;
/// Bytes of a pixel: the start of its fragments.
pub const PIXEL_BYTES: u64 = 4;
/// Threads of a workgroup over fragments, or over pixels of a row.
pub const GROUP: u32 = 64;
/// Pixels across and down that a workgroup lists: the tiles of its threads in `glsl/ground/image/fragments.comp`.
const LISTER_PIXELS: [u32; 2] = [8 * 4, 8 * 2];
/// The maximum number of samples in rows that are shaded at once, because one dispatch must suffice for their
/// fragments.
pub const MOST_AT_ONCE: u32 = GROUP * MOST_GROUPS;

const EMPTY_LIST: ListCount = ListCount { groups_x: 0, groups_y: 1, groups_z: 1, count: 0 };

/// The queues of a list.
const QUEUES: usize = 2;

/// Bytes of a list with room for `capacity` fragments.
pub fn list_bytes(capacity: u64) -> u64 {
    ((1 + QUEUES) * size_of::<ListCount>()) as u64 + capacity * FRAGMENT_BYTES
}

/// Empties a list. The caller adds a barrier.
pub fn empty(r: &mut Recorder, list: &Buffer) {
    r.update(list, 0, &[EMPTY_LIST]);
}

/// Memory of [`FragmentList::new`].
pub fn plan(shape: &ImageShape) -> MemoryRow {
    ("fragments", list_bytes(shape.most_seen_samples()) + PIXEL_BYTES * shape.most_seen_pixels())
}

/// The fragments of the opaque surfaces that a band sees.
pub struct FragmentList {
    pub list: Buffer,
    of_pixels: Buffer,
    pass: Compute,
}

impl FragmentList {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, shape: &ImageShape) -> Result<Self> {
        let buffer = |label: &str, bytes| Buffer::new(context, label, bytes, BufferKind::Device);
        let multisampled = if shape.samples > 1 { " MULTISAMPLED" } else { "" };
        let shader = format!("ground/image/fragments.comp{multisampled}");
        Ok(Self {
            list: buffer("fragments 1", list_bytes(shape.most_seen_samples()))?,
            of_pixels: buffer("fragments 2", PIXEL_BYTES * shape.most_seen_pixels())?,
            pass: Compute::new(context, &ComputeDesc { label: "fragments", shader: &shader, ..Default::default() })?,
        })
    }

    /// Lists visible fragments. `seen` is from [`Visibility::bind`](super::visibility::Visibility::bind).
    pub fn record(&self, r: &mut Recorder, of: &BandFrame, seen: Bind<'_>) {
        empty(r, &self.list);
        r.full_barrier();
        let [list, of_pixels] = self.binds();
        let [across, down] = LISTER_PIXELS;
        let groups = [of.shape().width.div_ceil(across), of.rows.count.div_ceil(down), 1];
        let frame = Bind::buffer("frame", &of.ground().frame);
        r.dispatch(&self.pass, &[frame, list, of_pixels, seen], &of.rows.push(), groups);
        r.full_barrier();
    }

    pub fn binds(&self) -> [Bind<'_>; 2] {
        [Bind::buffer("fragment_counts", &self.list), Bind::buffer("pixel_fragments", &self.of_pixels)]
    }
}

/// Bytes of `capacity` shaded fragments.
pub fn shaded_bytes(shape: &ImageShape, capacity: u64) -> u64 {
    let (width, height) = shaded_size(capacity);
    u64::from(width) * u64::from(height) * shape.color_bytes()
}

/// The size of images for `capacity` shaded fragments: about square, because drivers pad the sides.
fn shaded_size(capacity: u64) -> (u32, u32) {
    let width = (capacity.isqrt() as u32).next_power_of_two();
    (width, capacity.div_ceil(u64::from(width)).max(1) as u32)
}

/// The passes that shade the fragments of a list: one over all of them, and one over each queue of those that need
/// further parts of light.
pub struct FragmentShading {
    /// The label of the images.
    label: &'static str,
    shaded: Vec<Image>,
    pass: LightReader,
    queued: Vec<(Queue, LightReader)>,
}

impl FragmentShading {
    /// Passes for `capacity` fragments of these surfaces.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(
        context: &Arc<Context>,
        desc: &ImagePassDesc,
        shape: &ImageShape,
        of: Nearest,
        capacity: u64,
    ) -> Result<Self> {
        let (label, images) = match of {
            Nearest::Opaque => ("image", "shaded fragments"),
            Nearest::Blended => ("image blended", "blended fragments"),
        };
        let forms = [("GATHERED", shape.gathers.is_some()), ("AOVS", shape.outputs > 1)];
        let shader = shader(&format!("ground/image/image.comp {}", desc.method), &forms);
        let pass = |label, parts: u32| desc.light_reader(context, label, &shader, &[("PARTS", parts.into())]);
        let queues = Queue::of_image(desc, shape);
        let queued = queues.iter().map(|queue| Ok((*queue, pass(queue.label(), queue.part())?)));
        let apart = queues.iter().fold(0, |parts, queue| parts | queue.part());
        Ok(Self {
            label: images,
            shaded: shaded(context, images, shape.outputs, capacity)?,
            pass: pass(label, ALL_PARTS & !apart)?,
            queued: queued.collect::<Result<_>>()?,
        })
    }

    /// Grows the images for `capacity` fragments.
    ///
    /// # Errors
    /// Too little memory.
    pub fn grow(&mut self, context: &Arc<Context>, capacity: u64) -> Result<()> {
        self.shaded = shaded(context, self.label, self.shaded.len(), capacity)?;
        Ok(())
    }

    /// Shades the fragments of `list`. `binds` are the other bindings of the shader.
    pub fn record(&self, r: &mut Recorder, of: &BandFrame, list: &Buffer, binds: &[Bind<'_>]) {
        let mut binds = binds.to_vec();
        binds.push(Bind::buffer("fragment_counts", list));
        binds.push(Bind::storage_images("shaded", self.shaded()));
        let counts = size_of::<ListCount>() as u64;
        r.update(list, counts, &[EMPTY_LIST; QUEUES]);
        r.full_barrier();
        let pass = self.pass.for_use(of.light);
        r.dispatch_indirect(pass, &pass.select(&binds), &of.push(), list.at(0));
        r.full_barrier();
        for (queue, pass) in &self.queued {
            let pass = pass.for_use(of.light);
            r.dispatch_indirect(pass, &pass.select(&binds), &of.push(), list.at(counts * (1 + *queue as u64)));
            r.full_barrier(); // a fragment may be in both queues
        }
    }

    /// The images of shaded fragments.
    pub fn shaded(&self) -> impl Iterator<Item = ImageView<'_>> {
        self.shaded.iter().map(Image::view)
    }
}

fn shaded(context: &Arc<Context>, label: &str, outputs: usize, capacity: u64) -> Result<Vec<Image>> {
    let (width, height) = shaded_size(capacity);
    let usage = ImageUsageFlags::STORAGE | ImageUsageFlags::SAMPLED;
    let image = |index: usize| {
        let (label, format) = (format!("{label} {}", index + 1), COLOR_FORMAT);
        Image::new(context, &ImageDesc { label: &label, format, width, height, usage, ..Default::default() })
    };
    (0..outputs).map(image).collect()
}

/// All parts of a fragment's light: `PARTS` in `glsl/ground/image/shade.glsl`.
const ALL_PARTS: u32 = 7;

/// The queues of `glsl/ground/image/fragments.glsl`.
#[derive(Clone, Copy, Debug)]
enum Queue {
    /// Fragments for which no light was gathered, or not all.
    LookUps,
    /// Fragments that look along specular or transmitted lobes.
    Lobes,
}

impl Queue {
    /// The queues of an image, in the order of their passes.
    fn of_image(desc: &ImagePassDesc, shape: &ImageShape) -> Vec<Self> {
        // Where nothing is gathered, every fragment looks up its own light.
        let look_ups = (shape.queues && shape.gathers.is_some()).then_some(Self::LookUps);
        let glossy = Features::SPECULAR.and(Features::TRANSMISSION, true);
        let lobes = (shape.queues && desc.features.has(glossy)).then_some(Self::Lobes);
        look_ups.into_iter().chain(lobes).collect()
    }

    /// The part of light that its pass shades.
    fn part(self) -> u32 {
        match self {
            Self::LookUps => 2,
            Self::Lobes => 4,
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::LookUps => "image look-ups",
            Self::Lobes => "image lobes",
        }
    }
}
