//! What the window shows, by a device of its own: a swapchain, a picture copied into it, and the panel drawn over that. Frames are
//! made by another one, so that the window answers while they are.

use std::ffi::CStr;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use anyhow::{Context as _, anyhow};
use ash::{khr, vk};
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

use super::NoWindow;

/// 8 bits per channel, not converted: what is shown was encoded before.
const FORMATS: [vk::Format; 2] = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
const PICTURE_FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
/// Attempts at a swapchain while the window keeps changing its size.
const ATTEMPTS: u32 = 8;

/// Errors and warnings of the validation layer so far.
static MESSAGES: AtomicU32 = AtomicU32::new(0);

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
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    instance: ash::Instance,
    _entry: ash::Entry,
    /// Swapchains made so far.
    pub made: u32,
}

#[derive(Default)]
struct Swapchain {
    handle: vk::SwapchainKHR,
    format: vk::Format,
    extent: vk::Extent2D,
    images: Vec<(vk::Image, vk::ImageView, vk::Semaphore)>,
}

/// The picture on the device, and the buffer that it comes through.
struct Shown {
    size: (u32, u32),
    image: vk::Image,
    memory: Allocation,
    staging: vk::Buffer,
    mapped: Allocation,
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
        let mut extensions = ash_window::enumerate_required_extensions(display)
            .map_err(|e| NoWindow::because(format!("Vulkan cannot present to this display: {e}")))?
            .to_vec();
        let mut layers = vec![];
        if validation {
            layers.push(VALIDATION_LAYER.as_ptr());
            extensions.push(ash::ext::debug_utils::NAME.as_ptr());
        }
        let application =
            vk::ApplicationInfo::default().application_name(c"twobounce").api_version(vk::API_VERSION_1_3);
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validation {
            info = info.push_next(&mut features);
        }
        // SAFETY: the info and all that it points to live through the call.
        let instance = unsafe { entry.create_instance(&info, None) }
            .map_err(|e| NoWindow::because(format!("Vulkan cannot present to this display: {e}")))?;
        let messenger = validation.then(|| listen(&entry, &instance)).transpose()?;
        let surface_functions = khr::surface::Instance::new(&entry, &instance);
        // SAFETY: the window outlives the screen.
        let surface =
            unsafe { ash_window::create_surface(&entry, &instance, display, window.window_handle()?.as_raw(), None) }?;
        let (physical, family) = choose(&instance, (&surface_functions, surface), device_name)?;
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

    fn remake_once(&mut self, window_size: (u32, u32)) -> anyhow::Result<()> {
        // SAFETY: all handles are of this device and instance; nothing is in flight after the wait.
        unsafe {
            self.device.device_wait_idle()?;
            let functions = &self.surface_functions;
            let can = functions.get_physical_device_surface_capabilities(self.physical, self.surface)?;
            let formats = functions.get_physical_device_surface_formats(self.physical, self.surface)?;
            let fits = |f: &&vk::SurfaceFormatKHR| FORMATS.contains(&f.format);
            let format =
                *formats.iter().find(fits).ok_or_else(|| NoWindow::because("the display takes no 8-bit format"))?;
            let extent = match can.current_extent {
                vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D {
                    width: window_size.0.clamp(can.min_image_extent.width, can.max_image_extent.width),
                    height: window_size.1.clamp(can.min_image_extent.height, can.max_image_extent.height),
                },
                own => own,
            };
            let old = std::mem::take(&mut self.swapchain);
            let nothing = extent.width == 0 || extent.height == 0 || window_size.0 == 0 || window_size.1 == 0;
            if !nothing {
                let most = if can.max_image_count == 0 { u32::MAX } else { can.max_image_count };
                let info = vk::SwapchainCreateInfoKHR::default()
                    .surface(self.surface)
                    .min_image_count((can.min_image_count + 1).min(most))
                    .image_format(format.format)
                    .image_color_space(format.color_space)
                    .image_extent(extent)
                    .image_array_layers(1)
                    .image_usage(
                        vk::ImageUsageFlags::COLOR_ATTACHMENT
                            | vk::ImageUsageFlags::TRANSFER_DST
                            | vk::ImageUsageFlags::TRANSFER_SRC,
                    )
                    .pre_transform(can.current_transform)
                    .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE)
                    .present_mode(vk::PresentModeKHR::FIFO)
                    .clipped(true)
                    .old_swapchain(old.handle);
                let handle = self.swapchain_functions.create_swapchain(&info, None)?;
                let new = |image| {
                    let range = color_range();
                    let info = vk::ImageViewCreateInfo::default()
                        .image(image)
                        .view_type(vk::ImageViewType::TYPE_2D)
                        .format(format.format)
                        .subresource_range(range);
                    let view = self.device.create_image_view(&info, None)?;
                    Ok((image, view, self.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?))
                };
                let images = self.swapchain_functions.get_swapchain_images(handle)?;
                let images = images.into_iter().map(new).collect::<Result<_, vk::Result>>()?;
                self.swapchain = Swapchain { handle, format: format.format, extent, images };
                self.made += 1;
            }
            self.destroy_swapchain(old);
            if self.egui.is_none() && !nothing {
                let options = Options { in_flight_frames: 1, ..Options::default() };
                let allocator = self.allocator.clone().expect("until the screen is dropped");
                let mode = RenderMode::DynamicRendering(DynamicRendering {
                    color_attachment_format: format.format,
                    depth_attachment_format: None,
                    stencil_attachment_format: None,
                });
                self.egui = Some(Renderer::with_gpu_allocator(allocator, self.device.clone(), mode, options)?);
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
            let acquired =
                self.swapchain_functions.acquire_next_image(handle, u64::MAX, self.acquired, vk::Fence::null());
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
            let grabbed = staging.map(|staging| self.read_grab(staging)).transpose()?;
            let (swapchains, indices) = ([handle], [index]);
            let present =
                vk::PresentInfoKHR::default().wait_semaphores(&signals).swapchains(&swapchains).image_indices(&indices);
            let stale = match self.swapchain_functions.queue_present(self.queue, &present) {
                Ok(late) => late || suboptimal,
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => true,
                Err(error) => return Err(error.into()),
            };
            Ok(Drawn { stale, grabbed })
        }
    }

    /// The picture into a swapchain's image, which then is in `GENERAL` layout.
    ///
    /// # Safety
    /// The command buffer is recording.
    unsafe fn record_picture(&self, image: vk::Image) {
        let (device, commands) = (&self.device, self.commands);
        let extent = self.swapchain.extent;
        self.barrier(image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
        let Some(shown) = &self.picture else {
            let grey = vk::ClearColorValue { float32: [0.05, 0.05, 0.05, 1.0] };
            let range = [color_range()];
            // SAFETY: the image is in this layout.
            unsafe { device.cmd_clear_color_image(commands, image, vk::ImageLayout::GENERAL, &grey, &range) };
            self.barrier(image, vk::ImageLayout::GENERAL, vk::ImageLayout::GENERAL);
            return;
        };
        self.barrier(shown.image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
        let (width, height) = shown.size;
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let copy = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })];
        let corners = |width: u32, height: u32| {
            [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }]
        };
        let blit = [vk::ImageBlit::default()
            .src_subresource(layers)
            .src_offsets(corners(width, height))
            .dst_subresource(layers)
            .dst_offsets(corners(extent.width, extent.height))];
        let general = vk::ImageLayout::GENERAL;
        // A pixel for a pixel where the sizes are the same.
        let same = (width, height) == (extent.width, extent.height);
        let filter = if same { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
        // SAFETY: the images are in these layouts.
        unsafe {
            device.cmd_copy_buffer_to_image(commands, shown.staging, shown.image, general, &copy);
            self.barrier(shown.image, general, general);
            device.cmd_blit_image(commands, shown.image, general, image, general, &blit, filter);
        }
        self.barrier(image, general, general);
    }

    /// Everything before is done and visible.
    fn barrier(&self, image: vk::Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let access = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(access)
            .dst_stage_mask(all)
            .dst_access_mask(access)
            .old_layout(from)
            .new_layout(to)
            .image(image)
            .subresource_range(color_range())];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: the command buffer is recording.
        unsafe { self.device.cmd_pipeline_barrier2(self.commands, &info) };
    }

    fn record_grab(&self, image: vk::Image) -> anyhow::Result<(vk::Buffer, Allocation)> {
        let vk::Extent2D { width, height } = self.swapchain.extent;
        let bytes = u64::from(width) * u64::from(height) * 4;
        let (buffer, memory) = self.buffer(bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)?;
        let general = vk::ImageLayout::GENERAL;
        self.barrier(image, general, general);
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let copy = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })];
        let visible = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        // SAFETY: the image is in this layout, the buffer is large enough.
        unsafe {
            self.device.cmd_copy_image_to_buffer(self.commands, image, general, buffer, &copy);
            self.device.cmd_pipeline_barrier2(self.commands, &vk::DependencyInfo::default().memory_barriers(&visible));
        }
        Ok((buffer, memory))
    }

    fn read_grab(&self, (buffer, memory): (vk::Buffer, Allocation)) -> anyhow::Result<Picture> {
        let vk::Extent2D { width, height } = self.swapchain.extent;
        let bytes = width as usize * height as usize * 4;
        let mut rgba = memory.mapped_slice().context("memory that is not mapped")?[..bytes].to_vec();
        if self.swapchain.format == vk::Format::B8G8R8A8_UNORM {
            rgba.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        self.free_buffer(buffer, memory);
        Ok(Picture { size: (width, height), rgba })
    }

    fn buffer(
        &self,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> anyhow::Result<(vk::Buffer, Allocation)> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device is alive.
        let buffer = unsafe { self.device.create_buffer(&info, None) }?;
        // SAFETY: as above.
        let requirements = unsafe { self.device.get_buffer_memory_requirements(buffer) };
        let memory = self.memory("picture, staging", requirements, location, true)?;
        // SAFETY: the memory fits the buffer's requirements.
        unsafe { self.device.bind_buffer_memory(buffer, memory.memory(), memory.offset()) }?;
        Ok((buffer, memory))
    }

    fn memory(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> anyhow::Result<Allocation> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let desc = AllocationCreateDesc { name, requirements, location, linear, allocation_scheme };
        let allocator = self.allocator.as_ref().expect("until the screen is dropped");
        Ok(allocator.lock().map_err(|_| anyhow!("an allocation failed before"))?.allocate(&desc)?)
    }

    fn new_picture(&self, (width, height): (u32, u32)) -> anyhow::Result<Shown> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(PICTURE_FORMAT)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC);
        // SAFETY: the device is alive.
        let image = unsafe { self.device.create_image(&info, None) }?;
        // SAFETY: as above.
        let requirements = unsafe { self.device.get_image_memory_requirements(image) };
        let memory = self.memory("picture", requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the memory fits the image's requirements.
        unsafe { self.device.bind_image_memory(image, memory.memory(), memory.offset()) }?;
        let bytes = u64::from(width) * u64::from(height) * 4;
        let (staging, mapped) = self.buffer(bytes, vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu)?;
        Ok(Shown { size: (width, height), image, memory, staging, mapped })
    }

    fn free_buffer(&self, buffer: vk::Buffer, memory: Allocation) {
        // SAFETY: no frame is in flight: each is waited for.
        unsafe { self.device.destroy_buffer(buffer, None) };
        self.free(memory);
    }

    fn free_picture(&self, shown: Shown) {
        self.free_buffer(shown.staging, shown.mapped);
        // SAFETY: no frame is in flight.
        unsafe { self.device.destroy_image(shown.image, None) };
        self.free(shown.memory);
    }

    fn free(&self, memory: Allocation) {
        if let Some(Ok(mut allocator)) = self.allocator.as_ref().map(|allocator| allocator.lock()) {
            // It fails only for memory of another allocator.
            let _ = allocator.free(memory);
        }
    }

    /// # Safety
    /// The device is idle.
    unsafe fn destroy_swapchain(&self, old: Swapchain) {
        for (_, view, semaphore) in old.images {
            // SAFETY: as the caller says.
            unsafe {
                self.device.destroy_image_view(view, None);
                self.device.destroy_semaphore(semaphore, None);
            }
        }
        // SAFETY: as above; a null handle is ignored.
        unsafe { self.swapchain_functions.destroy_swapchain(old.handle, None) };
    }

    /// An error where the validation layer said anything.
    pub fn refuse_invalid() -> anyhow::Result<()> {
        match MESSAGES.load(Ordering::Relaxed) {
            0 => Ok(()),
            count => Err(anyhow!("the validation layer has {count} messages about the window")),
        }
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

fn color_range() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1)
}

/// The device that makes the frames, where it presents too, else the first one that presents.
fn choose(
    instance: &ash::Instance,
    (functions, surface): (&khr::surface::Instance, vk::SurfaceKHR),
    name: &str,
) -> anyhow::Result<(vk::PhysicalDevice, u32)> {
    // SAFETY: the instance is alive, as is the surface.
    unsafe {
        let mut found = vec![];
        for physical in instance.enumerate_physical_devices()? {
            let extensions = instance.enumerate_device_extension_properties(physical)?;
            let properties = instance.get_physical_device_properties(physical);
            let presents = extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME));
            if !presents || properties.api_version < vk::API_VERSION_1_3 {
                continue;
            }
            let families = instance.get_physical_device_queue_family_properties(physical);
            let family = (0..families.len() as u32).find(|&family| {
                families[family as usize].queue_flags.contains(vk::QueueFlags::GRAPHICS)
                    && functions.get_physical_device_surface_support(physical, family, surface).unwrap_or(false)
            });
            let is_it = properties.device_name_as_c_str().is_ok_and(|own| own.to_string_lossy() == name);
            found.extend(family.map(|family| (!is_it, physical, family)));
        }
        let best = found.into_iter().min_by_key(|(other, ..)| *other);
        let (_, physical, family) =
            best.ok_or_else(|| NoWindow::because("no Vulkan 1.3 device presents to this display"))?;
        Ok((physical, family))
    }
}

fn listen(
    entry: &ash::Entry,
    instance: &ash::Instance,
) -> anyhow::Result<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    let debug = ash::ext::debug_utils::Instance::new(entry, instance);
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION)
        .pfn_user_callback(Some(on_message));
    // SAFETY: the callback uses nothing but a static.
    let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }?;
    Ok((debug, messenger))
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _: *mut std::ffi::c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data.
    let text = unsafe { (*data).message_as_c_str() }.map(|text| text.to_string_lossy().into_owned());
    crate::cli::out::warn(&format!("validation: {}", text.unwrap_or_default()));
    MESSAGES.fetch_add(1, Ordering::Relaxed);
    vk::FALSE
}
