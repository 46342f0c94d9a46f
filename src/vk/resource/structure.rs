//! Acceleration structures: the driver's form of triangles for ray queries. A lower structure contains the triangles,
//! and an upper one, at which queries begin, contains the lower one.

use super::buffer::{Buffer, BufferKind};
use crate::Result;
use crate::vk::device::context::Context;
use ash::vk;
use std::sync::Arc;

/// Description of the triangles of a structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StructureDesc {
    /// The number of opaque triangles, which come first.
    pub opaque: u32,
    /// The number of triangles that a query reports individually, so that a shader may let the ray pass.
    pub translucent: u32,
    /// Whether they move: then the structure is optimised for fast builds, else for fast tracing.
    pub moving: bool,
}

/// Bytes of the lower structure, of the upper one, and of the memory for building both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StructureSize {
    pub triangles: u64,
    pub top: u64,
    pub scratch: u64,
}

/// The triangles: three indices each, and corners of three f32.
#[derive(Clone, Copy)]
pub struct TriangleCorners<'a> {
    pub indices: &'a Buffer,
    pub positions: &'a Buffer,
}

pub(in crate::vk) struct RawStructure {
    context: Arc<Context>,
    handle: vk::AccelerationStructureKHR,
    pub(in crate::vk) label: String,
    /// The memory of the structure.
    memory: Buffer,
}

impl Drop for RawStructure {
    fn drop(&mut self) {
        if self.context.device_to_destroy_with().is_some() {
            // SAFETY: nothing in flight refers to it; see `Memory::drop`.
            unsafe { functions(&self.context).destroy_acceleration_structure(self.handle, None) };
        }
    }
}

/// Acceleration structures with the memory for building them. They are empty until
/// [`Recorder::build`](crate::vk::Recorder::build).
pub struct Structure {
    desc: StructureDesc,
    pub(in crate::vk) triangles: Arc<RawStructure>,
    pub(in crate::vk) top: Arc<RawStructure>,
    /// The single instance of the triangles in the upper structure.
    pub(in crate::vk) instance: Buffer,
    pub(in crate::vk) scratch: Buffer,
}

/// The functions. Panics if they are not enabled, which is a mistake in the program.
pub(in crate::vk) fn functions(context: &Context) -> &ash::khr::acceleration_structure::Device {
    context.structures.as_ref().expect("ray queries are enabled")
}

/// The input for building one of the two structures.
#[derive(Default)]
pub(in crate::vk) struct StructureInput {
    geometries: Vec<vk::AccelerationStructureGeometryKHR<'static>>,
    ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
    kind: vk::AccelerationStructureTypeKHR,
    flags: vk::BuildAccelerationStructureFlagsKHR,
}

impl StructureInput {
    pub(in crate::vk) fn info(&self) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.kind)
            .flags(self.flags)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(&self.geometries)
    }

    pub(in crate::vk) fn ranges(&self) -> &[vk::AccelerationStructureBuildRangeInfoKHR] {
        &self.ranges
    }

    fn size(&self, context: &Context) -> (u64, u64) {
        let counts: Vec<u32> = self.ranges.iter().map(|range| range.primitive_count).collect();
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        let device = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        // SAFETY: there is a count for each geometry.
        unsafe {
            functions(context).get_acceleration_structure_build_sizes(device, &self.info(), &counts, &mut sizes);
        }
        (sizes.acceleration_structure_size, sizes.build_scratch_size)
    }
}

impl StructureDesc {
    /// Bytes of an instance.
    pub const INSTANCE: u64 = 64;

    /// The sizes of the structures, on a context with ray queries.
    pub fn size(&self, context: &Context) -> StructureSize {
        let ((triangles, own), (top, over)) = (self.parts(None).size(context), self.top(0).size(context));
        // Alignment of the memory for building.
        let aligned = context.capabilities.scratch_alignment;
        StructureSize { triangles, top, scratch: own.max(over) + aligned }
    }

    /// The triangles as input; without `corners` only their number.
    pub(in crate::vk) fn parts(&self, corners: Option<&TriangleCorners>) -> StructureInput {
        let address = |buffer: fn(&TriangleCorners<'_>) -> u64| vk::DeviceOrHostAddressConstKHR {
            device_address: corners.map_or(0, buffer),
        };
        let count = corners.map_or(3, |corners| (corners.positions.bytes() / 12) as u32);
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
            .vertex_format(vk::Format::R32G32B32_SFLOAT)
            .vertex_data(address(|corners| corners.positions.address()))
            .vertex_stride(12)
            .max_vertex(count - 1)
            .index_type(vk::IndexType::UINT32)
            .index_data(address(|corners| corners.indices.address()));
        use vk::GeometryFlagsKHR as F;
        let geometry = |flags| {
            vk::AccelerationStructureGeometryKHR::default()
                .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
                .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
                .flags(flags)
        };
        let range = |count: u32, first: u32| {
            let range = vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count);
            range.primitive_offset(12 * first)
        };
        let flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;
        StructureInput {
            // A shader sees each translucent triangle only once.
            geometries: vec![geometry(F::OPAQUE), geometry(F::NO_DUPLICATE_ANY_HIT_INVOCATION)],
            ranges: vec![range(self.opaque, 0), range(self.translucent, self.opaque)],
            kind: vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            flags: if self.moving { vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_BUILD } else { flags },
        }
    }

    /// The upper structure's input: the instance at that address.
    pub(in crate::vk) fn top(&self, instance: u64) -> StructureInput {
        let data = vk::DeviceOrHostAddressConstKHR { device_address: instance };
        let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(data);
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances });
        StructureInput {
            geometries: vec![geometry],
            ranges: vec![vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(1)],
            kind: vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            flags: vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE,
        }
    }
}

impl RawStructure {
    fn new(context: &Arc<Context>, label: &str, bytes: u64, kind: vk::AccelerationStructureTypeKHR) -> Result<Self> {
        let memory = Buffer::new(context, label, bytes, BufferKind::Structure)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(memory.handle()).size(bytes).ty(kind);
        // SAFETY: the buffer has the required size.
        let handle = unsafe { functions(context).create_acceleration_structure(&info, None) }
            .map_err(|result| context.error(&format!("creating {label}"), result))?;
        context.set_name(handle, label);
        Ok(Self { context: context.clone(), handle, label: label.to_owned(), memory })
    }

    pub(in crate::vk) fn handle(&self) -> vk::AccelerationStructureKHR {
        self.handle
    }

    fn address(&self) -> u64 {
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(self.handle);
        // SAFETY: the structure is alive.
        unsafe { functions(&self.context).get_acceleration_structure_device_address(&info) }
    }
}

impl Structure {
    /// As [`Structure::new`], without writing the instance.
    pub(in crate::vk) fn unwritten(context: &Arc<Context>, desc: StructureDesc) -> Result<Self> {
        let size = desc.size(context);
        use vk::AccelerationStructureTypeKHR as T;
        let triangles = RawStructure::new(context, "acceleration structure", size.triangles, T::BOTTOM_LEVEL)?;
        let instance = Buffer::new(context, "acceleration instance", StructureDesc::INSTANCE, BufferKind::Device)?;
        Ok(Self {
            desc,
            triangles: Arc::new(triangles),
            top: Arc::new(RawStructure::new(context, "acceleration top", size.top, T::TOP_LEVEL)?),
            instance,
            scratch: Buffer::new(context, "acceleration scratch", size.scratch, BufferKind::Structure)?,
        })
    }

    /// The instance in the device's format, with an identity transform.
    pub(in crate::vk) fn instance_words(&self) -> [[u32; 4]; 4] {
        // The rows of the matrix are (1 0 0 0), (0 1 0 0), (0 0 1 0), followed by number and mask, without flags.
        let one = 1f32.to_bits();
        let address = self.triangles.address();
        [[one, 0, 0, 0], [0, one, 0, 0], [0, 0, one, 0], [0xff00_0000, 0, address as u32, (address >> 32) as u32]]
    }

    pub fn desc(&self) -> &StructureDesc {
        &self.desc
    }

    /// Bytes of both structures.
    pub fn bytes(&self) -> u64 {
        self.triangles.memory.bytes() + self.top.memory.bytes()
    }
}
