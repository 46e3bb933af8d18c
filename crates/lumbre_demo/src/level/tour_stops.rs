//! The cameras of the headless tour.

use glam::DVec3;
use lumbre_scene::Transform;

use super::builder::Builder;
use crate::tour::TOUR_CAMERA;

/// Eye and target of each camera, metres.
pub const STOPS: [([f64; 3], [f64; 3]); 12] = [
    ([7.6, 2.0, 9.2], [2.5, 1.7, 1.5]),
    ([6.2, 2.2, 5.6], [3.5, 1.4, 0.5]),
    ([10.4, 1.7, 5.0], [16.0, 1.6, 5.0]),
    ([13.4, 1.6, 5.0], [22.0, 1.5, 5.0]),
    ([19.0, 1.6, 5.2], [24.0, 1.5, 4.8]),
    ([23.6, 1.8, 5.0], [32.0, 1.0, 4.5]),
    ([27.2, 1.8, 5.2], [29.5, 1.2, 8.5]),
    ([30.2, 2.0, 5.4], [34.0, 1.6, 0.5]),
    ([26.6, 1.8, 7.0], [24.4, 0.6, 11.5]),
    ([24.6, 1.5, 11.2], [24.5, -0.2, 14.8]),
    ([22.2, 0.4, 14.6], [16.0, -0.3, 14.0]),
    ([19.8, 0.5, 14.6], [13.6, -0.4, 13.2]),
];

/// Adds the cameras.
pub fn place(builder: &mut Builder<'_>) {
    for (number, (eye, target)) in STOPS.into_iter().enumerate() {
        let place = Transform::from_translation(eye.into()).looking_at(target.into(), DVec3::Y);
        builder.camera(&format!("{TOUR_CAMERA} {:02}", number + 1), place);
    }
}
