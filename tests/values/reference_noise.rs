//! The noise of a reference image.

use std::sync::atomic::AtomicBool;

use glam::Vec3;
use twobounce::layers::Aov;
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::scene::{LoadOptions, Scene, Still};

const SIZE: u32 = 96;

/// Pixels of a tile share paths: the noise of two images changes as much across every column and row of pixels,
/// although the first samples' tiles have their borders after each fourth one (1.9 times as much there if all samples'
/// do).
#[test]
fn noise_has_no_tiles() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/cornell-area.glb");
    let scene = Scene::load(&path, &LoadOptions::default()).expect("the scene loads");
    let pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    let images = [0, 1].map(|seed| {
        let options = Options {
            width: SIZE,
            height: SIZE,
            depth: Depth::Bounces(2),
            stop: Stop::Samples(16),
            seed,
            occlusion: false,
        };
        let mut film = Film::new(SIZE, SIZE);
        let never = AtomicBool::new(false);
        let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
        render(Still::new(&scene, &pose, &view), &options, &mut film, control).expect("nothing interrupts");
        film.layers(&[]).layers.into_iter().find(|(aov, _)| *aov == Aov::Beauty).expect("an image").1
    });
    let noise = |x: u32, y: u32| {
        let [a, b] = [0, 1].map(|k: usize| Vec3::from(images[k][(y * SIZE + x) as usize]));
        // Relative, and bounded where the lamp's own pixels have none.
        (a - b) / (a + b + 0.1)
    };
    for (dx, dy) in [(1, 0), (0, 1)] {
        let (mut steps, mut counts) = ([0.0; 4], [0.0; 4]);
        for y in 0..SIZE - dy {
            for x in 0..SIZE - dx {
                let place = ((dx * x + dy * y) % 4) as usize;
                steps[place] += (noise(x + dx, y + dy) - noise(x, y)).abs().element_sum();
                counts[place] += 1.0;
            }
        }
        let means = [0, 1, 2, 3].map(|place| steps[place] / counts[place]);
        let all = means.iter().sum::<f32>() / 4.0;
        // 2,300 steps each, which neighbours share: their mean has a deviation of 4 %.
        assert!(means.iter().all(|mean| (mean / all - 1.0).abs() < 0.15), "{means:?}");
    }
}
