//! Builds acceleration structures during recording.

use super::frame_log::CommandLog;
use super::recorder::Recorder;
use super::transfer::upload_into;
use crate::Result;
use crate::vk::device::context::Context;
use crate::vk::resource::structure::{
    RawStructure, Structure, StructureDesc, StructureInput, TriangleCorners, functions,
};
use ash::vk;
use std::sync::Arc;

impl Structure {
    /// A structure for the triangles of `desc`, on a context with ray queries.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: StructureDesc) -> Result<Self> {
        let structure = Self::unwritten(context, desc)?;
        upload_into(context, &structure.instance, structure.instance_words().as_flattened())?;
        Ok(structure)
    }
}

impl Recorder {
    /// Rebuilds a structure over the triangles that `corners` holds at that time, as many as it was created for. A
    /// barrier must follow before queries use it.
    pub fn build(&mut self, structure: &Structure, corners: &TriangleCorners<'_>) {
        let (scratch, aligned) = (structure.scratch.address(), self.context().capabilities.scratch_alignment);
        let scratch = scratch.next_multiple_of(aligned);
        let given = [corners.indices, corners.positions, &structure.scratch];
        self.build_one(&structure.triangles, &structure.desc().parts(Some(corners)), scratch);
        self.log_build(&structure.triangles, given.map(|buffer| buffer.label().to_owned()).into());
        self.full_barrier(); // the upper structure reads it, and is built in the same memory
        self.build_one(&structure.top, &structure.desc().top(structure.instance.address()), scratch);
        let given = [structure.instance.label(), structure.scratch.label(), &structure.triangles.label];
        self.log_build(&structure.top, given.map(str::to_owned).into());
        for buffer in [corners.indices, corners.positions, &structure.instance, &structure.scratch] {
            self.keep(buffer.raw.clone());
        }
        self.keep(structure.triangles.clone());
        self.keep(structure.top.clone());
    }

    fn build_one(&mut self, structure: &RawStructure, parts: &StructureInput, scratch: u64) {
        let scratch = vk::DeviceOrHostAddressKHR { device_address: scratch };
        let info = parts.info().dst_acceleration_structure(structure.handle()).scratch_data(scratch);
        // SAFETY: outside of a rendering scope; every buffer with an address is kept.
        unsafe {
            functions(self.context()).cmd_build_acceleration_structures(self.handle, &[info], &[parts.ranges()]);
        }
    }

    fn log_build(&mut self, structure: &RawStructure, uses: Vec<String>) {
        self.log(|| CommandLog::Build { structure: structure.label.clone(), uses });
    }
}
