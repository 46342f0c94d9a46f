//! Atomic writing of files: to a temporary file in the target's folder, which is flushed to disk, then renamed.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Writes `bytes` to `path`. A failure leaves an existing file unchanged and no temporary file.
///
/// Links are followed. If `path` is not a regular file (a pipe, `/dev/stdout`), the bytes are written to it directly.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let target = resolve(path)?;
    if target.exists() && !target.is_file() {
        let written = OpenOptions::new().write(true).open(&target).and_then(|mut f| f.write_all(bytes));
        return written.map_err(|e| failed(path, &e));
    }
    let temporary = Temporary::create(path, &target)?;
    temporary.fill(bytes).and_then(|()| fs::rename(&temporary.name, &target)).map_err(|e| failed(path, &e))
}

/// Fails if [`write()`] to `path` would: its folder must exist and accept a new file. Leaves no file.
pub fn check_writable(path: &Path) -> Result<()> {
    let target = resolve(path)?;
    if target.exists() && !target.is_file() {
        return OpenOptions::new().write(true).open(&target).map(drop).map_err(|e| failed(path, &e));
    }
    Temporary::create(path, &target).map(drop)
}

/// Whether two paths name the same file, also by another spelling or a link.
pub fn is_same(a: &Path, b: &Path) -> bool {
    a == b || canonical(a).is_some_and(|a| canonical(b).is_some_and(|b| a == b))
}

/// The canonical path of a file, which need not exist yet; `None` if its folder does not exist.
fn canonical(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok().or_else(|| {
        let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    })
}

/// A temporary file in the target's folder, deleted when dropped.
struct Temporary {
    name: PathBuf,
    file: File,
}

impl Temporary {
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

impl Drop for Temporary {
    fn drop(&mut self) {
        // After a rename there is no file to remove. Other failures are ignored.
        let _ = fs::remove_file(&self.name);
    }
}

/// Follows links and refuses folders and read-only files.
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

/// The message for an error of the operating system while writing `path`.
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
