//! Calls of decoders that others wrote: a panic in one is an answer, not the end of the program. Not the decoders.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a decoder answers; nothing if it panics. What it was working on is dropped then.
pub(crate) fn guarded<T>(decode: impl FnOnce() -> T) -> Option<T> {
    // Nothing that the closure borrows is changed by it: decoders read bytes and make values of their own.
    catch_unwind(AssertUnwindSafe(decode)).ok()
}
