//! The flag by which a caller cancels a bake, shared with the bake's loops. Reporting progress and turning the flag
//! into an error is `monitor`'s.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Cancels a bake from any thread. Clones share one flag. Pass a token to [`Bake::cancel`](crate::Bake::cancel).
///
/// A cancelled bake returns [`BakeError::Cancelled`](crate::BakeError::Cancelled) within about a fifth of a second and
/// leaves the World unchanged. A token cannot be reset, so use a new one for each bake.
// Long-running functions poll the flag. If it is set they return at once, with any value of their return type: it is
// discarded.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// Returns true if [`CancelToken::cancel`] was called on this token or a clone.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Cancels the bakes that were given this token.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
