//! The runner of all experiments: missing rows, a budget, a lost device, progress, and repeated writing of pages.

use std::sync::Arc;
use std::time::{Duration, Instant};

use twobounce::output::file;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::DeviceArgs;
use super::interrupt;
use super::progress::RowProgress;

/// The minimum interval between writes of pages while rows are measured.
const PAGES_EVERY: Duration = Duration::from_secs(10);

/// Rows that are measured one by one, and pages that show them. Rows are numbered from 0.
pub trait Experiment {
    /// The number of rows, including measured ones.
    fn len(&self) -> usize;

    fn is_measured(&self, row: usize) -> bool;

    /// The row's name while it is measured.
    fn name(&self, row: usize) -> String;

    /// Prepares the references of a row, which does not count against the budget. An error ends the whole run.
    fn prepare(&mut self, _row: usize) -> Result<()> {
        Ok(())
    }

    /// Measures a row and stores it. `go_on` is called between frames. An error other than [`Error::Interrupted`] is
    /// the reason why the row cannot run, and is passed to [`Self::keep_failure`].
    fn measure(&mut self, row: usize, context: &Arc<Context>, go_on: &dyn Fn() -> Result<()>) -> Result<()>;

    /// Stores the reason why a row could not run, or returns an error that ends the whole run.
    fn keep_failure(&mut self, row: usize, error: Error) -> Result<()>;

    /// The finished row as a line; `None` if it is not printed.
    fn line(&self, _row: usize) -> Option<String> {
        None
    }

    /// Writes the pages with the existing rows. `running` says whether further rows follow.
    fn write(&mut self, _running: bool) -> Result<()> {
        Ok(())
    }
}

/// Options of a run.
pub struct Runner<'a> {
    pub device: &'a DeviceArgs,
    /// Size in pixels of the images, for the choice of a device.
    pub size: (u32, u32),
    /// The time limit for measuring.
    pub budget: Option<Duration>,
}

/// The time of the last writing of pages, and its duration.
#[derive(Default)]
pub struct Pages(Option<(Instant, Duration)>);

impl Pages {
    /// Writes pages with the existing rows unless they were written recently, so that a killed program leaves them.
    /// Writing takes at most a twentieth of the time.
    pub fn write_now_and_then(&mut self, experiment: &mut impl Experiment) -> Result<()> {
        if self.0.is_none_or(|(at, took)| at.elapsed() > PAGES_EVERY.max(20 * took)) {
            let begin = Instant::now();
            let _writing = file::writing();
            experiment.write(true)?;
            self.0 = Some((Instant::now(), begin.elapsed()));
        }
        Ok(())
    }
}

impl Runner<'_> {
    /// Measures the missing rows in order until the budget is spent or Ctrl-C is pressed. Returns whether the budget
    /// ended the run. Errors are those of the experiment that do not belong to a row, and a device that cannot be
    /// reopened.
    pub fn run(&self, experiment: &mut impl Experiment, context: Arc<Context>, pages: &mut Pages) -> Result<bool> {
        let missing: Vec<usize> = (0..experiment.len()).filter(|row| !experiment.is_measured(*row)).collect();
        let mut progress = RowProgress::new(missing.len(), experiment.len());
        let (mut start, mut device) = (Instant::now(), Some(context));
        let in_time = |start: Instant| self.budget.is_none_or(|budget| start.elapsed() < budget);
        let mut left = missing.len();
        for row in missing {
            if !in_time(start) || interrupt::check().is_err() {
                break;
            }
            let before = Instant::now();
            match experiment.prepare(row) {
                Err(Error::Interrupted) => break,
                result => result?,
            }
            start += before.elapsed();
            progress.begin(&experiment.name(row));
            let context = match device.take() {
                Some(context) => context,
                None => self.device.open(self.size)?,
            };
            let go_on = || if in_time(start) { interrupt::check() } else { Err(Error::Interrupted) };
            match experiment.measure(row, &context, &go_on) {
                Err(Error::Interrupted) => break,
                Ok(()) => device = Some(context),
                Err(error) => {
                    // A device that failed may be lost; the next row opens it again.
                    device = (!matches!(error, Error::Device(_))).then_some(context);
                    experiment.keep_failure(row, error)?;
                }
            }
            left -= 1;
            progress.finish(experiment.line(row).as_deref());
            pages.write_now_and_then(experiment)?;
        }
        Ok(interrupt::check().is_ok() && !in_time(start) && left > 0)
    }
}
