//! Standard output and error, which may close early (`twobounce settings | head`) or fail, without a panic.

use std::fmt;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use tracing::{Event, Level, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;
use twobounce::output::file;
use twobounce::{Error, Result};

use super::line;
pub use super::line::{be_quiet, be_verbose};

/// The first error other than a closed pipe.
static FAILED: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Whether a file goes to standard output, so that messages go to standard error.
static GIVEN_AWAY: AtomicBool = AtomicBool::new(false);

/// If one of these files is `-`, standard output is reserved for files.
pub fn leave_to(files: &[Option<&PathBuf>]) {
    GIVEN_AWAY.store(files.iter().flatten().any(|path| file::is_standard(path)), Ordering::Relaxed);
}

/// An error if standard output could not be written when the program began.
pub fn check_open() -> Result<()> {
    if CLOSED.load(Ordering::Relaxed) {
        let words = "standard output is closed; send it to a file or a program, or name a file";
        return Err(Error::Usage(words.into()));
    }
    Ok(())
}

static CLOSED: AtomicBool = AtomicBool::new(false);

/// The loader calls it before `main`, because Rust then opens `/dev/null` in place of a closed standard output.
#[cfg(target_os = "linux")]
#[used]
#[unsafe(link_section = ".init_array")]
static LOOK: extern "C" fn() = {
    extern "C" fn look() {
        // SAFETY: the call only takes numbers.
        let flags = unsafe { libc::fcntl(1, libc::F_GETFL) };
        CLOSED.store(flags == -1 || flags & libc::O_ACCMODE == libc::O_RDONLY, Ordering::Relaxed);
    }
    look
};

/// A file's name for a sentence.
pub fn name(path: &Path) -> String {
    if file::is_standard(path) { "standard output".into() } else { path.display().to_string() }
}

/// Prints a line on standard output.
#[macro_export]
macro_rules! say {
    ($($arg:tt)*) => { $crate::cli::out::write(&format!("{}\n", format_args!($($arg)*))) };
}

/// Writes text to standard output. A closed pipe is not an error: the work continues.
pub fn write(text: &str) {
    if line::is_quiet() {
        return;
    }
    line::clear();
    if GIVEN_AWAY.load(Ordering::Relaxed) {
        let _ = std::io::stderr().write_all(text.as_bytes());
        return;
    }
    let mut stdout = std::io::stdout().lock();
    let Err(error) = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) else { return };
    if error.kind() != ErrorKind::BrokenPipe
        && let Ok(mut failed) = FAILED.lock()
    {
        failed.get_or_insert(error);
    }
}

/// Sends the library's log to standard error: warnings as notes, or more with `TWOBOUNCE_LOG=info` or `debug`.
pub fn init_log() {
    let filter = EnvFilter::try_from_env("TWOBOUNCE_LOG").unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).event_format(Notes).init();
}

/// The format of the log: a line as [`warn`] prints it.
struct Notes;

impl<S, N> FormatEvent<S, N> for Notes
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(&self, context: &FmtContext<'_, S, N>, mut line: Writer<'_>, event: &Event<'_>) -> fmt::Result {
        line::clear();
        let kind = match *event.metadata().level() {
            Level::ERROR => "error",
            Level::WARN => "note",
            _ => "log",
        };
        write!(line, "twobounce: {kind}: ")?;
        context.field_format().format_fields(line.by_ref(), event)?;
        writeln!(line)
    }
}

/// Prints a line on standard error, unless it is closed.
pub fn warn(line: &str) {
    line::clear();
    let _ = writeln!(std::io::stderr(), "twobounce: {line}");
}

/// Reports lost output at the end of the program.
pub fn finish() -> anyhow::Result<()> {
    match FAILED.lock().ok().and_then(|mut failed| failed.take()) {
        Some(error) => Err(anyhow::anyhow!("cannot write to standard output: {error}")),
        None => Ok(()),
    }
}
