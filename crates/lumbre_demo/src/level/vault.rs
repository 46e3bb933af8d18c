//! The vault: a stone room 1.2 m below the others, lit by embers and candles, where the torch is of use. Two
//! stairs lead to it.

use glam::{DQuat, DVec3, Vec3};
use lumbre_scene::Transform;

use super::builder::{Builder, wisp};
use super::carve::{Air, Finish, Plan};
use super::paint::Paint;
use super::shape;
use crate::motion::{Bob, Flicker, Motion, Orbit};

/// Name and extent.
pub const ROOM: (&str, [f64; 3], [f64; 3]) = ("vault", [13.5, -1.2, 10.5], [21.5, 2.2, 16.5]);

/// The basin: smallest and largest x, then smallest and largest z.
const BASIN: [[f64; 2]; 2] = [[16.0, 18.5], [13.0, 15.0]];

/// Carves the vault, its two stairs, the basin and the hearth.
pub fn carve(plan: &mut Plan) {
    let (room, min, max) = ROOM;
    let finish = Finish::new(Paint::Stone, Paint::Stone, Paint::Stone);
    plan.air.push(Air { room, min: min.into(), max: max.into(), finish });
    let mut air = |min: [f64; 3], max: [f64; 3], finish: Finish| {
        plan.air.push(Air { room, min: min.into(), max: max.into(), finish });
    };
    // Down from the corridor: a doorway, six steps of 0.2 m, and another doorway.
    air([17.0, 0.0, 6.5], [18.2, 2.2, 7.0], finish);
    for step in 1..=6 {
        let (floor, z) = (-0.2 * f64::from(step), 7.0 + 0.5 * f64::from(step));
        air([17.0, floor, z - 0.5], [18.2, 2.2, z], finish);
    }
    air([17.0, -1.2, 10.0], [18.2, 1.0, 10.5], finish);
    // Up to the gallery: a passage, and six steps towards -z.
    air([21.5, -1.2, 14.0], [25.2, 1.0, 15.2], finish);
    for step in 1..=6 {
        let (floor, z) = (-1.2 + 0.2 * f64::from(step), 14.0 - 0.5 * f64::from(step));
        air([24.0, floor, z], [25.2, 2.2, z + 0.5], finish);
    }
    // A basin, half a metre deep.
    let [x, z] = BASIN;
    air([x[0], -1.7, z[0]], [x[1], -1.2, z[1]], finish);
    // The hearth in the west wall.
    let hearth = Finish { floor: Paint::Embers, ..finish };
    air([12.9, -0.8, 12.9], [13.5, 0.4, 14.1], hearth);
}

/// Adds ribs, a pool, a chest, candles, a wisp and a lantern.
pub fn furnish(builder: &mut Builder<'_>) {
    let rib = shape::arch(3.0, 1.9, 2.4, 0.5, 20);
    let along = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let ribs = [15.2, 19.6].map(|x| {
        shape::moved(&rib, glam::DAffine3::from_rotation_translation(along, DVec3::new(x, -0.2, 13.5)))
    });
    builder.fixed("vault ribs", Transform::IDENTITY, shape::together(ribs), Paint::Stone);

    let [x, z] = BASIN;
    let water = lumbre_mesh::shapes::plane((x[1] - x[0]) as f32, (z[1] - z[0]) as f32, 1, 1);
    let level = Transform::from_xyz(0.5 * (x[0] + x[1]), -1.26, 0.5 * (z[0] + z[1]));
    let water = builder.clear("pool", level, water, Paint::Water);
    builder.let_through(water);

    let chest = lumbre_mesh::shapes::cuboid(Vec3::new(1.1, 0.55, 0.6), 3);
    let turned = Transform::from_xyz(20.6, -0.925, 11.2).with_rotation(DQuat::from_rotation_y(-0.35));
    builder.fixed("chest", turned, chest, Paint::Timber);
    let ball = std::sync::Arc::new(lumbre_mesh::shapes::tetrahedral_sphere(0.26, 3, false));
    builder.fixed("ball of gold", Transform::from_xyz(20.6, -0.39, 11.2), ball, Paint::Gold);

    let stand = shape::turned(
        &[
            &[(0.16, 0.0), (0.16, 0.03)],
            &[(0.16, 0.03), (0.03, 0.05)],
            &[(0.03, 0.05), (0.025, 0.5), (0.03, 0.85)],
            &[(0.03, 0.85), (0.10, 0.90)],
            &[(0.10, 0.90), (0.0, 0.90)],
        ],
        14,
    );
    let candles = [(14.4, 11.3), (14.4, 15.7), (20.8, 15.8), (19.0, 11.0)];
    let stands = candles.map(|(x, z)| shape::at(&stand, x, -1.2, z));
    builder.fixed("candle stands", Transform::IDENTITY, shape::together(stands), Paint::Iron);
    for (number, (x, z)) in candles.into_iter().enumerate() {
        let phase = 0.23 * number as f64;
        let flicker = Flicker { depth: 0.5, period: 0.55 + 0.1 * phase, phase };
        let motion = Motion { flicker: Some(flicker), ..Motion::default() };
        let place = Transform::from_xyz(x, -0.18, z);
        let light = wisp(Vec3::new(0.75, 0.38, 0.13), 3.6);
        builder.moving_light(&format!("vault candle {}", number + 1), place, light, &motion);
    }
    let motion = Motion {
        orbit: Some(Orbit { radius: 1.6, period: 11.0, phase: 0.0, axis: DVec3::Y }),
        bob: Some(Bob { reach: DVec3::new(0.0, 0.5, 0.0), period: 4.7, phase: 0.0 }),
        ..Motion::default()
    };
    let light = wisp(Vec3::new(0.2, 0.55, 0.8), 4.5);
    builder.moving_light("vault wisp", Transform::from_xyz(17.6, 0.1, 13.5), light, &motion);

    let flicker = Flicker { depth: 0.4, period: 0.8, phase: 0.0 };
    let motion = Motion {
        bob: Some(Bob { reach: DVec3::new(0.15, 0.1, 0.0), period: 3.3, phase: 0.0 }),
        flicker: Some(flicker),
        ..Motion::default()
    };
    let light = wisp(Vec3::new(1.0, 0.6, 0.25), 4.5);
    builder.moving_light("passage lantern", Transform::from_xyz(24.6, 0.5, 14.6), light, &motion);
}
