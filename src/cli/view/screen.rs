//! The window's content, which its own device shows: the picture, scaled to the window, and the panel over it, drawn on
//! a canvas that is copied to the swapchain's next image. Another device makes frames, so that the window stays
//! responsive.

use std::collections::VecDeque;
use std::sync::Arc;

use ash::vk;
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};
use twobounce::Result;
use twobounce::measure::refuse_messages;
use twobounce::vk::{
    Buffer, BufferKind, Context, Image, ImageDesc, ImageRegion, ImageUsageFlags, Presenter, immediate, upload_image,
};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

use super::NoWindow;

/// The maximum number of attempts to create a swapchain while the window keeps changing its size.
const ATTEMPTS: u32 = 8;
/// The format of the picture and the canvas: 8 bits per channel without conversion, because values are already encoded.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
/// Formats of the swapchain.
const FORMATS: [vk::Format; 2] = [vk::Format::B8G8R8A8_UNORM, FORMAT];
const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

/// A picture: RGBA in 8-bit display codes, row by row from the upper left.
pub struct Picture {
    pub size: (u32, u32),
    pub rgba: Vec<u8>,
}

/// The panel as triangles.
pub struct Overlay<'a> {
    pub textures: egui::TexturesDelta,
    pub primitives: Vec<egui::ClippedPrimitive>,
    pub pixels_per_point: f32,
    pub window: &'a Window,
}

/// The screen. Fields are dropped in this order.
pub struct Screen {
    egui: Renderer<GpuAllocator>,
    picture: Image,
    /// An image of the window's size; `None` if the window has none.
    canvas: Option<Image>,
    swapchain: vk::SwapchainKHR,
    format: vk::Format,
    images: Vec<vk::Image>,
    /// Whether the swapchain no longer fits the window.
    stale: bool,
    /// The command pool for egui's uploads.
    pool: vk::CommandPool,
    /// Signalled when the swapchain's next image may be drawn into.
    acquired: vk::Fence,
    presenter: Presenter,
    /// The number of swapchains so far.
    pub made: u32,
    /// For tests: the next such calls report an outdated swapchain.
    pub faults: VecDeque<Call>,
}

/// A call of a frame that may fail without an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Call {
    Acquire,
    Present,
}

impl Screen {
    /// Opens the window's surface on the device with this name, or on any device that presents.
    ///
    /// # Errors
    /// One sentence: there is no loader, no device that presents, or no memory.
    pub fn new(window: &Window, device_name: &str, validation: bool) -> anyhow::Result<Self> {
        let (display, handle) = (window.display_handle()?.as_raw(), window.window_handle()?.as_raw());
        let extensions = ash_window::enumerate_required_extensions(display)
            .map_err(|e| NoWindow::because(format!("Vulkan cannot present to this display: {e}")))?;
        let presenter = Presenter::new(device_name, validation, extensions, |entry, instance| {
            // SAFETY: the window outlives the screen.
            unsafe { ash_window::create_surface(entry, instance, display, handle, None) }
        })
        .map_err(NoWindow::because)?;
        let context = &presenter.context;
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: FORMAT,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { in_flight_frames: 1, ..Options::default() };
        let egui = Renderer::with_gpu_allocator(presenter.allocator.clone(), context.device().clone(), mode, options)?;
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(presenter.queue_family);
        // If a later step fails, dropping this destroys the objects that were made before.
        let mut screen = Self {
            egui,
            picture: new_image(context, "picture", (1, 1))?,
            canvas: None,
            swapchain: vk::SwapchainKHR::null(),
            format: FORMAT,
            images: vec![],
            stale: false,
            pool: vk::CommandPool::null(),
            acquired: vk::Fence::null(),
            presenter,
            made: 0,
            faults: VecDeque::new(),
        };
        let device = screen.presenter.context.device();
        // SAFETY: the device is alive.
        unsafe {
            screen.pool = device.create_command_pool(&pool, None)?;
            screen.acquired = device.create_fence(&vk::FenceCreateInfo::default(), None)?;
        }
        screen.set_picture(&Picture { size: (1, 1), rgba: vec![13, 13, 13, 255] })?;
        screen.remake(window)?;
        Ok(screen)
    }

    /// Size in pixels; 0 while the window is minimised.
    pub fn size(&self) -> (u32, u32) {
        self.canvas.as_ref().map_or((0, 0), size_of)
    }

    pub fn context(&self) -> &Context {
        &self.presenter.context
    }

    /// Closes the screen with its device.
    ///
    /// # Errors
    /// The validation layer reported something.
    pub fn close(self) -> Result<()> {
        let context = self.presenter.context.clone();
        drop(self);
        refuse_messages(&context.close())
    }

    /// Recreates the swapchain, until the window keeps its size meanwhile.
    pub fn remake(&mut self, window: &Window) -> anyhow::Result<()> {
        for _ in 0..ATTEMPTS {
            let wanted = window.inner_size();
            self.remake_once(wanted.width, wanted.height)?;
            if window.inner_size() == wanted {
                break;
            }
        }
        Ok(())
    }

    /// Creates a swapchain for a window of this size in pixels.
    fn remake_once(&mut self, width: u32, height: u32) -> anyhow::Result<()> {
        let Presenter { surfaces, surface, swapchains, physical, context, .. } = &self.presenter;
        let failed = |result| context.error("making a swapchain", result);
        // SAFETY: all handles are of this device and instance; nothing is in flight after the wait.
        unsafe {
            context.device().device_wait_idle().map_err(failed)?;
            let can = surfaces.get_physical_device_surface_capabilities(*physical, *surface).map_err(failed)?;
            let formats = surfaces.get_physical_device_surface_formats(*physical, *surface).map_err(failed)?;
            let fits = |f: &&vk::SurfaceFormatKHR| FORMATS.contains(&f.format);
            let format =
                *formats.iter().find(fits).ok_or_else(|| NoWindow::because("the display takes no 8-bit format"))?;
            let extent = match can.current_extent {
                vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D {
                    width: width.clamp(can.min_image_extent.width, can.max_image_extent.width),
                    height: height.clamp(can.min_image_extent.height, can.max_image_extent.height),
                },
                own => own,
            };
            (self.canvas, self.images) = (None, vec![]);
            let old = std::mem::take(&mut self.swapchain);
            if extent.width.min(extent.height).min(width).min(height) > 0 {
                let most = if can.max_image_count == 0 { u32::MAX } else { can.max_image_count };
                let info = vk::SwapchainCreateInfoKHR::default()
                    .surface(*surface)
                    .min_image_count((can.min_image_count + 1).min(most))
                    .image_format(format.format)
                    .image_color_space(format.color_space)
                    .image_extent(extent)
                    .image_array_layers(1)
                    .image_usage(ImageUsageFlags::TRANSFER_DST | ImageUsageFlags::TRANSFER_SRC)
                    .pre_transform(can.current_transform)
                    .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE)
                    .present_mode(vk::PresentModeKHR::FIFO)
                    .clipped(true)
                    .old_swapchain(old);
                let made = swapchains.create_swapchain(&info, None);
                swapchains.destroy_swapchain(old, None);
                self.swapchain = made.map_err(failed)?;
                self.images = swapchains.get_swapchain_images(self.swapchain).map_err(failed)?;
                self.format = format.format;
                self.canvas = Some(new_image(context, "canvas", (extent.width, extent.height))?);
                self.made += 1;
            } else {
                swapchains.destroy_swapchain(old, None);
            }
        }
        Ok(())
    }

    /// Sets another picture to show.
    pub fn set_picture(&mut self, picture: &Picture) -> Result<()> {
        let context = &self.presenter.context;
        if size_of(&self.picture) != picture.size {
            self.picture = new_image(context, "picture", picture.size)?;
        }
        // Every draw is waited for, so the image is free.
        upload_image(context, &self.picture, ImageRegion::level(&self.picture, 0), &picture.rgba)
    }

    /// Shows the picture, scaled to the whole window, and the panel over it; waits until the device has finished. With
    /// `grab`, returns the content of the swapchain's image. `None` if the window shows nothing now, or changed its
    /// size.
    pub fn draw(&mut self, overlay: &Overlay, grab: bool) -> anyhow::Result<Option<Picture>> {
        for (id, deltas) in &overlay.textures.set {
            for delta in deltas {
                self.egui.set_texture(self.presenter.queue, self.pool, *id, delta)?;
            }
        }
        let grabbed = match self.acquire()? {
            Some(index) => self.draw_into(index, overlay, grab)?,
            None => None,
        };
        for id in &overlay.textures.free {
            self.egui.free_texture(*id)?;
        }
        if self.stale {
            self.remake(overlay.window)?;
        }
        Ok(grabbed)
    }

    /// The swapchain's next image; `None` if the swapchain no longer fits the window.
    fn acquire(&mut self) -> Result<Option<u32>> {
        self.stale = self.images.is_empty() || self.fault(Call::Acquire);
        if self.stale {
            return Ok(None);
        }
        let Presenter { swapchains, context, .. } = &self.presenter;
        let failed = |result| context.error("waiting for the window", result);
        // SAFETY: handles of this device; the fence is not in use.
        match unsafe { swapchains.acquire_next_image(self.swapchain, u64::MAX, vk::Semaphore::null(), self.acquired) } {
            Ok((index, late)) => {
                self.stale = late;
                let (device, fences) = (context.device(), [self.acquired]);
                // SAFETY: the call above signals the fence.
                unsafe { device.wait_for_fences(&fences, true, u64::MAX).and_then(|()| device.reset_fences(&fences)) }
                    .map_err(failed)?;
                Ok(Some(index))
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.stale = true;
                Ok(None)
            }
            Err(result) => Err(failed(result)),
        }
    }

    fn draw_into(&mut self, index: u32, overlay: &Overlay, grab: bool) -> anyhow::Result<Option<Picture>> {
        let Some(canvas) = &self.canvas else { return Ok(None) };
        let (context, image, size) = (self.presenter.context.clone(), self.images[index as usize], size_of(canvas));
        let bytes = size.0 as usize * size.1 as usize * 4;
        let grabbed = grab.then(|| Buffer::new(&context, "what is shown", bytes as u64, BufferKind::Readback));
        let grabbed = grabbed.transpose()?;
        let mut panel = Ok(());
        immediate(&context, |commands| {
            let drawn = Whole { image: canvas.handle(), size };
            let picture = Whole { image: self.picture.handle(), size: size_of(&self.picture) };
            picture.blit(&context, commands, drawn);
            barrier(&context, commands, drawn.image, [GENERAL, GENERAL]);
            let extent = vk::Extent2D { width: size.0, height: size.1 };
            let attachment = [vk::RenderingAttachmentInfo::default()
                .image_view(canvas.attachment_view(0).handle())
                .image_layout(GENERAL)
                .load_op(vk::AttachmentLoadOp::LOAD)
                .store_op(vk::AttachmentStoreOp::STORE)];
            let rendering =
                vk::RenderingInfo::default().render_area(extent.into()).layer_count(1).color_attachments(&attachment);
            // SAFETY: the canvas is in this layout; the command buffer is recording.
            unsafe { context.device().cmd_begin_rendering(commands, &rendering) };
            panel = self.egui.cmd_draw(commands, extent, overlay.pixels_per_point, &overlay.primitives);
            // SAFETY: begun above.
            unsafe { context.device().cmd_end_rendering(commands) };
            barrier(&context, commands, drawn.image, [GENERAL, GENERAL]);
            barrier(&context, commands, image, [vk::ImageLayout::UNDEFINED, GENERAL]);
            drawn.blit(&context, commands, Whole { image, size });
            if let Some(buffer) = &grabbed {
                barrier(&context, commands, image, [GENERAL, GENERAL]);
                let extent = vk::Extent3D { width: size.0, height: size.1, depth: 1 };
                let copy = [vk::BufferImageCopy::default().image_subresource(COLOR).image_extent(extent)];
                // SAFETY: the image is in this layout, the buffer is large enough.
                unsafe {
                    context.device().cmd_copy_image_to_buffer(commands, image, GENERAL, buffer.handle(), &copy);
                }
            }
            barrier(&context, commands, image, [GENERAL, vk::ImageLayout::PRESENT_SRC_KHR]);
        })?;
        panel?;
        let (chains, indices) = ([self.swapchain], [index]);
        let info = vk::PresentInfoKHR::default().swapchains(&chains).image_indices(&indices);
        // SAFETY: the image was acquired, and its draws were waited for.
        let presented = unsafe { self.presenter.swapchains.queue_present(self.presenter.queue, &info) };
        self.stale |= self.fault(Call::Present);
        match presented {
            Ok(late) => self.stale |= late,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.stale = true,
            Err(result) => return Err(context.error("presenting", result).into()),
        }
        Ok(grabbed.map(|buffer| {
            let mut rgba = buffer.read_some::<u8>(0, bytes);
            if self.format == vk::Format::B8G8R8A8_UNORM {
                rgba.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
            }
            Picture { size, rgba }
        }))
    }

    /// Whether a test makes the call fail.
    fn fault(&mut self, call: Call) -> bool {
        self.faults.pop_front_if(|at| *at == call).is_some()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let device = self.presenter.context.device();
        // SAFETY: everything is of this device, which is idle or lost.
        unsafe {
            let _ = device.device_wait_idle();
            self.presenter.swapchains.destroy_swapchain(self.swapchain, None);
            device.destroy_fence(self.acquired, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}

const COLOR: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// A whole image in `GENERAL` layout.
#[derive(Clone, Copy)]
struct Whole {
    image: vk::Image,
    size: (u32, u32),
}

impl Whole {
    /// Copies it to a whole other image, scaled unless the sizes are equal.
    fn blit(self, context: &Context, commands: vk::CommandBuffer, to: Self) {
        let filter = if self.size == to.size { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
        let corners = |(width, height): (u32, u32)| {
            [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }]
        };
        let blit = [vk::ImageBlit::default()
            .src_subresource(COLOR)
            .src_offsets(corners(self.size))
            .dst_subresource(COLOR)
            .dst_offsets(corners(to.size))];
        // SAFETY: the command buffer is recording, and the images are in this layout.
        unsafe { context.device().cmd_blit_image(commands, self.image, GENERAL, to.image, GENERAL, &blit, filter) };
    }
}

/// A barrier for all earlier commands, which changes the layout of the image.
fn barrier(context: &Context, commands: vk::CommandBuffer, image: vk::Image, [from, to]: [vk::ImageLayout; 2]) {
    let (all, access) =
        (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
    let range = vk::ImageSubresourceRange::default().aspect_mask(COLOR.aspect_mask).level_count(1).layer_count(1);
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(all)
        .src_access_mask(access)
        .dst_stage_mask(all)
        .dst_access_mask(access)
        .old_layout(from)
        .new_layout(to)
        .image(image)
        .subresource_range(range)];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: the command buffer is recording.
    unsafe { context.device().cmd_pipeline_barrier2(commands, &info) };
}

fn size_of(image: &Image) -> (u32, u32) {
    let [width, height, _] = image.extent(0);
    (width, height)
}

fn new_image(context: &Arc<Context>, label: &str, (width, height): (u32, u32)) -> Result<Image> {
    let usage = ImageUsageFlags::TRANSFER_DST | ImageUsageFlags::TRANSFER_SRC | ImageUsageFlags::COLOR_ATTACHMENT;
    Image::new(context, &ImageDesc { label, format: FORMAT, width, height, mips: 1, usage, ..ImageDesc::default() })
}
