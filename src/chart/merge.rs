//! Folders that several machines filled, as one. What determines a row also determines its numbers, its times excepted: rows that two
//! folders have are held against each other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::row::Row;
use super::store::{Keyed, Kind, Store, Stored};
use crate::{Error, Result};

/// A row that several folders may have.
pub trait Mergeable: Keyed {
    /// Hash over everything that determines it but the device.
    fn address(&self) -> &str;
    /// Its name in messages.
    fn title(&self) -> String;
    /// Whether it ran.
    fn is_measured(&self) -> bool;
    /// The noise that its numbers have; of two rows the one with less is kept.
    fn noise(&self) -> f64;
    /// What every machine with the same device and driver must find: all but times and where they were measured.
    fn lasting(&self) -> Value;
}

impl Mergeable for Row {
    fn address(&self) -> &str {
        &self.address
    }

    fn title(&self) -> String {
        format!("{} {}", self.scene, self.name)
    }

    fn is_measured(&self) -> bool {
        self.measured.is_some()
    }

    fn noise(&self) -> f64 {
        self.measured.as_ref().map_or(f64::INFINITY, |m| m.full.noise.max(m.same.noise))
    }

    fn lasting(&self) -> Value {
        let numbers = |m: &super::row::Measured| (m.memory_bytes, m.nonfinite, m.equal_terms.clone(), m.full, m.same);
        serde_json::json!([self.settings, self.source, self.failure, self.measured.as_ref().map(numbers)])
    }
}

/// What folders have together.
pub struct Merged<R, P> {
    /// In the order of the whole chart; those of several devices in the order of their keys.
    pub rows: Vec<Stored<R, P>>,
    pub folders: usize,
    /// Rows with further times, which become history.
    pub twice: usize,
    history: Vec<Stored<R, P>>,
    /// Images of rows whose errors are not final.
    images: Vec<(PathBuf, String)>,
}

/// Reads folders of a kind. `order`: the addresses of the rows to show; other rows that a folder keeps are history.
///
/// # Errors
/// [`Error::Usage`]: rows of the same key differ, with the names of some of them.
pub fn merge<R, P>(kind: Kind, folders: &[&Path], order: &[&str]) -> Result<Merged<R, P>>
where
    R: Mergeable + Clone + DeserializeOwned,
    P: Clone + DeserializeOwned,
{
    let mut merged =
        Merged { rows: Vec::new(), folders: folders.len(), twice: 0, history: Vec::new(), images: Vec::new() };
    let places: BTreeMap<&str, usize> = order.iter().enumerate().map(|(place, address)| (*address, place)).collect();
    // By place and key: a row, and the folder that it is of.
    type Found<'a, R, P> = BTreeMap<(usize, String), (Stored<R, P>, &'a Path)>;
    let mut rows: Found<R, P> = BTreeMap::new();
    let mut different = Vec::new();
    for folder in folders {
        let [now, before] = Store::read_all::<R, P>(kind, folder);
        merged.history.extend(before);
        for new in now {
            let Some(place) = places.get(new.row.address()) else {
                merged.history.push(new);
                continue;
            };
            let key = (*place, new.row.key().to_owned());
            let Some((old, of)) = rows.get_mut(&key) else {
                rows.insert(key, (new, folder));
                continue;
            };
            let is_same = new.row.lasting() == old.row.lasting();
            let both = new.row.is_measured() && old.row.is_measured();
            if both && new.row.noise() == old.row.noise() && !is_same {
                different.push(format!("{} ({} and {})", new.row.title(), of.display(), folder.display()));
                continue;
            }
            let is_better = (!old.row.is_measured() && new.row.is_measured()) || new.row.noise() < old.row.noise();
            let other_time = both && new.row.unix_s() != old.row.unix_s();
            let left = if is_better {
                *of = folder;
                std::mem::replace(old, new)
            } else {
                new
            };
            if other_time {
                merged.twice += 1;
                merged.history.push(left);
            }
        }
    }
    if !different.is_empty() {
        let (count, some) = (different.len(), different.iter().take(8).cloned().collect::<Vec<_>>().join(", "));
        let more = if count > 8 { ", …" } else { "" };
        return Err(Error::Usage(format!(
            "{count} rows were found differently by two folders, so nothing is merged: {some}{more}; were they made by the same build of \
             twobounce? measure them again in one of the folders"
        )));
    }
    for ((_, key), (_, folder)) in &rows {
        let image = Store::image_in(folder, key);
        merged.images.extend(image.exists().then(|| (image, key.clone())));
    }
    merged.rows = rows.into_values().map(|(stored, _)| stored).collect();
    Ok(merged)
}

impl<R, P> Merged<R, P>
where
    R: Mergeable + Clone + Serialize + DeserializeOwned,
    P: Clone + Serialize + DeserializeOwned,
{
    /// Writes the rows into a folder, which may have some of them already.
    pub fn save(&self, store: &Store) -> Result<()> {
        for row in &self.rows {
            store.put(row.clone())?;
        }
        for row in &self.history {
            store.put_into_history(row.clone())?;
        }
        for (from, key) in &self.images {
            let to = store.image_path(key);
            if !crate::output::file::is_same(from, &to) {
                let bytes = std::fs::read(from).map_err(|e| Error::file(from, format!("cannot be read: {e}")))?;
                crate::output::file::write(&to, &bytes)?;
            }
        }
        Ok(())
    }

    /// How many of the addresses no row has.
    pub fn missing(&self, order: &[&str]) -> usize {
        let there: std::collections::BTreeSet<&str> = self.rows.iter().map(|stored| stored.row.address()).collect();
        order.iter().filter(|address| !there.contains(*address)).count()
    }
}
