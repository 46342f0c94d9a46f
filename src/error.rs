//! The library's one error type. Every variant is one sentence that names what is wrong and what to do.

use std::path::PathBuf;

/// What can go wrong for reasons that a user can act on. Programming errors panic instead.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read, or does not hold what it should.
    #[error("{}: {problem}", path.display())]
    File { path: PathBuf, problem: String },
    /// A flag, a setting or a combination of them makes no sense.
    #[error("{0}")]
    Usage(String),
    /// The Vulkan loader, the driver or the device lacks something or failed.
    #[error("{0}")]
    Device(String),
    /// More memory is needed than the device or `--memory-limit` gives.
    #[error("{0}")]
    Memory(String),
    /// The user pressed Ctrl-C.
    #[error("interrupted")]
    Interrupted,
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A problem with the file at `path`; `problem` says what is wrong and how to mend it.
    pub fn file(path: impl Into<PathBuf>, problem: impl Into<String>) -> Self {
        Self::File { path: path.into(), problem: problem.into() }
    }
}
