//! A table held against an earlier one.

use super::cases;
use super::export::Rows;

/// What another driver's rounding may move a number: a share of its distance from the ideal, and of the case's limit (of a
/// thousandth, where the limit is nothing).
const SHARE: f64 = 0.1;
const OF_LIMIT: f64 = 0.2;

/// What changed, a sentence each.
#[derive(Debug, Default)]
pub struct Changes {
    /// Further from the ideal, or no longer measured.
    pub worse: Vec<String>,
    pub better: Vec<String>,
    /// Rows that the earlier table has not.
    pub unknown: Vec<String>,
    /// Rows that both have.
    pub compared: usize,
}

/// Compares the rows of `now` with those of `before`. Rows that only the earlier table has are left out.
pub fn changes(before: &Rows, now: &Rows) -> Changes {
    let mut changes = Changes::default();
    for (key @ (case, preset, grid), new) in now {
        let name = format!("{case} {preset} {grid}³");
        let Some(old) = before.get(key) else {
            changes.unknown.push(name);
            continue;
        };
        changes.compared += 1;
        match (old, new) {
            (Some(old), Some(new)) => {
                let line = format!("{name}: {} from the ideal, was {}", new.distance, old.distance);
                let limit = cases::named(case).map_or(0.0, |case| case.limit);
                let tolerance = SHARE * old.distance + OF_LIMIT * if limit > 0.0 { limit } else { 1e-3 };
                match new.distance - old.distance {
                    d if d > tolerance => changes.worse.push(line),
                    d if d < -tolerance => changes.better.push(line),
                    _ => {}
                }
            }
            (Some(_), None) => changes.worse.push(format!("{name} could not run, and did before")),
            (None, Some(_)) => changes.better.push(format!("{name} runs, and did not before")),
            (None, None) => {}
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::export::Kept;

    fn table(case: &str, distance: Option<f64>) -> Rows {
        let kept = distance.map(|distance| Kept { median: 0.0, min: 0.0, max: 0.0, distance });
        Rows::from([((case.to_owned(), "fast".to_owned(), 32), kept)])
    }

    #[test]
    fn worse_and_better_are_told_apart() {
        // The limit of leaks is a thousandth, that of stillness nothing.
        let told = |case, old, new| {
            let changes = changes(&table(case, old), &table(case, new));
            (changes.worse.len(), changes.better.len(), changes.compared)
        };
        assert_eq!(told("leak-1", Some(0.0), Some(0.0001)), (0, 0, 1));
        assert_eq!(told("leak-1", Some(0.0), Some(0.001)), (1, 0, 1));
        assert_eq!(told("flicker", Some(0.0), Some(0.001)), (1, 0, 1));
        assert_eq!(told("leak-1", Some(0.05), Some(0.04)), (0, 1, 1));
        assert_eq!(told("leak-1", Some(0.05), Some(0.054)), (0, 0, 1));
        assert_eq!(told("leak-1", Some(0.05), None), (1, 0, 1));
        assert_eq!(told("leak-1", None, Some(0.05)), (0, 1, 1));
        let changes = changes(&table("leak-1", None), &table("leak-2", None));
        assert_eq!((changes.unknown, changes.compared), (vec!["leak-2 fast 32³".to_owned()], 0));
    }
}
