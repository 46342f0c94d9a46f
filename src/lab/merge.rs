//! Merges folders that several machines filled. A row's inputs determine its numbers, except times, so rows that occur
//! in two folders are compared.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::store::{ExperimentRow, Store, Stored};
use crate::output::file;
use crate::{Error, Result};

/// The rows of several folders.
pub struct Merged<R: ExperimentRow> {
    /// Rows in the order of the whole chart; those of several devices in the order of their keys.
    pub rows: Vec<Stored<R>>,
    /// Rows with further times, which become history.
    pub twice: usize,
    /// The number of addresses without a row.
    pub missing: usize,
    history: Vec<Stored<R>>,
    /// Images of rows whose errors are not final.
    images: Vec<(PathBuf, String)>,
}

/// Reads folders with rows of one kind. `order` holds the addresses of the rows to show; other rows become history.
///
/// # Errors
/// [`Error::Usage`] with some of the names, if rows with the same key differ.
pub fn merge<R: ExperimentRow>(folders: &[&Path], order: &[String]) -> Result<Merged<R>> {
    let places: BTreeMap<&str, usize> =
        order.iter().enumerate().map(|(place, address)| (address.as_str(), place)).collect();
    // For each place and key: a row, and its folder.
    let mut rows: BTreeMap<(usize, String), (Stored<R>, &Path)> = BTreeMap::new();
    let (mut history, mut twice, mut different) = (Vec::new(), 0, Vec::new());
    for folder in folders {
        let [now, before] = Store::<R>::read_all(folder);
        history.extend(before);
        for new in now {
            let Some(place) = places.get(new.row.address()) else {
                history.push(new);
                continue;
            };
            let key = (*place, new.row.key().to_owned());
            let Some(kept) = rows.get_mut(&key) else {
                rows.insert(key, (new, folder));
                continue;
            };
            let (old, of) = &*kept;
            let both = new.row.is_measured() && old.row.is_measured();
            if both && new.row.noise() == old.row.noise() && new.row.lasting() != old.row.lasting() {
                different.push(format!("{} ({} and {})", new.row.title(), of.display(), folder.display()));
                continue;
            }
            let is_better = (!old.row.is_measured() && new.row.is_measured()) || new.row.noise() < old.row.noise();
            let other_time = both && new.row.unix_s() != old.row.unix_s();
            let mut left = (new, *folder);
            if is_better {
                std::mem::swap(&mut left, kept);
            }
            if other_time {
                twice += 1;
                history.push(left.0);
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
    let there: BTreeSet<usize> = rows.keys().map(|(place, _)| *place).collect();
    let image =
        |((_, key), (_, folder)): (&(usize, String), &(_, &Path))| (Store::<R>::image_in(folder, key), key.clone());
    let images = rows.iter().map(image).filter(|(image, _)| image.exists()).collect();
    let missing = places.len() - there.len();
    Ok(Merged { rows: rows.into_values().map(|(stored, _)| stored).collect(), twice, missing, history, images })
}

impl<R: ExperimentRow> Merged<R> {
    /// Writes the rows into a folder, which may already have some of them.
    pub fn save(&self, store: &Store<R>) -> Result<()> {
        for row in &self.rows {
            store.put(row.clone())?;
        }
        for row in &self.history {
            store.put_into_history(row.clone())?;
        }
        for (from, key) in &self.images {
            let to = store.image_path(key);
            if !file::is_same(from, &to) {
                let bytes = std::fs::read(from).map_err(|e| Error::file(from, format!("cannot be read: {e}")))?;
                file::write(&to, &bytes)?;
            }
        }
        Ok(())
    }
}
