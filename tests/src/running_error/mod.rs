//! Bounds on how much a device's results may be off: the shader's own program is interpreted with numbers that
//! carry a bound on their rounding error (running error analysis: Higham 2002, Accuracy and Stability of Numerical
//! Algorithms, section 3.3), with the accuracies that WGSL guarantees. This is not an emulation of f32: values are
//! those of exact arithmetic, and the bound holds for any conforming device.
//!
//! ```text
//!   WGSL ──► naga's IR ──► evaluate(x), every operation: exact value, bound of the error so far
//!                          a condition that the errors leave open: both ways, and the hull of what comes out
//! ```

mod arithmetic;
mod interpreter;

pub use arithmetic::Number;
pub use interpreter::{Bounds, Program};
