//! The part of an example without Vulkan: it reads the arguments and writes the picture.

use std::path::Path;
use std::process::ExitCode;

use twobounce::host::Layers;
use twobounce::output::display::Display;
use twobounce::scene::Scene;
use twobounce::settings::Settings;

use super::gpu::{Anything, Gpu};

/// Reads the arguments `SCENE.glb IMAGE.png [WxH [KEY=VALUE…]]`, opens a device, and writes the radiance that `make`
/// returns for a scene, settings and a size. With `HOST_VALIDATION=1` the validation layer checks all calls; any
/// message then ends the program with exit code 1.
pub fn run(name: &str, make: impl FnOnce(&Gpu, &Scene, &Settings, (u32, u32)) -> Anything<Vec<[f32; 3]>>) -> ExitCode {
    match write(name, make) {
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

/// Returns the number of the validation layer's messages.
fn write(
    name: &str,
    make: impl FnOnce(&Gpu, &Scene, &Settings, (u32, u32)) -> Anything<Vec<[f32; 3]>>,
) -> Anything<usize> {
    let mut args = std::env::args().skip(1);
    let (Some(path), Some(image)) = (args.next(), args.next()) else {
        return Err(format!("call it with a scene and an image: {name} SCENE.glb IMAGE.png [WxH [KEY=VALUE…]]").into());
    };
    let size = args.next().unwrap_or("320x180".into());
    let size = size.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let size = size.ok_or("write the image's size as WxH")?;
    let mut settings = Settings::fast();
    args.try_for_each(|assignment| settings.set(&assignment))?;
    let scene = Scene::open(path)?;
    // SAFETY: `make` leaves the device idle, and has destroyed its objects.
    let (pixels, messages) = unsafe {
        let gpu = Gpu::new(std::env::var_os("HOST_VALIDATION").is_some())?;
        let pixels = make(&gpu, &scene, &settings, size)?;
        (pixels, gpu.close())
    };
    Layers::new(size.0, size.1, pixels).write_shown(Path::new(&image), Display::default())?;
    Ok(messages)
}
