//! A device that a host made.

use super::context::{Context, Telling};
use super::features::{Features, required_extensions};
use super::needs::{Capabilities, serves};
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::Allocator;
use std::ffi::CStr;
use std::sync::{Arc, Mutex};

/// A device that a host made, with what the host enabled. Nothing of it is ever destroyed here.
pub struct HostDevice<'a> {
    pub instance: ash::Instance,
    /// The `apiVersion` that the instance was made with.
    pub api_version: u32,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    /// Of the command buffers to record into, and of `queue`: graphics, compute and timestamps.
    pub queue_family: u32,
    /// Only what submits by itself uses it: [`crate::vk::upload`], [`crate::vk::download`] and their like, and a
    /// [`crate::vk::Recorder`] of its own. The mutex is locked during each submission, and a host locks it for its own
    /// use of this queue. Without a queue a host records copies into its own command buffers instead.
    pub queue: Option<Arc<Mutex<vk::Queue>>>,
    /// Where memory comes from; without it an allocator is made. It is locked while a resource is made or dropped. With
    /// ray queries it gives memory for buffers with addresses (`AllocatorCreateDesc::buffer_device_address`).
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// For every pipeline made here; it must not be externally synchronised. Without it none is used.
    pub pipeline_cache: Option<vk::PipelineCache>,
    /// Those enabled. With `VK_EXT_debug_utils` among them, objects and passes have names in messages and captures.
    pub instance_extensions: &'a [&'a CStr],
    /// Those enabled: at least [`required_extensions`]; `grid.conservative = hardware` needs
    /// `VK_EXT_conservative_rasterization`, and rays are the device's own queries only with
    /// [`ray_query_extensions`](crate::host::ray_query_extensions).
    pub device_extensions: &'a [&'a CStr],
    /// Those enabled: at least [`required_features`](crate::host::required_features);
    /// `grid.conservative = geometry-shader`, which the talk's presets set, needs `geometry_shader`. Rays are the
    /// device's own queries only with `buffer_device_address`, `acceleration_structure` and `ray_query`, all three;
    /// else they go through the tree. With `robust_buffer_access`, as devices that are opened here have it, a shader
    /// that leaves a buffer reads and writes no other memory.
    pub features: Features,
}

impl Context {
    /// A context over a host's device.
    ///
    /// # Errors
    /// `Error::Device` names in one sentence what the device lacks, or what the host did not enable.
    ///
    /// # Safety
    /// - The handles are valid and belong together, and the extensions and features are enabled as stated.
    /// - They outlive the context, which lives as long as anything made with it. So does the loaded Vulkan library.
    /// - The host uses `queue` only while it holds the mutex, and makes no call to this library while it holds that
    ///   mutex or the allocator's.
    pub unsafe fn adopt(host: HostDevice<'_>) -> Result<Arc<Self>> {
        let capabilities = Capabilities::query(&host.instance, host.api_version, host.physical_device);
        check(&host, &capabilities)?;
        Self::assemble(host, capabilities, None, Telling::Nothing)
    }
}

/// Required features and limits that `physical_device` lacks, by the specification's names; empty where it will do. For
/// a host that chooses among devices, before it makes one. `api_version`: the version that the instance was made with.
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
