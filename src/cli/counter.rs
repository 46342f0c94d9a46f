//! The progress bar over the rows of a chart that are still to be made, and a line for each.

use indicatif::{ProgressBar, ProgressStyle};
use twobounce::chart::row::{Metric, Part, Row, Truth};

use crate::say;

pub struct Counter {
    bar: ProgressBar,
}

impl Counter {
    /// `missing` rows of `all` are to be made.
    pub fn new(missing: usize, all: usize) -> Self {
        if missing < all {
            say!("rows kept from earlier calls: {} of {all}", all - missing);
        }
        let bar = ProgressBar::new(missing as u64);
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos} of {len} rows, {eta} left: {msg}") {
            bar.set_style(style);
        }
        Self { bar }
    }

    pub fn begin(&self, row: &Row) {
        self.bar.set_message(format!("{} {}", row.scene, row.name));
        self.bar.tick();
    }

    pub fn finish(&self, row: &Row) {
        self.bar.inc(1);
        let told = match &row.measured {
            Some(measured) => {
                let error = |truth| row.error(truth, Part::Total, Metric::Rel).unwrap_or(f64::NAN);
                let (full, same) = (error(Truth::Full), error(Truth::Same));
                let ms = measured.frame_gpu_ms.median;
                format!("{ms:.0} ms, rel {full:.3} of all light, {same:.3} of as many bounces")
            }
            None => row.failure.clone().unwrap_or_default(),
        };
        self.bar.suspend(|| say!("{} {}: {told}", row.scene, row.name));
    }

    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
