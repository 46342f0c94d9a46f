//! A device that a host created.

use super::context::{Context, Telling};
use super::features::{Features, required_extensions};
use super::needs::{Capabilities, serves};
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::Allocator;
use std::ffi::CStr;
use std::sync::{Arc, Mutex};

/// A device that a host created, and what is enabled on it. This library never destroys it.
pub struct HostDevice<'a> {
    pub instance: ash::Instance,
    /// The `apiVersion` with which the instance was created.
    pub api_version: u32,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    /// The family of the command buffers for recording, and of `queue`. It supports graphics, compute and timestamps.
    pub queue_family: u32,
    /// The queue for functions that submit by themselves: [`crate::vk::upload`], [`crate::vk::download`] and similar
    /// ones, and a [`crate::vk::Recorder`] with its own command buffer. The mutex is locked during each submission, and
    /// the host locks it for its own use of this queue. Without a queue the host records copies into its own command
    /// buffers.
    pub queue: Option<Arc<Mutex<vk::Queue>>>,
    /// The allocator for memory; by default one is created. It is locked while a resource is created or dropped. With
    /// ray queries it supports buffers with addresses (`AllocatorCreateDesc::buffer_device_address`).
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// The cache for all pipelines, which must not be externally synchronised; by default there is none.
    pub pipeline_cache: Option<vk::PipelineCache>,
    /// Enabled instance extensions. With `VK_EXT_debug_utils`, objects and passes have names in messages and captures.
    pub instance_extensions: &'a [&'a CStr],
    /// Enabled device extensions: at least [`required_extensions`]. `grid.conservative = hardware` needs
    /// `VK_EXT_conservative_rasterization`, and ray queries need
    /// [`ray_query_extensions`](crate::host::ray_query_extensions).
    pub device_extensions: &'a [&'a CStr],
    /// Enabled features: at least [`required_features`](crate::host::required_features). `grid.conservative =
    /// geometry-shader`, which the talk's presets set, needs `geometry_shader`. Ray queries need
    /// `buffer_device_address`, `acceleration_structure` and `ray_query`; otherwise rays are traced through the tree.
    /// With `robust_buffer_access`, which devices opened here enable, a shader that exceeds a buffer accesses no other
    /// memory.
    pub features: Features,
}

impl Context {
    /// Creates a context over a host's device.
    ///
    /// # Errors
    /// `Error::Device` names in one sentence what the device lacks or the host did not enable.
    ///
    /// # Safety
    /// - The handles are valid and belong together, and the extensions and features are enabled as stated.
    /// - They outlive the context, which lives as long as any object made with it. So does the loaded Vulkan library.
    /// - The host uses `queue` only while it holds the mutex, and makes no call to this library while it holds that
    ///   mutex or the allocator's.
    pub unsafe fn adopt(host: HostDevice<'_>) -> Result<Arc<Self>> {
        let capabilities = Capabilities::query(&host.instance, host.api_version, host.physical_device);
        check(&host, &capabilities)?;
        Self::assemble(host, capabilities, None, Telling::Nothing)
    }
}

/// Required features and limits that `physical_device` lacks, by the specification's names; empty if it meets all. A
/// host calls this to choose a device before it creates one. `api_version` is the version with which the instance was
/// created.
///
/// # Safety
/// The handle comes from `instance`.
pub unsafe fn missing(instance: &ash::Instance, api_version: u32, physical_device: vk::PhysicalDevice) -> Vec<String> {
    Capabilities::query(instance, api_version, physical_device).missing()
}

fn check(host: &HostDevice<'_>, capabilities: &Capabilities) -> Result<()> {
    let name = capabilities.name();
    let version = capabilities.version;
    if version < vk::API_VERSION_1_2 {
        let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
        return Err(Error::Device(format!(
            "{name} is used with Vulkan {major}.{minor}, but 1.2 is needed: make the instance with that apiVersion, or \
             hand over a newer device"
        )));
    }
    let missing = capabilities.missing();
    if !missing.is_empty() {
        return Err(Error::Device(format!("{name} lacks {}: hand over another device", missing.join(", "))));
    }
    // SAFETY: the handle comes from this instance.
    let families = unsafe { host.instance.get_physical_device_queue_family_properties(host.physical_device) };
    let family = host.queue_family;
    if !families.get(family as usize).is_some_and(serves) {
        return Err(Error::Device(format!(
            "queue family {family} of {name} lacks graphics, compute or timestamps: hand over one that has all of them"
        )));
    }
    let features = host.features.required().filter(|(_, enabled)| !enabled).map(|(name, _)| name.to_owned());
    let extensions = required_extensions(version).into_iter().filter(|name| !host.device_extensions.contains(name));
    let disabled: Vec<_> = extensions.map(|name| name.to_string_lossy().into_owned()).chain(features).collect();
    if !disabled.is_empty() {
        return Err(Error::Device(format!(
            "the device handed over for {name} was made without {}: enable all that required_extensions and \
             required_features list",
            disabled.join(", ")
        )));
    }
    Ok(())
}
