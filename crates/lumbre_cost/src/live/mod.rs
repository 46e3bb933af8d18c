//! Measures the view that a window shows, one frame at a time between the window's own frames: its error
//! against the most accurate way to draw it, what its lights cost, and the Pareto front of settings. `tune`
//! measures a file at all of its cameras instead.
//!
//! Measured frames are drawn from the window's World by renderers of their own. Changes to the World are
//! undone before a call returns.

mod light_costs;
mod reference;
mod side_view;
mod view_front;
mod view_walk;

pub use light_costs::{LightCost, LightCosts};
pub use reference::{Beside, BesideReference};
pub use side_view::SideView;
pub use view_front::{Priced, ViewFront};
pub use view_walk::ViewWalk;
