//! Device memory: one allocation per resource. There are few resources and most are large, so blocks shared between
//! them would only blur the account; this way the bytes taken from the driver are the sum of what the resources need.

use super::context::Context;
use crate::{Error, Result};
use ash::vk;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Where a resource lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Location {
    Device,
    Upload,
    Readback,
}

impl Location {
    /// Memory properties, most wanted first; the last set is guaranteed to exist.
    fn wanted(self) -> &'static [vk::MemoryPropertyFlags] {
        use vk::MemoryPropertyFlags as F;
        const HOST: F = F::from_raw(F::HOST_VISIBLE.as_raw() | F::HOST_COHERENT.as_raw());
        const CACHED: F = F::from_raw(HOST.as_raw() | F::HOST_CACHED.as_raw());
        match self {
            Self::Device => const { &[F::DEVICE_LOCAL, F::empty()] },
            Self::Upload => const { &[HOST] },
            Self::Readback => const { &[CACHED, HOST] },
        }
    }
}

pub(super) enum Owner {
    Buffer(vk::Buffer),
    Image(vk::Image),
}

pub(super) struct Memory {
    context: Arc<Context>,
    handle: vk::DeviceMemory,
    bytes: u64,
    /// Start of the mapping; null for [`Location::Device`].
    mapped: *mut u8,
}

// SAFETY: the mapping is plain memory that lives as long as the allocation.
unsafe impl Send for Memory {}
unsafe impl Sync for Memory {}

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
        // SAFETY: as above; the allocation has the size and type that the owner asked for.
        unsafe {
            match owner {
                Owner::Buffer(buffer) => device.bind_buffer_memory(*buffer, memory.handle, 0),
                Owner::Image(image) => device.bind_image_memory(*image, memory.handle, 0),
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
        let types = &context.memory_properties().memory_types_as_slice();
        let find = |flags: &vk::MemoryPropertyFlags| {
            (0..types.len())
                .find(|&i| requirements.memory_type_bits & (1 << i) != 0 && types[i].property_flags.contains(*flags))
        };
        let Some(memory_type) = location.wanted().iter().find_map(find) else {
            return Err(Error::Device(format!("{} has no memory that can hold {label}", context.name)));
        };
        let mut dedicated = match owner {
            Owner::Buffer(buffer) => vk::MemoryDedicatedAllocateInfo::default().buffer(*buffer),
            Owner::Image(image) => vk::MemoryDedicatedAllocateInfo::default().image(*image),
        };
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(memory_type as u32)
            .push_next(&mut dedicated);
        let too_much = || {
            Error::Memory(format!(
                "{label} needs {}, but {} has no more than {} left: use fewer voxels or a smaller image",
                mebibytes(requirements.size),
                context.name,
                mebibytes(context.memory_budget())
            ))
        };
        let heap = context.memory_properties().memory_heaps[types[memory_type].heap_index as usize];
        if requirements.size > context.max_allocation_bytes.min(heap.size) {
            return Err(too_much());
        }
        // SAFETY: the info is complete and refers to live objects.
        let handle = unsafe { context.device().allocate_memory(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => too_much(),
            other => context.error(&format!("allocating {label}"), other),
        })?;
        let mut memory =
            Self { context: context.clone(), handle, bytes: requirements.size, mapped: std::ptr::null_mut() };
        context.allocated.fetch_add(memory.bytes, Ordering::Relaxed);
        if location != Location::Device {
            // SAFETY: host-visible, not mapped before; unmapped implicitly when freed.
            let mapped = unsafe { context.device().map_memory(handle, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()) };
            memory.mapped = mapped.map_err(|result| context.error(&format!("mapping {label}"), result))?.cast();
        }
        Ok(memory)
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The mapped bytes; panics for device memory.
    pub(super) fn mapped(&self) -> *mut u8 {
        assert!(!self.mapped.is_null(), "only upload and readback memory is mapped");
        self.mapped
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.context.allocated.fetch_sub(self.bytes, Ordering::Relaxed);
        if let Some(device) = self.context.device_to_destroy_with() {
            // SAFETY: the recorder waits for its work and holds what it uses, so nothing in flight refers to it.
            unsafe { device.free_memory(self.handle, None) };
        }
    }
}

/// `1.5 MiB`, for messages.
pub(super) fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0))
}
