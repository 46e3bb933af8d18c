//! The corridor: brick walls, arched ribs, warm lamps on the walls, and a grille in front of a lit niche.

use glam::{DQuat, DVec3, Vec3};
use lumbre_scene::Transform;

use super::builder::{Builder, wisp};
use super::carve::{Air, Finish, Plan};
use super::paint::Paint;
use super::shape;
use crate::motion::{Bob, Flicker, Motion, Path, Swing};

/// Name and extent.
pub const ROOM: (&str, [f64; 3], [f64; 3]) = ("corridor", [12.5, 0.0, 3.5], [22.5, 3.0, 6.5]);
/// The lamps: x, z, and the side of the corridor that their wall is on.
const LAMPS: [(f64, f64, f64); 4] =
    [(14.5, 3.5, -1.0), (14.5, 6.5, 1.0), (20.5, 3.5, -1.0), (20.5, 6.5, 1.0)];

/// Carves the corridor, its niche and the doorway to the gallery.
pub fn carve(plan: &mut Plan) {
    let (room, min, max) = ROOM;
    let finish = Finish::new(Paint::Stone, Paint::White, Paint::Brick);
    plan.air.push(Air { room, min: min.into(), max: max.into(), finish });
    let niche = Finish::new(Paint::White, Paint::White, Paint::White);
    let (min, max) = (DVec3::new(17.0, 1.0, 3.0), DVec3::new(18.2, 2.2, 3.5));
    plan.air.push(Air { room, min, max, finish: niche });
    let (min, max) = (DVec3::new(22.5, 0.0, 4.4), DVec3::new(23.0, 2.2, 5.6));
    plan.air.push(Air { room, min, max, finish: Finish { floor: Paint::Stone, ..niche } });
}

/// Adds ribs, lamps, the grille, two lanterns, a candle and a wisp.
pub fn furnish(builder: &mut Builder<'_>) {
    let rib = shape::arch(1.5, 1.05, 1.2, 0.35, 14);
    let along = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let ribs = [13.2, 16.0, 19.2, 21.8].map(|x| {
        shape::moved(&rib, glam::DAffine3::from_rotation_translation(along, DVec3::new(x, 1.8, 5.0)))
    });
    builder.fixed("corridor ribs", Transform::IDENTITY, shape::together(ribs), Paint::White);

    let shade = lumbre_mesh::shapes::tetrahedral_sphere(0.11, 2, false);
    let bracket = lumbre_mesh::shapes::cuboid(Vec3::new(0.06, 0.06, 0.24), 1);
    let from_wall = |side: f64, away: f64| 5.0 + side * (1.5 - away);
    let shades = LAMPS.map(|(x, _, side)| shape::at(&shade, x, 1.95, from_wall(side, 0.28)));
    builder.fixed("lamp shades", Transform::IDENTITY, shape::together(shades), Paint::Shade);
    let brackets = LAMPS.map(|(x, _, side)| shape::at(&bracket, x, 1.83, from_wall(side, 0.16)));
    builder.fixed("lamp brackets", Transform::IDENTITY, shape::together(brackets), Paint::Iron);
    for (number, (x, _, side)) in LAMPS.into_iter().enumerate() {
        // In front of the shade, which is opaque.
        let place = Transform::from_xyz(x, 2.0, from_wall(side, 0.45));
        let light = wisp(Vec3::new(1.25, 0.72, 0.33), 7.0);
        builder.baked_light(&format!("wall lamp {}", number + 1), place, light);
    }

    let grille = lumbre_mesh::shapes::plane(1.2, 1.2, 2, 2);
    let upright = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    builder.fixed(
        "grille",
        Transform::from_xyz(17.6, 1.6, 3.46).with_rotation(upright),
        grille,
        Paint::Grille,
    );
    builder.baked_light(
        "niche light",
        Transform::from_xyz(17.6, 1.9, 3.2),
        wisp(Vec3::new(0.9, 0.75, 0.4), 5.0),
    );

    let chain = lumbre_mesh::shapes::cylinder(0.01, 0.7, 6);
    for (number, x) in [15.2, 20.0].into_iter().enumerate() {
        let swing = Swing {
            angle: 0.35,
            period: 1.74,
            phase: 0.4 * number as f64,
            pivot: DVec3::new(0.0, 0.75, 0.0),
            axis: DVec3::new(1.0, 0.0, 0.2),
        };
        let flicker = Flicker { depth: 0.45, period: 0.6, phase: 0.5 * number as f64 };
        let motion = Motion { swing: Some(swing), flicker: Some(flicker), ..Motion::default() };
        let place = Transform::from_xyz(x, 2.25, 5.0);
        let light = wisp(Vec3::new(1.4, 0.75, 0.3), 5.0);
        let node = builder.moving_light(&format!("corridor lantern {}", number + 1), place, light, &motion);
        builder.hang(node, "chain", shape::at(&chain, 0.0, 0.4, 0.0), Paint::Iron);
    }
    let flicker = Flicker { depth: 0.5, period: 0.7, phase: 0.2 };
    let motion = Motion { flicker: Some(flicker), ..Motion::default() };
    let place = Transform::from_xyz(17.6, 1.25, 3.28);
    builder.moving_light("niche candle", place, wisp(Vec3::new(1.0, 0.55, 0.2), 4.0), &motion);

    let points = [(13.5, 4.3), (16.0, 5.6), (18.5, 4.3), (21.5, 5.0), (18.5, 5.8), (16.0, 4.4)]
        .map(|(x, z)| DVec3::new(x, 1.3, z))
        .to_vec();
    let motion = Motion {
        path: Some(Path { points, period: 18.0, phase: 0.0 }),
        bob: Some(Bob { reach: DVec3::new(0.0, 0.35, 0.0), period: 2.9, phase: 0.0 }),
        ..Motion::default()
    };
    let light = wisp(Vec3::new(0.3, 0.9, 1.3), 5.0);
    builder.moving_light("corridor wisp", Transform::from_xyz(13.5, 1.3, 4.3), light, &motion);
}
