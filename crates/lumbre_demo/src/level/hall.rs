//! The entrance hall: tall windows to the west, pillars, and a red wall facing a teal one.

use glam::{DQuat, DVec3, Vec3};
use lumbre_scene::Transform;

use super::builder::{Builder, beam, wisp};
use super::carve::{Air, Finish, Matter, Plan};
use super::paint::Paint;
use super::shape;
use crate::motion::{Bob, Flicker, Motion, Orbit, Swing};

/// Name and extent.
pub const ROOM: (&str, [f64; 3], [f64; 3]) = ("hall", [0.0, 0.0, 0.0], [12.0, 4.5, 10.0]);
/// The pillars: x and z.
const PILLARS: [(f64, f64); 4] = [(4.0, 2.75), (4.0, 7.25), (8.0, 2.75), (8.0, 7.25)];

/// Carves the hall, its windows and its doors.
pub fn carve(plan: &mut Plan) {
    let (room, min, max) = ROOM;
    let finish = Finish {
        walls: [Paint::White, Paint::White, Paint::Red, Paint::Teal],
        ..Finish::new(Paint::Tiles, Paint::White, Paint::White)
    };
    plan.air.push(Air { room, min: min.into(), max: max.into(), finish });
    let reveal = Finish::new(Paint::White, Paint::White, Paint::White);
    let window = Finish { walls: [Paint::Daylight, Paint::White, Paint::White, Paint::White], ..reveal };
    for z in [1.5, 4.0, 6.5] {
        let (min, max) = (DVec3::new(-0.5, 1.0, z), DVec3::new(0.0, 3.8, z + 2.0));
        plan.air.push(Air { room, min, max, finish: window });
    }
    // The closed front door, in a niche of the south wall.
    let door = Finish { walls: [Paint::White, Paint::White, Paint::White, Paint::Timber], ..reveal };
    let (min, max) = (DVec3::new(9.0, 0.0, 10.0), DVec3::new(10.2, 2.2, 10.3));
    plan.air.push(Air { room, min, max, finish: Finish { floor: Paint::Tiles, ..door } });
    // The doorway to the corridor.
    let doorway = Finish { floor: Paint::Stone, ..reveal };
    let (min, max) = (DVec3::new(12.0, 0.0, 4.4), DVec3::new(12.5, 2.2, 5.6));
    plan.air.push(Air { room: "corridor", min, max, finish: doorway });
    for x in [3.8, 7.8] {
        let (min, max) = (DVec3::new(x, 4.1, 0.0), DVec3::new(x + 0.4, 4.5, 10.0));
        plan.matter.push(Matter { min, max, paint: Paint::Timber });
    }
}

/// Adds pillars, a banner, the light from the windows, and moving lights.
pub fn furnish(builder: &mut Builder<'_>) {
    let pillar = pillar();
    let pillars = shape::together(PILLARS.map(|(x, z)| shape::at(&pillar, x, 0.0, z)));
    builder.fixed("hall pillars", Transform::IDENTITY, pillars, Paint::Marble);

    let banner = lumbre_mesh::shapes::plane(1.4, 2.2, 4, 6);
    let upright = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let node = builder.fixed(
        "banner",
        Transform::from_xyz(6.0, 3.0, 0.9).with_rotation(upright),
        banner,
        Paint::Banner,
    );
    builder.let_through(node);
    let rod = lumbre_mesh::shapes::cylinder(0.025, 1.7, 10);
    let across = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let node = builder.fixed(
        "banner rod",
        Transform::from_xyz(6.0, 4.12, 0.9).with_rotation(across),
        rod,
        Paint::Iron,
    );
    builder.let_through(node);

    for (number, z) in [2.5, 5.0, 7.5].into_iter().enumerate() {
        let place = Transform::from_xyz(-0.4, 3.2, z).looking_at(DVec3::new(3.6, 0.0, z - 0.4), DVec3::Y);
        let light = beam(Vec3::new(3.0, 3.1, 3.2), 32.0, 16.0);
        builder.baked_light(&format!("window light {}", number + 1), place, light);
    }

    let colors = [
        Vec3::new(1.5, 0.35, 0.25),
        Vec3::new(0.3, 1.2, 0.45),
        Vec3::new(0.35, 0.5, 1.7),
        Vec3::new(1.3, 0.9, 0.2),
    ];
    for (number, ((x, z), color)) in PILLARS.into_iter().zip(colors).enumerate() {
        let turn = 0.25 * number as f64;
        let motion = Motion {
            orbit: Some(Orbit { radius: 0.75, period: 5.0 + turn * 4.0, phase: turn, axis: DVec3::Y }),
            bob: Some(Bob { reach: DVec3::new(0.0, 0.6, 0.0), period: 3.7, phase: turn }),
            ..Motion::default()
        };
        let place = Transform::from_xyz(x, 1.7, z);
        builder.moving_light(&format!("pillar wisp {}", number + 1), place, wisp(color, 6.0), &motion);
    }
    let chain = lumbre_mesh::shapes::cylinder(0.012, 1.5, 6);
    for (number, z) in [3.0, 7.0].into_iter().enumerate() {
        let swing = Swing {
            angle: 0.28,
            period: 2.46,
            phase: 0.5 * number as f64,
            pivot: DVec3::new(0.0, 1.55, 0.0),
            axis: DVec3::new(0.3, 0.0, 1.0),
        };
        let flicker = Flicker { depth: 0.25, period: 0.9, phase: 0.3 * number as f64 };
        let motion = Motion { swing: Some(swing), flicker: Some(flicker), ..Motion::default() };
        let place = Transform::from_xyz(6.0, 2.95, z);
        let light = wisp(Vec3::new(1.7, 1.05, 0.5), 7.0);
        let node = builder.moving_light(&format!("hall lantern {}", number + 1), place, light, &motion);
        builder.hang(node, "chain", shape::at(&chain, 0.0, 0.8, 0.0), Paint::Iron);
    }
}

/// Returns a pillar: base, shaft with a slight entasis, and capital. It extends from just below the floor
/// into the beam.
fn pillar() -> lumbre_mesh::TriangleMesh {
    let shaft: Vec<(f64, f64)> = (0..=8)
        .map(|step| {
            let part = f64::from(step) / 8.0;
            (0.27 - 0.035 * part + 0.02 * (std::f64::consts::PI * part).sin(), 0.32 + 3.33 * part)
        })
        .collect();
    shape::turned(
        &[
            &[(0.42, -0.02), (0.42, 0.16)],
            &[(0.42, 0.16), (0.38, 0.16)],
            &[(0.38, 0.16), (0.385, 0.22), (0.35, 0.28), (0.29, 0.32)],
            &shaft,
            &[(0.24, 3.65), (0.27, 3.72), (0.33, 3.80), (0.40, 3.86)],
            &[(0.40, 3.86), (0.40, 4.12)],
        ],
        24,
    )
}
