//! A Vulkan program in which twobounce lights a scene: its own instance, device, queue, command buffers and images,
//! with two frames in flight. The camera travels for some frames; the last one becomes a PNG.
//!
//! `cargo run --release --example host -- SCENE.glb IMAGE.png [WxH [KEY=VALUE…]]`
//!
//! With `HOST_VALIDATION=1` the Khronos validation layer checks all calls, synchronisation too, and any message ends
//! the program with exit code 1.

mod gpu;
mod program;

use std::process::ExitCode;

use twobounce::ash::vk;
use twobounce::gpu_allocator::MemoryLocation;
use twobounce::gpu_allocator::vulkan::Allocation;
use twobounce::host::{Aov, Context, HostImage, ImageUse, Output, Prepare, Prepared, Shot};
use twobounce::scene::{Pose, Scene, View};
use twobounce::settings::Settings;

use gpu::{Anything, Frame, Gpu, image_bytes, radiance};

const FRAMES: usize = 5;
const IN_FLIGHT: usize = 2;
/// The format that this program reads back: exact radiance. A program with a window would use `R16G16B16A16_SFLOAT`, or
/// a smaller format.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

fn main() -> ExitCode {
    // SAFETY: the device is idle before anything is destroyed.
    program::run("host", |gpu, scene, settings, size| unsafe { travel(gpu, scene, settings, size) })
}

/// Renders all frames, two in flight, and reads back the last one.
unsafe fn travel(gpu: &Gpu, scene: &Scene, settings: &Settings, size: (u32, u32)) -> Anything<Vec<[f32; 3]>> {
    unsafe {
        // Once: lend the device, prepare the scene, name the image for the radiance.
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
            // Both frames use the target, so each starts when the one before has finished.
            let before = (number > 0).then(|| frames[(number - 1) % IN_FLIGHT].done);
            let view = camera(scene, &pose, number);
            frames[slot].begin(gpu)?;
            prepared.record(frames[slot].commands, slot, &Shot::new(scene, &pose, &view), &outputs);
            target.record_read(gpu, frames[slot].commands);
            frames[slot].submit(gpu, before)?;
        }
        // The kept picture must be complete. A program with a window would grow the lists before its next frame.
        let last = (FRAMES - 1) % IN_FLIGHT;
        let view = camera(scene, &pose, FRAMES - 1);
        gpu.device.device_wait_idle()?;
        while grow(gpu, &mut prepared, last)? {
            frames[last].begin(gpu)?;
            prepared.record(frames[last].commands, last, &Shot::new(scene, &pose, &view), &outputs);
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

/// Enlarges lists that were too small, if the frame over `slot` was incomplete.
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

/// The image for the radiance, and a buffer through which the CPU reads it.
struct Target {
    image: (vk::Image, Allocation),
    buffer: (vk::Buffer, Allocation),
    size: (u32, u32),
}

impl Target {
    unsafe fn new(gpu: &Gpu, size: (u32, u32)) -> Anything<Self> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
        let to_cpu = vk::BufferUsageFlags::TRANSFER_DST;
        unsafe {
            let image = gpu.image(FORMAT, size, usage)?;
            let buffer = gpu.buffer(image_bytes(size), to_cpu, MemoryLocation::GpuToCpu)?;
            Ok(Self { image, buffer, size })
        }
    }

    /// The state of the image before and after each recording, by its uses in this program.
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
        let (image, size) = (self.image.0, self.size);
        let image = HostImage { image, format: FORMAT, size, level: 0, layer: 0, before, after };
        Ok(prepared.output(Aov::Beauty, image)?)
    }

    /// This program's own commands after twobounce's. The image is in the requested layout.
    unsafe fn record_read(&self, gpu: &Gpu, commands: vk::CommandBuffer) {
        unsafe { gpu.copy_to_cpu(commands, &[self.image.0], self.size, self.buffer.0) };
    }

    /// Linear radiance, rows from the top, when the device is idle.
    fn pixels(&self) -> Vec<[f32; 3]> {
        radiance(&self.buffer.1, 1, self.size)
    }

    unsafe fn destroy(self, gpu: &Gpu) {
        unsafe {
            gpu.device.destroy_image(self.image.0, None);
            gpu.device.destroy_buffer(self.buffer.0, None);
        }
        gpu.free(self.image.1);
        gpu.free(self.buffer.1);
    }
}
