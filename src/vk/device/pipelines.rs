//! The pipelines of a context. A changed setting compiles only the pipelines that depend on it, and earlier settings
//! compile none.

use super::context::Context;
use crate::Result;
use ash::vk;
use std::any::Any;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The number of unused pipelines that are kept, those of about three frames. They take a few MiB each on llvmpipe.
const IDLE: usize = 64;

/// A pipeline as its context stores it.
pub(in crate::vk) trait Pipeline: Any + Send + Sync {
    fn label(&self) -> &str;

    /// The pipeline, after waiting for it.
    fn made(&self) -> std::result::Result<vk::Pipeline, vk::Result>;

    /// Whether the driver is known to have failed to create it.
    fn has_failed(&self) -> bool;

    /// Destroys the pipeline. No work in flight may use it.
    unsafe fn destroy(&self, device: &ash::Device);
}

/// Description that a pipeline was made from, and the pipeline.
type KeptPipeline = (String, Arc<dyn Pipeline>);

#[derive(Default)]
pub(in crate::vk) struct Pipelines {
    /// Pipelines in the order of their last use.
    kept: Mutex<Vec<KeptPipeline>>,
    compiled: AtomicU64,
}

impl Pipelines {
    /// The number of pipelines created so far.
    pub(in crate::vk) fn compiled(&self) -> u64 {
        self.compiled.load(Ordering::Relaxed)
    }

    /// The label of each pipeline and the pipeline, after waiting for it.
    pub(in crate::vk) fn labelled(&self) -> Vec<(String, std::result::Result<vk::Pipeline, vk::Result>)> {
        self.kept().iter().map(|(_, pipeline)| (pipeline.label().to_owned(), pipeline.made())).collect()
    }

    fn kept(&self) -> MutexGuard<'_, Vec<KeptPipeline>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The existing pipeline with the same description, or a new one by `make`.
    pub(in crate::vk) fn find_or_make<P: Pipeline>(
        &self,
        made_of: String,
        make: impl FnOnce() -> Result<P>,
    ) -> Result<Arc<P>> {
        let mut kept = self.kept();
        // A pipeline that failed before may succeed now: there may be more memory.
        let serves = |(of, pipeline): &KeptPipeline| *of == made_of && !pipeline.has_failed();
        let found = kept.iter().position(serves).map(|place| kept.remove(place));
        let pipeline = match found {
            Some((_, pipeline)) => {
                (pipeline as Arc<dyn Any + Send + Sync>).downcast().expect("a context keeps one type")
            }
            None => {
                self.compiled.fetch_add(1, Ordering::Relaxed);
                Arc::new(make()?)
            }
        };
        kept.push((made_of, pipeline.clone()));
        Ok(pipeline)
    }

    /// Removes unused pipelines, least recently used first, until [`IDLE`] are left.
    fn take_surplus(&self) -> Vec<KeptPipeline> {
        let mut kept = self.kept();
        let unused = |(_, pipeline): &KeptPipeline| Arc::strong_count(pipeline) == 1;
        let mut surplus = kept.iter().filter(|kept| unused(kept)).count().saturating_sub(IDLE);
        let taken = kept.extract_if(.., |kept| {
            let take = surplus > 0 && unused(kept);
            surplus -= usize::from(take);
            take
        });
        taken.collect()
    }

    /// Destroys all pipelines. No work may be in flight.
    pub(in crate::vk) unsafe fn close(&self, device: &ash::Device) {
        for (_, pipeline) in self.kept().drain(..) {
            // SAFETY: the caller's.
            unsafe { pipeline.destroy(device) };
        }
    }
}

impl Context {
    /// Waits for all pipelines that are being compiled.
    ///
    /// # Errors
    /// The driver could not compile one.
    pub fn wait_for_pipelines(&self) -> Result<()> {
        let kept: Vec<_> = self.pipelines.kept().iter().map(|(_, pipeline)| pipeline.clone()).collect();
        for pipeline in kept {
            let error = |result| self.error(&format!("compiling the pass {}", pipeline.label()), result);
            pipeline.made().map_err(error)?;
        }
        for (_, pipeline) in self.pipelines.take_surplus() {
            // SAFETY: no work uses it, because work in flight keeps its pipelines.
            unsafe { pipeline.destroy(self.device()) };
        }
        Ok(())
    }
}
