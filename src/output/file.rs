//! Whole files or none: written under another name beside the target, flushed to disk, then renamed.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Writes `bytes` to `path`. On failure what stood at `path` before is untouched and nothing is left beside it.
///
/// A link is followed. Something that is no regular file (a pipe, `/dev/stdout`) is written into directly.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let target = resolve(path)?;
    if target.exists() && !target.is_file() {
        let written = OpenOptions::new().write(true).open(&target).and_then(|mut f| f.write_all(bytes));
        return written.map_err(|e| failed(path, &e));
    }
    let beside = Beside::create(path, &target)?;
    beside.fill(bytes).and_then(|()| fs::rename(&beside.name, &target)).map_err(|e| failed(path, &e))
}

/// Whether [`write()`] to `path` could work: its folder exists and takes a new file. Leaves nothing behind.
pub fn check_writable(path: &Path) -> Result<()> {
    let target = resolve(path)?;
    if target.exists() && !target.is_file() {
        return OpenOptions::new().write(true).open(&target).map(drop).map_err(|e| failed(path, &e));
    }
    Beside::create(path, &target).map(drop)
}

/// Whether two names lead to one file, which one of them may spell another way or link to.
pub fn is_same(a: &Path, b: &Path) -> bool {
    a == b || whole(a).is_some_and(|a| whole(b).is_some_and(|b| a == b))
}

/// The one spelling of a name; of a file that is not there yet, in the one of its folder. `None` where that is not there.
fn whole(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok().or_else(|| {
        let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    })
}

/// A file beside the target that goes away with this value.
struct Beside {
    name: PathBuf,
    file: File,
}

impl Beside {
    fn create(path: &Path, target: &Path) -> Result<Self> {
        let stem = target.file_name().unwrap_or_default().to_string_lossy();
        let name = target.with_file_name(format!(".{stem}.{}.part", std::process::id()));
        let file = File::create(&name).map_err(|e| failed(path, &e))?;
        Ok(Self { name, file })
    }

    fn fill(&self, bytes: &[u8]) -> std::io::Result<()> {
        (&self.file).write_all(bytes)?;
        self.file.sync_all()
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        // After a rename there is nothing to remove, and a failure to remove has no better remedy.
        let _ = fs::remove_file(&self.name);
    }
}

/// Follows links and refuses what cannot be a target.
fn resolve(path: &Path) -> Result<PathBuf> {
    if path.is_dir() {
        return Err(Error::file(path, "is a folder; name a file in it"));
    }
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|m| m.permissions().readonly()) {
        return Err(Error::file(path, "is read-only; choose another name or allow writing to it"));
    }
    Ok(target)
}

/// The sentence for an error of the operating system while writing `path`.
fn failed(path: &Path, error: &std::io::Error) -> Error {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let problem = match error.kind() {
        ErrorKind::NotFound => format!("cannot be written: there is no folder {}; create it first", folder.display()),
        ErrorKind::NotADirectory => format!("cannot be written: {} is not a folder", folder.display()),
        ErrorKind::PermissionDenied => {
            format!("cannot be written: no permission to create files in {}; choose another folder", folder.display())
        }
        ErrorKind::ReadOnlyFilesystem => "cannot be written: the disk is read-only; choose another folder".into(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "cannot be written: the disk is full; free some space or choose another one".into()
        }
        ErrorKind::InvalidFilename => "cannot be written: the name is too long or not allowed here".into(),
        _ => format!("cannot be written: {error}"),
    };
    Error::file(path, problem)
}
