//! The raster pipeline of a typical engine: it draws triangles into the images of a G-buffer, and reads images back.

use twobounce::ash::vk;
use twobounce::glam::Vec4;
use twobounce::gpu_allocator::MemoryLocation;
use twobounce::gpu_allocator::vulkan::Allocation;
use twobounce::host::{HostImage, ImageUse};

use super::gpu::{Anything, Gpu, image_bytes, radiance};

/// A half is too coarse for the start of rays.
pub const DEPTH: vk::Format = vk::Format::R32_SFLOAT;
const HALF: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
const FLOAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
/// Depth, normal, albedo, material and emission are drawn here; twobounce writes direct and indirect light. The last
/// image is the depth buffer.
const FORMATS: [vk::Format; 8] = [DEPTH, HALF, HALF, HALF, FLOAT, FLOAT, FLOAT, vk::Format::D32_SFLOAT];
const DRAWN: usize = 5;
/// The images that twobounce reads.
pub const INPUTS: [usize; 4] = [0, 1, 2, 3];
/// The images whose sum is shown.
pub const SHOWN: [usize; 3] = [4, 5, 6];

/// A corner of a triangle, in the vertex shader's input format.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Surface {
    pub position: [f32; 3],
    pub normal: [f32; 3],
    pub albedo: [f32; 3],
    pub material: [f32; 3],
    pub emitted: [f32; 3],
}

const VERTEX: &str = "#version 460
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 albedo;
layout(location = 3) in vec3 material;
layout(location = 4) in vec3 emitted;
layout(location = 0) out vec4 normal_depth;
layout(location = 1) out vec3 to_albedo;
layout(location = 2) out vec3 to_material;
layout(location = 3) out vec3 to_emitted;
layout(push_constant) uniform Push { vec4 rows[3]; };
void main() {
    float depth = dot(rows[2].xyz, position);
    // Reversed depth: 1 near the eye, 0 at infinity.
    gl_Position = vec4(dot(rows[0].xyz, position), dot(rows[1].xyz, position), 0.01, depth);
    normal_depth = vec4(dot(normal, position) > 0.0 ? -normal : normal, depth);
    to_albedo = albedo;
    to_material = material;
    to_emitted = emitted;
}";

const FRAGMENT: &str = "#version 460
layout(location = 0) in vec4 normal_depth;
layout(location = 1) in vec3 albedo;
layout(location = 2) in vec3 material;
layout(location = 3) in vec3 emitted;
layout(location = 0) out vec4 to_depth;
layout(location = 1) out vec4 to_normal;
layout(location = 2) out vec4 to_albedo;
layout(location = 3) out vec4 to_material;
layout(location = 4) out vec4 to_emitted;
void main() {
    to_depth = vec4(normal_depth.w);
    to_normal = vec4(normalize(normal_depth.xyz), 0.0);
    to_albedo = vec4(albedo, 1.0);
    to_material = vec4(material, 0.0);
    to_emitted = vec4(emitted, 0.0);
}";

pub struct Raster {
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    images: Vec<(vk::Image, vk::ImageView, Allocation)>,
    vertices: (vk::Buffer, Allocation),
    read: (vk::Buffer, Allocation),
    size: (u32, u32),
    corners: u32,
}

impl Raster {
    pub unsafe fn new(gpu: &Gpu, size: (u32, u32), corners: usize) -> Anything<Self> {
        unsafe {
            let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(48)];
            let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&push);
            let layout = gpu.device.create_pipeline_layout(&info, None)?;
            let bytes = image_bytes(size) * SHOWN.len() as u64;
            let vertex_bytes = (corners.max(3) * size_of::<Surface>()) as u64;
            Ok(Self {
                layout,
                pipeline: pipeline(gpu, layout)?,
                images: FORMATS.iter().map(|format| image(gpu, *format, size)).collect::<Anything<_>>()?,
                vertices: gpu.buffer(vertex_bytes, vk::BufferUsageFlags::VERTEX_BUFFER, MemoryLocation::CpuToGpu)?,
                read: gpu.buffer(bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)?,
                size,
                corners: corners as u32,
            })
        }
    }

    /// An image that is drawn here, and that twobounce reads.
    pub fn input(&self, image: usize) -> HostImage {
        let stages = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
        let access = vk::AccessFlags2::COLOR_ATTACHMENT_WRITE;
        let drawn = ImageUse { stages, access, layout: vk::ImageLayout::ATTACHMENT_OPTIMAL };
        self.host_image(image, drawn, drawn)
    }

    /// An image that twobounce writes, and that is copied afterwards.
    pub fn output(&self, image: usize) -> HostImage {
        let stages = vk::PipelineStageFlags2::COPY;
        let before = ImageUse { stages, access: vk::AccessFlags2::NONE, layout: vk::ImageLayout::UNDEFINED };
        let (access, layout) = (vk::AccessFlags2::TRANSFER_READ, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        self.host_image(image, before, ImageUse { stages, access, layout })
    }

    fn host_image(&self, image: usize, before: ImageUse, after: ImageUse) -> HostImage {
        let (handle, format) = (self.images[image].0, FORMATS[image]);
        HostImage { image: handle, format, size: self.size, level: 0, layer: 0, before, after }
    }

    pub fn upload(&mut self, surfaces: &[Surface]) {
        let bytes = self.vertices.1.mapped_slice_mut().expect("memory for the CPU");
        let numbers = surfaces.iter().flat_map(|s| {
            let lists: [&[f32]; 5] = [&s.position, &s.normal, &s.albedo, &s.material, &s.emitted];
            lists.concat()
        });
        bytes.chunks_exact_mut(4).zip(numbers).for_each(|(to, number)| to.copy_from_slice(&number.to_ne_bytes()));
        self.corners = surfaces.len() as u32;
    }

    /// Draws the surfaces. `rows`: the rows of the matrix from positions relative to the eye to x, y (down) and depth.
    pub unsafe fn record(&self, gpu: &Gpu, commands: vk::CommandBuffer, rows: &[Vec4; 3]) {
        let extent = vk::Extent2D { width: self.size.0, height: self.size.1 };
        let colors: Vec<_> = self.images[..DRAWN].iter().map(|(_, view, _)| cleared(*view)).collect();
        let front = cleared(self.images[FORMATS.len() - 1].1);
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent };
        let info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
        let (width, height) = (extent.width as f32, extent.height as f32);
        let viewport = vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
        let numbers: Vec<u8> = rows.iter().flat_map(|row| row.to_array()).flat_map(f32::to_ne_bytes).collect();
        unsafe {
            let device = &gpu.device;
            self.discard(gpu, commands);
            device.cmd_begin_rendering(commands, &info.depth_attachment(&front));
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            device.cmd_set_viewport(commands, 0, &[viewport]);
            device.cmd_set_scissor(commands, 0, &[area]);
            device.cmd_bind_vertex_buffers(commands, 0, &[self.vertices.0], &[0]);
            device.cmd_push_constants(commands, self.layout, vk::ShaderStageFlags::VERTEX, 0, &numbers);
            device.cmd_draw(commands, self.corners, 1, 0, 0);
            device.cmd_end_rendering(commands);
        }
    }

    /// Prepares the images for drawing, which discards their content.
    unsafe fn discard(&self, gpu: &Gpu, commands: vk::CommandBuffer) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let drawn = FORMATS.iter().zip(&self.images).enumerate().filter(|(i, _)| !SHOWN[1..].contains(i));
        let barriers: Vec<_> = drawn
            .map(|(_, (format, (image, ..)))| {
                vk::ImageMemoryBarrier2::default()
                    .image(*image)
                    .subresource_range(whole(*format))
                    .src_stage_mask(all)
                    .dst_stage_mask(all)
                    .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
                    .new_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
            })
            .collect();
        let barriers = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        unsafe { gpu.device.cmd_pipeline_barrier2(commands, &barriers) };
    }

    /// Copies emission and light to a buffer that the CPU reads.
    pub unsafe fn record_read(&self, gpu: &Gpu, commands: vk::CommandBuffer) {
        let images = SHOWN.map(|image| self.images[image].0);
        let emission = [vk::ImageMemoryBarrier2::default()
            .image(images[0])
            .subresource_range(whole(FORMATS[SHOWN[0]]))
            .src_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::COPY)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_READ)
            .old_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
            .new_layout(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)];
        let emission = vk::DependencyInfo::default().image_memory_barriers(&emission);
        unsafe {
            gpu.device.cmd_pipeline_barrier2(commands, &emission);
            gpu.copy_to_cpu(commands, &images, self.size, self.read.0);
        }
    }

    /// Linear radiance, rows from the top, when the device is idle.
    pub fn pixels(&self) -> Vec<[f32; 3]> {
        radiance(&self.read.1, SHOWN.len(), self.size)
    }

    pub unsafe fn destroy(self, gpu: &Gpu) {
        for (image, view, memory) in self.images {
            unsafe {
                gpu.device.destroy_image_view(view, None);
                gpu.device.destroy_image(image, None);
            }
            gpu.free(memory);
        }
        for (buffer, memory) in [self.vertices, self.read] {
            unsafe { gpu.device.destroy_buffer(buffer, None) };
            gpu.free(memory);
        }
        unsafe {
            gpu.device.destroy_pipeline(self.pipeline, None);
            gpu.device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

/// A depth of 0 tells twobounce that the pixel has no surface.
fn cleared(view: vk::ImageView) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
}

fn whole(format: vk::Format) -> vk::ImageSubresourceRange {
    let front = format == vk::Format::D32_SFLOAT;
    let aspect = if front { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
    vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
}

unsafe fn image(gpu: &Gpu, format: vk::Format, size: (u32, u32)) -> Anything<(vk::Image, vk::ImageView, Allocation)> {
    let copied = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
    let usage = match format {
        vk::Format::D32_SFLOAT => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        _ => copied | vk::ImageUsageFlags::COLOR_ATTACHMENT,
    };
    unsafe {
        let (image, memory) = gpu.image(format, size, usage)?;
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(whole(format));
        Ok((image, gpu.device.create_image_view(&info, None)?, memory))
    }
}

unsafe fn pipeline(gpu: &Gpu, layout: vk::PipelineLayout) -> Anything<vk::Pipeline> {
    use vk::ShaderStageFlags as Stage;
    let compiler = shaderc::Compiler::new()?;
    let module = |text: &str, kind| -> Anything<vk::ShaderModule> {
        let compiled = compiler.compile_into_spirv(text, kind, "gbuffer", "main", None)?;
        let info = vk::ShaderModuleCreateInfo::default().code(compiled.as_binary());
        Ok(unsafe { gpu.device.create_shader_module(&info, None) }?)
    };
    let modules = [module(VERTEX, shaderc::ShaderKind::Vertex)?, module(FRAGMENT, shaderc::ShaderKind::Fragment)?];
    let stage =
        |i: usize, stage| vk::PipelineShaderStageCreateInfo::default().module(modules[i]).stage(stage).name(c"main");
    let stages = [stage(0, Stage::VERTEX), stage(1, Stage::FRAGMENT)];
    let bindings = [vk::VertexInputBindingDescription::default().stride(size_of::<Surface>() as u32)];
    let attributes: Vec<_> = (0..5)
        .map(|i| {
            let attribute = vk::VertexInputAttributeDescription::default().location(i).offset(12 * i);
            attribute.format(vk::Format::R32G32B32_SFLOAT)
        })
        .collect();
    let input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let triangles = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let filled = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let single = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let nearest = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(vk::CompareOp::GREATER);
    let written =
        [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA); DRAWN];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&written);
    let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(&FORMATS[..DRAWN])
        .depth_attachment_format(vk::Format::D32_SFLOAT);
    let info = [vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&triangles)
        .viewport_state(&viewport)
        .rasterization_state(&filled)
        .multisample_state(&single)
        .depth_stencil_state(&nearest)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering)];
    unsafe {
        let made = gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None);
        modules.into_iter().for_each(|module| gpu.device.destroy_shader_module(module, None));
        Ok(made.map_err(|(_, error)| error)?[0])
    }
}
