//! A drone with a lamp that flies a circuit through all rooms.

use glam::{DAffine3, DVec3, Vec3};
use lumbre_scene::Transform;

use super::builder::{Builder, wisp};
use super::paint::Paint;
use super::shape;
use crate::motion::{Bob, Motion, Path};

/// The points of its circuit: through the hall, the corridor and the gallery, down to the vault and up again.
/// They are about two metres apart, and closer near doorways.
pub const ROUND: [[f64; 3]; 34] = [
    [6.0, 2.4, 5.0],
    [9.5, 2.1, 5.0],
    [11.5, 1.7, 5.0],
    [13.0, 1.7, 5.0],
    [15.5, 1.9, 5.0],
    [18.5, 1.9, 5.0],
    [21.0, 1.8, 5.0],
    [22.4, 1.7, 5.0],
    [23.8, 1.8, 5.0],
    [26.0, 2.4, 4.8],
    [29.5, 2.8, 4.6],
    [32.5, 2.6, 5.2],
    [32.0, 2.6, 6.6],
    [29.0, 2.6, 6.2],
    [26.0, 2.2, 6.4],
    [24.7, 1.9, 8.5],
    [24.6, 1.6, 10.2],
    [24.6, 1.5, 11.6],
    [24.6, 0.7, 13.2],
    [24.4, 0.2, 14.5],
    [23.0, 0.1, 14.6],
    [21.5, 0.1, 14.6],
    [19.5, 0.3, 14.4],
    [16.0, 0.4, 14.8],
    [15.6, 0.4, 12.4],
    [17.2, 0.2, 11.8],
    [17.6, 0.1, 10.6],
    [17.6, 0.3, 9.4],
    [17.6, 1.0, 7.6],
    [17.6, 1.6, 6.6],
    [16.8, 1.8, 5.5],
    [14.6, 1.8, 5.0],
    [12.8, 1.7, 5.0],
    [11.4, 1.7, 5.0],
];

/// Adds the drone.
pub fn launch(builder: &mut Builder<'_>) {
    let points: Vec<DVec3> = ROUND.into_iter().map(DVec3::from_array).collect();
    let start = Transform::from_translation(points[0]);
    let motion = Motion {
        path: Some(Path { points, period: 68.0, phase: 0.0 }),
        bob: Some(Bob { reach: DVec3::new(0.0, 0.05, 0.0), period: 1.3, phase: 0.0 }),
        ..Motion::default()
    };
    let ball = lumbre_mesh::shapes::tetrahedral_sphere(0.13, 3, false);
    let body = shape::moved(&ball, DAffine3::from_scale(DVec3::new(1.0, 0.55, 1.0)));
    let ring = lumbre_mesh::shapes::torus(0.21, 0.025, 24, 8);
    let drone = builder.moving("drone", start, shape::together([body, ring]), Paint::Iron, &motion);
    builder.carried_light(
        drone,
        "drone lamp",
        Transform::from_xyz(0.0, -0.14, 0.0),
        wisp(Vec3::new(1.5, 1.5, 1.4), 6.0),
    );
}
