//! The runner of all experiments: rows that are missing, a budget, a lost device, progress, pages now and then.

use std::sync::Arc;
use std::time::{Duration, Instant};

use twobounce::output::file;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::DeviceArgs;
use super::interrupt;
use super::progress::RowProgress;

/// How often pages are written while rows are measured, at most.
const PAGES_EVERY: Duration = Duration::from_secs(10);

/// Rows that are measured one by one, and pages that show them. Rows are counted from 0.
pub trait Experiment {
    /// How many rows there are, those that are measured already too.
    fn len(&self) -> usize;

    fn is_measured(&self, row: usize) -> bool;

    /// The row's name while it is measured.
    fn name(&self, row: usize) -> String;

    /// Makes what a row is compared with, which does not count against the budget. Any error ends the whole run.
    fn prepare(&mut self, _row: usize) -> Result<()> {
        Ok(())
    }

    /// Measures a row and keeps it. `go_on` is asked between frames. An error that is not [`Error::Interrupted`] is
    /// what keeps the row from running: [`Self::keep_failure`] has it next.
    fn measure(&mut self, row: usize, context: &Arc<Context>, go_on: &dyn Fn() -> Result<()>) -> Result<()>;

    /// Keeps why a row could not run, or gives an error that ends the whole run.
    fn keep_failure(&mut self, row: usize, error: Error) -> Result<()>;

    /// The finished row in a line; `None` where it is not told.
    fn line(&self, _row: usize) -> Option<String> {
        None
    }

    /// Writes the pages with the rows that there are. `running`: whether others follow.
    fn write(&mut self, _running: bool) -> Result<()> {
        Ok(())
    }
}

/// How an experiment is run.
pub struct Runner<'a> {
    pub device: &'a DeviceArgs,
    /// Pixels of the images, for which a device is chosen.
    pub size: (u32, u32),
    /// The time for measuring.
    pub budget: Option<Duration>,
}

/// When pages were written last, and how long that took.
#[derive(Default)]
pub struct Pages(Option<(Instant, Duration)>);

impl Pages {
    /// Writes pages of what there is now, unless they were just written: a program that is killed leaves them. Of many
    /// rows that takes a while: at most a twentieth of the time goes into it.
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
    /// Measures the rows that are missing, in their order, until the budget is spent or Ctrl-C is pressed. Says whether
    /// the budget ended it. Errors are those of the experiment that are no row's own, and a device that cannot be
    /// opened again.
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
