//! Atomic writing of files: to a temporary file in the target's folder, which is flushed to disk, then renamed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

use crate::{Error, Result};

/// The number of writes in progress, which must not be interrupted.
static WRITES: Mutex<u32> = Mutex::new(0);
static WRITTEN: Condvar = Condvar::new();

const TOO_LARGE: &str = "it is larger than files may be here; raise the limit (ulimit -f) or choose another disk";

/// A write in progress, until it is dropped. Writes may nest.
pub struct Writing(());

/// Begins a write.
pub fn writing() -> Writing {
    *writes() += 1;
    Writing(())
}

/// Waits until no write is in progress; no write begins until the result is dropped.
pub fn wait_for_writes() -> impl Sized {
    WRITTEN.wait_while(writes(), |writes| *writes > 0).unwrap_or_else(PoisonError::into_inner)
}

fn writes() -> MutexGuard<'static, u32> {
    WRITES.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Writing {
    fn drop(&mut self) {
        *writes() -= 1;
        WRITTEN.notify_all();
    }
}

/// Writes `bytes` to `path`. A failure leaves an existing file unchanged and no temporary file.
///
/// Links are followed. If `path` is not a regular file (a pipe, `/dev/stdout`), the bytes are written to it directly.
/// `-` is standard output.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    if is_standard(path) {
        let mut stdout = io::stdout().lock();
        let written = stdout.write_all(bytes).and_then(|()| stdout.flush());
        return written.map_err(|error| {
            let too_large = error.kind() == ErrorKind::FileTooLarge;
            let problem = if too_large { TOO_LARGE.to_owned() } else { error.to_string() };
            Error::Usage(format!("standard output cannot be written: {problem}"))
        });
    }
    let target = resolve(path)?;
    let written = if is_special(&target) {
        // Another program may never read it, so there is no wait.
        OpenOptions::new().write(true).open(&target).and_then(|mut file| file.write_all(bytes))
    } else {
        let _writing = writing();
        let temporary = beside(&target);
        let fill = |mut file: File| file.write_all(bytes).and_then(|()| file.sync_all());
        let renamed = File::create(&temporary).and_then(fill).and_then(|()| fs::rename(&temporary, &target));
        // After the first error it does not matter whether it existed.
        renamed.inspect_err(|_| drop(fs::remove_file(&temporary)))
    };
    written.map_err(|e| failed(path, &e))
}

/// Writes `value` to `path` as indented JSON that ends in a newline, as [`write()`] does.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::file(path, e.to_string()))?;
    write(path, (text + "\n").as_bytes())
}

/// Writes data that the program reads again as TOML, whose numbers keep their bits; some lose the last one in JSON.
pub fn write_kept(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = toml::to_string(value).map_err(|e| Error::file(path, e.to_string()))?;
    write(path, text.as_bytes())
}

/// Fails if [`write()`] to `path` would: its folder must exist and accept a new file. Leaves no file.
pub fn check_writable(path: &Path) -> Result<()> {
    if is_standard(path) {
        return Ok(());
    }
    let target = resolve(path)?;
    let opened = if is_special(&target) {
        OpenOptions::new().write(true).open(&target).map(drop)
    } else {
        let temporary = beside(&target);
        File::create(&temporary).and_then(|_| fs::remove_file(&temporary))
    };
    opened.map_err(|e| failed(path, &e))
}

/// Whether a path is `-`: standard input or output. A file of that name is `./-`.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Creates a folder and its parents if they are missing.
pub fn create_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)
        .map_err(|e| Error::file(folder, format!("cannot be created: {e}; choose another folder")))
}

/// Locks a file or folder for this process until the result is dropped or the process ends; `None` if another process
/// has it. If the system or the disk has no such locks, every process succeeds.
pub fn lock(opened: File) -> Option<File> {
    (!matches!(opened.try_lock(), Err(TryLockError::WouldBlock))).then_some(opened)
}

/// A lock file of this process, which is deleted afterwards.
pub struct FileLock {
    path: PathBuf,
    _opened: File,
}

impl FileLock {
    /// Locks the file as [`lock`] does.
    pub fn take(path: &Path) -> io::Result<Option<Self>> {
        let opened = OpenOptions::new().create(true).truncate(false).write(true).open(path)?;
        Ok(lock(opened).map(|opened| Self { path: path.to_owned(), _opened: opened }))
    }
}

impl Drop for FileLock {
    fn drop(&mut self) {
        // A process that waits for this file gets it next and finds the work done; others create a new one.
        let _ = fs::remove_file(&self.path);
    }
}

/// Removes files with the ending of `newest`, least recently written or used first, until the files in its folder have
/// at most `most_bytes` bytes or it is the only one.
pub fn make_room(newest: &Path, most_bytes: u64) {
    let entries = newest.parent().and_then(|folder| folder.read_dir().ok()).into_iter().flatten().flatten();
    let alike = |entry: fs::DirEntry| {
        let (path, about) = (entry.path(), entry.metadata().ok()?);
        let is_alike = path.extension() == newest.extension() && about.is_file();
        is_alike.then_some((path == newest, about.modified().ok()?, about.len(), path))
    };
    let mut files: Vec<_> = entries.filter_map(alike).collect();
    files.sort(); // least recently used first, the newest file last
    let mut bytes: u64 = files.iter().map(|file| file.2).sum();
    for (_, _, own, path) in files.iter().filter(|file| !file.0) {
        if bytes <= most_bytes {
            break;
        }
        // Another process may have removed it.
        let _ = fs::remove_file(path);
        bytes -= own;
    }
}

/// Whether two paths name the same file, also by another spelling or a link.
pub fn is_same(a: &Path, b: &Path) -> bool {
    a == b || canonical(a).is_some_and(|a| canonical(b).is_some_and(|b| a == b))
}

/// The canonical path of a file, which need not exist yet; `None` if its folder does not exist.
fn canonical(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok().or_else(|| Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?)))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A pipe or a device, which cannot be replaced.
fn is_special(target: &Path) -> bool {
    target.exists() && !target.is_file()
}

/// The name of a temporary file in the target's folder.
fn beside(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    target.with_file_name(format!(".{name}.{}.part", std::process::id()))
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
fn failed(path: &Path, error: &io::Error) -> Error {
    let folder = folder_of(path);
    let problem = match error.kind() {
        // The form is that of /proc.
        ErrorKind::NotFound if folder.is_dir() => {
            format!("cannot be written: {} takes no new files; choose another folder", folder.display())
        }
        ErrorKind::NotFound => format!("cannot be written: there is no folder {}; create it first", folder.display()),
        ErrorKind::NotADirectory => format!("cannot be written: {} is not a folder", folder.display()),
        ErrorKind::PermissionDenied => {
            format!("cannot be written: no permission to create files in {}; choose another folder", folder.display())
        }
        ErrorKind::ReadOnlyFilesystem => "cannot be written: the disk is read-only; choose another folder".into(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "cannot be written: the disk is full; free some space or choose another one".into()
        }
        ErrorKind::FileTooLarge => format!("cannot be written: {TOO_LARGE}"),
        ErrorKind::InvalidFilename => {
            "cannot be written: the name is too long or not allowed here; choose another name".into()
        }
        _ => format!("cannot be written: {error}"),
    };
    Error::file(path, problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_numbers_come_back_with_the_same_bits() {
        #[derive(Serialize, serde::Deserialize)]
        struct Kept {
            numbers: Vec<f64>,
        }
        // Any exponent and any digits.
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            f64::from_bits(bits)
        };
        let mut numbers: Vec<f64> = (0..20_000).map(|_| next()).filter(|number| number.is_finite()).collect();
        numbers.extend([0.0, -0.0, f64::MIN_POSITIVE, f64::MAX, 0.1 + 0.2, 5e-324]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept.toml");
        write_kept(&path, &Kept { numbers: numbers.clone() }).unwrap();
        let read: Kept = toml::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read.numbers), bits(&numbers));
    }

    #[test]
    fn the_films_that_were_not_used_for_longest_go() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let (now, minute) = (std::time::SystemTime::now(), std::time::Duration::from_secs(60));
        // "c" was written last and used first.
        for (age, name) in [(3, "a.film"), (1, "b.film"), (4, "c.film"), (9, "pipelines.bin")] {
            fs::write(path(name), [0; 100]).unwrap();
            File::options().write(true).open(path(name)).unwrap().set_modified(now - age * minute).unwrap();
        }
        make_room(&path("c.film"), 300);
        assert!(path("a.film").exists(), "there is room for three");
        make_room(&path("c.film"), 299);
        assert_eq!(
            ["a.film", "b.film", "c.film", "pipelines.bin"].map(|n| path(n).exists()),
            [false, true, true, true]
        );
        make_room(&path("c.film"), 1);
        assert_eq!(["b.film", "c.film", "pipelines.bin"].map(|n| path(n).exists()), [false, true, true]);
    }
}
