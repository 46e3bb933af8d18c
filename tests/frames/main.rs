//! Headless frame tests: compares frames of the GPU with the f64 twin. docs/testing.md describes what each file
//! proves.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod accounting;
mod adapter;
mod baked;
mod balls;
mod changes;
mod conformance;
mod constant_colors;
mod degenerate;
mod display;
mod documents;
mod effects_table;
mod explained;
mod faces;
mod flat_rules;
mod frame_settings;
mod gltf_materials;
mod highlights;
mod irradiance_volumes;
mod level;
mod light_counts;
mod light_lists;
mod lightmap_formats;
mod materials;
mod mirrors;
mod missing_pipelines;
mod models;
mod multisampling;
mod normal_maps;
mod opengl;
mod own_effects;
mod polygon_lights;
mod properties;
mod reflection;
mod refraction;
mod rendering_paths;
mod settings;
mod shading_by_need;
mod shadows;
mod textures;
mod traced;
mod transforms;
mod transparency;
mod unchanged;
