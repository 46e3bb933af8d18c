//! Calls third-party decoders so that a panic in one becomes a return value instead of ending the program.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// The result of `decode`, or `None` if it panics; what it was working on is dropped then.
pub(crate) fn guarded<T>(decode: impl FnOnce() -> T) -> Option<T> {
    // Unwind safety: decoders only read the bytes that the closure borrows and build new values, so a panic
    // leaves no borrowed state half-modified.
    catch_unwind(AssertUnwindSafe(decode)).ok()
}
