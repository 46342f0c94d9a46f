//! A store of finished rows in a folder, with one file each, written completely or not at all, so that stopping the
//! program loses no row. [`file::write_kept`] describes the format. Also a store of results in the user's cache folder,
//! by a hash of everything that determines them.

use std::collections::BTreeSet;
use std::fs;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::said;
use crate::output::file;
use crate::vk::Context;
use crate::{Error, Result};

const ROWS: &str = "rows";
/// The file that describes all rows of a folder, including those of other shards.
const OUTLINE: &str = "outline.toml";
/// The folder of rows that newer ones replaced.
const HISTORY: &str = "history";

/// The kind of a folder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// The command that writes the folder; the file `<command>.txt` marks it.
    pub command: &'static str,
    /// The kind in words with an article.
    pub words: &'static str,
    /// The version of its rows; rows of other versions are measured again.
    pub version: u32,
}

/// A row of an experiment.
pub trait ExperimentRow: Clone + Serialize + DeserializeOwned {
    /// Pictures that are stored with a row and embedded in pages.
    type Pictures: Clone + Serialize + DeserializeOwned;

    /// The kind of folder for such rows.
    const KIND: Kind;

    /// Hash over everything that determines the row except the program.
    fn key(&self) -> &str;
    /// Hash over everything that determines the row except the program and the device: shards and merged folders
    /// identify the rows of any machine by it.
    fn address(&self) -> &str;
    /// The origin; `None` until the row was measured.
    fn origin(&self) -> Option<&Origin>;
    /// Whether the row was measured.
    fn is_measured(&self) -> bool;
    /// The row's name in messages.
    fn title(&self) -> String;
    /// The values that must be equal on every machine with the same device and driver: all except times and origin.
    fn lasting(&self) -> Value;

    /// The noise of its numbers; of two rows the one with less noise is kept.
    fn noise(&self) -> f64 {
        0.0
    }

    /// The time of measurement in seconds since 1970; 0 if unknown.
    fn unix_s(&self) -> u64 {
        self.origin().map_or(0, |origin| origin.unix_s)
    }
}

/// Where and when a row was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// `--machine`, or the host's name.
    pub machine: String,
    pub device: String,
    pub driver: String,
    /// The program's version.
    pub program: String,
    /// The first digits of the hash of the program's file.
    pub build: String,
    /// `--label`.
    pub label: Option<String>,
    /// Seconds since 1970, UTC.
    pub unix_s: u64,
}

impl Origin {
    /// The origin of rows that this program measures now, without the time.
    pub fn new(context: &Context, machine: String, build: &str, label: Option<String>) -> Self {
        let (device, driver) = (context.name.clone(), context.driver.clone());
        let program = env!("CARGO_PKG_VERSION").to_owned();
        Self { machine, device, driver, program, build: build.to_owned(), label, unix_s: 0 }
    }

    /// The origin of a row that was just measured.
    pub fn now(&self) -> Self {
        Self { unix_s: unix_s(), ..self.clone() }
    }

    /// The place of measurement, a device in a machine. Times of one place are comparable.
    pub fn place(&self) -> [&str; 3] {
        [&self.machine, &self.device, &self.driver]
    }

    /// The devices and drivers of some rows, in words.
    pub fn devices<'a>(origins: impl IntoIterator<Item = &'a Self>) -> String {
        let devices = origins.into_iter().map(|origin| format!("{} ({})", origin.device, origin.driver));
        devices.collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join("; ")
    }
}

/// Seconds since 1970, UTC.
pub fn unix_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

impl Kind {
    /// Whether a folder is of this kind.
    pub fn marks(self, folder: &Path) -> bool {
        fs::read_to_string(folder.join(self.mark())).is_ok_and(|text| text == self.mark_text())
    }

    /// The file that marks such a folder, and its text.
    fn mark(self) -> String {
        format!("{}.txt", self.command)
    }

    fn mark_text(self) -> String {
        let command = self.command;
        format!("Made by `twobounce {command}`, which rewrites everything here and continues with the rows in rows/.\n")
    }
}

/// A folder of rows. Nothing is written into it before the first row, and a new folder that stays empty is removed.
pub struct Store<R> {
    folder: PathBuf,
    /// Whether the folder was created.
    made: bool,
    /// Hash of the program's own file.
    program: String,
    any_build: bool,
    _lock: fs::File,
    rows: PhantomData<R>,
}

/// A row and its pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Stored<R: ExperimentRow> {
    pub version: u32,
    /// The build that measured it; another build may give other numbers.
    pub program: String,
    pub row: R,
    pub pictures: Option<R::Pictures>,
}

impl<R: ExperimentRow> Store<R> {
    /// Opens an empty folder, a new one, or an earlier one of this kind. Its rows are valid if this build of the
    /// program measured them, or with `any_build`.
    ///
    /// # Errors
    /// [`Error::File`] if the folder has other content, another process fills it, or it cannot be written.
    pub fn open(folder: &Path, any_build: bool) -> Result<Self> {
        if folder.exists() && !folder.is_dir() {
            return Err(Error::file(folder, "is a file; -o takes a folder"));
        }
        let made = !folder.exists();
        file::create_folder(folder)?;
        let failed = |e: std::io::Error| Error::file(folder, format!("cannot be read: {e}"));
        let lock = file::lock(fs::File::open(folder).map_err(failed)?).ok_or_else(|| {
            Error::file(folder, "is being filled by another process; wait for its end or name another folder")
        })?;
        let (folder_path, rows) = (folder.to_owned(), PhantomData);
        let store = Self { folder: folder_path, made, program: program()?, any_build, _lock: lock, rows };
        // A partly written file of a killed program does not count.
        let is_part = |e: fs::DirEntry| e.file_name().to_string_lossy().ends_with(".part");
        let entries = fs::read_dir(folder).map_err(failed)?;
        if !R::KIND.marks(folder) && entries.flatten().any(|entry| !is_part(entry)) {
            let words = R::KIND.words;
            let why = format!("holds something else than {words}; name an empty or a new folder");
            return Err(Error::file(folder, why));
        }
        file::check_writable(&store.path(&R::KIND.mark()))?;
        Ok(store)
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Stores the description of all rows, an object with [`Kind::version`] as `version`.
    pub fn save_outline(&self, outline: &impl Serialize) -> Result<()> {
        file::write_kept(&self.path(OUTLINE), outline)
    }

    /// Reads the description of all rows of a folder.
    ///
    /// # Errors
    /// [`Error::File`] if there is none, it is damaged, or another version of the program wrote it.
    pub fn outline<T: DeserializeOwned>(folder: &Path) -> Result<T> {
        #[derive(Deserialize)]
        struct Versioned {
            version: u32,
        }
        let (path, Kind { command, version: own, .. }) = (folder.join(OUTLINE), R::KIND);
        let wrong = |why: String| Error::file(&path, format!("{why}; run `twobounce {command}` there again"));
        let is_damaged = |e: toml::de::Error| wrong(format!("is damaged: {}", said(&e.message())));
        let text = fs::read_to_string(&path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
        match toml::from_str(&text).map_err(is_damaged)? {
            Versioned { version } if version != own => Err(wrong(format!("is of format {version}, not {own}"))),
            _ => toml::from_str(&text).map_err(is_damaged),
        }
    }

    /// The row with `key`; `None` if there is none, or it is damaged and must be measured again.
    pub fn load(&self, key: &str) -> Option<Stored<R>> {
        let stored = Self::read(&self.row_path(key))?;
        let same_build = self.any_build || stored.program == self.program;
        (stored.row.key() == key && same_build).then_some(stored)
    }

    /// Reads a row of this version from a file.
    fn read(path: &Path) -> Option<Stored<R>> {
        let stored: Stored<R> = toml::from_str(&fs::read_to_string(path).ok()?).ok()?;
        (stored.version == R::KIND.version).then_some(stored)
    }

    /// All rows in a folder, including those of other builds and earlier charts, and those that newer rows replaced.
    /// Keys and builds become file names, so rows in which one could lead to another folder are left out, like damaged
    /// ones.
    pub fn read_all(folder: &Path) -> [Vec<Stored<R>>; 2] {
        [ROWS, HISTORY].map(|name| {
            let entries = fs::read_dir(folder.join(name)).into_iter().flatten().flatten();
            let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
            paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
            paths.sort();
            let is_name = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_alphanumeric());
            let is_known = |stored: &Stored<R>| is_name(stored.row.key()) && is_name(&stored.program);
            paths.iter().filter_map(|path| Self::read(path)).filter(is_known).collect()
        })
    }

    /// Stores a row that this build measured. A row of another build with the same key becomes history.
    pub fn save(&self, row: R, pictures: Option<R::Pictures>) -> Result<Stored<R>> {
        self.put(Stored { version: R::KIND.version, program: self.program.clone(), row, pictures })
    }

    /// Stores a row unchanged. A row of another build with the same key becomes history, without its pictures.
    pub fn put(&self, stored: Stored<R>) -> Result<Stored<R>> {
        if !R::KIND.marks(&self.folder) {
            file::write(&self.path(&R::KIND.mark()), R::KIND.mark_text().as_bytes())?;
        }
        file::create_folder(&self.path(ROWS))?;
        let path = self.row_path(stored.row.key());
        if let Some(before) = Self::read(&path).filter(|before| before.program != stored.program) {
            self.put_into_history(before)?;
        }
        file::write_kept(&path, &stored)?;
        Ok(stored)
    }

    /// Stores a row in the history, without its pictures.
    pub fn put_into_history(&self, stored: Stored<R>) -> Result<()> {
        let [key, build] = [stored.row.key(), &stored.program].map(|text| text.chars().take(16).collect::<String>());
        let path = self.path(HISTORY).join(format!("{key}-{}-{build}.toml", stored.row.unix_s()));
        file::create_folder(&self.path(HISTORY))?;
        file::write_kept(&path, &Stored { pictures: None, ..stored })
    }

    /// The first digits of the hash of the program's file.
    pub fn build(&self) -> &str {
        &self.program[..12]
    }

    /// The path of a row's image, which is kept until its errors are final.
    pub fn image_path(&self, key: &str) -> PathBuf {
        Self::image_in(&self.folder, key)
    }

    /// Path of a row's image in a folder that is only read.
    pub fn image_in(folder: &Path, key: &str) -> PathBuf {
        folder.join(ROWS).join(format!("{key}.exr"))
    }

    fn row_path(&self, key: &str) -> PathBuf {
        self.path(ROWS).join(format!("{key}.toml"))
    }
}

impl<R> Drop for Store<R> {
    fn drop(&mut self) {
        if self.made {
            // This only works on an empty folder.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

fn program() -> Result<String> {
    let failed = |e: std::io::Error| Error::Usage(format!("the program's own file cannot be read: {e}"));
    let bytes = std::env::current_exe().and_then(fs::read).map_err(failed)?;
    Ok(blake3::hash(&bytes).to_string())
}

/// The device in words, which determines the numbers of a row together with its subject.
pub fn device_words(context: &Context) -> String {
    format!("{} / {} / {:?}", context.name, context.driver, context.api_version)
}

/// A hash of 32 digits over everything that determines a row.
pub fn short_hash(about: &serde_json::Value) -> String {
    blake3::hash(about.to_string().as_bytes()).to_hex()[..32].to_owned()
}

/// Results in the user's cache folder, or no folder.
pub struct Results {
    folder: Option<PathBuf>,
    /// The common part of all keys.
    common: String,
    /// Whether stored results are used.
    reads: bool,
}

/// Maximum bytes of stored results. The oldest ones are deleted first.
const MOST_BYTES: u64 = 256 << 20;

impl Results {
    /// `about` describes their common inputs in addition to the program, such as the device. `anew` ignores earlier
    /// results.
    ///
    /// # Errors
    /// The program's own file cannot be read.
    pub fn new(folder: Option<PathBuf>, about: &str, anew: bool) -> Result<Self> {
        Ok(Self { folder, common: format!("{about} {}", program()?), reads: !anew })
    }

    /// Whether results can be stored.
    pub fn keeps(&self) -> bool {
        self.folder.is_some()
    }

    /// The key for inputs described by `about`.
    pub fn key(&self, about: &str) -> String {
        blake3::hash(format!("{} {about}", self.common).as_bytes()).to_hex()[..32].to_owned()
    }

    /// A stored result; `None` if there is none, or it is damaged.
    pub fn load<T: DeserializeOwned>(&self, key: &str) -> Option<T> {
        let text = fs::read_to_string(self.path(key).filter(|_| self.reads)?).ok()?;
        toml::from_str(&text).ok()
    }

    /// Stores a result. A failure only costs time in the next call.
    pub fn save(&self, key: &str, value: &impl Serialize) {
        let Some((folder, path)) = self.folder.as_ref().zip(self.path(key)) else { return };
        match file::create_folder(folder).and_then(|()| file::write_kept(&path, value)) {
            Ok(()) => file::make_room(&path, MOST_BYTES),
            Err(error) => tracing::warn!("a result is not kept: {error}"),
        }
    }

    fn path(&self, key: &str) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{key}.toml")))
    }
}
