//! Which settings are run: every base by itself, then every value of every axis on top of every base, one axis at a time.

use std::collections::BTreeSet;
use std::slice;

use crate::settings::{Key, Range, Settings};
use crate::{Error, Result};

/// One setting to run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The preset that it starts from.
    pub preset: String,
    /// The swept value, as `key=value`; empty for a base by itself.
    pub swept: Vec<String>,
    pub settings: Settings,
}

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

impl Trial {
    /// What sweeps start from.
    pub fn base(preset: &str, settings: Settings) -> Self {
        Self { preset: preset.to_owned(), swept: Vec::new(), settings }
    }

    /// The preset and what was swept, in one line.
    pub fn name(&self) -> String {
        [slice::from_ref(&self.preset), &self.swept].concat().join(" ")
    }

    /// `key=value` of every setting whose value is not the preset's. A base that is no preset shows all that differs from the
    /// default one.
    pub fn changes(&self) -> Vec<String> {
        self.settings.changes_from(&Settings::preset(&self.preset).unwrap_or_default())
    }
}

/// The settings to run: the bases, then each of `values`, a list of `key=value`, on top of every base. What would run twice
/// runs once, under its first name.
///
/// # Errors
/// [`Error::Usage`]: a key or a value that does not exist.
pub fn trials(bases: &[Trial], values: &[Vec<String>]) -> Result<Vec<Trial>> {
    let mut trials: Vec<Trial> = Vec::new();
    for swept in std::iter::once(&Vec::new()).chain(values) {
        for base in bases {
            let mut settings = base.settings.clone();
            swept.iter().try_for_each(|assignment| settings.set(assignment))?;
            trials.push(Trial { preset: base.preset.clone(), swept: swept.clone(), settings });
        }
    }
    Ok(distinct(trials))
}

/// Without those whose settings mean the same as earlier ones.
pub fn distinct(trials: impl IntoIterator<Item = Trial>) -> Vec<Trial> {
    let mut seen = BTreeSet::new();
    trials.into_iter().filter(|trial| seen.insert(trial.settings.to_toml())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bases() -> [Trial; 2] {
        ["fast", "printed"].map(|name| Trial::base(name, Settings::preset(name).unwrap()))
    }

    #[test]
    fn one_axis_at_a_time_and_nothing_twice() {
        let values = ["voxels=64,128", "bounces=2,all"].map(|text| sweep(text).unwrap()).concat();
        let names: Vec<String> = trials(&bases(), &values).unwrap().iter().map(Trial::name).collect();
        // 128 voxels and two bounces are the presets themselves.
        let expected =
            ["fast", "printed", "fast voxels=64", "printed voxels=64", "fast bounces=all", "printed bounces=all"];
        assert_eq!(names, expected);
    }

    #[test]
    fn changes_are_those_from_the_preset() {
        let trials = trials(&bases(), &sweep("voxels=64").unwrap()).unwrap();
        assert_eq!(trials[3].changes(), ["voxels=64"]);
        assert!(trials[0].changes().is_empty());
        // What only cones would heed is no change of rays: nothing runs twice for it.
        let values = sweep("cones.step=2").unwrap();
        let names: Vec<String> = super::trials(&bases(), &values).unwrap().iter().map(Trial::name).collect();
        assert_eq!(names, ["fast", "printed", "printed cones.step=2"]);
    }
}
