//! Values that take long to create, above all pipelines, created on the device's worker thread while frames
//! continue without them. Whether a frame waits for them is decided by `options::MissingPipelines`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock};

use crate::{EffectError, Gpu};

/// A value that is created once: it is ready, still being created, or has failed.
#[derive(Debug)]
pub struct Pending<T>(Arc<OnceLock<Result<T, EffectError>>>);

impl<T: Send + Sync + 'static> Pending<T> {
    /// Starts to create it on the device's worker thread, after the jobs that were queued before.
    pub fn begin(gpu: &Gpu, make: impl FnOnce() -> Result<T, EffectError> + Send + 'static) -> Self {
        let place = Arc::new(OnceLock::new());
        let made = Arc::clone(&place);
        gpu.worker_thread().run(Box::new(move || {
            // Waiting callers must get a result even if `make` panics.
            let result = catch_unwind(AssertUnwindSafe(make));
            let _ = made.set(result.unwrap_or_else(|_| Err("its making has panicked".into())));
        }));
        Self(place)
    }

    /// Creates it at once on this thread.
    pub fn make(make: impl FnOnce() -> Result<T, EffectError>) -> Self {
        Self(Arc::new(OnceLock::from(make())))
    }

    /// Returns the result, or `None` while it is being created.
    pub fn get(&self) -> Option<Result<&T, &EffectError>> {
        self.0.get().map(Result::as_ref)
    }

    /// Waits for the result and returns it.
    pub fn wait(&self) -> Result<&T, &EffectError> {
        self.0.wait().as_ref()
    }

    /// Returns true if it is ready. With `wait`, waits for it first.
    ///
    /// # Errors
    /// The error message if creating it has failed.
    pub fn is_there(&self, wait: bool) -> Result<bool, String> {
        let result = if wait { Some(self.wait()) } else { self.get() };
        match result {
            None => Ok(false),
            Some(Ok(_)) => Ok(true),
            Some(Err(error)) => Err(error.to_string()),
        }
    }
}
