//! The remaining time of a frame and of later frames of its run. The passes after the light are known: those over the
//! image, band after band.

use std::time::{Duration, Instant};

use twobounce::vk::Step;

/// The passes over the image in order, which follow the light. A method may have only the second one.
pub const IMAGE_PASSES: [&str; 2] = ["gather", "image"];

/// The part of a frame that a pass belongs to, in words for users.
pub fn stage(pass: &str) -> &'static str {
    let of_image = ["visibility", "share", "resolve"].contains(&pass);
    if of_image || IMAGE_PASSES.iter().any(|name| pass.starts_with(name)) { "image" } else { "light" }
}

/// A frame in progress.
pub struct Course {
    began: Instant,
    /// The number of bands of an image, and of images whose mean is taken.
    bands: u32,
    images: u32,
    /// The current image, from 0.
    image: u32,
    /// The last observation: its time and its band.
    at: Instant,
    band: u32,
    /// For each pass: finished bands of all images, and their time.
    done: [(f64, Duration); 2],
    /// The number of later frames.
    pub after: u32,
    /// The mean time of earlier frames.
    pub mean: Option<Duration>,
    /// Whether an unknown number of passes follows, so that the rest is unknown.
    pub open: bool,
    /// The time at which a time limit ends the work, if there is one.
    pub until: Option<Instant>,
}

impl Course {
    /// A single frame. `bands` and `images`: see [`twobounce::renderer::Renderer::bands`].
    pub fn new(began: Instant, bands: u32, images: u32) -> Self {
        let done = [(0.0, Duration::ZERO); 2];
        Self {
            began,
            bands,
            images,
            image: 0,
            at: began,
            band: 0,
            done,
            after: 0,
            mean: None,
            open: false,
            until: None,
        }
    }

    /// Reports the end of a submission.
    pub fn step(&mut self, step: Step, now: Instant) {
        let spent = now - self.at;
        self.at = now;
        let Some(pass) = IMAGE_PASSES.iter().position(|name| *name == step.pass) else { return };
        // Another image begins with its first band.
        self.image = (self.image + u32::from(step.turn < self.band)).min(self.images - 1);
        self.band = step.turn;
        let (done, took) = &mut self.done[pass];
        (*done, *took) = (f64::from(self.image * self.bands + step.turn) + step.share, *took + spent);
    }

    /// The band of the current pass, if there are several.
    pub fn band(&self, pass: &str) -> Option<String> {
        let all = self.bands * self.images;
        let shown = all > 1 && IMAGE_PASSES.contains(&pass);
        shown.then(|| format!(" {} of {all}", (self.image * self.bands + self.band + 1).min(all)))
    }

    /// The remaining time of this frame and later ones at the average rate, and whether further work of unknown
    /// duration follows; `None` before the image.
    pub fn left(&self, now: Instant) -> Option<(Duration, bool)> {
        let limit = self.until.map(|until| until.saturating_duration_since(now));
        if self.open {
            return Some((limit?, false));
        }
        let all = f64::from(self.bands * self.images);
        let known = self.done.map(|(done, took)| (done > 0.01 && !took.is_zero()).then_some((done, took)));
        let rest = known.iter().flatten().map(|(done, took)| took.mul_f64((all / done - 1.0).max(0.0)));
        let rest = rest.sum::<Duration>().saturating_sub(now - self.at);
        let own = known.iter().any(Option::is_some).then_some((rest, known[1].is_none()));
        let spent = now - self.began;
        // The times of earlier frames are better known than that of an image after its first pass.
        let own = own.filter(|(_, at_least)| !at_least || self.mean.is_none());
        let (left, at_least) = own.or_else(|| Some((self.mean?.saturating_sub(spent), false)))?;
        let left = left + self.after * self.mean.unwrap_or(spent + left);
        Some(limit.filter(|limit| *limit <= left).map_or((left, at_least), |limit| (limit, false)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_tell_what_is_left_of_a_frame() {
        let began = Instant::now();
        let at = |seconds| began + Duration::from_secs(seconds);
        let step = |pass, turn, share| Step { pass, turn, share };
        let left = |course: &Course, seconds| {
            course.left(at(seconds)).map(|(left, at_least)| (left.as_secs_f64().round() as u64, at_least))
        };
        let mut course = Course::new(began, 4, 1);
        course.step(step("shade 1", 0, 0.5), at(8));
        assert_eq!(left(&course, 8), None, "the light tells nothing of the image");
        // Gathering takes 10 seconds per band, and the image 3.
        course.step(step("gather", 0, 0.0), at(10));
        course.step(step("gather", 0, 0.5), at(15));
        // The first observation counts two seconds of light as gathering.
        assert_eq!(left(&course, 15), Some((49, true)));
        assert_eq!(left(&course, 18), Some((46, true)), "time passes between looks");
        course.step(step("gather", 0, 1.0), at(20));
        course.step(step("image", 0, 1.0), at(23));
        assert_eq!(left(&course, 23), Some((3 * 12 + 3 * 3, false)));
        assert_eq!(course.band("image").as_deref(), Some(" 1 of 4"));
        // A submission may end two bands later.
        course.step(step("gather", 3, 0.0), at(46));
        assert_eq!(course.band("gather").as_deref(), Some(" 4 of 4"));
        course.step(step("gather", 3, 1.0), at(56));
        course.step(step("image", 3, 1.0), at(59));
        assert_eq!(left(&course, 59), Some((0, false)));
        (course.after, course.until) = (9, Some(at(70)));
        assert_eq!(left(&course, 60), Some((10, false)), "a time limit ends it");
        course.open = true;
        assert_eq!(left(&course, 61), Some((9, false)));
    }

    #[test]
    fn images_of_a_mean_come_one_after_another() {
        let began = Instant::now();
        let mut course = Course::new(began, 2, 3);
        let looks = [(0, 0.5), (0, 1.0), (1, 1.0), (0, 1.0), (1, 1.0)];
        for (i, (turn, share)) in looks.into_iter().enumerate() {
            course.step(Step { pass: "image", turn, share }, began + Duration::from_secs(2 * i as u64 + 2));
        }
        let now = began + Duration::from_secs(10);
        assert_eq!(course.left(now), Some((Duration::from_secs(5), false)));
        assert_eq!(course.band("image").as_deref(), Some(" 4 of 6"));
    }
}
