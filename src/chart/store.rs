//! Finished rows in a folder, one file each, written whole or not at all: no row is lost when the program is stopped.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::VERSION;
use super::measure::ChartScene;
use super::row::Row;
use crate::output::file::{self, FolderLock};
use crate::reference::{Depth, Stop, cache};
use crate::settings::Settings;
use crate::vk::Context;
use crate::{Error, Result};

const ROWS: &str = "rows";

/// What a folder is kept for.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// The command that writes it; the file `<command>.txt` marks the folder.
    pub command: &'static str,
    /// In words, with an article.
    pub words: &'static str,
    /// Of its rows: others are measured again.
    pub version: u32,
}

/// The folder of a chart.
pub const CHART: Kind = Kind { command: "chart", words: "a chart", version: VERSION };

/// A folder of rows. Nothing is written into it before the first row; a folder that was made and stays empty is removed.
pub struct Store {
    kind: Kind,
    folder: PathBuf,
    /// Whether there was no such folder before.
    made: bool,
    /// Hash of the program's own bytes.
    program: String,
    any_build: bool,
    _lock: FolderLock,
}

/// A row and its pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stored<R = Row, P = Pictures> {
    version: u32,
    /// The build that measured it: another may measure something else.
    program: String,
    pub row: R,
    pub pictures: Option<P>,
}

/// A row that is kept under a key.
pub trait Keyed {
    /// Hash over everything that determines the row except the program.
    fn key(&self) -> &str;
}

impl Keyed for Row {
    fn key(&self) -> &str {
        &self.key
    }
}

/// A setting's pictures as URIs that hold them, small enough for a page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pictures {
    pub image: String,
    /// Signed difference from the full light, and from that of as many bounces; red is too bright, blue too dark.
    pub full: String,
    pub same: String,
}

impl Store {
    /// An empty folder, a new one, or an earlier one of this kind, whose rows count if this build of the program measured
    /// them, or with `any_build`.
    ///
    /// # Errors
    /// [`Error::File`]: it holds something else, another process fills it, or nothing can be written there.
    pub fn open(kind: Kind, folder: &Path, any_build: bool) -> Result<Self> {
        if folder.exists() && !folder.is_dir() {
            return Err(Error::file(folder, "is a file; -o takes a folder"));
        }
        let made = !folder.exists();
        file::create_folder(folder)?;
        let failed = |e: std::io::Error| Error::file(folder, format!("cannot be read: {e}"));
        let lock = FolderLock::take(folder).map_err(failed)?.ok_or_else(|| {
            Error::file(folder, "is being filled by another process; wait for its end or name another folder")
        })?;
        let store = Self { kind, folder: folder.to_owned(), made, program: program()?, any_build, _lock: lock };
        // What a killed program left half written does not count.
        let is_part = |e: fs::DirEntry| e.file_name().to_string_lossy().ends_with(".part");
        let entries = fs::read_dir(folder).map_err(failed)?;
        if !store.is_marked() && entries.flatten().any(|entry| !is_part(entry)) {
            let words = kind.words;
            return Err(Error::file(
                folder,
                format!("holds something else than {words}; name an empty or a new folder"),
            ));
        }
        file::check_writable(&store.mark())?;
        Ok(store)
    }

    /// A file of the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The row kept under `key`; `None` if there is none, or it is damaged: then it is measured again.
    pub fn load<R: Keyed + DeserializeOwned, P: DeserializeOwned>(&self, key: &str) -> Option<Stored<R, P>> {
        let text = fs::read_to_string(self.row_path(key)).ok()?;
        let stored: Stored<R, P> = serde_json::from_str(&text).ok()?;
        let same_build = self.any_build || stored.program == self.program;
        (stored.version == self.kind.version && stored.row.key() == key && same_build).then_some(stored)
    }

    /// Keeps a row.
    pub fn save<R: Keyed + Serialize, P: Serialize>(&self, row: R, pictures: Option<P>) -> Result<Stored<R, P>> {
        let stored = Stored { version: self.kind.version, program: self.program.clone(), row, pictures };
        if !self.is_marked() {
            file::write(&self.mark(), self.mark_text().as_bytes())?;
        }
        let rows = self.path(ROWS);
        file::create_folder(&rows)?;
        let json = serde_json::to_string(&stored).map_err(|e| Error::file(&rows, e.to_string()))?;
        file::write(&self.row_path(stored.row.key()), json.as_bytes())?;
        Ok(stored)
    }

    fn is_marked(&self) -> bool {
        fs::read_to_string(self.mark()).is_ok_and(|text| text == self.mark_text())
    }

    fn mark(&self) -> PathBuf {
        self.path(&format!("{}.txt", self.kind.command))
    }

    fn mark_text(&self) -> String {
        let command = self.kind.command;
        format!("Made by `twobounce {command}`, which rewrites everything here and continues with the rows in rows/.\n")
    }

    fn row_path(&self, key: &str) -> PathBuf {
        self.path(ROWS).join(format!("{key}.json"))
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        if self.made {
            // Works on an empty folder only.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

fn program() -> Result<String> {
    let failed = |e: std::io::Error| Error::Usage(format!("the program's own file cannot be read: {e}"));
    let bytes = std::env::current_exe().and_then(fs::read).map_err(failed)?;
    Ok(blake3::hash(&bytes).to_string())
}

/// Names rows after everything that determines them except the program.
pub struct Keys {
    /// The device, validation, the noise of references.
    common: [String; 3],
    noise: f64,
}

impl Keys {
    /// `noise`: a share, not a percentage.
    pub fn new(context: &Context, validation: bool, noise: f64) -> Self {
        let device = format!("{} / {} / {:?}", context.name, context.driver, context.api_version);
        Self { common: [device, validation.to_string(), noise.to_string()], noise }
    }

    /// Hash over these, the scene as it is seen, and the settings.
    pub fn key(&self, scene: &ChartScene, settings: &Settings) -> String {
        let seen = scene.reference_options(Depth::Full, Stop::Noise(self.noise));
        let seen = cache::key((&scene.scene, &scene.pose, &scene.view), &seen).to_string();
        let bounds = format!("{:?}", scene.options.bounds);
        let about = serde_json::json!([self.common, seen, bounds, settings.to_toml()]);
        blake3::hash(about.to_string().as_bytes()).to_hex()[..32].to_owned()
    }
}
