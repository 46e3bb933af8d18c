//! What the view that somebody is looking at costs and lacks, measured a frame at a time between the frames of a window: its error against the most accurate way to draw it,
//! what its lights cost, and the front of settings for it. Not the window, and not `tune`, which measures a file at all of its cameras.
//!
//! A measured frame is drawn from the World of the window, by renderers of its own. What it changes of the World it gives back before it returns.

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
