//! The images that the window shows by turns.

use ash::vk;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};

use super::Screen;
use crate::cli::view::NoWindow;

/// 8 bits per channel, not converted: what is shown was encoded before.
const FORMATS: [vk::Format; 2] = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];

#[derive(Default)]
pub struct Swapchain {
    pub handle: vk::SwapchainKHR,
    pub format: vk::Format,
    pub extent: vk::Extent2D,
    /// With what renders to each, and what says that it is rendered.
    pub images: Vec<(vk::Image, vk::ImageView, vk::Semaphore)>,
}

impl Screen {
    /// Makes it anew for a window of this size, in pixels.
    pub(super) fn remake_once(&mut self, window_size: (u32, u32)) -> anyhow::Result<()> {
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

    /// # Safety
    /// The device is idle.
    pub(super) unsafe fn destroy_swapchain(&self, old: Swapchain) {
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
}

pub fn color_range() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1)
}
