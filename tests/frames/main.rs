//! Headless frame tests: frames of the GPU against the f64 twin. docs/testing.md says what each file proves.

mod adapter;
mod baked;
mod balls;
mod conformance;
mod models;
