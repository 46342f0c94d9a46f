//! Samplers.

use crate::Result;
use crate::vk::device::context::Context;
use ash::vk;
use std::sync::Arc;

pub(in crate::vk) struct RawSampler {
    context: Arc<Context>,
    pub(in crate::vk) handle: vk::Sampler,
}

impl Drop for RawSampler {
    fn drop(&mut self) {
        if let Some(device) = self.context.device_to_destroy_with() {
            // SAFETY: nothing in flight refers to it; see `Memory::drop`.
            unsafe { device.destroy_sampler(self.handle, None) };
        }
    }
}

/// The filtering and addressing of image reads.
pub struct Sampler {
    pub(in crate::vk) raw: Arc<RawSampler>,
}

impl Sampler {
    /// A sampler with `filter` for texels and levels, and `address` for all three axes. A border is transparent black;
    /// every level may be read.
    pub fn new(context: &Arc<Context>, filter: vk::Filter, address: vk::SamplerAddressMode) -> Result<Self> {
        let linear = filter == vk::Filter::LINEAR;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(if linear { vk::SamplerMipmapMode::LINEAR } else { vk::SamplerMipmapMode::NEAREST })
            .address_mode_u(address)
            .address_mode_v(address)
            .address_mode_w(address)
            .border_color(vk::BorderColor::FLOAT_TRANSPARENT_BLACK)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: the info is complete.
        let handle = unsafe { context.device().create_sampler(&info, None) }
            .map_err(|result| context.error("creating a sampler", result))?;
        Ok(Self { raw: Arc::new(RawSampler { context: context.clone(), handle }) })
    }
}
