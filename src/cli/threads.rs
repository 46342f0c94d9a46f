//! Threads where the system sets a limit to them: `ulimit -u`, the pids of a container.

use std::sync::mpsc;
use std::thread::{Builder, JoinHandle, available_parallelism};

use rayon::ThreadPoolBuilder;
use twobounce::{Error, Result};

/// Starts a thread.
///
/// # Errors
/// [`Error::Usage`] where the system allows none.
pub fn spawn(work: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>> {
    Builder::new().spawn(work).map_err(|error| {
        Error::Usage(format!(
            "no thread can be started ({error}): raise the limit on processes (ulimit -u, or the pids of a container)"
        ))
    })
}

/// Starts the threads that share loops: one per core, or as many as the variable `RAYON_NUM_THREADS` says. Where the
/// system allows fewer, half of those that it allows: the others are for the driver.
///
/// # Errors
/// [`Error::Usage`] where the system allows none.
pub fn start_pool() -> Result<()> {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok()).filter(|number| *number > 0);
    let wanted = asked.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
    // A pool must be told its size before its threads are started, so they come first, and wait for their work.
    let mut threads = vec![];
    while threads.len() < wanted {
        let (give, take) = mpsc::channel::<rayon::ThreadBuilder>();
        match spawn(move || take.recv().into_iter().for_each(rayon::ThreadBuilder::run)) {
            Ok(thread) => threads.push((give, thread)),
            Err(error) if threads.is_empty() => return Err(error),
            Err(_) => {
                for (give, thread) in threads.drain(threads.len().div_ceil(2)..) {
                    drop(give);
                    let _ = thread.join(); // it did nothing
                }
                break;
            }
        }
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads.len());
    let mut threads = threads.into_iter();
    let start = move |work| {
        let (give, _) = threads.next().expect("there are as many as the pool was told");
        give.send(work).expect("it waits for its work");
        Ok(())
    };
    // It fails only where there is a pool already.
    let _ = pool.spawn_handler(start).build_global();
    Ok(())
}
