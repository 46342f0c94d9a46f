//! The device on which everything runs.

use super::choose::{choose, open};
use super::features::ray_query_extensions;
use super::functions::with_promoted;
use super::host::HostDevice;
use super::instance::{DeviceKind, Instance, heap_budgets, lock, version_of};
use super::label::Labels;
use super::needs::Capabilities;
use super::pipeline_cache::PipelineCache;
use super::pipelines::Pipelines;
use super::submit::{CommandSet, immediate, record_image_barrier};
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::any::Any;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Options of a [`Context`].
#[derive(Clone, Debug, Default)]
pub struct ContextOptions {
    /// A part of a device's name, or its index in `twobounce info`. By default the variable `TWOBOUNCE_DEVICE`, then
    /// the best device that meets the requirements (discrete, integrated, virtual, CPU).
    pub device: Option<String>,
    /// Whether to run under the validation layer, with synchronisation validation.
    pub validation: bool,
}

/// Additional information from the pipelines of a context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::vk) enum Telling {
    Nothing,
    /// Counts of their reads.
    Reads,
    /// The driver's statistics of their programs.
    Executables,
}

/// An image without a layout, and the barrier that brings it into one.
pub(in crate::vk) type FirstTransition = (Weak<dyn Any + Send + Sync>, vk::ImageMemoryBarrier2<'static>);

/// A logical device with one queue, its limits, its pipeline cache and its memory allocator.
pub struct Context {
    pub name: String,
    /// The driver's name and its own description of its version.
    pub driver: String,
    /// (major, minor, patch)
    pub api_version: (u32, u32, u32),
    pub is_cpu: bool,
    /// Whether pipelines count their reads: see [`Context::counting`].
    pub(in crate::vk) counting: bool,
    /// The extension that describes pipelines: see [`Context::describing`].
    pub(in crate::vk) executable_properties: Option<ash::khr::pipeline_executable_properties::Device>,
    /// Whether the driver loses descriptors in loops: see `src/vk/pipeline/early.rs`.
    pub(in crate::vk) loses_descriptors: bool,
    #[cfg_attr(not(internals), doc(hidden))]
    pub limits: vk::PhysicalDeviceLimits,
    /// Whether `VK_EXT_conservative_rasterization` is enabled, for [`RasterDesc::conservative`](crate::vk::RasterDesc).
    #[cfg_attr(not(internals), doc(hidden))]
    pub conservative_rasterization: bool,
    /// Whether geometry shaders are enabled.
    #[cfg_attr(not(internals), doc(hidden))]
    pub geometry_shader: bool,
    /// The extension of acceleration structures, if it and ray queries are enabled.
    pub(in crate::vk) structures: Option<ash::khr::acceleration_structure::Device>,
    pub(in crate::vk) allocated: AtomicU64,
    /// The allocator, which is dropped before the device.
    pub(in crate::vk) allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    /// Whether a wait timed out. The device may still be at work then, so its objects must not be destroyed.
    pub(in crate::vk) stuck: AtomicBool,
    lost: AtomicBool,
    /// For tests: makes the next submission report a lost device.
    loses: AtomicBool,
    queue: Option<Arc<Mutex<vk::Queue>>>,
    pub(in crate::vk) queue_family: u32,
    pub(in crate::vk) commands: Mutex<Vec<CommandSet>>,
    /// Without a queue: images that the next recording transitions.
    untransitioned: Mutex<Vec<FirstTransition>>,
    pub(in crate::vk) pipeline_cache: PipelineCache,
    pub(in crate::vk) pipelines: Pipelines,
    pub(in crate::vk) push_descriptor: ash::khr::push_descriptor::Device,
    pub(in crate::vk) debug_utils: Option<ash::ext::debug_utils::Device>,
    pub(in crate::vk) labels: Labels,
    pub(in crate::vk) capabilities: Capabilities,
    pub(in crate::vk) physical: vk::PhysicalDevice,
    device: ash::Device,
    pub(in crate::vk) instance: ash::Instance,
    /// The instance, if it and the device were created here. They are destroyed with the context; those of a host are
    /// not.
    own: Option<Instance>,
}

impl Context {
    /// Finds the device and opens it. `Error::Device` says in one sentence what is missing and how to get it.
    pub fn new(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::with(options, Telling::Nothing)
    }

    /// A device on which shaders with counters (`glsl/common/count.glsl`) count their reads for each zone. Frames are
    /// slower, and images are the same. The counts are part of the zones' times.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn counting(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::with(options, Telling::Reads)
    }

    /// A device whose driver keeps statistics of pipelines if it can, for [`Context::executables`]. It may then
    /// recompile pipelines that are in its cache. The pipelines are the same.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn describing(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::with(options, Telling::Executables)
    }

    fn with(options: &ContextOptions, asked: Telling) -> Result<Arc<Self>> {
        let instance = Instance::new(options.validation, &[])?;
        let (physical, capabilities) = choose(&instance, options.device.as_deref())?;
        let name = capabilities.name();
        let queue_family = capabilities.queue_family.expect("checked among the needs");
        let mut extensions = capabilities.enabled_extensions();
        let describes = asked == Telling::Executables && capabilities.describes_executables;
        let telling = if asked == Telling::Executables && !describes { Telling::Nothing } else { asked };
        if describes {
            extensions.push(ash::khr::pipeline_executable_properties::NAME);
        }
        let host = open(&instance, physical, queue_family, &extensions, capabilities.enabled_features()).map_err(
            |result| {
                Error::Device(format!(
                    "{name} cannot be opened ({result}): check its driver with vulkaninfo, or choose another device"
                ))
            },
        )?;
        Self::assemble(host, capabilities, Some(instance), telling)
    }

    /// The number of pipelines compiled so far.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn compiled_pipelines(&self) -> u64 {
        self.pipelines.compiled()
    }

    /// The number of pipelines compiled so far if the pipeline cache was empty at the start, else `None`. Compiling
    /// takes long, but only once.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn compiled_anew(&self) -> Option<u64> {
        Some(self.compiled_pipelines()).filter(|_| self.pipeline_cache.is_cold())
    }

    /// A context over a device that meets all requirements: a host's, or one of `own`.
    pub(in crate::vk) fn assemble(
        host: HostDevice<'_>,
        capabilities: Capabilities,
        own: Option<Instance>,
        telling: Telling,
    ) -> Result<Arc<Self>> {
        let HostDevice { instance, physical_device: physical, queue, queue_family, .. } = host;
        let name = capabilities.name();
        let device = if capabilities.is_1_3() { host.device } else { with_promoted(&instance, host.device.handle()) };
        let queries = host.features.has_queries()
            && ray_query_extensions().iter().all(|name| host.device_extensions.contains(name));
        let allocator = match host.allocator {
            Some(shared) => shared,
            None => match allocator(&name, &allocator_desc(&instance, physical, &device, queries)) {
                Ok(allocator) => Arc::new(Mutex::new(allocator)),
                Err(error) => {
                    if own.is_some() {
                        // SAFETY: nothing was made with the device yet.
                        unsafe { device.destroy_device(None) };
                    }
                    return Err(error);
                }
            },
        };
        let pipeline_cache = match (&own, host.pipeline_cache) {
            (Some(_), None) => PipelineCache::open(&device, &capabilities),
            (_, given) => PipelineCache::of_host(given.unwrap_or_default()),
        };
        let debug_utils = host.instance_extensions.contains(&ash::ext::debug_utils::NAME);
        let enabled = |name| host.device_extensions.contains(&name);
        Ok(Arc::new(Self {
            driver: capabilities.driver.clone(),
            api_version: version_of(&capabilities.properties),
            counting: telling == Telling::Reads,
            executable_properties: (telling == Telling::Executables)
                .then(|| ash::khr::pipeline_executable_properties::Device::new(&instance, &device)),
            is_cpu: DeviceKind::of_type(capabilities.properties.device_type) == DeviceKind::Cpu,
            loses_descriptors: capabilities.loses_descriptors,
            limits: capabilities.properties.limits,
            conservative_rasterization: enabled(ash::ext::conservative_rasterization::NAME),
            geometry_shader: host.features.geometry_shader,
            structures: queries.then(|| ash::khr::acceleration_structure::Device::new(&instance, &device)),
            allocated: AtomicU64::new(0),
            allocator: ManuallyDrop::new(allocator),
            stuck: AtomicBool::new(false),
            lost: AtomicBool::new(false),
            loses: AtomicBool::new(false),
            queue,
            untransitioned: Mutex::default(),
            queue_family,
            commands: Mutex::default(),
            pipeline_cache,
            pipelines: Pipelines::default(),
            push_descriptor: ash::khr::push_descriptor::Device::new(&instance, &device),
            debug_utils: debug_utils.then(|| ash::ext::debug_utils::Device::new(&instance, &device)),
            labels: Labels::default(),
            name,
            capabilities,
            physical,
            device,
            instance,
            own,
        }))
    }

    #[cfg_attr(not(internals), doc(hidden))]
    pub fn device(&self) -> &ash::Device {
        &self.device
    }

    /// Whether the device's ray queries can trace rays: they are supported and enabled.
    pub fn has_ray_queries(&self) -> bool {
        self.structures.is_some()
    }

    /// Every error and warning of the validation layer so far, without performance advice. Empty on a host's device,
    /// whose own messenger receives them.
    pub fn validation_messages(&self) -> Vec<String> {
        self.own.as_ref().map_or_else(Vec::new, |own| lock(&own.messages).clone())
    }

    /// As [`Self::validation_messages`], and clears them.
    pub fn take_validation_messages(&self) -> Vec<String> {
        self.own.as_ref().map_or_else(Vec::new, |own| std::mem::take(&mut *lock(&own.messages)))
    }

    /// Drops the context and returns all of [`Self::validation_messages`], including those about its destruction if
    /// nothing else holds it.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn close(self: Arc<Self>) -> Vec<String> {
        let messages = self.own.as_ref().map(|own| own.messages.clone());
        drop(self);
        messages.map_or_else(Vec::new, |messages| lock(&messages).clone())
    }

    /// Bytes of device memory that are currently allocated from the driver.
    pub fn allocated_bytes(&self) -> u64 {
        self.allocated.load(Ordering::Relaxed)
    }

    /// Bytes that are still available in the largest device-local heap: as reported by the driver, or the heap's size
    /// minus the allocations of this context.
    pub fn memory_budget(&self) -> u64 {
        let heaps = self.capabilities.memory.memory_heaps_as_slice();
        let local = |&i: &usize| heaps[i].flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        let Some(largest) = (0..heaps.len()).filter(local).max_by_key(|&i| heaps[i].size) else { return 0 };
        match heap_budgets(&self.instance, self.physical, &self.capabilities) {
            Some(left) => left[largest],
            None => heaps[largest].size.saturating_sub(self.allocated_bytes()),
        }
    }

    /// The queue, which is locked for each submission.
    pub(in crate::vk) fn queue(&self) -> Result<&Mutex<vk::Queue>> {
        self.queue.as_deref().ok_or_else(|| {
            Error::Device(format!(
                "{} was handed over without a queue, so nothing can be uploaded, read back or submitted here: give \
                 HostDevice a queue, or record into a command buffer of your own",
                self.name
            ))
        })
    }

    /// Transitions a new image: now if there is a queue, else in the next recording.
    pub(in crate::vk) fn transition_first(self: &Arc<Self>, transition: FirstTransition) -> Result<()> {
        if self.queue.is_some() {
            return immediate(self, |commands| record_image_barrier(self, commands, transition.1));
        }
        self.untransitioned.lock().unwrap_or_else(PoisonError::into_inner).push(transition);
        Ok(())
    }

    /// Takes the images that still need a transition.
    pub(in crate::vk) fn take_untransitioned(&self) -> Vec<FirstTransition> {
        std::mem::take(&mut *self.untransitioned.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The device for destroying objects; `None` after a wait that timed out, when objects are left to the end of the
    /// process.
    pub(in crate::vk) fn device_to_destroy_with(&self) -> Option<&ash::Device> {
        (!self.stuck.load(Ordering::Relaxed)).then_some(&self.device)
    }

    /// Whether the device is lost. Another context may open it again.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// For tests: makes the next submission report a lost device.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn lose(&self) {
        self.loses.store(true, Ordering::Relaxed);
    }

    /// Whether this submission is that of [`Self::lose`].
    pub(in crate::vk) fn loses(&self) -> bool {
        self.loses.swap(false, Ordering::Relaxed)
    }

    /// The error for `result`, which was returned while `doing` something.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn error(&self, doing: &str, result: vk::Result) -> Error {
        match result {
            vk::Result::ERROR_DEVICE_LOST => {
                self.lost.store(true, Ordering::Relaxed);
                Error::Device(format!(
                    "{} was lost while {doing}: its driver gave up; ask for less at once, such as a smaller image, or \
                     choose another device",
                    self.name
                ))
            }
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => Error::Memory(format!(
                "{} ran out of memory while {doing}: ask for less, such as a smaller image",
                self.name
            )),
            other => Error::Device(format!("{} failed while {doing} ({other})", self.name)),
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        if self.stuck.load(Ordering::Relaxed) {
            if let Some(own) = &mut self.own {
                own.abandon();
            }
            return;
        }
        let commands = std::mem::take(&mut *self.commands.lock().unwrap_or_else(PoisonError::into_inner));
        // SAFETY: all other objects hold this context, so they no longer exist.
        unsafe {
            if self.own.is_some() {
                // An error here is a lost device, and destroying is still correct.
                let _ = self.device.device_wait_idle();
            }
            for set in commands {
                set.destroy(&self.device);
            }
            self.pipelines.close(&self.device);
            self.pipeline_cache.close(&self.device);
            ManuallyDrop::drop(&mut self.allocator);
            if self.own.is_some() {
                self.device.destroy_device(None);
            }
        }
    }
}

fn allocator(name: &str, desc: &AllocatorCreateDesc) -> Result<Allocator> {
    Allocator::new(desc).map_err(|error| Error::Device(format!("{name} gives no memory: {error}")))
}

/// `addresses` says whether buffers have device addresses.
fn allocator_desc(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    device: &ash::Device,
    addresses: bool,
) -> AllocatorCreateDesc {
    AllocatorCreateDesc {
        instance: instance.clone(),
        device: device.clone(),
        physical_device: physical,
        debug_settings: Default::default(),
        buffer_device_address: addresses,
        allocation_sizes: Default::default(),
    }
}
