//! Checks of a file before it is read.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

use crate::memory::{Limit, apart};
use crate::{Error, Result};

/// Metadata of a regular file. Others are refused before they are opened, because a pipe may never deliver anything,
/// and a device may never end. `what` is a description with its article, for messages.
pub(crate) fn about(path: &Path, what: &str) -> Result<Metadata> {
    if path.is_dir() {
        return Err(Error::file(path, format!("is a folder, not {what}")));
    }
    let about = std::fs::metadata(path).map_err(|e| unreadable(path, &e))?;
    if !about.is_file() {
        return Err(Error::file(path, "is no regular file; copy what it holds into one and name that"));
    }
    Ok(about)
}

pub(crate) fn unreadable(path: &Path, e: &std::io::Error) -> Error {
    match e.kind() {
        std::io::ErrorKind::NotFound => Error::file(path, "cannot be read: it does not exist; check the path"),
        std::io::ErrorKind::PermissionDenied => {
            Error::file(path, "cannot be read: permission is denied; allow it, or name another file")
        }
        _ => Error::file(path, format!("cannot be read: {e}")),
    }
}

/// Refuses content that needs `bytes` bytes of memory beyond the limit. `smaller` names an alternative.
pub(crate) fn check_memory(path: &Path, bytes: u64, smaller: &str) -> Result<()> {
    let limit = Limit::host();
    if bytes <= limit.bytes {
        return Ok(());
    }
    let [needed, _] = apart([bytes, limit.bytes]);
    Err(Error::file(path, format!("needs {needed} of memory, more than {}; name a smaller {smaller}", limit.words)))
}

/// Refuses a header that states more than the file can hold.
pub(crate) fn check_length(path: &Path, is_enough: bool) -> Result<()> {
    if is_enough { Ok(()) } else { Err(Error::file(path, "is too short for the size that it states; save it again")) }
}

/// The text of a small file, which may be a pipe that ends. `what` is its description for messages.
/// [`Error::File`] if it cannot be read, is not text, or is larger than 1 MiB.
pub fn text(path: &Path, what: &str) -> Result<String> {
    const BYTES_MAX: u64 = 1 << 20;
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(BYTES_MAX + 1).read_to_string(&mut text));
    read.map_err(|e| unreadable(path, &e))?;
    if text.len() as u64 > BYTES_MAX {
        return Err(Error::file(path, format!("is larger than 1 MiB, as no {what} is; name another")));
    }
    Ok(text)
}
