//! Device memory, allocated by gpu-allocator with one allocation per resource. There are few resources and most are
//! large. Separate allocations make the allocated bytes the sum of the resources' sizes.

use crate::vk::device::context::Context;
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

/// The resource to which a block of memory belongs.
pub(in crate::vk) enum Owner {
    Buffer(vk::Buffer, MemoryLocation),
    Image(vk::Image),
}

pub(in crate::vk) struct Memory {
    context: Arc<Context>,
    /// The allocation, which is taken when it is freed.
    allocation: Option<Allocation>,
    bytes: u64,
}

impl Memory {
    /// Allocates memory for `owner` and binds it. `Error::Memory` names `label` if there is too little.
    pub(in crate::vk) fn bind(context: &Arc<Context>, label: &str, owner: &Owner) -> Result<Self> {
        let device = context.device();
        // SAFETY: the owner's handle is alive, it belongs to this device, and nothing was bound to it yet.
        let requirements = unsafe {
            match owner {
                Owner::Buffer(buffer, _) => device.get_buffer_memory_requirements(*buffer),
                Owner::Image(image) => device.get_image_memory_requirements(*image),
            }
        };
        let allocation = allocate(context, label, requirements, owner)?;
        // SAFETY: as above; the allocation has the size and type that the owner requires.
        let bound = unsafe {
            let (memory, offset) = (allocation.memory(), allocation.offset());
            match owner {
                Owner::Buffer(buffer, _) => device.bind_buffer_memory(*buffer, memory, offset),
                Owner::Image(image) => device.bind_image_memory(*image, memory, offset),
            }
        };
        context.allocated.fetch_add(requirements.size, Ordering::Relaxed);
        let this = Self { context: context.clone(), allocation: Some(allocation), bytes: requirements.size };
        bound.map_err(|result| context.error(&format!("binding memory to {label}"), result))?;
        Ok(this)
    }

    pub(in crate::vk) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The mapped bytes; panics for device memory.
    pub(in crate::vk) fn mapped(&self) -> *mut u8 {
        let mapped = self.allocation.as_ref().and_then(Allocation::mapped_ptr);
        mapped.expect("only upload and readback memory is mapped").as_ptr().cast()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.context.allocated.fetch_sub(self.bytes, Ordering::Relaxed);
        let Some(allocation) = self.allocation.take() else { return };
        if self.context.stuck.load(Ordering::Relaxed) {
            // The device may still use it, so it is left to the end of the process.
            std::mem::forget(allocation);
        } else if let Err(error) = self.context.allocator().free(allocation) {
            // An error cannot be handled here, and the memory is freed with the device.
            tracing::warn!("giving memory back: {error}");
        }
    }
}

impl Context {
    /// The allocator. It stays usable after a panic elsewhere.
    fn allocator(&self) -> std::sync::MutexGuard<'_, gpu_allocator::vulkan::Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn allocate(context: &Context, label: &str, requirements: vk::MemoryRequirements, owner: &Owner) -> Result<Allocation> {
    let too_much = || {
        Error::Memory(format!(
            "{label} needs {}, but {} has no more than {} left: ask for less, such as a smaller image",
            mebibytes(requirements.size),
            context.name,
            mebibytes(context.memory_budget())
        ))
    };
    if requirements.size > context.capabilities.max_allocation_bytes.min(context.memory_budget()) {
        return Err(too_much());
    }
    let (location, linear, allocation_scheme) = match *owner {
        Owner::Buffer(buffer, location) => (location, true, AllocationScheme::DedicatedBuffer(buffer)),
        Owner::Image(image) => (MemoryLocation::GpuOnly, false, AllocationScheme::DedicatedImage(image)),
    };
    let desc = AllocationCreateDesc { name: label, requirements, location, linear, allocation_scheme };
    context.allocator().allocate(&desc).map_err(|error| match error {
        AllocationError::OutOfMemory => too_much(),
        other => Error::Device(format!("{} has no memory for {label}: {other}", context.name)),
    })
}

/// A size such as `1.5 MiB`, for messages.
pub(in crate::vk) fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0))
}
