//! Limits of a device and of the machine, and whether a frame's resources fit.

use std::sync::Arc;

use crate::Result;
use crate::frame::{FrameDesc, first_plan, make_trees};
use crate::ground::layout::Triangle;
use crate::ground::memory_plan::{self, MemoryRow};
use crate::ground::scene_on_gpu::ScenePacked;
use crate::ground::tree::groups::TreesOnce;
use crate::memory::Limit;
use crate::scene::Pose;
use crate::vk::{Context, DeviceReport, beside_compiler};

/// Memory of a device that may be taken: what it has left, on a CPU what the machine has left besides the driver, or
/// `limit` bytes of that.
pub fn memory_limit(context: &Context, limit: Option<u64>) -> Limit {
    let budget = Limit { bytes: context.memory_budget(), words: format!("the budget of {}", context.name) };
    let machine = context.is_cpu.then(beside_compiler).flatten();
    let asked = limit.map(|bytes| Limit { bytes, words: "the --memory-limit".into() });
    machine.into_iter().chain(asked).fold(budget, |least, other| if other.bytes < least.bytes { other } else { least })
}

/// How many texels a side an image of a device has, in which a texture lies with its mips, and what says so.
pub fn largest_image(context: &Context) -> (u32, String) {
    let most = context.limits.max_image_dimension2_d;
    (most, format!("the {most} texels a side of an image of {}", context.name))
}

/// How many triangles, over all instances, a device's buffers hold at most, whatever is known of each, and what says
/// so.
pub fn most_triangles(context: &Context) -> (u64, String) {
    let most = u64::from(context.limits.max_storage_buffer_range) / size_of::<Triangle>() as u64;
    (most, format!("the largest buffer that {} binds", context.name))
}

/// The numbers that decide whether the resources of a frame fit.
pub(crate) struct MemoryCheck {
    /// Bytes that may be taken, and what sets the limit.
    limit: Limit,
    /// Bytes that the device binds at once.
    largest: Limit,
}

/// Refuses a frame whose resources exceed the memory of a device, or what it binds at once, before anything is made:
/// the device need not be here.
///
/// # Errors
/// [`crate::Error::Memory`]
pub fn fits(device: &DeviceReport, desc: &FrameDesc, pose: &Pose) -> Result<()> {
    let memory = device.heaps.iter().filter(|(_, is_own)| *is_own).map(|heap| heap.0).max().unwrap_or(0);
    let check = MemoryCheck {
        limit: Limit { bytes: memory, words: format!("the memory of {}", device.name) },
        largest: largest(&device.name, device.limits.max_storage_buffer_range),
    };
    let trees = Arc::new(TreesOnce::new(&pose.world_from_instance));
    let packed = ScenePacked::with(desc.scene, pose, trees.clone());
    check.check_first(desc, &trees, &packed.plan())
}

/// The limit of `bytes` for buffers, which the device of that name binds at once.
fn largest(name: &str, bytes: u32) -> Limit {
    Limit { bytes: bytes.into(), words: format!("the largest buffer that {name} binds") }
}

impl MemoryCheck {
    /// `limit`: bytes, where the caller sets them.
    pub fn new(context: &Context, limit: Option<u64>) -> Self {
        let largest = largest(&context.name, context.limits.max_storage_buffer_range);
        Self { limit: memory_limit(context, limit), largest }
    }

    /// Packs the scene for the device, and makes its trees if they are asked for: refused is what does not fit, as soon
    /// as it is known. Returns the bytes of what does not depend on the grid, of which `more` is known.
    pub fn pack(
        &self,
        context: &Context,
        desc: &FrameDesc,
        pose: &Pose,
        more: &[MemoryRow],
    ) -> Result<(ScenePacked, Vec<MemoryRow>)> {
        let trees = Arc::new(TreesOnce::new(&pose.world_from_instance));
        let plan = first_plan(desc, &trees);
        self.check(desc.settings.voxels, more, &plan)?;
        let packed = ScenePacked::with(desc.scene, pose, trees.clone());
        packed.check_textures(context)?;
        let fixed = [packed.plan().as_slice(), more].concat();
        self.check_trees(desc, &trees, &fixed, &plan)?;
        Ok((packed, fixed))
    }

    /// Refuses what a new frame takes beyond what `fixed` names, before anything is uploaded, and most of it before
    /// trees are made.
    pub fn check_first(&self, desc: &FrameDesc, trees: &TreesOnce, fixed: &[MemoryRow]) -> Result<()> {
        self.check_trees(desc, trees, fixed, &first_plan(desc, trees))
    }

    fn check_trees(
        &self,
        desc: &FrameDesc,
        trees: &TreesOnce,
        fixed: &[MemoryRow],
        plan: &impl Fn(u32) -> Vec<MemoryRow>,
    ) -> Result<()> {
        self.check(desc.settings.voxels, fixed, plan)?;
        make_trees(desc, trees);
        self.check(desc.settings.voxels, fixed, plan)
    }

    /// Refuses a grid of edge `voxels` whose resources exceed the limit or what the device binds at once. `fixed`:
    /// those that do not depend on the grid; `plan`: those that a grid of that edge takes.
    pub fn check(&self, voxels: u32, fixed: &[MemoryRow], plan: &impl Fn(u32) -> Vec<MemoryRow>) -> Result<()> {
        let rows_at = |edge: u32| fixed.iter().copied().chain(plan(edge)).collect::<Vec<_>>();
        memory_plan::check_buffers(&memory_plan::check(voxels, &self.limit, rows_at)?, &self.largest)
    }
}
