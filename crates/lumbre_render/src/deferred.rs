//! Things that take long to make, above all pipelines, made on a thread of the device's own while frames go on without them. Not when a frame goes on and when it waits:
//! that is `options::MissingPipelines`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock};

use crate::{EffectError, Gpu};

/// Something that is made once: there, on its way, or impossible.
#[derive(Debug)]
pub struct Deferred<T>(Arc<OnceLock<Result<T, EffectError>>>);

impl<T: Send + Sync + 'static> Deferred<T> {
    /// Begins to make it on the device's thread, after what was begun before.
    pub fn begin(gpu: &Gpu, make: impl FnOnce() -> Result<T, EffectError> + Send + 'static) -> Self {
        let place = Arc::new(OnceLock::new());
        let made = Arc::clone(&place);
        gpu.worker_thread().run(Box::new(move || {
            // Whoever waits is answered whatever happens.
            let result = catch_unwind(AssertUnwindSafe(make));
            let _ = made.set(result.unwrap_or_else(|_| Err("its making has panicked".into())));
        }));
        Self(place)
    }

    /// Makes it at once.
    pub fn make(make: impl FnOnce() -> Result<T, EffectError>) -> Self {
        Self(Arc::new(OnceLock::from(make())))
    }

    /// What became of it, or nothing yet.
    pub fn get(&self) -> Option<Result<&T, &EffectError>> {
        self.0.get().map(Result::as_ref)
    }

    /// What becomes of it.
    pub fn wait(&self) -> Result<&T, &EffectError> {
        self.0.wait().as_ref()
    }

    /// Whether it is there; with `wait` it is waited for.
    ///
    /// # Errors
    /// It cannot be made; the words of the fault.
    pub fn is_there(&self, wait: bool) -> Result<bool, String> {
        let result = if wait { Some(self.wait()) } else { self.get() };
        match result {
            None => Ok(false),
            Some(Ok(_)) => Ok(true),
            Some(Err(error)) => Err(error.to_string()),
        }
    }
}
