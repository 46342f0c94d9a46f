//! Transfers between the CPU and device-local resources outside of frames. Each call waits.

use super::recorder::{Recorder, RecorderOptions};
use crate::Result;
use crate::vk::device::context::Context;
use crate::vk::resource::buffer::{Buffer, BufferKind};
use crate::vk::resource::image::{Image, ImageRegion};
use bytemuck::Pod;
use std::sync::Arc;

/// Records, submits and waits.
fn once(context: &Arc<Context>, record: impl FnOnce(&mut Recorder)) -> Result<()> {
    let mut recorder = Recorder::new(context, RecorderOptions::default())?;
    record(&mut recorder);
    recorder.finish().map(drop)
}

/// A new device-local buffer with the content `data`.
pub fn upload<T: Pod>(context: &Arc<Context>, label: &str, data: &[T]) -> Result<Buffer> {
    let bytes = size_of_val(data) as u64;
    let target = Buffer::new(context, label, bytes, BufferKind::Device)?;
    upload_into(context, &target, data)?;
    Ok(target)
}

/// Writes `data` to the start of a device-local buffer.
pub fn upload_into<T: Pod>(context: &Arc<Context>, target: &Buffer, data: &[T]) -> Result<()> {
    upload_at(context, target, 0, data)
}

/// Writes `data` to a device-local buffer from byte `first`.
pub fn upload_at<T: Pod>(context: &Arc<Context>, target: &Buffer, first: u64, data: &[T]) -> Result<()> {
    let bytes = size_of_val(data) as u64;
    if bytes == 0 {
        return Ok(());
    }
    let staging = Buffer::new(context, "staging", bytes, BufferKind::Upload)?;
    staging.write(0, data);
    once(context, |r| r.copy_range(staging.at(0), target.at(first), bytes))
}

/// The content of `buffer` as elements of `T`; a remainder that is too short is dropped.
pub fn download<T: Pod>(context: &Arc<Context>, buffer: &Buffer) -> Result<Vec<T>> {
    let staging = Buffer::new(context, "readback", buffer.bytes(), BufferKind::Readback)?;
    once(context, |r| r.copy(buffer, &staging))?;
    Ok(staging.read())
}

/// Writes `texels` (layer by layer, slice by slice, row by row) into a region of `image`.
pub fn upload_image<T: Pod>(context: &Arc<Context>, image: &Image, region: ImageRegion, texels: &[T]) -> Result<()> {
    let bytes = size_of_val(texels) as u64;
    let staging = Buffer::new(context, "staging", bytes, BufferKind::Upload)?;
    staging.write(0, texels);
    once(context, |r| r.copy_buffer_to_image(&staging, 0, image, region))
}

/// All texels of one level: layer by layer, slice by slice, row by row. `T` is one texel.
pub fn download_image<T: Pod>(context: &Arc<Context>, image: &Image, level: u32) -> Result<Vec<T>> {
    let region = ImageRegion::level(image, level);
    let texels = region.extent.iter().product::<u32>() as usize * region.layers as usize;
    let bytes = (texels * size_of::<T>()) as u64;
    let staging = Buffer::new(context, "readback", bytes, BufferKind::Readback)?;
    once(context, |r| r.copy_image_to_buffer(image, region, &staging, 0))?;
    Ok(staging.read_some(0, texels))
}
