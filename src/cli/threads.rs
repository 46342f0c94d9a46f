//! Threads under a limit of the system: `ulimit -u`, or the process limit of a container.

use std::sync::mpsc;
use std::thread::{Builder, JoinHandle, available_parallelism};

use rayon::ThreadPoolBuilder;
use twobounce::{Error, Result};

/// Starts a thread.
///
/// # Errors
/// [`Error::Usage`] if the system allows no thread.
pub fn spawn(work: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>> {
    Builder::new().spawn(work).map_err(|error| {
        Error::Usage(format!(
            "no thread can be started ({error}): raise the limit on processes (ulimit -u, or the pids of a container)"
        ))
    })
}

/// Starts the threads of parallel loops: one per core, or the number in the variable `RAYON_NUM_THREADS`. If the system
/// allows fewer, it uses half of them and leaves the others to the driver.
///
/// # Errors
/// [`Error::Usage`] if the system allows no thread.
pub fn start_pool() -> Result<()> {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok()).filter(|number| *number > 0);
    let wanted = asked.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
    // A pool needs its size before its threads start, so they are started first and wait for their work.
    let mut threads = vec![];
    while threads.len() < wanted {
        let (give, take) = mpsc::channel::<rayon::ThreadBuilder>();
        match spawn(move || take.recv().into_iter().for_each(rayon::ThreadBuilder::run)) {
            Ok(thread) => threads.push((give, thread)),
            Err(error) if threads.is_empty() => return Err(error),
            Err(_) => {
                for (give, thread) in threads.drain(threads.len().div_ceil(2)..) {
                    drop(give);
                    let _ = thread.join(); // the thread did nothing
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
    // This only fails if there is already a pool.
    let _ = pool.spawn_handler(start).build_global();
    Ok(())
}
