//! The gallery, which is half a workshop: spheres with three specular exponents on plinths, a crystal ball, a
//! mirror, crates and barrels, a table, an arch, and a podium with a golden ring, under moving coloured
//! lights.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use lumbre_scene::Transform;

use super::builder::{Builder, beam, wisp};
use super::carve::{Air, Finish, Matter, Plan};
use super::paint::Paint;
use super::shape;
use crate::motion::{Bob, Motion, Orbit, Spin, Swing};

/// Name and extent.
pub const ROOM: (&str, [f64; 3], [f64; 3]) = ("gallery", [23.0, 0.0, -1.0], [35.0, 4.0, 11.0]);
/// The spheres: x, z and paint.
const SPHERES: [(f64, f64, Paint); 3] =
    [(26.0, 8.0, Paint::Broad), (28.5, 8.0, Paint::Medium), (31.0, 8.0, Paint::Narrow)];
/// The crystal ball: x and z.
const CRYSTAL: (f64, f64) = (33.5, 8.0);
/// The smallest x and z of the ceiling panels; each is 1.5 m square.
const PANELS: [(f64, f64); 4] = [(25.5, 1.5), (31.0, 1.5), (25.5, 7.0), (31.0, 7.0)];

/// Carves the gallery, its ceiling panels and the steps of the podium.
pub fn carve(plan: &mut Plan) {
    let (room, min, max) = ROOM;
    let finish = Finish {
        walls: [Paint::White, Paint::Ochre, Paint::White, Paint::Blue],
        ..Finish::new(Paint::Planks, Paint::White, Paint::White)
    };
    plan.air.push(Air { room, min: min.into(), max: max.into(), finish });
    let panel = Finish { ceiling: Paint::Panel, ..Finish::new(Paint::White, Paint::White, Paint::White) };
    for (x, z) in PANELS {
        let (min, max) = (DVec3::new(x, 4.0, z), DVec3::new(x + 1.5, 4.1, z + 1.5));
        plan.air.push(Air { room, min, max, finish: panel });
    }
    // Three steps of 0.2 m.
    for (x, height) in [(31.0, 0.2), (31.5, 0.4), (32.0, 0.6)] {
        let (min, max) = (DVec3::new(x, 0.0, -1.0), DVec3::new(35.0, height, 4.0));
        plan.matter.push(Matter { min, max, paint: Paint::Stone });
    }
}

/// Adds the exhibits, the workshop and the lights.
pub fn furnish(builder: &mut Builder<'_>) {
    exhibits(builder);
    workshop(builder);
    lights(builder);
}

fn exhibits(builder: &mut Builder<'_>) {
    let plinth = lumbre_mesh::shapes::cuboid(Vec3::new(0.6, 1.0, 0.6), 3);
    let places = SPHERES.map(|(x, z, _)| (x, z)).into_iter().chain([CRYSTAL]);
    let plinths = places.map(|(x, z)| shape::at(&plinth, x, 0.5, z));
    builder.fixed("plinths", Transform::IDENTITY, shape::together(plinths), Paint::Marble);
    // The three spheres share one mesh, coarse enough for shading at its vertices to be visible.
    let sphere = std::sync::Arc::new(lumbre_mesh::shapes::tetrahedral_sphere(0.38, 4, false));
    for (x, z, paint) in SPHERES {
        let name = format!("sphere {}", paint.name());
        builder.fixed(&name, Transform::from_xyz(x, 1.37, z), sphere.clone(), paint);
    }
    let ball = lumbre_mesh::shapes::uv_sphere(0.38, 40, 20);
    builder.clear("crystal ball", Transform::from_xyz(CRYSTAL.0, 1.39, CRYSTAL.1), ball, Paint::Crystal);

    // A mirror on the east wall.
    let frame = lumbre_mesh::shapes::cuboid(Vec3::new(0.06, 1.9, 2.6), 3);
    builder.fixed("mirror frame", Transform::from_xyz(34.97, 1.75, 6.0), frame, Paint::Timber);
    let mirror = lumbre_mesh::shapes::plane(1.7, 2.4, 1, 1);
    let westwards = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let before = Transform::from_xyz(34.935, 1.75, 6.0).with_rotation(westwards);
    builder.clear("mirror", before, mirror, Paint::Mirror);

    let pane = lumbre_mesh::shapes::plane(1.6, 1.5, 3, 3);
    let upright = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    builder.fixed("pane", Transform::from_xyz(28.5, 1.0, 7.1).with_rotation(upright), pane, Paint::Glass);

    let ring = lumbre_mesh::shapes::torus(0.55, 0.17, 40, 18);
    let motion = Motion {
        spin: Some(Spin { period: 9.0, axis: DVec3::Y }),
        bob: Some(Bob { reach: DVec3::new(0.0, 0.08, 0.0), period: 4.2, phase: 0.0 }),
        ..Motion::default()
    };
    let tilted = Transform::from_xyz(33.6, 2.1, 1.5).with_rotation(DQuat::from_rotation_x(1.1));
    builder.moving("golden ring", tilted, ring, Paint::Gold, &motion);
    let foot = shape::turned(
        &[
            &[(0.45, 0.0), (0.45, 0.12)],
            &[(0.45, 0.12), (0.2, 0.12)],
            &[(0.2, 0.12), (0.14, 0.3), (0.12, 0.5), (0.16, 0.62)],
            &[(0.16, 0.62), (0.0, 0.62)],
        ],
        24,
    );
    builder.fixed("foot of the ring", Transform::from_xyz(33.6, 0.6, 1.5), foot, Paint::Marble);

    // An arch to walk through: two legs and the span between them.
    let leg = lumbre_mesh::shapes::cuboid(Vec3::new(0.4, 2.0, 0.4), 4);
    let span = shape::arch(0.9, 0.7, 0.9, 0.4, 16);
    let cap = lumbre_mesh::shapes::cuboid(Vec3::new(0.4, 0.9, 0.4), 2);
    let gate = shape::together([
        shape::at(&leg, -1.1, 1.0, 0.0),
        shape::at(&leg, 1.1, 1.0, 0.0),
        shape::at(&cap, -1.1, 2.45, 0.0),
        shape::at(&cap, 1.1, 2.45, 0.0),
        shape::at(&span, 0.0, 2.0, 0.0),
    ]);
    let turned = Transform::from_xyz(28.2, 0.0, 2.6).with_rotation(DQuat::from_rotation_y(0.5));
    builder.fixed("gate", turned, gate, Paint::Stone);
}

fn workshop(builder: &mut Builder<'_>) {
    let wood = lumbre_mesh::shapes::cuboid(Vec3::splat(0.8), 2);
    let turned = |x: f64, y: f64, z: f64, angle: f64, size: f64| {
        let rotation = DQuat::from_rotation_y(angle);
        shape::moved(
            &wood,
            DAffine3::from_scale_rotation_translation(DVec3::splat(size), rotation, DVec3::new(x, y, z)),
        )
    };
    let crates = [
        turned(24.0, 0.4, 0.2, 0.15, 1.0),
        turned(25.0, 0.4, -0.2, -0.3, 1.0),
        turned(24.4, 1.2, 0.0, 0.6, 1.0),
        turned(24.1, 0.25, 1.5, 0.9, 0.625),
    ];
    builder.fixed("crates", Transform::IDENTITY, shape::together(crates), Paint::Crate);

    let barrel = shape::turned(
        &[
            &[(0.27, 0.0), (0.32, 0.2), (0.345, 0.45), (0.32, 0.7), (0.27, 0.9)],
            &[(0.27, 0.9), (0.25, 0.9)],
            &[(0.25, 0.9), (0.25, 0.86)],
            &[(0.25, 0.86), (0.0, 0.86)],
        ],
        20,
    );
    let barrels = [(34.3, 5.2), (34.2, 6.1), (33.5, 5.5)].map(|(x, z)| shape::at(&barrel, x, 0.0, z));
    builder.fixed("barrels", Transform::IDENTITY, shape::together(barrels), Paint::Timber);

    let top = lumbre_mesh::shapes::cuboid(Vec3::new(2.0, 0.08, 0.9), 4);
    let leg = lumbre_mesh::shapes::cuboid(Vec3::new(0.09, 0.76, 0.09), 1);
    let legs = [(-0.9, -0.36), (0.9, -0.36), (-0.9, 0.36), (0.9, 0.36)];
    let table =
        legs.map(|(x, z)| shape::at(&leg, x, 0.38, z)).into_iter().chain([shape::at(&top, 0.0, 0.80, 0.0)]);
    let place = Transform::from_xyz(33.4, 0.0, 10.2);
    builder.fixed("table", place, shape::together(table), Paint::Timber);
    let bowl = shape::turned(
        &[
            &[(0.0, 0.0), (0.10, 0.0)],
            &[(0.10, 0.0), (0.18, 0.06), (0.22, 0.14)],
            &[(0.22, 0.14), (0.20, 0.14)],
            &[(0.20, 0.14), (0.16, 0.07), (0.0, 0.03)],
        ],
        24,
    );
    builder.fixed("bowl", Transform::from_xyz(33.0, 0.84, 10.2), bowl, Paint::Gold);
    let jug = shape::turned(
        &[
            &[(0.0, 0.0), (0.09, 0.0)],
            &[(0.09, 0.0), (0.14, 0.1), (0.13, 0.22), (0.06, 0.34), (0.08, 0.40)],
            &[(0.08, 0.40), (0.0, 0.38)],
        ],
        20,
    );
    builder.fixed("jug", Transform::from_xyz(34.0, 0.84, 10.3), jug, Paint::Broad);
}

fn lights(builder: &mut Builder<'_>) {
    for (number, (x, z, _)) in SPHERES.into_iter().enumerate() {
        let color = [Vec3::new(1.5, 1.2, 0.8), Vec3::new(1.4, 0.5, 1.2), Vec3::new(0.6, 1.2, 1.5)][number];
        let orbit =
            Orbit { radius: 0.95, period: 4.0 + number as f64, phase: 0.3 * number as f64, axis: DVec3::Y };
        let motion = Motion {
            orbit: Some(orbit),
            bob: Some(Bob { reach: DVec3::new(0.0, 0.3, 0.0), period: 3.1, phase: 0.0 }),
            ..Motion::default()
        };
        let place = Transform::from_xyz(x, 1.75, z);
        builder.moving_light(&format!("sphere wisp {}", number + 1), place, wisp(color, 5.0), &motion);
    }
    for (number, (x, z, color)) in
        [(27.0, 4.6, Vec3::new(2.0, 0.5, 0.3)), (31.5, 5.4, Vec3::new(0.35, 0.6, 2.2))]
            .into_iter()
            .enumerate()
    {
        let place = Transform::from_xyz(x, 3.8, z).looking_at(DVec3::new(x, 0.0, z), DVec3::Z);
        let swing = Swing {
            angle: 0.6,
            period: 6.5 + number as f64,
            phase: 0.5 * number as f64,
            pivot: DVec3::ZERO,
            axis: DVec3::new(1.0, 0.0, 0.6 - number as f64),
        };
        let motion = Motion { swing: Some(swing), ..Motion::default() };
        builder.moving_light(
            &format!("sweeping beam {}", number + 1),
            place,
            beam(color, 28.0, 9.0),
            &motion,
        );
    }
    let corners = [
        (24.6, 1.2, Vec3::new(1.4, 0.8, 0.25)),
        (28.2, 2.6, Vec3::new(0.4, 1.3, 0.7)),
        (33.6, 1.5, Vec3::new(1.5, 1.1, 0.6)),
        (33.6, 8.9, Vec3::new(1.1, 0.4, 1.4)),
        (24.6, 9.6, Vec3::new(0.4, 0.7, 1.5)),
    ];
    for (number, (x, z, color)) in corners.into_iter().enumerate() {
        let turn = 0.2 * number as f64;
        let motion = Motion {
            orbit: Some(Orbit {
                radius: 1.0,
                period: -(6.0 + 3.0 * turn),
                phase: turn,
                axis: DVec3::new(0.2, 1.0, 0.1),
            }),
            bob: Some(Bob { reach: DVec3::new(0.0, 0.35, 0.0), period: 2.3 + turn, phase: turn }),
            ..Motion::default()
        };
        let place = Transform::from_xyz(x, 2.2, z);
        builder.moving_light(&format!("gallery wisp {}", number + 1), place, wisp(color, 6.0), &motion);
    }
}
