//! Finished rows in a folder, one file each, written whole or not at all: no row is lost when the program is stopped. See
//! [`file::write_kept`] for their form.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::VERSION;
use super::measure::ChartScene;
use super::row::Row;
use super::subject::Subject;
use crate::output::file::{self, FolderLock};
use crate::reference::{Depth, Stop, cache};
use crate::scene::Still;
use crate::vk::Context;
use crate::{Error, Result};

const ROWS: &str = "rows";
/// Of rows that newer ones took the place of.
const HISTORY: &str = "history";

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

impl Kind {
    /// The file that marks such a folder, and its text.
    fn mark(self) -> String {
        format!("{}.txt", self.command)
    }

    fn mark_text(self) -> String {
        let command = self.command;
        format!("Made by `twobounce {command}`, which rewrites everything here and continues with the rows in rows/.\n")
    }
}

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
    pub program: String,
    pub row: R,
    pub pictures: Option<P>,
}

/// A row that is kept under a key.
pub trait Keyed {
    /// Hash over everything that determines the row except the program.
    fn key(&self) -> &str;
    /// Seconds since 1970 at which it was measured; 0 where that is not known.
    fn unix_s(&self) -> u64;
}

impl Keyed for Row {
    fn key(&self) -> &str {
        &self.key
    }

    fn unix_s(&self) -> u64 {
        self.origin.as_ref().map_or(0, |origin| origin.unix_s)
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
        let stored: Stored<R, P> = toml::from_str(&text).ok()?;
        let same_build = self.any_build || stored.program == self.program;
        (stored.version == self.kind.version && stored.row.key() == key && same_build).then_some(stored)
    }

    /// Every row that is kept, of other builds and of former charts too; and those that newer ones took the place of.
    pub fn all<R: Keyed + DeserializeOwned, P: DeserializeOwned>(&self) -> [Vec<Stored<R, P>>; 2] {
        Self::read_all(self.kind, &self.folder)
    }

    /// As [`Self::all`], of a folder that is only read. Keys and builds become names of files, so that a row of which one of them could
    /// lead to another folder is left out, as a damaged one is.
    pub fn read_all<R: Keyed + DeserializeOwned, P: DeserializeOwned>(
        kind: Kind,
        folder: &Path,
    ) -> [Vec<Stored<R, P>>; 2] {
        [ROWS, HISTORY].map(|name| {
            let entries = fs::read_dir(folder.join(name)).into_iter().flatten().flatten();
            let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
            paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
            paths.sort();
            let read = |path: &PathBuf| toml::from_str(&fs::read_to_string(path).ok()?).ok();
            let is_name = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_alphanumeric());
            let is_known = |stored: &Stored<R, P>| {
                stored.version == kind.version && is_name(stored.row.key()) && is_name(&stored.program)
            };
            paths.iter().filter_map(read).filter(is_known).collect()
        })
    }

    /// Keeps a row that this build made. One of another build under the same key becomes history.
    pub fn save<R, P>(&self, row: R, pictures: Option<P>) -> Result<Stored<R, P>>
    where
        R: Keyed + Serialize + DeserializeOwned,
        P: Serialize + DeserializeOwned,
    {
        let stored = Stored { version: self.kind.version, program: self.program.clone(), row, pictures };
        self.put(stored)
    }

    /// Keeps a row as it is. One of another build under the same key becomes history, without its pictures.
    pub fn put<R, P>(&self, stored: Stored<R, P>) -> Result<Stored<R, P>>
    where
        R: Keyed + Serialize + DeserializeOwned,
        P: Serialize + DeserializeOwned,
    {
        if !self.is_marked() {
            file::write(&self.mark(), self.kind.mark_text().as_bytes())?;
        }
        let rows = self.path(ROWS);
        file::create_folder(&rows)?;
        let path = self.row_path(stored.row.key());
        let read = |text: String| toml::from_str::<Stored<R, P>>(&text).ok();
        let before = fs::read_to_string(&path).ok().and_then(read).filter(|before| before.version == self.kind.version);
        if let Some(before) = before.filter(|before| before.program != stored.program) {
            self.put_into_history(before)?;
        }
        file::write_kept(&path, &stored)?;
        Ok(stored)
    }

    /// Keeps a row beside those of today, without its pictures.
    pub fn put_into_history<R: Keyed + Serialize, P: Serialize>(&self, stored: Stored<R, P>) -> Result<()> {
        let [key, build] = [stored.row.key(), &stored.program].map(|text| text.chars().take(16).collect::<String>());
        let path = self.path(HISTORY).join(format!("{key}-{}-{build}.toml", stored.row.unix_s()));
        file::create_folder(&self.path(HISTORY))?;
        file::write_kept(&path, &Stored { pictures: None, ..stored })
    }

    /// The first digits of the hash of the program's file.
    pub fn build(&self) -> &str {
        &self.program[..12]
    }

    /// Where the image of a row is kept as long as its errors are not final.
    pub fn image_path(&self, key: &str) -> PathBuf {
        Self::image_in(&self.folder, key)
    }

    /// The same in a folder that is only read.
    pub fn image_in(folder: &Path, key: &str) -> PathBuf {
        folder.join(ROWS).join(format!("{key}.exr"))
    }

    /// Whether a folder is of this kind.
    pub fn is_marked_as(kind: Kind, folder: &Path) -> bool {
        fs::read_to_string(folder.join(kind.mark())).is_ok_and(|text| text == kind.mark_text())
    }

    fn is_marked(&self) -> bool {
        Self::is_marked_as(self.kind, &self.folder)
    }

    fn mark(&self) -> PathBuf {
        self.path(&self.kind.mark())
    }

    fn row_path(&self, key: &str) -> PathBuf {
        self.path(ROWS).join(format!("{key}.toml"))
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
    /// The device, validation.
    common: [String; 2],
    noise: f64,
}

impl Keys {
    /// `noise`: a share, not a percentage.
    pub fn new(context: &Context, validation: bool, noise: f64) -> Self {
        let device = format!("{} / {} / {:?}", context.name, context.driver, context.api_version);
        Self { common: [device, validation.to_string()], noise }
    }

    /// Hash over the device and the address; of an image of another program, which needs no device, over the address
    /// alone.
    pub fn key(&self, address: &str, subject: &Subject) -> String {
        match subject {
            Subject::Import(_) => short_hash(&serde_json::json!([address])),
            Subject::Settings(_) | Subject::Paths(_) => short_hash(&serde_json::json!([self.common, address])),
        }
    }

    /// Hash over the scene as it is seen, the noise of references, and the settings, or what else made the image.
    pub fn address(&self, scene: &ChartScene, subject: &Subject) -> String {
        let seen = scene.reference_options(Depth::Full, Stop::Noise(self.noise));
        let seen = cache::key(Still::new(&scene.scene, &scene.pose, &scene.view), &seen).to_string();
        let bounds = format!("{:?}", scene.options.bounds);
        short_hash(&serde_json::json!([self.noise.to_string(), seen, bounds, subject.identity()]))
    }
}

/// 32 digits over everything that a row is made of.
pub fn short_hash(about: &serde_json::Value) -> String {
    blake3::hash(about.to_string().as_bytes()).to_hex()[..32].to_owned()
}
