//! Scenes that the baker was not tuned on, an independent path tracer, and the judgement of a bake by it. Nothing here is
//! shared with the baker or its ray caster.

#![allow(dead_code, reason = "every test and example uses its own part of this module")]

pub mod input;
pub mod judgement;
pub mod local_errors;
pub mod path_tracer;
pub mod random;
pub mod reference_points;
pub mod scenes;
pub mod view;
