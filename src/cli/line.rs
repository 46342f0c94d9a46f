//! Progress of long work on standard error: one rewritten line on a terminal, otherwise a line every ten seconds.

pub mod course;

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

use twobounce::stage::duration;
use twobounce::vk::Step;

use super::threads;
use course::{Course, stage};

/// The interval of writing the line without a terminal, and on one.
const EVERY: Duration = Duration::from_secs(10);
const EVERY_ON_TERMINAL: Duration = Duration::from_millis(200);
/// Shorter work shows nothing on a terminal.
const SHORT: Duration = Duration::from_millis(500);
/// The maximum width in characters: a longer line would wrap, and could not be rewritten.
const WIDTH: usize = 79;

static LINE: Mutex<Line> = Mutex::new(Line { quiet: false, verbose: false, work: None, on_terminal: false });

struct Line {
    quiet: bool,
    /// Whether the line names passes and bands.
    verbose: bool,
    work: Option<Shown>,
    /// Whether a terminal shows the line now.
    on_terminal: bool,
}

/// The current work.
struct Shown {
    began: Instant,
    written: Instant,
    text: String,
    /// The remaining time as far as it is known, and when it was estimated.
    left: Option<(Instant, Duration)>,
    pass: Option<RunningPass>,
    /// The frame of a run.
    frame: Option<Course>,
}

struct RunningPass {
    name: &'static str,
    share: f64,
}

/// Work in progress; dropping it removes the line.
pub struct Work(());

impl Work {
    pub fn begin(text: &str) -> Self {
        static WRITER: Once = Once::new();
        // Without a thread there is no line.
        WRITER.call_once(|| drop(threads::spawn(write_now_and_then)));
        line().work = Some(Shown::new(text.to_owned(), Instant::now()));
        Self(())
    }

    /// Reports the current step, and the time for the rest.
    pub fn is_at(&self, text: String, left: Option<Duration>) {
        let (mut line, now) = (line(), Instant::now());
        // Other work in between removed the line when it ended.
        let work = line.work.get_or_insert_with(|| Shown::new(String::new(), now));
        (work.text, work.pass, work.frame) = (text, None, None);
        work.left = left.map(|left| (now, left));
    }

    /// Begins a frame of a run.
    pub fn frame(&self, course: Course) {
        if let Some(work) = &mut line().work {
            work.frame = Some(course);
        }
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        clear();
        line().work = None;
    }
}

/// Turns progress and other output off or on. Notes and errors are always written.
pub fn be_quiet(quiet: bool) {
    line().quiet = quiet;
}

/// Whether progress names passes and bands from now on.
pub fn be_verbose(verbose: bool) {
    line().verbose = verbose;
}

pub fn is_quiet() -> bool {
    line().quiet
}

/// Removes the line from the terminal before other output.
pub fn clear() {
    let mut line = line();
    if std::mem::take(&mut line.on_terminal) {
        let _ = write!(std::io::stderr(), "\r\x1b[K");
    }
}

/// Shows the progress of a frame's passes.
pub fn step(step: Step) {
    line().work.iter_mut().for_each(|work| work.step(step, Instant::now()));
}

fn line() -> MutexGuard<'static, Line> {
    LINE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn write_now_and_then() {
    let terminal = std::io::stderr().is_terminal();
    loop {
        std::thread::sleep(EVERY_ON_TERMINAL);
        let mut line = line();
        let (quiet, verbose) = (line.quiet, line.verbose);
        let Some(work) = line.work.as_mut().filter(|_| !quiet) else { continue };
        if let Some(text) = work.due(Instant::now(), terminal, verbose) {
            let _ = std::io::stderr().write_all(text.as_bytes());
            line.on_terminal = terminal;
        }
    }
}

impl Shown {
    fn new(text: String, began: Instant) -> Self {
        Self { began, written: began, text, left: None, pass: None, frame: None }
    }

    fn step(&mut self, step: Step, now: Instant) {
        if let Some(frame) = &mut self.frame {
            frame.step(step, now);
        }
        self.pass = Some(RunningPass { name: step.pass, share: step.share });
    }

    /// The text to be written now, if any.
    fn due(&mut self, now: Instant, terminal: bool, verbose: bool) -> Option<String> {
        let due = if terminal { now - self.began >= SHORT } else { now - self.written >= EVERY };
        due.then(|| {
            self.written = now;
            let text: String = self.progress_in_words(now, verbose).chars().take(WIDTH).collect();
            if terminal { format!("\r\x1b[K{text}") } else { format!("twobounce: {text}\n") }
        })
    }

    /// The current work, and the remaining time of all of it, or the time so far if that is unknown.
    fn progress_in_words(&self, now: Instant, verbose: bool) -> String {
        let mut words = self.text.clone();
        match &self.pass {
            Some(pass) if verbose => {
                let band = self.frame.as_ref().and_then(|frame| frame.band(pass.name));
                let band = band.map_or(String::new(), |band| band + ",");
                words += &format!(": {}{band} {:.0} %", pass.name, 100.0 * pass.share);
            }
            Some(pass) => words += &format!(": {}", stage(pass.name)),
            None => {}
        }
        let own = self.left.map(|(since, left)| (left.saturating_sub(now - since), false));
        let left = own.or_else(|| self.frame.as_ref()?.left(now));
        // A lower bound of 0 is not shown.
        match left.filter(|(left, at_least)| !at_least || *left >= Duration::from_secs(1)) {
            Some((left, at_least)) => {
                words + &format!(", {} {} left", if at_least { "at least" } else { "about" }, duration(left))
            }
            None if self.pass.is_some() => words + &format!(", {} so far", duration(now - self.began)),
            None => words,
        }
    }
}

/// The time for the rest at the average rate so far, of which `spent` is the time. The latest rate alone would be
/// worse: rows alternate between scenes, and one takes ten times as long as another.
pub fn left(spent: Duration, done: u64, all: u64) -> Option<Duration> {
    (0 < done && done < all).then(|| spent.mul_f64((all - done) as f64 / done as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_takes_as_long_as_rows_took_in_the_mean() {
        let spent = Duration::from_secs(60);
        assert_eq!([0, 3, 12].map(|done| left(spent, done, 12)), [None, Some(3 * spent), None]);
    }

    #[test]
    fn a_line_says_what_is_done_and_what_is_left() {
        let began = Instant::now();
        let at = |seconds| began + Duration::from_secs(seconds);
        let mut work = Shown::new("duck".into(), began);
        assert_eq!(work.due(at(0), true, false), None, "nothing at once");
        assert_eq!(work.due(at(9), false, false), None, "nothing before ten seconds without a terminal");
        work.step(Step { pass: "shade 1", turn: 0, share: 0.25 }, at(4));
        assert_eq!(work.due(at(5), true, false).as_deref(), Some("\r\x1b[Kduck: light, 5 s so far"));
        assert_eq!(work.progress_in_words(at(5), true), "duck: shade 1 25 %, 5 s so far", "passes only with -v");
        assert_eq!(work.due(at(5), false, false), None, "the last line is younger than ten seconds");
        work.left = Some((at(4), Duration::from_secs(125)));
        let line = work.due(at(15), false, false);
        assert_eq!(line.as_deref(), Some("twobounce: duck: light, about 1 min 54 s left\n"));
        work.step(Step { pass: "image", turn: 0, share: 0.5 }, at(16));
        work.left = None;
        assert_eq!(
            work.progress_in_words(at(16), false),
            "duck: image, 16 s so far",
            "without a frame nothing is known of the rest"
        );
    }

    #[test]
    fn frames_after_this_one_take_as_long() {
        let began = Instant::now();
        let at = |seconds| began + Duration::from_secs(seconds);
        let course = |since, after, mean| {
            let mut course = Course::new(at(since), 4, 1);
            (course.after, course.mean) = (after, mean);
            Some(course)
        };
        let mut work = Shown::new("duck, frame 1 of 3".to_owned(), began);
        work.frame = course(0, 2, None);
        work.step(Step { pass: "image", turn: 0, share: 0.5 }, at(1));
        assert_eq!(work.progress_in_words(at(1), true), "duck, frame 1 of 3: image 1 of 4, 50 %, about 23 s left");
        assert_eq!(work.progress_in_words(at(1), false), "duck, frame 1 of 3: image, about 23 s left");
        work.frame = course(10, 1, Some(Duration::from_secs(10)));
        work.pass = None;
        assert_eq!(
            work.progress_in_words(at(12), false),
            "duck, frame 1 of 3, about 18 s left",
            "before the image the mean tells"
        );
        work.frame.as_mut().unwrap().open = true;
        work.step(Step { pass: "image", turn: 0, share: 0.5 }, at(13));
        assert_eq!(
            work.progress_in_words(at(13), false),
            "duck, frame 1 of 3: image, 13 s so far",
            "passes of unknown number follow"
        );
    }
}
