//! Merges presets, files and single keys, and checks key by key, so that every message names the wrong key.

use std::collections::BTreeMap;

use toml::{Table, Value};

use super::{Key, PRESETS, Range, Settings, keys};
use crate::error::said;
use crate::{Error, Result};

impl Settings {
    /// The preset called `name`.
    ///
    /// # Errors
    /// [`Error::Usage`] that suggests the nearest name if there is no such preset.
    pub fn preset(name: &str) -> Result<Self> {
        let found = PRESETS.iter().find(|preset| preset.name == name);
        found.map(|preset| (preset.settings)()).ok_or_else(|| {
            let names: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
            Error::Usage(format!("there is no preset {name:?}; {}", suggestion(name, &names)))
        })
    }

    /// Applies every key of a TOML text; other keys stay unchanged.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the line or the key, without the file's name.
    pub fn merge_toml(&mut self, text: &str) -> Result<()> {
        let table: Table = text.parse().map_err(|e: toml::de::Error| {
            let line = e.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            Error::Usage(format!("line {line} is not valid TOML: {}", said(&e.message())))
        })?;
        // A known group without keys changes nothing.
        let leaves =
            leaves("", &table).into_iter().filter(|(name, value)| !value.is_table() || first_of_group(name).is_none());
        self.replace(&leaves.map(|(name, value)| Ok((known(&name)?, value))).collect::<Result<Vec<_>>>()?)
    }

    /// Applies one `key=value` of `--set`.
    ///
    /// # Errors
    /// [`Error::Usage`], naming the key.
    pub fn set(&mut self, assignment: &str) -> Result<()> {
        let (name, text) = assignment
            .split_once('=')
            .ok_or_else(|| Error::Usage(format!("{assignment:?} has no value: write key=value, such as voxels=64")))?;
        let key = known(name.trim())?;
        self.replace(&[(key, parse(key, text.trim()))])
    }

    /// Every key that has an effect and its value as TOML, in the order of [`keys()`], without tables of other methods.
    /// `merge_toml` of the text gives equivalent settings.
    pub fn to_toml(&self) -> String {
        let values = self.all_values().into_iter().filter(|(key, _)| key.has_effect(self.method));
        values.map(|(key, value)| format!("{} = {}\n", key.name, write(&value))).collect()
    }

    /// Checks each value against its key. Settings from text are checked already, but the fields are public and take
    /// any value.
    ///
    /// # Errors
    /// [`Error::Usage`], naming the key.
    pub fn check(&self) -> Result<()> {
        self.all_values().iter().try_for_each(|(key, value)| check(key, value).map(drop))
    }

    /// Whether both settings give the same image; tables of other methods may differ.
    pub fn means_same(&self, other: &Self) -> bool {
        self.to_toml() == other.to_toml()
    }

    /// `key=value` of every setting that has an effect and differs in `other`.
    pub fn changes_from(&self, other: &Self) -> Vec<String> {
        let pairs = self.entries().into_iter().zip(other.entries());
        let changed = pairs.filter(|(own, other)| own.1 != other.1 && own.0.has_effect(self.method));
        changed.map(|((key, value), _)| format!("{}={value}", key.name)).collect()
    }

    /// Every key with its value in the form of `--set key=value`, including tables of other methods.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn entries(&self) -> Vec<(&'static Key, String)> {
        let bare = |value: &Value| match value {
            Value::String(text) => text.clone(),
            Value::Array(items) => items.iter().map(write).collect::<Vec<_>>().join(","),
            other => write(other),
        };
        self.all_values().iter().map(|(key, value)| (*key, bare(value))).collect()
    }

    /// Every key and its value.
    fn all_values(&self) -> Vec<(&'static Key, Value)> {
        let mut leaves = self.leaves();
        keys().iter().filter_map(|key| Some((key, leaves.remove(key.name)?))).collect()
    }

    fn leaves(&self) -> BTreeMap<String, Value> {
        let tree = Table::try_from(self).expect("settings are plain data, which TOML can hold");
        leaves("", &tree).into_iter().collect()
    }

    /// Writes checked values into the tree.
    fn replace(&mut self, changed: &[(&Key, Value)]) -> Result<()> {
        let mut leaves = self.leaves();
        for (key, value) in changed {
            leaves.insert(key.name.to_owned(), check(key, value)?);
        }
        let text: String = leaves.iter().map(|(name, value)| format!("{name} = {value}\n")).collect();
        *self = toml::from_str(&text).map_err(|e| Error::Usage(said(&e.message())))?;
        Ok(())
    }
}

/// The leaves of a table by their dotted names; an empty table is a leaf.
fn leaves(prefix: &str, table: &Table) -> Vec<(String, Value)> {
    let below = |(name, value): (&String, &Value)| match value {
        Value::Table(inner) if !inner.is_empty() => leaves(&format!("{prefix}{name}."), inner),
        _ => vec![(format!("{prefix}{name}"), value.clone())],
    };
    table.iter().flat_map(below).collect()
}

/// The key called `name`, or an error with the nearest names.
fn known(name: &str) -> Result<&'static Key> {
    Key::named(name).ok_or_else(|| {
        if let Some(inner) = first_of_group(name) {
            return Error::Usage(format!(
                "{name:?} is a group of settings; name one of its keys, such as {:?}",
                inner.name
            ));
        }
        let names: Vec<&str> = keys().iter().map(|k| k.name).collect();
        Error::Usage(format!("there is no setting {name:?}; {}", suggestion(name, &names)))
    })
}

fn first_of_group(name: &str) -> Option<&'static Key> {
    keys().iter().find(|key| key.name.strip_prefix(name).is_some_and(|rest| rest.starts_with('.')))
}

/// "did you mean …?", or where to look if no name is near. The last part of a dotted name counts as a name too.
fn suggestion(name: &str, names: &[&str]) -> String {
    let near = |candidate: &str| {
        let whole = strsim::jaro_winkler(name, candidate);
        candidate.rsplit_once('.').map_or(whole, |(_, last)| whole.max(strsim::jaro_winkler(name, last)))
    };
    let best = names.iter().map(|n| (near(n), n)).max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        // Below this value, jaro_winkler pairs words that only have a similar length.
        Some((likeness, nearest)) if likeness > 0.75 => format!("did you mean {nearest:?}?"),
        _ => "`twobounce settings` lists what there is".into(),
    }
}

/// The text after `key=` in the type of the key. Text of another type stays text, and `check` refuses it.
fn parse(key: &Key, text: &str) -> Value {
    let number = |s: &str| s.trim().parse().ok().map(Value::Float);
    let parsed = match key.range {
        Range::Bool => text.parse().ok().map(Value::Boolean),
        Range::Choice(_) => None,
        Range::PowerOfTwo(..) | Range::OneOf(_) | Range::Whole(..) | Range::WholeOrAuto(..) => {
            text.parse().ok().map(Value::Integer)
        }
        Range::Number(..) | Range::NumberOrAuto(..) => number(text),
        Range::Center(_) => text.split(',').map(number).collect::<Option<Vec<_>>>().map(Value::Array),
    };
    parsed.unwrap_or_else(|| Value::String(text.to_owned()))
}

/// The value in the form of the tree, or a sentence about the values that the key takes.
fn check(key: &Key, value: &Value) -> Result<Value> {
    let number = |v: &Value| v.as_float().or(v.as_integer().map(|i| i as f64));
    let within = |v: &Value, least: f64, most: f64| number(v).filter(|n| (least..=most).contains(n)).map(Value::Float);
    let auto = || (value.as_str() == Some("auto")).then(|| value.clone());
    let whole = |fits: &dyn Fn(&u32) -> bool| {
        value.as_integer().and_then(|i| u32::try_from(i).ok()).filter(fits).map(|n| Value::Integer(n.into()))
    };
    let between = |least, most| whole(&|n| (least..=most).contains(n));
    let choice = |names: &[&str]| {
        // `cones = 5` means the set with the name "5".
        let name = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        names.contains(&name.as_str()).then_some(Value::String(name))
    };
    let accepted = match key.range {
        Range::Bool => value.as_bool().map(Value::Boolean),
        Range::Choice(names) => choice(&names()),
        Range::Whole(least, most) => between(least, most),
        Range::WholeOrAuto(least, most) => between(least, most).or_else(auto),
        Range::PowerOfTwo(least, most) => whole(&|n| n.is_power_of_two() && (least..=most).contains(n)),
        Range::OneOf(values) => whole(&|n| values.contains(n)),
        Range::Number(least, most) => within(value, least, most),
        Range::NumberOrAuto(least, most) => within(value, least, most).or_else(auto),
        Range::Center(most) => value
            .as_array()
            .filter(|items| items.len() == 3)
            .and_then(|items| items.iter().map(|v| within(v, -most, most)).collect())
            .map(Value::Array)
            .or_else(|| (value.as_str() == Some("camera")).then(|| value.clone()))
            .or_else(auto),
    };
    accepted.ok_or_else(|| {
        let given = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let hint = match key.range {
            Range::Choice(names) => nearest_choice(&given, &names()),
            _ => value.as_str().and_then(|text| unquoted(key, text)).unwrap_or_default(),
        };
        Error::Usage(format!("setting {:?} takes {}, not {:?}{hint}", key.name, key.range, said(&given)))
    })
}

/// A hint for a number or a truth value in quotes, which TOML reads as text.
fn unquoted(key: &Key, text: &str) -> Option<String> {
    let meant = Some(parse(key, text.trim_matches(['"', '\'']))).filter(|value| !value.is_str())?;
    check(key, &meant).ok().map(|_| format!(", which the quotes make a text: write {} without them", write(&meant)))
}

fn nearest_choice(given: &str, names: &[&str]) -> String {
    let near = names.iter().find(|n| strsim::damerau_levenshtein(given, n) <= 2 && n.len() > 2);
    near.map_or(String::new(), |n| format!("; did you mean {n:?}?"))
}

/// TOML with the shortest digits that give the same number, so that f32 settings do not show the digits of an f64.
fn write(value: &Value) -> String {
    match value {
        Value::Float(v) if f64::from(*v as f32) == *v => {
            Value::Float((*v as f32).to_string().parse().unwrap_or(*v)).to_string()
        }
        Value::Array(items) => format!("[{}]", items.iter().map(write).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}
