//! Invalid values in public fields are refused or path-traced, without a panic.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;

use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::scene::{Playback, Scene, Still};
use twobounce::settings::Settings;

use crate::nonsense::{Chance, scene, spoil, spoilt_settings, spoilt_view, view};

/// Every call of a program with a scene, before and during the path tracing.
fn traced(scene: &Scene, chance: &mut Chance) -> twobounce::Result<()> {
    scene.check()?;
    let playback = Playback { animations: vec![0], repeats: chance.below(2) == 0 };
    let pose = scene.pose_of(&playback, [0.0, 0.5, -1e9, f64::NAN, f64::INFINITY][chance.below(5)]);
    pose.check(scene)?;
    scene.bounds_of(&playback);
    let seen = match chance.below(3) {
        0 => spoilt_view(view(scene), chance),
        1 => scene.view(&pose, 0),
        _ => view(scene),
    };
    let (width, height, seed) = (4, 4, 0);
    let options = Options { width, height, depth: Depth::Full, stop: Stop::Samples(2), seed, occlusion: true };
    let control = Control { progress: &|_| (), save: &mut |_| Ok(()), cancel: &AtomicBool::new(false) };
    render(Still::new(scene, &pose, &seen), &options, &mut Film::new(4, 4), control)
}

#[test]
fn nonsense_in_public_fields_is_refused_or_traced() {
    let outcome = |seed| {
        let mut chance = Chance::new(seed);
        let mut scene = scene();
        spoil(&mut scene, &mut chance);
        catch_unwind(AssertUnwindSafe(|| traced(&scene, &mut chance)))
    };
    let outcomes: Vec<_> = (0..4000).map(outcome).collect();
    let panics: Vec<_> =
        (0..4000).zip(&outcomes).filter(|(_, outcome)| outcome.is_err()).map(|(seed, _)| seed).collect();
    assert!(panics.is_empty(), "seeds {panics:?} panic");
    let done = outcomes.iter().filter(|outcome| matches!(outcome, Ok(Ok(())))).count();
    assert!((400..3800).contains(&done), "{done} of 4000 were traced");
}

#[test]
fn settings_with_nonsense_are_refused_by_their_check_or_written() {
    let mut refused = 0;
    for seed in 0..2000 {
        let settings = spoilt_settings(&Settings::default(), &mut Chance::new(seed));
        match settings.check() {
            Ok(()) => assert!(settings.to_toml().contains("voxels")),
            Err(error) => refused += u32::from(!error.to_string().is_empty()),
        }
    }
    assert!((200..1900).contains(&refused), "{refused} of 2000 were refused");
}
