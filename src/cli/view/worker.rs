//! The thread that makes frames. The newest job wins, and a frame at rest ends early for it. [`super::maker`] makes the
//! frames.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use twobounce::vk::Step;
use twobounce::{Error, Result};

use super::job::{Job, ShownFrame};
use super::maker::Makers;
use super::question::Question;
use crate::cli::progress::course::IMAGE_PASSES;
use crate::cli::{interrupt, threads};

/// A thread that makes frames; dropping it ends it.
pub struct Worker {
    pub shared: Arc<Shared>,
    thread: Option<std::thread::JoinHandle<()>>,
}

#[derive(Default)]
pub struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

/// The thread's task and its current step.
#[derive(Default)]
pub struct State {
    /// The newest job, which replaces earlier ones.
    pub job: Option<Job>,
    /// The newest frame of a job, given by its revision, or the reason why there is none. A slow window misses earlier
    /// ones.
    pub frame: Option<(u64, std::result::Result<ShownFrame, String>)>,
    /// A question, which is answered between frames.
    pub question: Option<Question>,
    pub step: Option<Step>,
    /// The current job, if it is at rest.
    at_rest: Option<u64>,
    /// Whether a complete picture stays unchanged, for comparison with the path tracer.
    pub holds: bool,
    ends: bool,
}

impl Shared {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and wakes the thread.
    pub fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    /// # Errors
    /// [`Error::Interrupted`] if there is a newer job than this one, or the thread must end.
    pub fn check(&self, job: &Job) -> Result<()> {
        let state = self.lock();
        let newest = state.job.as_ref().is_none_or(|newest| newest.revision == job.revision);
        if newest && !state.ends { interrupt::check() } else { Err(Error::Interrupted) }
    }
}

impl Worker {
    /// # Errors
    /// One sentence if the system allows no thread.
    pub fn start(makers: Makers) -> Result<Self> {
        let shared = makers.shared.clone();
        let thread = threads::spawn(move || work(makers))?;
        Ok(Self { shared, thread: Some(thread) })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.change(|state| state.ends = true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn work(mut makers: Makers) {
    let shared = makers.shared.clone();
    let watched = shared.clone();
    makers.options.watch = Some(Arc::new(move |step| watch(&watched, step)));
    let mut done = 0;
    loop {
        let idle = |state: &mut State| {
            let asked = state.question.is_some() && done > 0;
            !state.ends && !asked && state.job.as_ref().is_none_or(|job| job.revision == done)
        };
        let waited = shared.changed.wait_while(shared.lock(), idle);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner);
        let Some(job) = state.job.clone().filter(|_| !state.ends) else { return };
        state.at_rest = Some(job.revision).filter(|_| !job.moving);
        drop(state);
        if job.revision == done {
            makers.answer(&job); // there is only a new question
        } else {
            match makers.make(&job) {
                Err(Error::Interrupted) => {} // for a newer job, or the end
                made => {
                    done = job.revision;
                    if let Err(error) = made {
                        makers.tell_frame(&job, Err(error.to_string()));
                    }
                }
            }
        }
        shared.lock().step = None;
    }
}

/// Ends a frame at rest for a newer job once its light is made, and any frame at the end.
fn watch(shared: &Shared, step: Step) -> Result<()> {
    let mut state = shared.lock();
    state.step = Some(step);
    let newer = state.job.as_ref().is_some_and(|job| Some(job.revision) != state.at_rest);
    let late = state.at_rest.is_some() && newer && IMAGE_PASSES.contains(&step.pass);
    if state.ends || late { Err(Error::Interrupted) } else { interrupt::check() }
}
