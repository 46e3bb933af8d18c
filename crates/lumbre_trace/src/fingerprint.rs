//! A hash of what a value says of itself when it is printed for debugging: all of its fields, those that are added later too, and every
//! number to its last digit. Slow for large pictures; nothing to keep for years.

use std::fmt::{self, Debug, Write};

/// BLAKE3.
pub(crate) type Fingerprint = [u8; 32];

/// Of a value.
pub(crate) fn of_debug(value: &dyn Debug) -> Fingerprint {
    let mut hash = Hash(blake3::Hasher::new());
    // Hashing takes whatever is written to it.
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
