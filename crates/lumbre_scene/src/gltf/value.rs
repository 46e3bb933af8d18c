//! Converts numbers of the JSON (f64) to the f32 of components. Values beyond the range of f32 become
//! infinite and are refused where they are used.

use glam::Vec3;

pub(crate) fn color(value: [f64; 3]) -> Vec3 {
    Vec3::from_array(value.map(|channel| channel as f32))
}

pub(crate) fn number(value: Option<f64>, default: f32) -> f32 {
    value.map_or(default, |value| value as f32)
}
