//! Hot reload: GLSL files that change on disk replace the compiled shaders of pipelines that are created afterwards.

use super::compile::{Store, compile_all};
use super::shader;
use crate::{Error, Result};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// A folder of GLSL that is watched.
pub struct Reload {
    root: PathBuf,
    /// The time of the last write of each file.
    stamps: BTreeMap<PathBuf, SystemTime>,
    shaders: Shaders,
    learnt: bool,
}

/// Shaders in use, by the preprocessed text of each, and shaders that are compiled but not yet in use.
#[derive(Default)]
struct Shaders(Mutex<State>);

#[derive(Default)]
struct State {
    /// Whether texts are recorded as those that the build compiled, instead of compiled.
    learns: bool,
    texts: HashMap<String, String>,
    compiled: BTreeMap<String, Vec<u32>>,
}

impl Reload {
    /// Watches a folder, whose current state is taken as that of the build.
    ///
    /// # Errors
    /// There is no GLSL in the folder.
    pub fn watch(root: &Path) -> Result<Self> {
        let stamps = stamps(root);
        if stamps.is_empty() {
            return Err(Error::file(root, "there is no GLSL: name the folder glsl of the source with --glsl"));
        }
        Ok(Self { root: root.to_owned(), stamps, shaders: Shaders::default(), learnt: false })
    }

    /// Replaces the shaders of the build by all shaders of a folder.
    ///
    /// # Errors
    /// The compiler's messages, or a sentence about a changed interface of a shader.
    pub fn take_all(root: &Path) -> Result<()> {
        Self::watch(root)?.compile().map(drop)
    }

    /// Compiles files that were saved since the last call. Returns the number of replaced shaders, or `None` if no file
    /// changed. After an error everything stays as it is. The first call takes longer, because it reads everything.
    ///
    /// # Errors
    /// The compiler's messages, one `file:line: message` per line.
    pub fn look(&mut self) -> Option<Result<usize>> {
        if !std::mem::replace(&mut self.learnt, true)
            && let Err(error) = self.learn()
        {
            return Some(Err(error));
        }
        let stamps = stamps(&self.root);
        if stamps == self.stamps {
            return None;
        }
        self.stamps = stamps;
        Some(self.compile())
    }

    /// Records the text of each shader.
    fn learn(&self) -> Result<()> {
        self.shaders.lock().learns = true;
        let read = compile_all(&self.root, &self.shaders);
        let mut state = self.shaders.lock();
        state.learns = false;
        if stamps(&self.root) != self.stamps {
            state.texts.clear(); // it is unknown which of two states was read
        }
        read.map(drop).map_err(Error::Usage)
    }

    fn compile(&self) -> Result<usize> {
        compile_all(&self.root, &self.shaders).map_err(Error::Usage)?;
        shader::replace(std::mem::take(&mut self.shaders.lock().compiled))
    }
}

impl Shaders {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for Shaders {
    fn has(&self, name: &str, text: &str) -> bool {
        let mut state = self.lock();
        if state.learns {
            state.texts.insert(name.to_owned(), text.to_owned());
        }
        state.texts.get(name).is_some_and(|known| known == text)
    }

    fn put(&self, name: &str, text: &str, words: Vec<u32>) -> std::result::Result<(), String> {
        let mut state = self.lock();
        state.texts.insert(name.to_owned(), text.to_owned());
        state.compiled.insert(name.to_owned(), words);
        Ok(())
    }
}

/// The times of all files in a folder. A file that an editor is replacing is missing, and is found by the next call.
fn stamps(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(stamps(&path));
        } else if let Ok(written) = entry.metadata().and_then(|metadata| metadata.modified()) {
            found.insert(path, written);
        }
    }
    found
}
