//! Ctrl-C, SIGTERM, SIGHUP and SIGXCPU (`ulimit -t`) set a flag that long work checks between steps, and then stops
//! cleanly. Work that does not stop soon is ended anyway, as after a second signal, but not while a file is being
//! written.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::{Duration, Instant};

use twobounce::output::file;

use super::threads;

/// The time that work may take to check the flag, and then to report its end.
const PATIENCE: Duration = Duration::from_millis(700);
const LAST_WORDS: Duration = Duration::from_millis(300);

/// Makes these signals set the flag, and starts the threads of parallel loops, which receive no signals. It must be
/// called before long work and before other threads start.
///
/// # Errors
/// One sentence if the system allows no threads.
pub fn install() -> anyhow::Result<()> {
    imp::install()?;
    Ok(threads::start_pool()?)
}

/// The flag.
pub static PRESSED: AtomicBool = AtomicBool::new(false);

/// 128 plus the number of the signal.
static EXIT_CODE: AtomicU8 = AtomicU8::new(130);

/// [`twobounce::Error::Interrupted`] once the flag is set.
pub fn check() -> twobounce::Result<()> {
    if PRESSED.load(Ordering::Relaxed) { Err(twobounce::Error::Interrupted) } else { Ok(()) }
}

/// The exit code of an interrupted program.
pub fn exit_code() -> u8 {
    EXIT_CODE.load(Ordering::Relaxed)
}

fn signalled(exit_code: u8) {
    EXIT_CODE.store(exit_code, Ordering::Relaxed);
    if PRESSED.swap(true, Ordering::Relaxed) {
        end();
    }
    // If no thread can be started, a second signal waits as well.
    if threads::spawn(end_soon).is_err() {
        end_soon();
    }
}

fn end_soon() {
    std::thread::sleep(PATIENCE);
    let waiting = Instant::now();
    drop(file::wait_for_writes());
    if waiting.elapsed() > LAST_WORDS / 10 {
        std::thread::sleep(LAST_WORDS);
    }
    end();
}

/// Ends the program at once, because destructors would wait for the device.
fn end() -> ! {
    let _nothing_is_written = file::wait_for_writes();
    super::out::warn("interrupted");
    imp::exit(i32::from(exit_code()))
}

#[cfg(unix)]
mod imp {
    use crate::cli::threads;

    /// A separate thread receives the signals, so that they interrupt no call.
    pub(super) fn install() -> anyhow::Result<()> {
        // SAFETY: the set is initialised before it is used, and all pointers are valid for their calls.
        let signals = unsafe {
            let mut signals = std::mem::zeroed();
            libc::sigemptyset(&mut signals);
            libc::sigaddset(&mut signals, libc::SIGINT);
            libc::sigaddset(&mut signals, libc::SIGTERM);
            libc::sigaddset(&mut signals, libc::SIGXCPU);
            let mut before: libc::sigaction = std::mem::zeroed();
            libc::sigaction(libc::SIGHUP, std::ptr::null(), &mut before);
            // `nohup` requests that it be ignored.
            if before.sa_sigaction != libc::SIG_IGN {
                libc::sigaddset(&mut signals, libc::SIGHUP);
            }
            let result = libc::pthread_sigmask(libc::SIG_BLOCK, &signals, std::ptr::null_mut());
            anyhow::ensure!(result == 0, "signals cannot be handled (error {result})");
            signals
        };
        threads::spawn(move || {
            loop {
                let mut signal = 0;
                // SAFETY: both pointers are valid.
                if unsafe { libc::sigwait(&signals, &mut signal) } == 0 {
                    super::signalled((128 + signal) as u8);
                }
            }
        })?;
        Ok(())
    }

    pub(super) fn exit(code: i32) -> ! {
        #[cfg(target_os = "linux")]
        raise_priorities();
        // SAFETY: output is not buffered. Handlers at exit would run beside a driver's threads.
        unsafe { libc::_exit(code) }
    }

    /// Raises the priorities of threads. A process ends after each of its threads has run once more, and a thread of
    /// Mesa's shader cache has the lowest priority. Does nothing without the permission.
    #[cfg(target_os = "linux")]
    fn raise_priorities() {
        let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
        for thread in threads.filter_map(|entry| entry.file_name().to_str()?.parse::<libc::id_t>().ok()) {
            // SAFETY: the call only takes numbers.
            unsafe { libc::setpriority(libc::PRIO_PROCESS, thread, 0) };
        }
    }
}

#[cfg(not(unix))]
mod imp {
    pub(super) fn install() -> anyhow::Result<()> {
        Ok(ctrlc::set_handler(|| super::signalled(130))?)
    }

    pub(super) fn exit(code: i32) -> ! {
        std::process::exit(code)
    }
}
