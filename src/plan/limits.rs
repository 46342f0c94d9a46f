//! Limits on settings, and the comparison of settings.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use super::search::Reading;

/// Limits on a frame's cost and error; at least one is set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Mean |image − reference| over the reference's mean, as a share.
    pub error: Option<f64>,
    /// Milliseconds of device time.
    pub ms: Option<f64>,
    /// Bytes of device memory.
    pub bytes: Option<u64>,
}

/// A score of settings; less is better. Settings that hold the limits come first: among these the fastest wins if the
/// error is limited, otherwise the most accurate. Among the others the one nearest to the limits wins.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Score {
    /// Sum of ln(value / limit) over the exceeded limits.
    pub excess: f64,
    /// The logarithm of the quantity to minimise.
    pub cost: f64,
}

impl Limits {
    /// The limits that are set: their flags, and the shares that are used.
    fn taken(&self, of: &Reading) -> impl Iterator<Item = (&'static str, f64)> {
        let error = self.error.map(|limit| ("--max-error", of.error / limit));
        let ms = self.ms.map(|limit| ("--max-ms", of.ms / limit));
        let bytes = self.bytes.map(|limit| ("--max-mib", of.bytes as f64 / limit as f64));
        [error, ms, bytes].into_iter().flatten()
    }

    pub fn score(&self, of: &Reading) -> Score {
        let excess = self.taken(of).map(|(_, share)| share.ln().max(0.0)).sum();
        let cost = if self.error.is_some() { of.ms } else { of.error };
        Score { excess, cost: cost.ln() }
    }

    pub fn hold(&self, of: &Reading) -> bool {
        self.score(of).excess <= 0.0
    }

    /// The limit that is exceeded most or, if all hold, the one with the least room: its flag, and the share that is
    /// used.
    pub fn binding(&self, of: &Reading) -> Option<(&'static str, f64)> {
        self.taken(of).max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl Score {
    pub fn compare(&self, other: &Self) -> Ordering {
        self.excess.total_cmp(&other.excess).then(self.cost.total_cmp(&other.cost))
    }

    /// Whether the score is better by at least the share `by`.
    pub fn beats(&self, other: &Self, by: f64) -> bool {
        if self.excess != other.excess {
            self.excess < other.excess - by.min(0.5 * other.excess)
        } else {
            self.cost < other.cost - by
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(error: f64, ms: f64, mib: u64) -> Reading {
        Reading { ms, error, bytes: mib << 20, passes: Default::default() }
    }

    #[test]
    fn what_holds_comes_first_then_the_cheapest_then_the_nearest() {
        let limits = Limits { error: Some(0.1), ms: None, bytes: Some(50 << 20) };
        let in_order = [
            reading(0.09, 10.0, 50),
            reading(0.01, 11.0, 1),
            reading(0.11, 1.0, 1),
            reading(0.01, 1.0, 60),
            reading(f64::INFINITY, 1.0, 1),
        ];
        for pair in in_order.windows(2) {
            assert_eq!(limits.score(&pair[0]).compare(&limits.score(&pair[1])), Ordering::Less, "{pair:?}");
        }
        assert_eq!(in_order.map(|reading| limits.hold(&reading)), [true, true, false, false, false]);
    }

    #[test]
    fn without_a_limit_on_the_error_the_least_error_wins() {
        let limits = Limits { error: None, ms: Some(20.0), bytes: None };
        assert!(limits.score(&reading(0.05, 19.0, 1)).beats(&limits.score(&reading(0.06, 1.0, 1)), 0.03));
        assert_eq!(limits.binding(&reading(0.05, 19.0, 1)).unwrap(), ("--max-ms", 0.95));
    }
}
