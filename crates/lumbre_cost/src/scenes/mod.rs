//! Small scenes that studies create if no files are passed, each for one question.

mod assorted_balls;
mod ball;
mod balls_and_lamps;
mod every_effect;
mod fence;
mod highlight;
mod lit_sphere;
mod mirror_and_glass;
mod room;
mod scan;
mod sheet;

pub use assorted_balls::assorted_balls;
pub use ball::{Ball, ball, ball_of_table, exact_ball};
pub use balls_and_lamps::{BallsAndLamps, balls_and_lamps};
pub use every_effect::every_effect;
pub use fence::fence;
pub use highlight::{Highlight, highlight};
pub use lit_sphere::{LAMPS, LitSphere, lit_sphere};
pub use mirror_and_glass::mirror_and_glass;
pub use room::{Air, room, two_rooms};
pub use scan::scan;
pub use sheet::{Sheet, sheet};
