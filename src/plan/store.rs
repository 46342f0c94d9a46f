//! What was measured, and answers, kept in the user's cache folder: each under a hash of everything that determines it.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::VERSION;
use super::bench::Seen;
use crate::output::file;
use crate::reference::{Depth, Options, Stop, cache};
use crate::scene::{Scene, Still};
use crate::vk::Context;
use crate::{Error, Result};

/// Bytes that are kept: beyond these, those go that were written first.
const MOST_BYTES: u64 = 256 << 20;

/// A folder of results, or nowhere to keep any.
pub struct Store {
    folder: Option<PathBuf>,
    /// Program, device and scene: what every key has in common.
    common: String,
    /// Whether what is kept counts.
    reads: bool,
}

impl Store {
    /// `folder`: where films are kept. `anew`: what was kept before does not count.
    pub fn new(folder: Option<&Path>, context: &Context, validation: bool, anew: bool) -> Result<Self> {
        let failed = |e: std::io::Error| Error::Usage(format!("the program's own file cannot be read: {e}"));
        let program = std::env::current_exe().and_then(std::fs::read).map_err(failed)?;
        let device = format!("{} / {} / {:?}", context.name, context.driver, context.api_version);
        let common = format!("{VERSION} {} {device} {validation}", blake3::hash(&program));
        Ok(Self { folder: folder.map(|folder| folder.join("plan")), common, reads: !anew })
    }

    /// Whether anything can be kept.
    pub fn keeps(&self) -> bool {
        self.folder.is_some()
    }

    /// The key of what is about these words.
    pub fn key(&self, about: &str) -> String {
        blake3::hash(format!("{} {about}", self.common).as_bytes()).to_hex()[..32].to_owned()
    }

    /// `None` where nothing is kept, or it is damaged.
    pub fn load<T: DeserializeOwned>(&self, key: &str) -> Option<T> {
        let text = std::fs::read_to_string(self.path(key).filter(|_| self.reads)?).ok()?;
        toml::from_str(&text).ok()
    }

    /// What cannot be kept only costs time in the next call.
    pub fn save(&self, key: &str, value: &impl Serialize) {
        let Some((folder, path)) = self.folder.as_ref().zip(self.path(key)) else { return };
        if let Err(error) = file::create_folder(folder).and_then(|()| file::write_kept(&path, value)) {
            tracing::warn!("a result is not kept: {error}");
        }
        make_room(folder, MOST_BYTES);
    }

    fn path(&self, key: &str) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{key}.toml")))
    }
}

/// A scene as it is seen, as words to make a key of.
pub fn seen_key(scene: &Scene, seen: &Seen, (width, height): (u32, u32)) -> String {
    let options = Options { width, height, depth: Depth::Full, stop: Stop::Samples(1), seed: 0, occlusion: false };
    cache::key(Still::new(scene, &seen.pose, &seen.view), &options).to_string()
}

/// Removes the files that were written first until those in `folder` have at most so many bytes.
fn make_room(folder: &Path, most_bytes: u64) {
    let about = |entry: std::fs::DirEntry| {
        let about = entry.metadata().ok()?;
        Some((about.modified().ok()?, about.len(), entry.path()))
    };
    let mut files: Vec<_> = folder.read_dir().into_iter().flatten().flatten().filter_map(about).collect();
    files.sort();
    let mut bytes: u64 = files.iter().map(|file| file.1).sum();
    for (_, own, path) in files {
        if bytes <= most_bytes {
            break;
        }
        // Another process may have removed it.
        let _ = std::fs::remove_file(path);
        bytes -= own;
    }
}
