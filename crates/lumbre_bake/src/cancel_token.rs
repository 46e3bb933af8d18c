//! The caller's wish to end a bake, as its own threads and the bake's loops see it. Not the asking: that is `progress`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends a bake from any thread; its copies are one. [`Bake::cancel`](crate::Bake::cancel) takes it.
///
/// A bake that is cancelled returns within a fifth of a second or so, with [`BakeError::Cancelled`](crate::BakeError::Cancelled), and leaves the
/// World as it was. Once cancelled, a token stays so: each bake wants one of its own.
// Work that takes long looks at it now and then; if it is set, it returns at once with whatever fits its type: nobody will read it.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// Whether nobody waits for the result any more.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Ends the bakes that were given this token.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
