//! The loader, the instance, the validation layer's messages, and the list of devices.

use super::needs::{Capabilities, Need};
use super::room;
use crate::{Error, Result};
use ash::{khr, vk};
use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The API version of the instance.
pub(in crate::vk) const VERSION: u32 = vk::API_VERSION_1_3;
const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Messages of the validation layer, in order.
pub(in crate::vk) type Messages = Mutex<Vec<String>>;

/// The loader, an instance with debug utilities where the system has them, and the surface of a window.
pub(in crate::vk) struct Instance {
    // The field is declared before the library that its functions come from, like everything created through it.
    pub(in crate::vk) raw: ash::Instance,
    pub(in crate::vk) debug_utils: bool,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// The messages, to which the messenger holds a pointer.
    pub(in crate::vk) messages: Arc<Messages>,
    /// The surface, which is destroyed after its swapchains and before the instance.
    pub(in crate::vk) surface: Option<(khr::surface::Instance, vk::SurfaceKHR)>,
    pub(in crate::vk) entry: ash::Entry,
    abandoned: bool,
}

impl Instance {
    /// Loads the Vulkan library and creates an instance with these extensions; with `validation`, under the validation
    /// layer with synchronisation validation. `Error::Device` names a missing package; other errors name a limit of the
    /// machine at which the driver would end the process.
    pub(in crate::vk) fn new(validation: bool, extensions: &[*const c_char]) -> Result<Self> {
        room::check()?;
        // SAFETY: loading the system's Vulkan library runs only its own initialisers.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| {
            Error::Device(format!(
                "the Vulkan loader is missing ({error}): install it (package libvulkan1 on Debian and Ubuntu)"
            ))
        })?;
        let failed = |result: vk::Result| {
            Error::Device(match result {
                vk::Result::ERROR_INCOMPATIBLE_DRIVER => NO_DRIVER.to_owned(),
                other => format!("Vulkan does not start ({other}): check the graphics driver with vulkaninfo"),
            })
        };
        // SAFETY: no arguments.
        let version = unsafe { entry.try_enumerate_instance_version() }.map_err(failed)?;
        if version.is_none_or(|version| version < vk::API_VERSION_1_2) {
            return Err(Error::Device("the Vulkan loader is older than 1.2: update it (package libvulkan1)".into()));
        }
        let mut layers = Vec::new();
        if validation {
            // SAFETY: no arguments.
            let known = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
            if known.iter().all(|layer| layer.layer_name_as_c_str() != Ok(VALIDATION_LAYER)) {
                return Err(Error::Device(
                    "the Vulkan validation layer is missing: install it (package vulkan-validationlayers on Debian and Ubuntu)"
                        .into(),
                ));
            }
            layers.push(VALIDATION_LAYER.as_ptr());
        }
        // SAFETY: no layer name, or the name of one that exists.
        let available = unsafe { entry.enumerate_instance_extension_properties(None) }.map_err(failed)?;
        let has = |name: &CStr| available.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        // The validation layer provides debug utilities itself; without it they provide labels for captures.
        let debug_utils = validation || has(ash::ext::debug_utils::NAME);
        let mut extensions = extensions.to_vec();
        if debug_utils {
            extensions.push(ash::ext::debug_utils::NAME.as_ptr());
        }
        if validation {
            extensions.push(ash::ext::validation_features::NAME.as_ptr());
        }
        // Without it the loader hides devices that omit parts of Vulkan, such as those over Metal.
        let mut flags = vk::InstanceCreateFlags::empty();
        if has(khr::portability_enumeration::NAME) {
            extensions.push(khr::portability_enumeration::NAME.as_ptr());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        let application = vk::ApplicationInfo::default().application_name(c"twobounce").api_version(VERSION);
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let mut info = vk::InstanceCreateInfo::default()
            .flags(flags)
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validation {
            info = info.push_next(&mut features);
        }
        // SAFETY: the info and all that it points to live through the call.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(failed)?;
        let mut this = Self {
            raw,
            debug_utils,
            messenger: None,
            messages: Arc::default(),
            surface: None,
            entry,
            abandoned: false,
        };
        if validation {
            this.listen().map_err(failed)?;
        }
        Ok(this)
    }

    /// Leaves everything, including the loaded driver, to the end of the process, because its threads may still be at
    /// work.
    pub(in crate::vk) fn abandon(&mut self) {
        self.abandoned = true;
        std::mem::forget(self.entry.clone());
        std::mem::forget(self.messages.clone());
    }

    fn listen(&mut self) -> std::result::Result<(), vk::Result> {
        use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
        let debug = ash::ext::debug_utils::Instance::new(&self.entry, &self.raw);
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::WARNING | Severity::ERROR)
            .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&self.messages).cast_mut().cast());
        // SAFETY: the user data outlives the messenger, which `drop` destroys first.
        let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }?;
        self.messenger = Some((debug, messenger));
        Ok(())
    }

    /// All physical devices in the loader's order; never empty.
    pub(in crate::vk) fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() }.map_err(|result| {
            Error::Device(format!(
                "listing the Vulkan devices failed ({result}): check the graphics driver with vulkaninfo"
            ))
        })?;
        if devices.is_empty() { Err(Error::Device(NO_DRIVER.to_owned())) } else { Ok(devices) }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if self.abandoned {
            return;
        }
        // SAFETY: the context destroys its device before this, and only the surface was created from the instance.
        unsafe {
            if let Some((functions, surface)) = self.surface.take() {
                functions.destroy_surface(surface, None);
            }
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

const NO_DRIVER: &str = "there is no Vulkan device: install a driver \
     (package mesa-vulkan-drivers on Debian and Ubuntu brings one that runs on the CPU)";

/// The messages so far: errors and warnings, without performance advice.
pub(in crate::vk) fn lock(messages: &Messages) -> MutexGuard<'_, Vec<String>> {
    messages.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The callback of the layer, on the thread that made the faulty call.
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and `user` is the `Messages` given at creation.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().map(|c| c.to_string_lossy().into_owned()).unwrap_or_default();
        (text, &*user.cast::<Messages>())
    };
    if kind.contains(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION) {
        tracing::error!("validation: {text}");
        lock(messages).push(text);
    } else if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
        tracing::warn!("vulkan: {text}");
    } else {
        tracing::debug!("vulkan: {text}");
    }
    vk::FALSE
}

/// The kind of processor of a device, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    Discrete,
    Integrated,
    Virtual,
    Cpu,
    Other,
}

impl DeviceKind {
    pub(in crate::vk) fn of_type(kind: vk::PhysicalDeviceType) -> Self {
        match kind {
            vk::PhysicalDeviceType::DISCRETE_GPU => Self::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => Self::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => Self::Virtual,
            vk::PhysicalDeviceType::CPU => Self::Cpu,
            _ => Self::Other,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete GPU",
            Self::Integrated => "integrated GPU",
            Self::Virtual => "virtual GPU",
            Self::Cpu => "CPU",
            Self::Other => "other",
        }
    }
}

/// The report of `info` about one device.
#[derive(Clone, Debug)]
pub struct DeviceReport {
    pub name: String,
    pub kind: DeviceKind,
    /// (major, minor, patch)
    pub api_version: (u32, u32, u32),
    /// The driver's name and its own description of its version.
    pub driver: String,
    /// All requirements of the passes, and whether each is met.
    pub needs: Vec<Need>,
    /// Features and extensions that single settings need, and whether each is present.
    pub wishes: Vec<Need>,
    pub limits: vk::PhysicalDeviceLimits,
    /// Largest single allocation in bytes.
    pub max_allocation_bytes: u64,
    pub max_push_descriptors: u32,
    /// The size in bytes of each memory heap, and whether it is device-local.
    pub heaps: Vec<(u64, bool)>,
    /// Bytes still available in each heap, if the driver reports them.
    pub budgets: Option<Vec<u64>>,
    /// Sample counts (1, 2, 4, …) of an RGBA32F colour attachment and of a D32F depth attachment.
    pub color_samples: Vec<u32>,
    pub depth_samples: Vec<u32>,
}

/// All Vulkan devices of this machine, in the order of their indices.
pub fn devices() -> Result<Vec<DeviceReport>> {
    let instance = Instance::new(false, &[])?;
    Ok(instance.physical_devices()?.into_iter().map(|physical| report(&instance.raw, physical)).collect())
}

fn report(instance: &ash::Instance, physical: vk::PhysicalDevice) -> DeviceReport {
    let found = Capabilities::query(instance, VERSION, physical);
    let samples = |format, usage| {
        // SAFETY: the handle comes from this instance.
        let flags = unsafe {
            instance.get_physical_device_image_format_properties(
                physical,
                format,
                vk::ImageType::TYPE_2D,
                vk::ImageTiling::OPTIMAL,
                usage,
                vk::ImageCreateFlags::empty(),
            )
        }
        .map(|properties| properties.sample_counts)
        .unwrap_or_default();
        [1, 2, 4, 8, 16].into_iter().filter(|&n| flags.contains(vk::SampleCountFlags::from_raw(n))).collect()
    };
    DeviceReport {
        budgets: heap_budgets(instance, physical, &found),
        color_samples: samples(vk::Format::R32G32B32A32_SFLOAT, vk::ImageUsageFlags::COLOR_ATTACHMENT),
        depth_samples: samples(vk::Format::D32_SFLOAT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
        ..found.report()
    }
}

/// (major, minor, patch)
pub(in crate::vk) fn version_of(properties: &vk::PhysicalDeviceProperties) -> (u32, u32, u32) {
    let version = properties.api_version;
    (vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version))
}

/// Bytes available per heap by `VK_EXT_memory_budget`; `None` if the device lacks the extension.
pub(in crate::vk) fn heap_budgets(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    found: &Capabilities,
) -> Option<Vec<u64>> {
    if !found.has_extension(ash::ext::memory_budget::NAME) {
        return None;
    }
    let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
    let mut properties = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
    // SAFETY: the device has the extension that the chained structure belongs to.
    unsafe { instance.get_physical_device_memory_properties2(physical, &mut properties) };
    let count = found.memory.memory_heap_count as usize;
    let left = budget.heap_budget.iter().zip(&budget.heap_usage).map(|(all, used)| all.saturating_sub(*used));
    Some(left.take(count).collect())
}
