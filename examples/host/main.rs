//! A Vulkan program of its own that has twobounce light a scene: its instance, device, queue, command buffers and images, two
//! frames in flight. The camera travels for some frames; the last one becomes a PNG.
//!
//! `cargo run --release --example host -- SCENE.glb IMAGE.png [WxH [KEY=VALUE…]]`
//!
//! With `HOST_VALIDATION=1` the Khronos validation layer watches, synchronisation too, and any message ends it with exit code 1.

mod gpu;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use twobounce::ash::vk;
use twobounce::gpu_allocator::MemoryLocation;
use twobounce::gpu_allocator::vulkan::Allocation;
use twobounce::host::{Aov, Context, HostImage, ImageUse, Layers, Output, Prepare, Prepared, Seen};
use twobounce::output::display::Display;
use twobounce::scene::{LoadOptions, Pose, Scene, View};
use twobounce::settings::Settings;

use gpu::{Frame, Gpu};

const FRAMES: usize = 5;
const IN_FLIGHT: usize = 2;
/// Format that this program reads back: exact radiance. A program with a window would take `R16G16B16A16_SFLOAT`, or
/// half as much.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

type Anything<T> = Result<T, Box<dyn Error>>;

fn main() -> ExitCode {
    match run() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(messages) => {
            eprintln!("the validation layer had {messages} messages");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// Returns how many messages the validation layer had.
fn run() -> Anything<usize> {
    let mut args = std::env::args().skip(1);
    let (Some(path), Some(image)) = (args.next(), args.next()) else {
        return Err("call it with a scene and an image: host SCENE.glb IMAGE.png [WxH [KEY=VALUE…]]".into());
    };
    let size = args.next().unwrap_or("320x180".into());
    let size = size.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let size = size.ok_or("write the image's size as WxH")?;
    let mut settings = Settings::fast();
    args.try_for_each(|assignment| settings.set(&assignment))?;
    let scene = Scene::load(&PathBuf::from(path), &LoadOptions::default())?;
    // SAFETY: the device is idle before anything is destroyed.
    unsafe {
        let gpu = Gpu::new(std::env::var_os("HOST_VALIDATION").is_some())?;
        let pixels = travel(&gpu, &scene, &settings, size)?;
        let messages = gpu.close();
        Layers::new(size.0, size.1, pixels).write_shown(&PathBuf::from(image), Display::default())?;
        Ok(messages)
    }
}

/// Renders all frames, two in flight, and reads back the last.
unsafe fn travel(gpu: &Gpu, scene: &Scene, settings: &Settings, size: (u32, u32)) -> Anything<Vec<[f32; 3]>> {
    unsafe {
        // Once: lend the device, prepare the scene, say where radiance goes.
        let context = Context::adopt(gpu.lent())?;
        let pose = scene.pose(None, 0.0);
        let prepare = Prepare { slots: IN_FLIGHT, ..Prepare::new(size, scene.bounds(None)) };
        let mut prepared = Prepared::new(&context, scene, &pose, settings, &prepare)?;
        let target = Target::new(gpu, size)?;
        let outputs = [target.output(&prepared)?];
        let frames = (0..IN_FLIGHT).map(|_| Frame::new(gpu)).collect::<Anything<Vec<_>>>()?;
        for number in 0..FRAMES {
            let slot = number % IN_FLIGHT;
            frames[slot].wait(gpu)?; // for the frame before the last one; the last one is still being rendered
            grow(gpu, &mut prepared, slot)?;
            // Both frames use the target, so each starts when the one before is done.
            let before = (number > 0).then(|| frames[(number - 1) % IN_FLIGHT].done);
            let view = camera(scene, &pose, number);
            frames[slot].begin(gpu)?;
            prepared.record(frames[slot].commands, slot, &Seen::new(scene, &pose, &view), &outputs);
            target.record_read(gpu, frames[slot].commands);
            frames[slot].submit(gpu, before)?;
        }
        // The picture that is kept must be whole. A program with a window would grow before its next frame.
        let last = (FRAMES - 1) % IN_FLIGHT;
        let view = camera(scene, &pose, FRAMES - 1);
        gpu.device.device_wait_idle()?;
        while grow(gpu, &mut prepared, last)? {
            frames[last].begin(gpu)?;
            prepared.record(frames[last].commands, last, &Seen::new(scene, &pose, &view), &outputs);
            target.record_read(gpu, frames[last].commands);
            frames[last].submit(gpu, Some(frames[last].done))?;
            gpu.device.device_wait_idle()?;
        }
        let pixels = target.pixels();
        drop((prepared, context)); // made with this program's device
        frames.into_iter().for_each(|frame| frame.destroy(gpu));
        target.destroy(gpu);
        Ok(pixels)
    }
}

/// Makes what was too small larger, where the frame over `slot` was not whole.
unsafe fn grow(gpu: &Gpu, prepared: &mut Prepared, slot: usize) -> Anything<bool> {
    let Some(growth) = (unsafe { prepared.poll(slot) }) else { return Ok(false) };
    unsafe {
        gpu.device.device_wait_idle()?;
        prepared.grow(growth)?;
    }
    Ok(true)
}

/// The view of frame `number`: the last one is that of the file's camera.
fn camera(scene: &Scene, pose: &Pose, number: usize) -> View {
    let end = if scene.cameras.is_empty() { View::framing(scene.bounds(None)) } else { scene.view(pose, 0) };
    let back = (FRAMES - 1 - number) as f64 * 0.01 * scene.bounds(None).size().length();
    View { eye: end.eye - end.forward * back, ..end }
}

/// The image that radiance goes to, and a buffer that the CPU reads it from.
struct Target {
    image: vk::Image,
    image_memory: Allocation,
    buffer: vk::Buffer,
    buffer_memory: Allocation,
    size: (u32, u32),
}

impl Target {
    unsafe fn new(gpu: &Gpu, (width, height): (u32, u32)) -> Anything<Self> {
        unsafe {
            let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(FORMAT)
                .extent(vk::Extent3D { width, height, depth: 1 })
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(usage);
            let image = gpu.device.create_image(&info, None)?;
            let needs = gpu.device.get_image_memory_requirements(image);
            let image_memory = gpu.memory("target", needs, MemoryLocation::GpuOnly)?;
            gpu.device.bind_image_memory(image, image_memory.memory(), image_memory.offset())?;
            let bytes = u64::from(width) * u64::from(height) * 16;
            let info = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
            let buffer = gpu.device.create_buffer(&info, None)?;
            let needs = gpu.device.get_buffer_memory_requirements(buffer);
            let buffer_memory = gpu.memory("pixels", needs, MemoryLocation::GpuToCpu)?;
            gpu.device.bind_buffer_memory(buffer, buffer_memory.memory(), buffer_memory.offset())?;
            Ok(Self { image, image_memory, buffer, buffer_memory, size: (width, height) })
        }
    }

    /// Uses of the image by this program before and after each recording.
    fn output(&self, prepared: &Prepared) -> Anything<Output> {
        let before = ImageUse {
            stages: vk::PipelineStageFlags2::COPY,
            access: vk::AccessFlags2::NONE, // it was read, and is written anew
            layout: vk::ImageLayout::UNDEFINED,
        };
        let after = ImageUse {
            stages: vk::PipelineStageFlags2::COPY,
            access: vk::AccessFlags2::TRANSFER_READ,
            layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        };
        let (image, size) = (self.image, self.size);
        let image = HostImage { image, format: FORMAT, size, level: 0, layer: 0, before, after };
        Ok(prepared.output(Aov::Beauty, image)?)
    }

    /// This program's own commands after twobounce's. The image is in the layout that was asked for.
    unsafe fn record_read(&self, gpu: &Gpu, commands: vk::CommandBuffer) {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let extent = vk::Extent3D { width: self.size.0, height: self.size.1, depth: 1 };
        let region = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent)];
        let to_cpu = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let barrier = vk::DependencyInfo::default().memory_barriers(&to_cpu);
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        unsafe {
            gpu.device.cmd_copy_image_to_buffer(commands, self.image, layout, self.buffer, &region);
            gpu.device.cmd_pipeline_barrier2(commands, &barrier);
        }
    }

    /// Linear radiance, rows from the top, once the device is idle.
    fn pixels(&self) -> Vec<[f32; 3]> {
        let bytes = self.buffer_memory.mapped_slice().expect("memory for the CPU");
        let number = |texel: &[u8], i: usize| f32::from_le_bytes(texel[4 * i..][..4].try_into().expect("four bytes"));
        let texels = bytes[..(self.size.0 * self.size.1 * 16) as usize].chunks_exact(16);
        texels.map(|texel| [number(texel, 0), number(texel, 1), number(texel, 2)]).collect()
    }

    unsafe fn destroy(self, gpu: &Gpu) {
        unsafe {
            gpu.device.destroy_image(self.image, None);
            gpu.device.destroy_buffer(self.buffer, None);
        }
        gpu.free(self.image_memory);
        gpu.free(self.buffer_memory);
    }
}
