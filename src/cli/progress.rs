//! The progress bar over the rows of a chart that are still to be made, and a line for each.

use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use crate::say;

pub struct RowProgress {
    bar: ProgressBar,
}

/// A progress bar on standard error that looks like `template`.
pub fn bar(length: u64, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template).expect("the template is valid");
    ProgressBar::new(length).with_style(style)
}

impl RowProgress {
    /// `missing` rows of `all` are to be made.
    pub fn new(missing: usize, all: usize) -> Self {
        if missing < all {
            say!("rows kept from earlier calls: {} of {all}", all - missing);
        }
        Self { bar: bar(missing as u64, "{wide_bar} {msg}") }
    }

    /// `name`: of the row that is being made.
    pub fn begin(&self, name: &str) {
        self.bar.set_message(format!("{}: {name}", self.progress()));
        self.bar.tick();
    }

    /// `result`: the finished row in a line.
    pub fn finish(&self, result: &str) {
        self.bar.inc(1);
        // Into a log too, which shows no bar. Made before: a suspended bar cannot be asked.
        let progress = self.progress();
        self.bar.suspend(|| say!("{result} ({progress})"));
    }

    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Rows made, and how long the others take, over all scenes.
    fn progress(&self) -> String {
        let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let left = left(self.bar.elapsed(), done, all);
        format!("{done} of {all} rows") + &left.map_or(String::new(), |left| format!(", {} left", HumanDuration(left)))
    }
}

/// How long the rest takes if its rows take as long as all those before, which `spent` went into. The latest ones alone would
/// say less: scenes alternate, and one takes ten times as long as another.
fn left(spent: Duration, done: u64, all: u64) -> Option<Duration> {
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
}
