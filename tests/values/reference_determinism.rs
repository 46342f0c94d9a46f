//! The number of threads and interruptions do not change a bit of a film.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use twobounce::Error;
use twobounce::reference::cache::Cache;
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::scene::{LoadOptions, Pose, Scene, Still, View};

/// No multiple of the side of a tile.
const SIZE: u32 = 22;

fn cornell() -> (Scene, Pose, View) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/truth/cornell-area/cornell-area.glb");
    let scene = Scene::load(&path, &LoadOptions::default()).expect("the scene loads");
    let pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    (scene, pose, view)
}

fn options(stop: Stop) -> Options {
    Options { width: SIZE, height: SIZE, depth: Depth::Full, stop, seed: 3, occlusion: false }
}

fn uninterrupted(stop: Stop) -> Film {
    let (scene, pose, view) = cornell();
    let mut film = Film::new(SIZE, SIZE);
    let never = AtomicBool::new(false);
    render(
        Still::new(&scene, &pose, &view),
        &options(stop),
        &mut film,
        Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never },
    )
    .expect("nothing interrupts");
    film
}

#[test]
fn threads_do_not_matter() {
    let films = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        pool.install(|| uninterrupted(Stop::Samples(20)))
    });
    assert!(films[0] == films[1] && films[0] == films[2], "the number of threads changes the image");
}

#[test]
fn seeds_matter() {
    let (scene, pose, view) = cornell();
    let stop = Stop::Samples(4);
    let with = |seed| {
        let mut film = Film::new(SIZE, SIZE);
        let never = AtomicBool::new(false);
        let options = Options { seed, ..options(stop) };
        render(
            Still::new(&scene, &pose, &view),
            &options,
            &mut film,
            Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never },
        )
        .expect("nothing interrupts");
        film
    };
    assert!(with(0) != with(1) && with(0) != with(1 << 40), "a seed changes nothing");
}

/// The render is interrupted after every few rows and continued from the cache.
#[test]
fn a_resumed_image_is_the_uninterrupted_one() {
    let (scene, pose, view) = cornell();
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Cache::at(folder.path());
    for stop in [Stop::Samples(21), Stop::Noise(0.07)] {
        let mut interruptions = 0;
        let film = loop {
            let (rows, cancel) = (AtomicU32::new(0), AtomicBool::new(false));
            let progress = |_| {
                if rows.fetch_add(1, Ordering::Relaxed) == 4 {
                    cancel.store(true, Ordering::Relaxed);
                }
            };
            match cache.render(Still::new(&scene, &pose, &view), &options(stop), &progress, &cancel) {
                Ok(film) => break film,
                Err(Error::Interrupted) => interruptions += 1,
                Err(error) => panic!("{error}"),
            }
        };
        assert!(interruptions > 0, "it was never interrupted");
        assert!(film == uninterrupted(stop), "{stop:?}: the resumed image differs");
    }
}

#[test]
fn a_finished_image_comes_from_the_cache() {
    let (scene, pose, view) = cornell();
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Cache::at(folder.path());
    let traced = |scene: &Scene, samples| {
        let calls = AtomicU32::new(0);
        let count = |_| {
            calls.fetch_add(1, Ordering::Relaxed);
        };
        let options = options(Stop::Samples(samples));
        let film = cache
            .render(Still::new(scene, &pose, &view), &options, &count, &AtomicBool::new(false))
            .expect("it renders");
        (calls.into_inner() > 0, film)
    };
    let (worked, first) = traced(&scene, 16);
    assert!(worked);
    let (worked, again) = traced(&scene, 16);
    assert!(!worked && again == first, "the second call returns the first one's film");
    assert!(traced(&scene, 18).0, "more samples are added to it");
    let (worked, fewer) = traced(&scene, 16);
    assert!(worked && fewer == first, "for fewer samples than the film has, the same image is rendered again");
    let mut other = scene.clone();
    other.materials[1].roughness *= 0.5;
    assert!(traced(&other, 16).0, "another scene has another film");
    for file in std::fs::read_dir(folder.path()).expect("the folder is there") {
        let path = file.expect("an entry").path();
        let mut bytes = std::fs::read(&path).expect("a film");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&path, bytes).expect("a damaged film");
    }
    let (worked, mended) = traced(&scene, 16);
    assert!(worked && mended == first, "a damaged film is rendered again");
}
