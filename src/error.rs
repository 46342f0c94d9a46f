//! The library's error type. Every message is one sentence: what is wrong and what to do.

use std::path::PathBuf;

/// Errors that a user can act on. Programming errors panic instead.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written, or its content is wrong.
    #[error("{}: {problem}", path.display())]
    File { path: PathBuf, problem: String },
    /// A flag, a setting or a combination of them is invalid.
    #[error("{0}")]
    Usage(String),
    /// The Vulkan loader, the driver or the device lacks something or failed.
    #[error("{0}")]
    Device(String),
    /// More memory is needed than the device or `--memory-limit` allows.
    #[error("{0}")]
    Memory(String),
    /// The user pressed Ctrl-C.
    #[error("interrupted")]
    Interrupted,
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A problem with the file at `path`; `problem` says what is wrong and what to do.
    pub fn file(path: impl Into<PathBuf>, problem: impl Into<String>) -> Self {
        Self::File { path: path.into(), problem: problem.into() }
    }
}
