//! Scenes that the baker was not tuned on, an independent path tracer that computes reference irradiance for them, and
//! the errors of a bake against that reference. Nothing here shares code with the baker or its ray caster.

#![allow(dead_code, reason = "each test and example uses only a part of this module")]

pub mod input;
pub mod local_errors;
pub mod path_tracer;
pub mod point_errors;
pub mod random;
pub mod reference_points;
pub mod scenes;
pub mod view;
