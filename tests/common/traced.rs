//! The path tracer's images for tests. Every test file uses a part of this.

use std::sync::atomic::AtomicBool;

use twobounce::reference::film::Film;
use twobounce::reference::{Control, Options, render};
use twobounce::scene::{Scene, Still, View};

/// The path tracer's film of `scene` from `view`, in its first pose. A sample that is not finite fails.
pub fn film(scene: &Scene, view: &View, options: &Options) -> Film {
    film_of(Still::new(scene, &scene.pose(None, 0.0), view), options)
}

/// As [`film`], of a scene in any pose.
pub fn film_of(still: Still, options: &Options) -> Film {
    let (mut film, never) = (Film::new(options.width, options.height), AtomicBool::new(false));
    let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
    render(still, options, &mut film, control).expect("nothing interrupts");
    assert_eq!(film.rejected(), 0, "samples that are not finite");
    film
}
