//! A device that presents to a window. It draws an image and a panel, so it need not meet the requirements of passes.

use super::choose::open;
use super::context::{Context, Telling};
use super::features::Features;
use super::host::HostDevice;
use super::instance::{Instance, VERSION};
use super::needs::{Capabilities, serves};
use crate::{Error, Result};
use ash::{khr, vk};
use gpu_allocator::vulkan::Allocator;
use std::ffi::c_char;
use std::sync::{Arc, Mutex};

/// The surface of a window, and a device that presents to it. Swapchains are destroyed before this.
pub struct Presenter {
    pub surface: vk::SurfaceKHR,
    pub surfaces: khr::surface::Instance,
    pub swapchains: khr::swapchain::Device,
    pub physical: vk::PhysicalDevice,
    pub queue: vk::Queue,
    pub queue_family: u32,
    /// The allocator of the context. It is declared before the context, which destroys the device and the surface.
    pub allocator: Arc<Mutex<Allocator>>,
    pub context: Arc<Context>,
}

impl Presenter {
    /// The device called `name` if it presents to the window, else the first one that does. `extensions` are those that
    /// the instance needs for `surface`, which creates the surface of the window.
    ///
    /// # Errors
    /// One sentence: there is no loader, or no device that presents.
    pub fn new(
        name: &str,
        validation: bool,
        extensions: &[*const c_char],
        surface: impl FnOnce(&ash::Entry, &ash::Instance) -> std::result::Result<vk::SurfaceKHR, vk::Result>,
    ) -> Result<Self> {
        let failed = |result: vk::Result| Error::Device(format!("Vulkan cannot present to this display: {result}"));
        let mut instance = Instance::new(validation, extensions)?;
        let surface = surface(&instance.entry, &instance.raw).map_err(failed)?;
        let surfaces = khr::surface::Instance::new(&instance.entry, &instance.raw);
        instance.surface = Some((surfaces.clone(), surface));
        let mut found = vec![];
        for physical in instance.physical_devices()? {
            let capabilities = Capabilities::query(&instance.raw, VERSION, physical);
            if !capabilities.is_1_3() || !capabilities.has_extension(khr::swapchain::NAME) {
                continue;
            }
            // SAFETY: the handle comes from this instance.
            let families = unsafe { instance.raw.get_physical_device_queue_family_properties(physical) };
            // SAFETY: as above; the surface is alive.
            let presents = |family| unsafe { surfaces.get_physical_device_surface_support(physical, family, surface) };
            let family = (0..)
                .zip(families)
                .find(|(family, properties)| serves(properties) && presents(*family).unwrap_or(false));
            found.extend(family.map(|(family, _)| (physical, family, capabilities)));
        }
        let (physical, queue_family, capabilities) =
            found.into_iter().min_by_key(|(.., capabilities)| capabilities.name() != name).ok_or_else(|| {
                Error::Device(
                    "no device that twobounce can use presents to this display; render images with `twobounce render`"
                        .into(),
                )
            })?;
        let features = Features { dynamic_rendering: true, synchronization2: true, ..Features::default() };
        let host = open(&instance, physical, queue_family, &[khr::swapchain::NAME], features).map_err(failed)?;
        let swapchains = khr::swapchain::Device::new(&instance.raw, &host.device);
        // SAFETY: the family has the queue that `open` requested.
        let queue = unsafe { host.device.get_device_queue(queue_family, 0) };
        // One pipeline for the panel does not need a cache file.
        let host = HostDevice { pipeline_cache: Some(vk::PipelineCache::null()), ..host };
        let context = Context::assemble(host, capabilities, Some(instance), Telling::Nothing)?;
        let allocator = Arc::clone(&context.allocator);
        Ok(Self { surface, surfaces, swapchains, physical, queue, queue_family, allocator, context })
    }
}
