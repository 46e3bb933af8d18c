//! The caller's wish to end, as loops on any thread see it. Not the asking: that is `progress`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether a bake is to end. Its copies are one.
///
/// Work that takes long looks at it now and then; if it is set, it returns at once with whatever fits its type: nobody will read it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Whether nobody waits for the result any more.
    #[inline]
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
