//! Lists and light are kept from frame to frame while nothing changes, without a difference in any image.

use crate::gpu;

use crate::studio::{Studio, moved_poses, pose, room};
use glam::DVec3;
use twobounce::scene::View;
use twobounce::settings::Settings;
use twobounce::settings::methods::cones::choices::Passes;

const LISTS: [&str; 3] = ["reset", "record", "voxelise"];
const LIGHT: [&str; 2] = ["shade 1", "shade 2"];

fn does(passes: &[&str], some: &[&str]) -> bool {
    let count = some.iter().filter(|name| passes.contains(name)).count();
    assert!(count == 0 || count == some.len(), "{passes:?} do a part of {some:?}");
    count > 0
}

#[test]
fn frames_that_keep_what_holds_are_those_that_start_anew() {
    let scene = room();
    let [here, there, lit] = moved_poses(&scene);
    for base in [Settings::fast(), Settings::corrected(), Settings::printed()] {
        // The talk's jitter would differ in each frame.
        let base = gpu::with(base, &["voxels=16", "cones.shadow_jitter=false"]);
        let mut kept = Studio::new(&scene, &base);
        // A view from within the room.
        let first_view = View { eye: DVec3::new(4.0, 4.0, 0.5), forward: DVec3::Z, up: DVec3::Y, ..kept.view };
        let other_view = View { eye: DVec3::new(3.0, 4.5, 1.0), ..first_view };
        // The change from the frame before, and whether new lists and new light are due.
        let frames = [
            ("first", &here, first_view, (true, true)),
            ("still", &here, first_view, (false, false)),
            ("camera moved", &here, other_view, (false, false)),
            ("box moved", &there, other_view, (true, true)),
            ("light moved", &lit, other_view, (false, true)),
            ("box and light back", &here, first_view, (true, true)),
        ];
        let mut images = Vec::new();
        for (what, pose, view, due) in frames {
            let mut fresh = Studio::new(&scene, &base);
            (kept.view, fresh.view) = (view, view);
            let (image, passes) = kept.image(pose);
            assert_eq!((does(&passes, &LISTS), does(&passes, &LIGHT)), due, "{what}: {passes:?}");
            assert!(passes.contains(&"image"));
            assert!(image == fresh.image(pose).0, "{what}: the image is another");
            images.push(image);
        }
        let shows: Vec<bool> = images.windows(2).map(|pair| pair[0] != pair[1]).collect();
        assert_eq!(shows, [false, true, true, true, true], "whether each change shows");
        assert!(images[0] == images[5]);
    }
}

#[test]
fn frames_that_are_to_be_timed_do_everything() {
    let scene = room();
    let pose = scene.pose(None, 0.0);
    let mut studio = Studio::new(&scene, &Settings { voxels: 16, ..Settings::fast() });
    let (first, _) = studio.image(&pose);
    studio.renderer.make_anew();
    let (image, passes) = studio.image(&pose);
    assert!(does(&passes, &LISTS) && does(&passes, &LIGHT), "{passes:?}");
    assert!(image == first);
}

#[test]
fn light_that_is_jittered_is_kept_for_one_time_alone() {
    let scene = room();
    let [pose, later] = [0.0, 0.5].map(|time_s| scene.pose(None, time_s));
    let jittered = gpu::with(Settings::cones(), &["voxels=16", "cones.set=g4", "cones.jitter=true"]);
    let printed = Settings { voxels: 16, ..Settings::printed() };
    for settings in [jittered, printed] {
        let mut studio = Studio::new(&scene, &settings);
        let (first, _) = studio.image(&pose);
        let (again, passes) = studio.image(&pose);
        let expected: &[&str] = if settings.of.cones.passes == Passes::Layered {
            &["visibility", "image", "resolve"]
        } else {
            &["visibility", "image"]
        };
        assert_eq!(passes, expected);
        assert!(again == first);
        // The cones turn with time.
        let (turned, passes) = studio.image(&later);
        assert!(!does(&passes, &LISTS) && does(&passes, &LIGHT), "{passes:?}");
        assert!(turned != first);
    }
}

#[test]
fn light_that_is_fed_back_stays_once_its_mean_is_made() {
    let scene = room();
    let (here, there) = (pose(&scene, DVec3::new(1.0, 1.0, 1.0)), pose(&scene, DVec3::new(5.0, 4.0, 3.0)));
    let settings = gpu::with(Settings::fast(), &["voxels=16", "bounces=all", "rays.passes=3"]);
    let mut studio = Studio::new(&scene, &settings);
    studio.view = View { eye: DVec3::new(4.0, 4.0, 0.5), forward: DVec3::Z, up: DVec3::Y, ..studio.view };
    let (first, _) = studio.image(&here);
    for _ in 0..2 {
        let (image, passes) = studio.image(&here);
        assert!(!does(&passes, &LISTS) && !passes.contains(&"shade 1"), "{passes:?}");
        assert!(image == first, "a still scene shows other bits");
    }
    // An object moves, a frame per position, without waiting; then the mean begins again, pass by pass, and ends.
    let (moved, passes) = studio.image(&there);
    assert!(does(&passes, &LISTS) && passes.contains(&"shade 1") && passes.contains(&"carry"), "{passes:?}");
    assert!(moved != first);
    let (_, passes) = studio.image(&there);
    assert!(!does(&passes, &LISTS) && passes.contains(&"shade 1") && !passes.contains(&"carry"), "{passes:?}");
}
