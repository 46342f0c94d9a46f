//! The settings of a chart: every base alone, then every value of every axis on top of every base, one axis at a time.

use std::collections::BTreeSet;

use super::row::Row;
use crate::settings::{Key, Range, Settings};
use crate::{Error, Result};

/// The values of a sweep `key=value,value,…`, each as the `key=value` to set.
///
/// # Errors
/// [`Error::Usage`], naming the key.
pub fn sweep(text: &str) -> Result<Vec<Vec<String>>> {
    let Some((key, values)) = text.split_once('=') else {
        return Err(Error::Usage(format!("{text:?} names no values: write key=value,value, such as voxels=32,64")));
    };
    let (key, is_point) = (key.trim(), |key: &Key| matches!(key.range, Range::Center(_)));
    if Key::named(key).is_some_and(is_point) {
        return Err(Error::Usage(format!("{key} is a point, which cannot be swept: set it with --set")));
    }
    Ok(values.split(',').map(|value| vec![format!("{key}={}", value.trim())]).collect())
}

/// The settings to run: the bases, then each of `values`, a list of `key=value`, on top of every base. Equal settings
/// run once, under their first name.
///
/// # Errors
/// [`Error::Usage`] for a key or a value that does not exist.
pub fn trials(bases: &[Row], values: &[Vec<String>]) -> Result<Vec<Row>> {
    let mut trials: Vec<Row> = Vec::new();
    for swept in std::iter::once(&Vec::new()).chain(values) {
        for base in bases {
            let mut settings = base.settings.clone().unwrap_or_default();
            swept.iter().try_for_each(|assignment| settings.set(assignment))?;
            trials.push(Row::of_settings(&base.preset, swept, settings));
        }
    }
    Ok(distinct(trials))
}

/// The trials without those whose settings are equivalent to earlier ones.
pub fn distinct(trials: impl IntoIterator<Item = Row>) -> Vec<Row> {
    let mut seen = BTreeSet::new();
    trials.into_iter().filter(|row| seen.insert(row.settings.as_ref().map(Settings::to_toml))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bases() -> [Row; 2] {
        ["fast", "printed"].map(|name| Row::of_settings(name, &[], Settings::preset(name).unwrap()))
    }

    #[test]
    fn one_axis_at_a_time_and_nothing_twice() {
        let values = ["voxels=64,128", "bounces=2,all"].map(|text| sweep(text).unwrap()).concat();
        let names: Vec<String> = trials(&bases(), &values).unwrap().into_iter().map(|row| row.name).collect();
        // 128 voxels and two bounces equal the presets themselves.
        let expected =
            ["fast", "printed", "fast voxels=64", "printed voxels=64", "fast bounces=all", "printed bounces=all"];
        assert_eq!(names, expected);
    }

    #[test]
    fn changes_are_those_from_the_preset() {
        let trials = trials(&bases(), &sweep("voxels=64").unwrap()).unwrap();
        assert_eq!(trials[3].changes, ["voxels=64"]);
        assert!(trials[0].changes.is_empty());
        // A setting of cones does not affect rays, so nothing runs twice for it.
        let values = sweep("cones.step=2").unwrap();
        let names: Vec<String> = super::trials(&bases(), &values).unwrap().into_iter().map(|row| row.name).collect();
        assert_eq!(names, ["fast", "printed", "printed cones.step=2"]);
    }
}
