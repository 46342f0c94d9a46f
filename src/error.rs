//! The library's error type. Every message is one sentence: what is wrong and what to do.

use std::fmt::Display;
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

/// The maximum number of characters that a message quotes from another library, so that it does not bury the own text.
const SAID_MAX: usize = 160;

/// Another library's message about a file as part of a sentence: on one line and shortened, even if it quotes the file.
pub(crate) fn said(problem: &impl Display) -> String {
    let text = problem.to_string();
    let words: Vec<&str> = text.split(|c: char| c.is_control() || c == ' ').filter(|word| !word.is_empty()).collect();
    let text = words.join(" ");
    match text.char_indices().nth(SAID_MAX) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_others_say_fits_into_a_sentence() {
        assert_eq!(said(&"expected `\"`\n  at\u{1b} \0the end\n"), "expected `\"` at the end");
        assert_eq!(said(&"é".repeat(500)).chars().count(), SAID_MAX + 1);
    }
}
