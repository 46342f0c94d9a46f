//! The thread that makes frames: the newest job wins, and a frame at rest ends early for it. [`super::maker`] says how they are made.

use std::sync::{Arc, PoisonError};

use twobounce::Error;
use twobounce::vk::{Step, Watch};
use winit::event_loop::EventLoopProxy;

pub use super::job::{Answer, Frame, Job, Stage};
use super::job::{Shared, State, Wanted};
use super::maker::Makers;
use super::question::{Found, Question};
use crate::cli::interrupt;
use crate::cli::progress::course::IMAGE_PASSES;

/// A thread that makes frames; it ends when this is dropped.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread; `wake` is told of each answer.
    pub fn start(stage: Stage, wake: EventLoopProxy<()>) -> Self {
        let shared = Arc::<Shared>::default();
        let own = shared.clone();
        let thread = std::thread::spawn(move || work(&own, stage, &wake));
        Self { shared, thread: Some(thread) }
    }

    /// Asks for a frame instead of any asked for before.
    pub fn ask(&self, job: Job) {
        self.shared.lock().job = Some(job);
        self.shared.changed.notify_all();
    }

    /// Whether a picture that is whole stays as it is, for the path tracer to be compared with.
    pub fn hold(&self, whether: bool) {
        self.shared.lock().holds = whether;
    }

    /// Makes passes anew for the next job: their shaders are others.
    #[cfg(feature = "hot-reload")]
    pub fn renew(&self) {
        self.shared.lock().renews = true;
    }

    /// The newest answer, once.
    pub fn answer(&self) -> Option<Answer> {
        self.shared.lock().answer.take()
    }

    /// Asks something else, between frames.
    pub fn put(&self, question: Question) {
        self.shared.lock().question = Some(question);
        self.shared.changed.notify_all();
    }

    /// What came of the last question, once.
    pub fn found(&self) -> Option<Found> {
        self.shared.lock().found.take()
    }

    /// What it is at.
    pub fn step(&self) -> Option<Step> {
        self.shared.lock().step
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.lock().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn work(shared: &Arc<Shared>, stage: Stage, wake: &EventLoopProxy<()>) {
    let mut makers = Makers::new(stage, watch(shared));
    let mut done = 0;
    loop {
        let job = {
            let idle = |state: &mut State| {
                let asked = state.question.is_some() && done > 0;
                !state.ends && !asked && state.job.as_ref().is_none_or(|job| job.revision == done)
            };
            let waited = shared.changed.wait_while(shared.lock(), idle);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            state.step = None;
            if std::mem::take(&mut state.renews) {
                makers.renew();
            }
            let Some(job) = state.job.clone().filter(|_| !state.ends) else { return };
            state.at_rest = Some(job.revision).filter(|_| !job.moving);
            job
        };
        let answer = |frame| {
            let mut state = shared.lock();
            state.step = None;
            state.answer = Some(Answer { revision: job.revision, frame });
            drop(state);
            let _ = wake.send_event(()); // the window may be closed
        };
        let wanted = Wanted { shared, wake, revision: job.revision };
        if job.revision == done {
            makers.answer(&job, &wanted); // only a question is new
            shared.lock().step = None;
            continue;
        }
        match makers.make(&job, &wanted, &|frame| answer(Ok(frame))) {
            Err(Error::Interrupted) => continue, // for a newer job, or to end
            Err(error) => answer(Err(error.to_string())),
            Ok(()) => {}
        }
        (shared.lock().step, done) = (None, job.revision);
    }
}

/// Ends a frame at rest for a newer job once its light is made, and any frame for the end.
fn watch(shared: &Arc<Shared>) -> Watch {
    let shared = shared.clone();
    Arc::new(move |step| {
        let mut state = shared.lock();
        state.step = Some(step);
        let newer = state.job.as_ref().is_some_and(|job| Some(job.revision) != state.at_rest);
        let late = state.at_rest.is_some() && newer && IMAGE_PASSES.contains(&step.pass);
        if state.ends || late { Err(Error::Interrupted) } else { interrupt::check() }
    })
}
