//! A table held against an earlier one.

use super::cases;
use super::export::Line;

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
pub fn changes(before: &[Line], now: &[Line]) -> Changes {
    let mut changes = Changes::default();
    for new in now {
        let name = format!("{} {} {}³", new.case, new.preset, new.grid);
        let Some(old) = before.iter().find(|old| old.is_same_as(new)) else {
            changes.unknown.push(name);
            continue;
        };
        changes.compared += 1;
        match (old.distance, new.distance) {
            (Some(old), Some(now)) => {
                let line = format!("{name}: {now} from the ideal, was {old}");
                let limit = cases::named(&new.case).map_or(0.0, |case| case.limit);
                let tolerance = SHARE * old + OF_LIMIT * if limit > 0.0 { limit } else { 1e-3 };
                match now - old {
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

    #[test]
    fn worse_and_better_are_told_apart() {
        let table = |case: &str, distance| {
            [Line { case: case.into(), preset: "fast".into(), grid: 32, distance, ..Line::default() }]
        };
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
