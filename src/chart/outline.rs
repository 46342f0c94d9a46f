//! The description of a chart without its rows. It is stored with them, so that folders with parts of a chart can be
//! merged and shown without opening a scene.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::row::Row;
use crate::lab::store::Store;

/// The file `outline.toml` of a chart's folder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    pub version: u32,
    /// Width of the images in pixels.
    pub width: u32,
    pub height: u32,
    /// The noise of `--reference-noise` as a share.
    pub reference_noise: f64,
    pub scenes: Vec<Sketch>,
    /// Every row of the whole chart in order, including those of other shards: see [`super::row::Row::address`].
    pub rows: Vec<Planned>,
}

/// A planned row of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    pub scene: String,
    pub address: String,
}

/// A scene of the chart with its view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneLine {
    pub name: String,
    pub hash: String,
    pub triangles: usize,
    pub camera: String,
    /// Whether no mesh is metallic or transmits.
    pub all_diffuse: bool,
    /// The beginning of the command that renders it, before `--preset`; empty if unknown.
    pub command: String,
}

/// A scene for pages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sketch {
    pub line: SceneLine,
    /// The current references.
    pub truths: Vec<Truth>,
}

/// A reference for pages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The number of indirect bounces; `None` for all.
    pub bounces: Option<u32>,
    /// Root mean square of its pixels' relative error.
    pub noise: f64,
    /// The picture as a URI.
    pub picture: String,
}

impl Outline {
    fn size_and_noise(&self) -> (u32, u32, f64) {
        (self.width, self.height, self.reference_noise)
    }

    /// Adopts the sketches that an earlier call stored for these scenes, so that no references are needed if every row
    /// exists. Scenes without references are left out.
    pub fn take_truths(&mut self, store: &Store<Row>) {
        if let Ok(before) = Store::<Row>::outline::<Self>(&store.path(""))
            && before.size_and_noise() == self.size_and_noise()
        {
            for sketch in &mut self.scenes {
                let same = before.scenes.iter().find(|old| sketch.is_of_same(old) && sketch.line.name == old.line.name);
                same.into_iter().for_each(|old| sketch.unite(old.clone()));
            }
        }
        self.scenes.retain(|sketch| !sketch.truths.is_empty());
    }

    /// Adds the content of another outline, which may be of another part of the same chart, or of another chart.
    ///
    /// # Errors
    /// A sentence about a difference that prevents this.
    pub fn unite(&mut self, other: Self) -> std::result::Result<(), String> {
        if self.size_and_noise() != other.size_and_noise() {
            let [ours, theirs] = [&*self, &other]
                .map(|o| format!("{}x{} pixels at {} % noise", o.width, o.height, 100.0 * o.reference_noise));
            return Err(format!(
                "is of {theirs}, this chart of {ours}; make both with the same --size and --reference-noise"
            ));
        }
        for sketch in other.scenes {
            match self.scenes.iter_mut().find(|ours| ours.line.name == sketch.line.name) {
                None => self.scenes.push(sketch),
                Some(ours) if ours.is_of_same(&sketch) => ours.unite(sketch),
                Some(ours) => {
                    let name = &ours.line.name;
                    return Err(format!("has another scene or camera by the name {name}; rename one of the files"));
                }
            }
        }
        let known: BTreeSet<String> = self.rows.iter().map(|row| row.address.clone()).collect();
        self.rows.extend(other.rows.into_iter().filter(|row| !known.contains(&row.address)));
        Ok(())
    }
}

impl Sketch {
    /// Whether another outline has the same scene and camera.
    fn is_of_same(&self, other: &Self) -> bool {
        (&self.line.hash, &self.line.camera) == (&other.line.hash, &other.line.camera)
    }

    /// Adopts references with less noise.
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
