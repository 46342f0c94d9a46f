//! Ctrl-C sets a flag that long work looks at between steps, and then stops cleanly; a second Ctrl-C ends the program at once.

use std::sync::atomic::{AtomicBool, Ordering};

/// The flag.
pub static PRESSED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C (and SIGTERM) sets the flag.
pub fn install() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if PRESSED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })?;
    Ok(())
}

/// [`twobounce::Error::Interrupted`] once Ctrl-C was pressed.
pub fn check() -> twobounce::Result<()> {
    if PRESSED.load(Ordering::Relaxed) { Err(twobounce::Error::Interrupted) } else { Ok(()) }
}
