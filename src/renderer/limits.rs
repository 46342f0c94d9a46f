//! Limits of a device and of the machine, and the check whether the resources of a frame fit.

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

/// Device memory that may be used: the free memory of the device (of the machine, less a share for the driver, on a
/// CPU), or at most `limit` bytes.
pub fn memory_limit(context: &Context, limit: Option<u64>) -> Limit {
    let budget = Limit { bytes: context.memory_budget(), words: format!("the budget of {}", context.name) };
    let machine = context.is_cpu.then(beside_compiler).flatten();
    let asked = limit.map(|bytes| Limit { bytes, words: "the --memory-limit".into() });
    machine.into_iter().chain(asked).fold(budget, |least, other| if other.bytes < least.bytes { other } else { least })
}

/// The maximum side in texels of an image on the device, which holds a texture with its mips, and the reason for it.
pub fn largest_image(context: &Context) -> (u32, String) {
    let most = context.limits.max_image_dimension2_d;
    (most, format!("the {most} texels a side of an image of {}", context.name))
}

/// The maximum number of triangles over all instances that the device's buffers can hold, and the reason for it.
pub fn most_triangles(context: &Context) -> (u64, String) {
    let most = u64::from(context.limits.max_storage_buffer_range) / size_of::<Triangle>() as u64;
    (most, format!("the largest buffer that {} binds", context.name))
}

/// The numbers that decide if the resources of a frame fit.
pub(crate) struct MemoryCheck {
    /// Bytes that may be used, and the reason for the limit.
    limit: Limit,
    /// Bytes that the device can bind at once.
    largest: Limit,
}

/// Refuses a frame whose resources exceed the memory of a device or its largest binding. Nothing is created, and the
/// device need not be present.
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

/// The limit of `bytes` for one binding of the device `name`.
fn largest(name: &str, bytes: u32) -> Limit {
    Limit { bytes: bytes.into(), words: format!("the largest buffer that {name} binds") }
}

impl MemoryCheck {
    /// The limits of an open device. `limit` is the caller's limit in bytes.
    pub fn new(context: &Context, limit: Option<u64>) -> Self {
        let largest = largest(&context.name, context.limits.max_storage_buffer_range);
        Self { limit: memory_limit(context, limit), largest }
    }

    /// Packs the scene for the device, and builds its trees if they are needed. Refuses the scene as soon as it is
    /// known not to fit. Returns the bytes of all resources that do not depend on the grid, including the known `more`.
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

    /// Refuses the resources of a new frame beyond `fixed` before anything is uploaded, and most of them before trees
    /// are built.
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

    /// Refuses a grid of edge `voxels` whose resources exceed the limit or the largest binding. `fixed` lists the
    /// resources that do not depend on the grid, and `plan` those of a grid with the given edge.
    pub fn check(&self, voxels: u32, fixed: &[MemoryRow], plan: &impl Fn(u32) -> Vec<MemoryRow>) -> Result<()> {
        let rows_at = |edge: u32| fixed.iter().copied().chain(plan(edge)).collect::<Vec<_>>();
        memory_plan::check_buffers(&memory_plan::check(voxels, &self.limit, rows_at)?, &self.largest)
    }
}
