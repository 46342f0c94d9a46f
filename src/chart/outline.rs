//! What a chart is of, without its rows: kept beside them, so that folders of parts of a chart can be merged and shown without
//! opening a scene.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::VERSION;
use super::export::SceneLine;
use super::measure::ChartScene;
use super::row::Row;
use crate::lab::store::Store;
use crate::output::file;
use crate::{Error, Result};

/// The file `outline.toml` of a chart's folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    pub version: u32,
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// What `--reference-noise` asked for, as a share.
    pub reference_noise: f64,
    pub scenes: Vec<Sketch>,
    /// Every row of the whole chart in its order, those of other shards too: see [`super::row::Row::address`].
    pub rows: Vec<Planned>,
}

/// A row that a chart is to have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    pub scene: String,
    pub address: String,
}

/// A scene as pages show it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sketch {
    pub line: SceneLine,
    /// The references of today.
    pub truths: Vec<Truth>,
}

/// A reference as pages show it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Indirect bounces; `None`: all.
    pub bounces: Option<u32>,
    /// Root mean square of its pixels' relative error.
    pub noise: f64,
    /// A URI.
    pub picture: String,
}

impl Sketch {
    /// Of a scene whose reference of all light is there. `command`: see [`SceneLine::command`].
    pub fn of(scene: &ChartScene, command: &str) -> Result<Self> {
        let mut truths = Vec::new();
        for reference in &scene.references {
            let picture = scene.picture(reference.layers.beauty())?;
            truths.push(Truth { bounces: reference.bounces(), noise: reference.noise, picture });
        }
        Ok(Self { line: SceneLine { command: command.to_owned(), ..scene.line() }, truths })
    }
}

const FILE: &str = "outline.toml";

impl Outline {
    pub fn save(&self, store: &Store<Row>) -> Result<()> {
        file::write_kept(&store.path(FILE), self)
    }

    /// That of a folder.
    ///
    /// # Errors
    /// [`Error::File`]: there is none, it is damaged, or it is of another version of the program.
    pub fn load(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let wrong = |why: String| Error::file(&path, format!("{why}; run `twobounce chart` there again"));
        let text = std::fs::read_to_string(&path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
        let outline: Self = toml::from_str(&text).map_err(|e| wrong(format!("is damaged: {}", e.message())))?;
        if outline.version != VERSION {
            return Err(wrong(format!("is of format {}, not {VERSION}", outline.version)));
        }
        Ok(outline)
    }

    /// Takes what an earlier call left of these scenes, so that references are not needed where every row is there already.
    pub fn take_truths<'a>(&mut self, store: &Store<Row>, scenes: impl Iterator<Item = (SceneLine, &'a str)>) {
        let Ok(before) = Self::load(&store.path("")) else { return };
        if (before.width, before.height, before.reference_noise) != (self.width, self.height, self.reference_noise) {
            return;
        }
        let mut sketches = Vec::new();
        for (line, command) in scenes {
            let line = SceneLine { command: command.to_owned(), ..line };
            let is_same = |other: &&Sketch| {
                (&other.line.name, &other.line.hash, &other.line.camera) == (&line.name, &line.hash, &line.camera)
            };
            let (old, new) = (before.scenes.iter().find(is_same), self.scenes.iter().find(is_same));
            let Some(any) = new.or(old) else { continue };
            let mut sketch = Sketch { line: line.clone(), ..any.clone() };
            old.into_iter().for_each(|old| sketch.unite(old.clone()));
            sketches.push(sketch);
        }
        self.scenes = sketches;
    }

    /// This with what another one has, which may be of another part of the same chart or of another chart.
    ///
    /// # Errors
    /// A sentence about what they do not have in common.
    pub fn unite(&mut self, other: Self) -> std::result::Result<(), String> {
        let [ours, theirs] = [&*self, &other].map(|o| (o.width, o.height, o.reference_noise));
        if ours != theirs {
            let words = |(width, height, noise): (u32, u32, f64)| {
                format!("{width}x{height} pixels at {} % noise", 100.0 * noise)
            };
            return Err(format!("is of {}, not of {}; chart both alike", words(theirs), words(ours)));
        }
        for sketch in other.scenes {
            match self.scenes.iter_mut().find(|ours| ours.line.name == sketch.line.name) {
                None => self.scenes.push(sketch),
                Some(ours) if (&ours.line.hash, &ours.line.camera) != (&sketch.line.hash, &sketch.line.camera) => {
                    return Err(format!(
                        "has another scene or camera by the name {}; rename one of the files",
                        ours.line.name
                    ));
                }
                Some(ours) => ours.unite(sketch),
            }
        }
        let known: BTreeMap<&str, ()> = self.rows.iter().map(|row| (row.address.as_str(), ())).collect();
        let new: Vec<Planned> =
            other.rows.into_iter().filter(|row| !known.contains_key(row.address.as_str())).collect();
        self.rows.extend(new);
        Ok(())
    }
}

impl Sketch {
    /// Takes the references that are less noisy.
    fn unite(&mut self, other: Self) {
        for truth in other.truths {
            match self.truths.iter_mut().find(|ours| ours.bounces == truth.bounces) {
                None => self.truths.push(truth),
                Some(ours) if truth.noise < ours.noise => *ours = truth,
                Some(_) => {}
            }
        }
        self.truths.sort_by_key(|truth| std::cmp::Reverse(truth.bounces.unwrap_or(u32::MAX)));
    }
}
