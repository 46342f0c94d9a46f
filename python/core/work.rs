//! Work on a separate thread, while Python's signals and other threads go on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;

use crate::to_python;

/// The interval of checks for signals.
const PAUSE: Duration = Duration::from_millis(20);

/// Ends the work, and stores the reason.
#[derive(Clone, Default)]
pub struct Job {
    pub cancel: Arc<AtomicBool>,
    why: Arc<Mutex<Option<PyErr>>>,
}

impl Job {
    fn end(&self, why: PyErr) {
        self.why.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// A function that calls one of Python's with its argument converted by `words`. An exception there ends the work.
    pub fn caller<T, A>(
        &self,
        call: Py<PyAny>,
        words: impl Fn(T) -> A + Send + Sync + 'static,
    ) -> Arc<dyn Fn(T) + Send + Sync>
    where
        A: for<'py> PyCallArgs<'py>,
    {
        let job = self.clone();
        Arc::new(move |told| {
            if !job.cancel.load(Ordering::Relaxed)
                && let Err(why) = Python::attach(|py| call.call1(py, words(told)))
            {
                job.end(why);
            }
        })
    }
}

/// Runs `work` without Python's lock. Ctrl-C and exceptions of callbacks end it, and are raised.
pub fn run<T: Send>(py: Python<'_>, work: impl FnOnce(&Job) -> twobounce::Result<T> + Send) -> PyResult<T> {
    let job = Job::default();
    let result = py.detach(|| {
        thread::scope(|scope| {
            let worker = scope.spawn(|| work(&job));
            while !worker.is_finished() {
                thread::sleep(PAUSE);
                if !job.cancel.load(Ordering::Relaxed)
                    && let Err(why) = Python::attach(|py| py.check_signals())
                {
                    job.end(why);
                }
            }
            worker.join()
        })
    });
    let why = job.why.lock().unwrap_or_else(PoisonError::into_inner).take();
    match (why, result) {
        (Some(why), _) => Err(why),
        (None, Ok(result)) => result.map_err(to_python),
        (None, Err(panic)) => std::panic::resume_unwind(panic),
    }
}
