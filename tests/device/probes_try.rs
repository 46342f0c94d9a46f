use crate::gpu;
use crate::studio::asset;
use std::path::Path;
use std::time::Instant;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::compare;
use twobounce::measure::terms::Subtract;
use twobounce::settings::Settings;

#[test]
fn try_it() {
    let Ok(text) = std::env::var("PROBES_TRY") else { return };
    let context = twobounce::vk::Context::new(&Default::default()).unwrap();
    gpu::context();
    for line in text.split(';') {
        let mut words = line.split_whitespace();
        let Some(name) = words.next() else { continue };
        let preset = words.next().unwrap();
        let sets: Vec<&str> = words.collect();
        let settings = gpu::with(Settings::preset(preset).unwrap(), &sets);
        let scene = asset(&format!("{name}.glb"));
        let view = scene.view(&scene.pose(None, 0.0), 0);
        let start = Instant::now();
        let options = twobounce::renderer::RenderOptions {
            aovs: vec![Aov::Direct, Aov::Diffuse],
            ..twobounce::renderer::RenderOptions::new((128, 128), scene.bounds(None))
        };
        let pose = scene.pose(None, 0.0);
        let mut renderer =
            twobounce::renderer::Renderer::new(&context, scene.clone(), &pose, settings, options).unwrap();
        let report = renderer.render(&pose, &view).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let image = renderer.read();
        let path = format!("{}/suite/references/{name}-128.exr", env!("CARGO_MANIFEST_DIR"));
        let (truth, _) = Layers::read_exr(Path::new(&path)).unwrap();
        let found = compare(&image, &truth, Subtract::Own).unwrap();
        let d = found.indirect_diffuse.unwrap();
        println!(
            "{line}: diffuse energy {:.3} rel {:.4}; total energy {:.3} rel {:.4}; settling {}; {seconds:.1} s, passes {:.0} ms",
            d.energy,
            d.rel,
            found.total.energy,
            found.total.rel,
            report.settling,
            report.timings.zones.iter().map(|z| z.gpu_ms).sum::<f64>(),
        );
        image.write_exr(Path::new(&format!("/tmp/pr/t-{name}.exr")), &Default::default()).unwrap();
    }
}
