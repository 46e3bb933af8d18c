//! Tests of the baker as a whole, with a module for each subject. They are one program, since each program compiles the
//! baker's generic code again.
//!
//! Tests that measure the process or depend on its timing (`peak_memory`, `cancelled`) are programs of their own.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/corner.rs"]
mod corner;
#[path = "../held_out/mod.rs"]
mod held_out;

mod atlases;
mod checkpoint;
mod content_hash;
mod coverage;
mod emitters;
mod error_curve;
mod hard_cases;
mod hard_cases_of_size;
mod hard_shadows;
mod hashed_sources;
mod held_out_scenes;
mod honest_error;
mod known_answers;
mod leaks;
mod lightmap_scale;
mod limits;
mod many_lamps;
mod metamorphic;
mod path_tracer;
mod plain_scene;
mod probe_light;
mod probes;
mod real_client;
mod rebake;
mod reference_irradiance;
mod resolution_error;
mod scene_parts;
mod seams;
mod separate_light;
mod sky;
mod soft_shadows;
mod texture_coordinates;
mod two_path_tracers;
