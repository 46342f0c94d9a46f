//! The device that everything runs on.

use super::instance::{DeviceKind, Instance, heap_budgets};
use super::label::Labels;
use super::needs::Capabilities;
use super::pipeline_cache::PipelineCache;
use super::submit::CommandSet;
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// How to make a [`Context`].
#[derive(Clone, Debug, Default)]
pub struct ContextOptions {
    /// Part of a device's name, or its index in `twobounce info`. `None`: the variable `TWOBOUNCE_DEVICE`, then the
    /// best device that has what is needed (discrete, integrated, virtual, CPU).
    pub device: Option<String>,
    /// Run under the validation layer, with synchronisation validation.
    pub validation: bool,
}

/// A logical device with one queue, its limits, its pipeline cache and the account of its memory.
pub struct Context {
    pub name: String,
    /// The driver's name and its own description of its version.
    pub driver: String,
    /// (major, minor, patch)
    pub api_version: (u32, u32, u32),
    pub is_cpu: bool,
    /// Pipelines count what they read; see [`Context::counting`].
    pub(super) counting: bool,
    pub limits: vk::PhysicalDeviceLimits,
    pub(super) max_push_descriptors: u32,
    pub(super) max_allocation_bytes: u64,
    pub(super) allocated: AtomicU64,
    /// Dropped before the device.
    pub(super) allocator: ManuallyDrop<Mutex<Allocator>>,
    /// Set when a wait timed out: the device may still be at work, so nothing of it may be destroyed.
    pub(super) stuck: AtomicBool,
    pub(super) queue: Mutex<vk::Queue>,
    pub(super) queue_family: u32,
    pub(super) commands: Mutex<Vec<CommandSet>>,
    pub(super) pipeline_cache: PipelineCache,
    pub(super) functions: Functions,
    pub(super) labels: Labels,
    capabilities: Capabilities,
    physical: vk::PhysicalDevice,
    device: ash::Device,
    instance: Instance,
}

/// Entry points of extensions; dynamic rendering and barriers are core from Vulkan 1.3 on.
pub(super) struct Functions {
    pub(super) push_descriptor: ash::khr::push_descriptor::Device,
    pub(super) debug_utils: Option<ash::ext::debug_utils::Device>,
    dynamic_rendering: Option<ash::khr::dynamic_rendering::Device>,
    synchronization2: Option<ash::khr::synchronization2::Device>,
}

impl Context {
    /// Finds the device and opens it. `Error::Device` says in one sentence what is missing and how to get it.
    pub fn new(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::with(options, false)
    }

    /// A device on which every shader that can (`glsl/common/count.glsl`) counts what it reads, zone by zone: slower, and
    /// the same images. The counts come with the zones' times.
    pub fn counting(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::with(options, true)
    }

    fn with(options: &ContextOptions, counting: bool) -> Result<Arc<Self>> {
        let instance = Instance::new(options.validation)?;
        let (physical, capabilities) = choose(&instance, options.device.as_deref())?;
        let name = capabilities.name();
        let queue_family = capabilities.queue_family.expect("checked among the needs");
        let device = open(&instance.raw, physical, &capabilities, queue_family)
            .map_err(|result| Error::Device(format!("{name} cannot be opened ({result})")))?;
        let functions = Functions {
            push_descriptor: ash::khr::push_descriptor::Device::new(&instance.raw, &device),
            debug_utils: instance.debug_utils.then(|| ash::ext::debug_utils::Device::new(&instance.raw, &device)),
            dynamic_rendering: (!capabilities.is_1_3())
                .then(|| ash::khr::dynamic_rendering::Device::new(&instance.raw, &device)),
            synchronization2: (!capabilities.is_1_3())
                .then(|| ash::khr::synchronization2::Device::new(&instance.raw, &device)),
        };
        // SAFETY: the family has at least one queue, which `open` asked for.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        let version = capabilities.properties.api_version;
        let pipeline_cache = PipelineCache::open(&device, &capabilities);
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|error| Error::Device(format!("{name} gives no memory: {error}")))?;
        Ok(Arc::new(Self {
            driver: capabilities.driver.clone(),
            api_version: (
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version),
            ),
            counting,
            is_cpu: DeviceKind::of(capabilities.properties.device_type) == DeviceKind::Cpu,
            limits: capabilities.properties.limits,
            max_push_descriptors: capabilities.max_push_descriptors,
            max_allocation_bytes: capabilities.max_allocation_bytes,
            allocated: AtomicU64::new(0),
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            stuck: AtomicBool::new(false),
            queue: Mutex::new(queue),
            queue_family,
            commands: Mutex::default(),
            pipeline_cache,
            functions,
            labels: Labels::default(),
            name,
            capabilities,
            physical,
            device,
            instance,
        }))
    }

    pub fn device(&self) -> &ash::Device {
        &self.device
    }

    /// Every error and warning of the validation layer so far, advice on performance left out.
    pub fn validation_messages(&self) -> Vec<String> {
        self.instance.messages()
    }

    /// As [`Self::validation_messages`], and forgets them.
    pub fn take_validation_messages(&self) -> Vec<String> {
        self.instance.take_messages()
    }

    /// Bytes of device memory taken from the driver now.
    pub fn allocated_bytes(&self) -> u64 {
        self.allocated.load(Ordering::Relaxed)
    }

    /// Bytes that may still be taken from the largest heap of the device's own memory: by the driver's account where it
    /// keeps one, else the heap's size less what this context took.
    pub fn memory_budget(&self) -> u64 {
        let heaps = self.capabilities.memory.memory_heaps_as_slice();
        let local = |&i: &usize| heaps[i].flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        let Some(largest) = (0..heaps.len()).filter(local).max_by_key(|&i| heaps[i].size) else { return 0 };
        match heap_budgets(&self.instance.raw, self.physical, &self.capabilities) {
            Some(left) => left[largest],
            None => heaps[largest].size.saturating_sub(self.allocated_bytes()),
        }
    }

    /// Whether `format` can be used like `features` in optimally tiled images.
    pub fn supports(&self, format: vk::Format, features: vk::FormatFeatureFlags) -> bool {
        // SAFETY: the handle comes from this instance.
        let found = unsafe { self.instance.raw.get_physical_device_format_properties(self.physical, format) };
        found.optimal_tiling_features.contains(features)
    }

    /// The device to destroy things with; `None` after a wait that timed out, when they are left to the process's end.
    pub(super) fn device_to_destroy_with(&self) -> Option<&ash::Device> {
        (!self.stuck.load(Ordering::Relaxed)).then_some(&self.device)
    }

    /// The error to report when `result` came back while `doing` something.
    pub(super) fn error(&self, doing: &str, result: vk::Result) -> Error {
        match result {
            vk::Result::ERROR_DEVICE_LOST => Error::Device(format!(
                "{} was lost while {doing}: its driver gave up; try fewer voxels, a smaller image or another device \
                 with --device",
                self.name
            )),
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                Error::Memory(format!("{} ran out of memory while {doing}: use fewer voxels", self.name))
            }
            other => Error::Device(format!("{} failed while {doing} ({other})", self.name)),
        }
    }

    pub(super) unsafe fn cmd_begin_rendering(&self, commands: vk::CommandBuffer, info: &vk::RenderingInfo<'_>) {
        // SAFETY: the caller's.
        unsafe {
            match &self.functions.dynamic_rendering {
                Some(khr) => khr.cmd_begin_rendering(commands, info),
                None => self.device.cmd_begin_rendering(commands, info),
            }
        }
    }

    pub(super) unsafe fn cmd_end_rendering(&self, commands: vk::CommandBuffer) {
        // SAFETY: the caller's.
        unsafe {
            match &self.functions.dynamic_rendering {
                Some(khr) => khr.cmd_end_rendering(commands),
                None => self.device.cmd_end_rendering(commands),
            }
        }
    }

    pub(super) unsafe fn cmd_pipeline_barrier2(&self, commands: vk::CommandBuffer, info: &vk::DependencyInfo<'_>) {
        // SAFETY: the caller's.
        unsafe {
            match &self.functions.synchronization2 {
                Some(khr) => khr.cmd_pipeline_barrier2(commands, info),
                None => self.device.cmd_pipeline_barrier2(commands, info),
            }
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        if self.stuck.load(Ordering::Relaxed) {
            self.instance.abandon();
            return;
        }
        let commands = std::mem::take(&mut *self.commands.lock().unwrap_or_else(PoisonError::into_inner));
        // SAFETY: every other object of the device holds this context, so all of them are gone.
        unsafe {
            // An error here is a lost device, and destroying is then still the right thing.
            let _ = self.device.device_wait_idle();
            for set in commands {
                set.destroy(&self.device);
            }
            self.pipeline_cache.close(&self.device);
            ManuallyDrop::drop(&mut self.allocator);
            self.device.destroy_device(None);
        }
    }
}

/// The device that was asked for, or the best one; `Error::Device` when it lacks something.
fn choose(instance: &Instance, wanted: Option<&str>) -> Result<(vk::PhysicalDevice, Capabilities)> {
    let variable = std::env::var("TWOBOUNCE_DEVICE").ok().filter(|value| !value.is_empty());
    let wanted = wanted.or(variable.as_deref());
    let mut found: Vec<_> = instance
        .physical_devices()?
        .into_iter()
        .map(|physical| (physical, Capabilities::query(&instance.raw, physical)))
        .collect();
    let names: Vec<_> = found.iter().map(|(_, capabilities)| capabilities.name()).collect();
    let index = match wanted {
        Some(wanted) => pick(wanted, &names)?,
        None => {
            let rank = |&i: &usize| {
                let (_, capabilities) = &found[i];
                (!capabilities.missing().is_empty(), DeviceKind::of(capabilities.properties.device_type))
            };
            (0..found.len()).min_by_key(rank).expect("the list is not empty")
        }
    };
    let missing = found[index].1.missing();
    if missing.is_empty() {
        return Ok(found.swap_remove(index));
    }
    Err(Error::Device(format!(
        "{} lacks {}: choose another device with --device (twobounce info lists them) or update its driver",
        names[index],
        missing.join(", ")
    )))
}

/// Index of the device that `wanted` names: an index, or a part of a name, in any case of letters.
fn pick(wanted: &str, names: &[String]) -> Result<usize> {
    if let Ok(index) = wanted.parse::<usize>()
        && index < names.len()
    {
        return Ok(index);
    }
    let lower = wanted.to_lowercase();
    names.iter().position(|name| name.to_lowercase().contains(&lower)).ok_or_else(|| {
        let list: Vec<_> = names.iter().enumerate().map(|(i, name)| format!("{i}: {name}")).collect();
        Error::Device(format!("no Vulkan device is called {wanted:?}; there is {}", list.join(", ")))
    })
}

fn open(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    capabilities: &Capabilities,
    queue_family: u32,
) -> std::result::Result<ash::Device, vk::Result> {
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
    let extensions: Vec<_> = capabilities.enabled_extensions().iter().map(|name| name.as_ptr()).collect();
    let features = Capabilities::enabled_features();
    let mut vulkan12 =
        vk::PhysicalDeviceVulkan12Features::default().shader_output_layer(true).scalar_block_layout(true);
    let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true);
    let mut sync2 = vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut vulkan12)
        .push_next(&mut rendering)
        .push_next(&mut sync2);
    // SAFETY: the needs were checked, so every extension and feature exists.
    unsafe { instance.create_device(physical, &info, None) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_picked_by_index_or_part_of_its_name() {
        let names = ["NVIDIA H200".to_owned(), "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned()];
        assert_eq!(pick("1", &names).unwrap(), 1);
        assert_eq!(pick("LLVMpipe", &names).unwrap(), 1);
        assert_eq!(pick("200", &names).unwrap(), 0, "a number that is no index is a part of a name");
        let message = pick("radeon", &names).unwrap_err().to_string();
        assert!(message.contains("radeon") && message.contains("0: NVIDIA H200"), "{message}");
    }
}
