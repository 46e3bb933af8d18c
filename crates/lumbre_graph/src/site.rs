//! Where in the caller's source something was declared, so that an error can point to both declarations.

use std::fmt;
use std::panic::Location;

/// A source location: file, line and column of the call that declared a pass or a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Site(&'static Location<'static>);

impl Site {
    /// The location that called the `#[track_caller]` function that calls this.
    #[track_caller]
    pub(crate) fn caller() -> Self {
        Self(Location::caller())
    }

    /// Line in the file, starting from 1.
    #[must_use]
    pub fn line(&self) -> u32 {
        self.0.line()
    }

    /// File name as the compiler has it.
    #[must_use]
    pub fn file(&self) -> &'static str {
        self.0.file()
    }
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.0.file(), self.0.line())
    }
}
