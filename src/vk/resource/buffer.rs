//! Buffers: device-local ones for passes, and mapped ones for transfers.

use super::memory::{Memory, Owner, mebibytes};
use crate::vk::device::context::Context;
use crate::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// The use of a buffer's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferKind {
    /// Only the device.
    Device,
    /// Only the device, for an acceleration structure or the memory for building one.
    Structure,
    /// Written by the CPU, permanently mapped.
    Upload,
    /// Read by the CPU, permanently mapped.
    Readback,
}

pub(in crate::vk) struct RawBuffer {
    context: Arc<Context>,
    pub(in crate::vk) handle: vk::Buffer,
    memory: Option<Memory>,
    pub(in crate::vk) label: String,
    bytes: u64,
    kind: BufferKind,
}

impl Drop for RawBuffer {
    fn drop(&mut self) {
        if let Some(device) = self.context.device_to_destroy_with() {
            // SAFETY: nothing in flight refers to it; see `Memory::drop`.
            unsafe { device.destroy_buffer(self.handle, None) };
        }
    }
}

/// A buffer and its memory. Recorded commands keep it alive, so it may be dropped at any time.
pub struct Buffer {
    pub(in crate::vk) raw: Arc<RawBuffer>,
}

/// A position in a buffer.
#[derive(Clone, Copy)]
pub struct BufferAt<'a> {
    pub buffer: &'a Buffer,
    pub offset: u64,
}

impl Buffer {
    /// The position `offset` bytes into the buffer.
    pub fn at(&self, offset: u64) -> BufferAt<'_> {
        BufferAt { buffer: self, offset }
    }

    /// A buffer of `bytes` bytes (at least 16, so that empty data can be bound), for use as storage, uniform, indirect,
    /// index, vertex and transfer buffer.
    ///
    /// `Error::Memory` if it exceeds `maxStorageBufferRange` or the free device memory.
    pub fn new(context: &Arc<Context>, label: &str, bytes: u64, kind: BufferKind) -> Result<Self> {
        let limit = u64::from(context.limits.max_storage_buffer_range);
        if kind == BufferKind::Device && bytes > limit {
            return Err(Error::Memory(format!(
                "{label} needs {}, but {} binds at most {} as one storage buffer: ask for less",
                mebibytes(bytes),
                context.name,
                mebibytes(limit)
            )));
        }
        let bytes = bytes.max(16).next_multiple_of(4);
        use vk::BufferUsageFlags as U;
        let common = U::STORAGE_BUFFER
            | U::UNIFORM_BUFFER
            | U::INDIRECT_BUFFER
            | U::INDEX_BUFFER
            | U::VERTEX_BUFFER
            | U::TRANSFER_SRC
            | U::TRANSFER_DST;
        let usage = match kind {
            BufferKind::Structure => {
                U::ACCELERATION_STRUCTURE_STORAGE_KHR | U::STORAGE_BUFFER | U::SHADER_DEVICE_ADDRESS
            }
            BufferKind::Device if context.has_ray_queries() => {
                common | U::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR | U::SHADER_DEVICE_ADDRESS
            }
            _ => common,
        };
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the info is complete.
        let handle = unsafe { context.device().create_buffer(&info, None) }
            .map_err(|result| context.error(&format!("creating {label}"), result))?;
        let mut raw =
            RawBuffer { context: context.clone(), handle, memory: None, label: label.to_owned(), bytes, kind };
        let location = match kind {
            BufferKind::Device | BufferKind::Structure => MemoryLocation::GpuOnly,
            BufferKind::Upload => MemoryLocation::CpuToGpu,
            BufferKind::Readback => MemoryLocation::GpuToCpu,
        };
        raw.memory = Some(Memory::bind(context, label, &Owner::Buffer(handle, location))?);
        context.set_name(handle, label);
        Ok(Self { raw: Arc::new(raw) })
    }

    /// Size in bytes: the requested size rounded up to 4, at least 16.
    pub fn bytes(&self) -> u64 {
        self.raw.bytes
    }

    /// Bytes that the driver allocated for it.
    pub fn allocated_bytes(&self) -> u64 {
        self.memory().bytes()
    }

    /// The handle for a host's own commands, valid as long as the buffer lives.
    pub fn handle(&self) -> vk::Buffer {
        self.raw.handle
    }

    /// The address for acceleration structures, on a context with ray queries.
    pub(in crate::vk) fn address(&self) -> u64 {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw.handle);
        // SAFETY: the buffer is alive, and its usage allows it wherever there are ray queries.
        unsafe { self.raw.context.device().get_buffer_device_address(&info) }
    }

    pub fn label(&self) -> &str {
        &self.raw.label
    }

    fn memory(&self) -> &Memory {
        self.raw.memory.as_ref().expect("bound at creation")
    }

    /// Writes `data` at byte `offset` of an upload buffer. The next submission sees it. A submission in flight that
    /// reads the buffer would see a mixture, so frames in flight use separate buffers.
    pub fn write<T: Pod>(&self, offset: u64, data: &[T]) {
        let source: &[u8] = bytemuck::cast_slice(data);
        let label = self.label();
        assert_eq!(self.raw.kind, BufferKind::Upload, "{label} is not an upload buffer");
        let end = offset.checked_add(source.len() as u64);
        assert!(end.is_some_and(|end| end <= self.bytes()), "write past the end of {label}");
        // SAFETY: in bounds by the line above; the mapping lives as long as the buffer.
        unsafe {
            let target = self.memory().mapped().add(offset as usize);
            std::ptr::copy_nonoverlapping(source.as_ptr(), target, source.len());
        }
    }

    /// The whole content of a readback buffer as elements of `T`; a remainder that is too short is dropped.
    pub fn read<T: Pod>(&self) -> Vec<T> {
        let count = self.bytes() as usize / size_of::<T>();
        self.read_some(0, count)
    }

    /// `count` elements of `T` from byte `offset` of a readback buffer. The caller has waited for the commands that
    /// wrote them.
    pub fn read_some<T: Pod>(&self, offset: u64, count: usize) -> Vec<T> {
        let label = self.label();
        assert_eq!(self.raw.kind, BufferKind::Readback, "{label} is not a readback buffer");
        let mut data = vec![T::zeroed(); count];
        let target: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        let end = offset.checked_add(target.len() as u64);
        assert!(end.is_some_and(|end| end <= self.bytes()), "read past the end of {label}");
        // SAFETY: in bounds by the line above; the mapping lives as long as the buffer.
        unsafe {
            let source = self.memory().mapped().add(offset as usize);
            std::ptr::copy_nonoverlapping(source, target.as_mut_ptr(), target.len());
        }
        data
    }
}
