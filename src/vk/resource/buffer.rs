//! Buffers: device-local ones for the passes, mapped ones to bring data in and out.

use super::memory::{Memory, Owner, mebibytes};
use crate::vk::device::context::Context;
use crate::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// Which side reads and writes a buffer's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferKind {
    /// Only the device.
    Device,
    /// Only the device, as an acceleration structure or as memory in which one is built.
    Structure,
    /// Written by the CPU, mapped for good.
    Upload,
    /// Read by the CPU, mapped for good.
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

/// A buffer and its memory. Recorded commands keep what they use alive, so it may be dropped at any time.
pub struct Buffer {
    pub(in crate::vk) raw: Arc<RawBuffer>,
}

/// A byte of a buffer.
#[derive(Clone, Copy)]
pub struct BufferAt<'a> {
    pub buffer: &'a Buffer,
    pub offset: u64,
}

impl Buffer {
    /// The byte `offset` of it.
    pub fn at(&self, offset: u64) -> BufferAt<'_> {
        BufferAt { buffer: self, offset }
    }

    /// A buffer of `bytes` bytes (at least 16 are made, so that empty data can be bound), usable as storage, uniform,
    /// indirect, index, vertex and transfer buffer.
    ///
    /// `Error::Memory` when it is larger than `maxStorageBufferRange` or than what the device has left.
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

    /// Size in bytes: what was asked for, rounded up to 4, at least 16.
    pub fn bytes(&self) -> u64 {
        self.raw.bytes
    }

    /// Bytes that the driver allocated for it.
    pub fn allocated_bytes(&self) -> u64 {
        self.memory().bytes()
    }

    /// For a host's own commands; valid as long as the buffer lives.
    pub fn handle(&self) -> vk::Buffer {
        self.raw.handle
    }

    /// Where it stands, for acceleration structures: of a context with ray queries.
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

    /// Writes `data` at byte `offset`. Upload buffers only. The next submission sees it; one that is still in flight
    /// and reads the buffer would see a mixture, so frames in flight take a buffer each.
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

    /// All of it as elements of `T`; a rest too short for one is left out. Readback buffers only.
    pub fn read<T: Pod>(&self) -> Vec<T> {
        let count = self.bytes() as usize / size_of::<T>();
        self.read_some(0, count)
    }

    /// `count` elements of `T` from byte `offset` on. Readback buffers only. What wrote them is over: it was waited
    /// for, or polled.
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
