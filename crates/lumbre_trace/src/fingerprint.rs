//! A hash of a value's `Debug` output, which contains every field, also those added later, and every number
//! exactly. Slow for large pictures, and not stable enough to be stored for years.

use std::fmt::{self, Debug, Write};

/// A BLAKE3 hash.
pub(crate) type Fingerprint = [u8; 32];

/// Hashes the `Debug` output of a value.
pub(crate) fn of_debug(value: &dyn Debug) -> Fingerprint {
    let mut hash = Hash(blake3::Hasher::new());
    // Writing to a hasher cannot fail.
    let written = write!(hash, "{value:?}");
    debug_assert!(written.is_ok());
    *hash.0.finalize().as_bytes()
}

struct Hash(blake3::Hasher);

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}
