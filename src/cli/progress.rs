//! Progress of frames and rows, and the function that ends work after Ctrl-C.

use std::sync::Arc;
use std::time::Instant;

use twobounce::vk::Watch;

pub use super::line::{Work, course, left};
use super::{interrupt, line};
use crate::say;
use course::Course;
use twobounce::stage::duration;

/// Shows the progress of a frame's passes, and ends it after Ctrl-C.
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
    /// Whether an unknown number of passes refines the image.
    pub refined: bool,
    /// The time at which a time limit ends the work, if there is one.
    pub until: Option<Instant>,
}

impl FrameProgress {
    /// `work` is in progress until frames begin.
    pub fn new(work: Work, all: u32) -> Self {
        Self { work, began: Instant::now(), done: 0, all, refined: false, until: None }
    }

    /// Begins a frame of the scene `name`. `bands`: see [`twobounce::renderer::Renderer::bands`].
    pub fn begin(&self, name: &str, bands: (u32, u32)) {
        let (done, all) = (self.done, self.all);
        let text = if all > 1 { format!("{name}, frame {} of {all}", done + 1) } else { name.to_owned() };
        self.work.is_at(text, None);
        let mut course = Course::new(Instant::now(), bands.0, bands.1);
        (course.after, course.mean) = (all - done - 1, (done > 0).then(|| self.began.elapsed() / done));
        (course.open, course.until) = (self.refined, self.until);
        self.work.frame(course);
    }

    /// Reports that the image has `has` passes, and needs about as many as `needs` says.
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

/// The missing rows of a chart, with a line on standard output for each finished row.
pub struct RowProgress {
    work: Work,
    began: Instant,
    done: u64,
    all: u64,
}

impl RowProgress {
    /// `missing` rows of `all` remain.
    pub fn new(missing: usize, all: usize) -> Self {
        if missing < all {
            say!("rows kept from earlier calls: {} of {all}", all - missing);
        }
        Self { work: Work::begin("rows"), began: Instant::now(), done: 0, all: missing as u64 }
    }

    /// Begins the row `name`.
    pub fn begin(&self, name: &str) {
        let text = format!("{} of {} rows: {name}", self.done, self.all);
        self.work.is_at(text, left(self.began.elapsed(), self.done, self.all));
    }

    /// Ends a row; `result` is a line for it, if it is printed.
    pub fn finish(&mut self, result: Option<&str>) {
        self.done += 1;
        let Some(result) = result else { return };
        let left = left(self.began.elapsed(), self.done, self.all);
        let left = left.map_or(String::new(), |left| format!(", {} left", duration(left)));
        say!("{result} ({} of {} rows{left})", self.done, self.all);
    }
}
