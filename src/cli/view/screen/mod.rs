//! What the window shows, by a device of its own: a swapchain, a picture copied into it, and the panel drawn over that. Frames are
//! made by another one, so that the window answers while they are.

mod device;
mod picture;
mod swapchain;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use anyhow::Context as _;
use ash::{khr, vk};
use egui_ash_renderer::Renderer;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

use device::Messenger;
pub use device::refuse_invalid;
use picture::Shown;
use swapchain::Swapchain;

/// Attempts at a swapchain while the window keeps changing its size.
const ATTEMPTS: u32 = 8;

/// A picture: RGBA in 8 bits as a display takes them, row by row from the upper left.
pub struct Picture {
    pub size: (u32, u32),
    pub rgba: Vec<u8>,
}

/// The panel, as triangles.
pub struct Overlay<'a> {
    pub textures: egui::TexturesDelta,
    pub primitives: Vec<egui::ClippedPrimitive>,
    pub pixels_per_point: f32,
    pub window: &'a Window,
}

pub struct Screen {
    swapchain: Swapchain,
    picture: Option<Shown>,
    egui: Option<Renderer<egui_ash_renderer::allocator::GpuAllocator>>,
    allocator: Option<Arc<Mutex<Allocator>>>,
    commands: vk::CommandBuffer,
    pool: vk::CommandPool,
    fence: vk::Fence,
    acquired: vk::Semaphore,
    queue: vk::Queue,
    swapchain_functions: khr::swapchain::Device,
    device: ash::Device,
    physical: vk::PhysicalDevice,
    surface: vk::SurfaceKHR,
    surface_functions: khr::surface::Instance,
    messenger: Option<Messenger>,
    instance: ash::Instance,
    _entry: ash::Entry,
    /// Swapchains made so far.
    pub made: u32,
    /// For tests: results that the next calls are taken to have, one after another.
    pub faults: VecDeque<(Call, vk::Result)>,
}

/// What of a frame can fail though nothing of it is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Call {
    Acquire,
    Present,
}

impl Screen {
    /// Opens the window's surface on the device of this name, or on any that presents.
    ///
    /// # Errors
    /// One sentence: no loader, no device that presents, no memory.
    pub fn new(window: &Window, device_name: &str, validation: bool) -> anyhow::Result<Self> {
        // SAFETY: loading the system's Vulkan library runs only its own initialisers.
        let entry =
            unsafe { ash::Entry::load() }.context("the Vulkan loader is missing: install package libvulkan1")?;
        let display = window.display_handle()?.as_raw();
        let (instance, messenger) = device::instance(&entry, display, validation)?;
        let surface_functions = khr::surface::Instance::new(&entry, &instance);
        // SAFETY: the window outlives the screen.
        let surface =
            unsafe { ash_window::create_surface(&entry, &instance, display, window.window_handle()?.as_raw(), None) }?;
        let (physical, family) = device::choose(&instance, &surface_functions, surface, device_name)?;
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
        let mut vulkan_13 =
            vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
        let device_extensions = [khr::swapchain::NAME.as_ptr()];
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&device_extensions)
            .push_next(&mut vulkan_13);
        // SAFETY: extension and features were checked.
        let device = unsafe { instance.create_device(physical, &info, None) }?;
        // SAFETY: one queue was asked for.
        let queue = unsafe { device.get_device_queue(family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?;
        let pool_info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: the device is alive.
        let (pool, commands, fence, acquired) = unsafe {
            let pool = device.create_command_pool(&pool_info, None)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info)?[0];
            let fence = device.create_fence(&vk::FenceCreateInfo::default(), None)?;
            (pool, commands, fence, device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?)
        };
        let mut screen = Self {
            swapchain: Swapchain::default(),
            picture: None,
            egui: None,
            allocator: Some(Arc::new(Mutex::new(allocator))),
            commands,
            pool,
            fence,
            acquired,
            queue,
            swapchain_functions: khr::swapchain::Device::new(&instance, &device),
            device,
            physical,
            surface,
            surface_functions,
            messenger,
            instance,
            _entry: entry,
            made: 0,
            faults: VecDeque::new(),
        };
        screen.remake(window)?;
        Ok(screen)
    }

    /// Pixels; 0 while the window is minimised.
    pub fn size(&self) -> (u32, u32) {
        (self.swapchain.extent.width, self.swapchain.extent.height)
    }

    /// Makes the swapchain anew, until the window keeps its size meanwhile.
    pub fn remake(&mut self, window: &Window) -> anyhow::Result<()> {
        for _ in 0..ATTEMPTS {
            let wanted = window.inner_size();
            self.remake_once((wanted.width, wanted.height))?;
            if window.inner_size() == wanted {
                break;
            }
        }
        Ok(())
    }

    /// Takes another picture to show.
    pub fn set_picture(&mut self, picture: &Picture) -> anyhow::Result<()> {
        if self.picture.as_ref().is_none_or(|shown| shown.size != picture.size) {
            if let Some(old) = self.picture.take() {
                self.free_picture(old);
            }
            self.picture = Some(self.new_picture(picture.size)?);
        }
        let shown = self.picture.as_mut().expect("just made");
        shown.mapped.mapped_slice_mut().context("memory that is not mapped")?[..picture.rgba.len()]
            .copy_from_slice(&picture.rgba);
        Ok(())
    }

    /// Shows the picture, scaled to the whole window, and the panel over it; waits until the device is done. With `grab`, returns
    /// what the swapchain's image then holds. `None`: the window shows nothing now, or changed its size.
    pub fn draw(&mut self, overlay: Overlay, grab: bool) -> anyhow::Result<Option<Picture>> {
        let Overlay { textures, primitives, pixels_per_point, window } = overlay;
        if let Some(egui) = &mut self.egui {
            for (id, deltas) in &textures.set {
                for delta in deltas {
                    egui.set_texture(self.queue, self.pool, *id, delta)?;
                }
            }
        }
        let drawn = self.draw_frame(&primitives, pixels_per_point, grab)?;
        if let Some(egui) = &mut self.egui {
            for id in &textures.free {
                egui.free_texture(*id)?;
            }
        }
        if drawn.stale {
            self.remake(window)?;
        }
        Ok(drawn.grabbed)
    }

    fn draw_frame(&mut self, primitives: &[egui::ClippedPrimitive], points: f32, grab: bool) -> anyhow::Result<Drawn> {
        let stale = |stale| Ok(Drawn { stale, grabbed: None });
        if self.swapchain.images.is_empty() {
            return stale(true);
        }
        let (handle, extent) = (self.swapchain.handle, self.swapchain.extent);
        // SAFETY: handles of this device; the fence says that the last frame is done.
        unsafe {
            let acquired = match self.fault(Call::Acquire) {
                Some(result) => Err(result),
                None => self.swapchain_functions.acquire_next_image(handle, u64::MAX, self.acquired, vk::Fence::null()),
            };
            let (index, suboptimal) = match acquired {
                Ok(next) => next,
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => return stale(true),
                Err(error) => return Err(error.into()),
            };
            let (image, view, rendered) = self.swapchain.images[index as usize];
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            self.device.begin_command_buffer(self.commands, &begin)?;
            self.record_picture(image);
            let attachment = [vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(vk::AttachmentLoadOp::LOAD)
                .store_op(vk::AttachmentStoreOp::STORE)];
            let area = vk::Rect2D { offset: vk::Offset2D::default(), extent };
            let rendering =
                vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachment);
            self.device.cmd_begin_rendering(self.commands, &rendering);
            if let Some(egui) = &mut self.egui {
                egui.cmd_draw(self.commands, extent, points, primitives)?;
            }
            self.device.cmd_end_rendering(self.commands);
            let staging = grab.then(|| self.record_grab(image)).transpose()?;
            self.barrier(image, vk::ImageLayout::GENERAL, vk::ImageLayout::PRESENT_SRC_KHR);
            self.device.end_command_buffer(self.commands)?;
            let (waits, signals) = ([self.acquired], [rendered]);
            let (stages, commands) = ([vk::PipelineStageFlags::ALL_COMMANDS], [self.commands]);
            let submit = vk::SubmitInfo::default()
                .wait_semaphores(&waits)
                .wait_dst_stage_mask(&stages)
                .command_buffers(&commands)
                .signal_semaphores(&signals);
            self.device.queue_submit(self.queue, &[submit], self.fence)?;
            self.device.wait_for_fences(&[self.fence], true, u64::MAX)?;
            self.device.reset_fences(&[self.fence])?;
            let grabbed = staging.map(|(buffer, memory)| self.read_grab(buffer, memory)).transpose()?;
            let (swapchains, indices) = ([handle], [index]);
            let present =
                vk::PresentInfoKHR::default().wait_semaphores(&signals).swapchains(&swapchains).image_indices(&indices);
            let presented = self.swapchain_functions.queue_present(self.queue, &present);
            let stale = match self.fault(Call::Present).map_or(presented, Err) {
                Ok(late) => late || suboptimal,
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => true,
                Err(error) => return Err(error.into()),
            };
            Ok(Drawn { stale, grabbed })
        }
    }
}

impl Screen {
    /// What the call is to come to, if a test says so.
    fn fault(&mut self, call: Call) -> Option<vk::Result> {
        self.faults.pop_front_if(|(at, _)| *at == call).map(|(_, result)| result)
    }
}

struct Drawn {
    /// The swapchain no longer fits the window.
    stale: bool,
    grabbed: Option<Picture>,
}

impl Drop for Screen {
    fn drop(&mut self) {
        // SAFETY: everything is of this device, which is idle or lost.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.egui = None;
            if let Some(picture) = self.picture.take() {
                self.free_picture(picture);
            }
            let swapchain = std::mem::take(&mut self.swapchain);
            self.destroy_swapchain(swapchain);
            self.device.destroy_semaphore(self.acquired, None);
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.pool, None);
            self.allocator = None;
            self.device.destroy_device(None);
            self.surface_functions.destroy_surface(self.surface, None);
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}
