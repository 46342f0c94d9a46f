//! How far frames and rows are, and the watch that ends work after Ctrl-C.

use std::sync::Arc;
use std::time::Instant;

use twobounce::vk::Watch;

pub use super::line::{Work, course, left};
use super::{interrupt, line};
use crate::say;
use course::Course;
use twobounce::stage::duration;

/// Shows how far a frame's passes are, and ends it after Ctrl-C.
pub fn watch() -> Watch {
    Arc::new(|step| {
        line::step(step);
        interrupt::check()
    })
}

/// The frames of a run.
pub struct FrameProgress {
    work: Work,
    began: Instant,
    done: u32,
    all: u32,
    /// Whether passes whose number is not known yet refine the image.
    pub refined: bool,
    /// When a time limit ends the work, if it has one.
    pub until: Option<Instant>,
}

impl FrameProgress {
    /// `work`: under way already, while passes are made.
    pub fn new(work: Work, all: u32) -> Self {
        Self { work, began: Instant::now(), done: 0, all, refined: false, until: None }
    }

    /// `name`: of the scene whose frame is being made. `bands`: see [`twobounce::renderer::Renderer::bands`].
    pub fn begin(&self, name: &str, bands: (u32, u32)) {
        let (done, all) = (self.done, self.all);
        let text = if all > 1 { format!("{name}, frame {} of {all}", done + 1) } else { name.to_owned() };
        self.work.is_at(text, None);
        let mut course = Course::new(Instant::now(), bands.0, bands.1);
        (course.after, course.mean) = (all - done - 1, (done > 0).then(|| self.began.elapsed() / done));
        (course.open, course.until) = (self.refined, self.until);
        self.work.frame(course);
    }

    /// The image has so many passes, and needs about as many as `needs` says.
    pub fn adds_a_pass(&self, name: &str, bands: u32, has: u32, needs: Option<u32>) {
        let of = needs.map_or(String::new(), |needs| format!(" of about {}", needs.max(has + 1)));
        self.work.is_at(format!("{name}, pass {}{of}", has + 1), None);
        let mut course = Course::new(Instant::now(), bands, 1);
        (course.open, course.until) = (needs.is_none(), self.until);
        course.after = needs.map_or(0, |needs| needs.saturating_sub(has + 1));
        course.mean = Some(self.began.elapsed() / (self.done + has));
        self.work.frame(course);
    }

    pub fn finish(&mut self) {
        self.done += 1;
    }
}

/// The rows of a chart that are still to be made, with a line on standard output for each that is finished.
pub struct RowProgress {
    work: Work,
    began: Instant,
    done: u64,
    all: u64,
}

impl RowProgress {
    /// `missing` rows of `all` are to be made.
    pub fn new(missing: usize, all: usize) -> Self {
        if missing < all {
            say!("rows kept from earlier calls: {} of {all}", all - missing);
        }
        Self { work: Work::begin("rows"), began: Instant::now(), done: 0, all: missing as u64 }
    }

    /// `name`: of the row that is being made.
    pub fn begin(&self, name: &str) {
        let text = format!("{} of {} rows: {name}", self.done, self.all);
        self.work.is_at(text, left(self.began.elapsed(), self.done, self.all));
    }

    /// `result`: the finished row in a line, if it is told.
    pub fn finish(&mut self, result: Option<&str>) {
        self.done += 1;
        let Some(result) = result else { return };
        let left = left(self.began.elapsed(), self.done, self.all);
        let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
        say!("{result} ({} of {} rows{left})", self.done, self.all);
    }
}
