//! Device memory, by gpu-allocator with one allocation per resource. There are few resources and most are large, so blocks
//! shared between them would only blur the account; this way the bytes taken from the driver are the sum of what the
//! resources need.

use super::context::Context;
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

/// Where a resource lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Location {
    Device,
    Upload,
    Readback,
}

impl Location {
    fn of_allocator(self) -> MemoryLocation {
        match self {
            Self::Device => MemoryLocation::GpuOnly,
            Self::Upload => MemoryLocation::CpuToGpu,
            Self::Readback => MemoryLocation::GpuToCpu,
        }
    }
}

pub(super) enum Owner {
    Buffer(vk::Buffer),
    Image(vk::Image),
}

pub(super) struct Memory {
    context: Arc<Context>,
    /// Taken when it is given back.
    allocation: Option<Allocation>,
    bytes: u64,
}

impl Memory {
    /// Allocates what `owner` needs and binds it. `Error::Memory` names `label` when there is too little.
    pub(super) fn bind(context: &Arc<Context>, label: &str, location: Location, owner: &Owner) -> Result<Self> {
        let device = context.device();
        // SAFETY: the owner's handle is alive, it belongs to this device, and nothing was bound to it yet.
        let requirements = unsafe {
            match owner {
                Owner::Buffer(buffer) => device.get_buffer_memory_requirements(*buffer),
                Owner::Image(image) => device.get_image_memory_requirements(*image),
            }
        };
        let memory = Self::allocate(context, label, location, requirements, owner)?;
        let allocation = memory.allocation.as_ref().expect("taken only when dropped");
        // SAFETY: as above; the allocation has the size and type that the owner asked for.
        unsafe {
            match owner {
                Owner::Buffer(buffer) => device.bind_buffer_memory(*buffer, allocation.memory(), allocation.offset()),
                Owner::Image(image) => device.bind_image_memory(*image, allocation.memory(), allocation.offset()),
            }
        }
        .map_err(|result| context.error(&format!("binding memory to {label}"), result))?;
        Ok(memory)
    }

    fn allocate(
        context: &Arc<Context>,
        label: &str,
        location: Location,
        requirements: vk::MemoryRequirements,
        owner: &Owner,
    ) -> Result<Self> {
        let bytes = requirements.size;
        let too_much = || {
            Error::Memory(format!(
                "{label} needs {}, but {} has no more than {} left: ask for less, such as a smaller image",
                mebibytes(bytes),
                context.name,
                mebibytes(context.memory_budget())
            ))
        };
        if bytes > context.max_allocation_bytes.min(context.memory_budget()) {
            return Err(too_much());
        }
        let (linear, allocation_scheme) = match owner {
            Owner::Buffer(buffer) => (true, AllocationScheme::DedicatedBuffer(*buffer)),
            Owner::Image(image) => (false, AllocationScheme::DedicatedImage(*image)),
        };
        let desc = AllocationCreateDesc {
            name: label,
            requirements,
            location: location.of_allocator(),
            linear,
            allocation_scheme,
        };
        let allocation = context.allocator().allocate(&desc).map_err(|error| match error {
            AllocationError::OutOfMemory => too_much(),
            other => Error::Device(format!("{} has no memory for {label}: {other}", context.name)),
        })?;
        context.allocated.fetch_add(bytes, Ordering::Relaxed);
        Ok(Self { context: context.clone(), allocation: Some(allocation), bytes })
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The mapped bytes; panics for device memory.
    pub(super) fn mapped(&self) -> *mut u8 {
        let mapped = self.allocation.as_ref().and_then(Allocation::mapped_ptr);
        mapped.expect("only upload and readback memory is mapped").as_ptr().cast()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.context.allocated.fetch_sub(self.bytes, Ordering::Relaxed);
        let Some(allocation) = self.allocation.take() else { return };
        if self.context.stuck.load(Ordering::Relaxed) {
            // The device may still be at work in it: it is left to the process's end.
            std::mem::forget(allocation);
        } else if let Err(error) = self.context.allocator().free(allocation) {
            // Nothing can be done about it here, and the memory goes with the device.
            tracing::warn!("giving memory back: {error}");
        }
    }
}

impl Context {
    /// The one allocator; a panic elsewhere leaves it as usable as it was.
    fn allocator(&self) -> std::sync::MutexGuard<'_, gpu_allocator::vulkan::Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// `1.5 MiB`, for messages.
pub(super) fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0))
}
