//! Invalid values in public fields are refused or rendered, without a panic or a message of the validation layer.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::Playback;
use twobounce::settings::Settings;
use twobounce::vk::Context;

use crate::gpu;
use crate::more;
use crate::nonsense::{Chance, scene, spoil, spoilt_bounds, spoilt_settings, spoilt_view, view};

fn drawn(context: &Arc<Context>, chance: &mut Chance) -> twobounce::Result<()> {
    let (mut scene, mut settings) = (scene(), gpu::with(Settings::fast(), &["voxels=16"]));
    let part = chance.below(4);
    if part < 2 {
        spoil(&mut scene, chance);
    }
    scene.check()?;
    let playback = Playback { animations: vec![0], repeats: true };
    let (pose, mut seen, mut bounds) = (scene.pose_of(&playback, 0.5), view(&scene), scene.bounds_of(&playback));
    let mut size = (8, 8);
    match part {
        2 => {
            settings = spoilt_settings(&settings, chance);
            settings.voxels = settings.voxels.min(32);
            settings.image.passes = settings.image.passes.min(2);
        }
        3 => match chance.below(3) {
            0 => seen = spoilt_view(seen, chance),
            1 => bounds = spoilt_bounds(chance),
            _ => size = [(0, 8), (8, 0), (1, 1), (u32::MAX, u32::MAX), (1, u32::MAX), (3, 16_385)][chance.below(6)],
        },
        _ => {}
    }
    let mut renderer = Renderer::new(context, scene, &pose, settings, RenderOptions::new(size, bounds))?;
    renderer.render(&pose, &seen)?;
    renderer.read();
    Ok(())
}

#[test]
fn nonsense_in_public_fields_is_refused_or_drawn() {
    let context = gpu::own_context();
    let seeds: Vec<u64> = more::every(16, 0..400).collect();
    let mut done = 0;
    for &seed in &seeds {
        let outcome = catch_unwind(AssertUnwindSafe(|| drawn(&context, &mut Chance::new(seed))));
        done += usize::from(outcome.unwrap_or_else(|_| panic!("seed {seed} panics")).is_ok());
        let said = context.take_validation_messages();
        assert!(said.is_empty(), "seed {seed}: {said:?}");
    }
    let most = seeds.len();
    assert!((most / 10..most).contains(&done), "{done} of {most} were drawn");
}
