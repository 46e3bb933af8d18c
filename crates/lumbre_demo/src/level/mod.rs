//! The demo level: four rooms and their contents, built procedurally. The example `generate_level` writes it
//! to a file.
//!
//! ```text
//!        z  -1                                              ┌──────────────┐
//!            0  ┌──────────────┐                            │    podium    │
//!               ▌              │    lamps                   │              │
//!           3.5 ▌     hall     ├────────────────────────────┤              │
//!               ▌  o      o    │          corridor               gallery   │
//!           6.5 ▌  o      o    ├──────────┐  ┌──────────────┤              │
//!          10   └──────────────┘          │stairs          │              │
//!          11                      ┌──────┘  └──────┐       └─┐  ┌─────────┘
//!                                  │      vault     │         │  stairs
//!          15                      │    (1.2 m      └─────────┘  │
//!          16.5                    │      below)    ┌────────────┘
//!                                  └────────────────┘
//!            x  0              12  13.5   17        21.5    23              35
//! ```

mod builder;
mod carve;
mod corridor;
mod drone;
mod gallery;
mod hall;
mod noise;
mod paint;
mod shape;
mod textures;
mod tour_stops;
mod vault;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_scene::{ActiveCamera, Bounds, SceneSettings, Transform};

use builder::Builder;
use carve::Plan;

use crate::game::START_CAMERA;

/// Longest edge of the rectangles that walls and floors are made of, metres: coarse enough for Gouraud
/// shading to show its error.
const SPACING: f64 = 0.5;

/// A room of the level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// The name of the room.
    pub name: &'static str,
    /// The extent of its air, metres.
    pub bounds: Bounds,
}

/// Returns the rooms of the level.
pub fn rooms() -> Vec<Room> {
    [hall::ROOM, corridor::ROOM, gallery::ROOM, vault::ROOM]
        .into_iter()
        .map(|(name, min, max)| Room { name, bounds: Bounds { min: min.into(), max: max.into() } })
        .collect()
}

/// Returns the solid geometry: the air of rooms, doorways, stairs and niches, and the matter left in it.
fn plan() -> Plan {
    let mut plan = Plan::default();
    hall::carve(&mut plan);
    corridor::carve(&mut plan);
    gallery::carve(&mut plan);
    vault::carve(&mut plan);
    plan
}

/// Builds the level into a World.
pub fn build(world: &mut World) {
    let mut builder = Builder::new(world);
    for ((room, paint), mesh) in plan().surface(SPACING) {
        builder.fixed(&format!("{room} {}", paint.name()), Transform::IDENTITY, mesh, paint);
    }
    hall::furnish(&mut builder);
    corridor::furnish(&mut builder);
    gallery::furnish(&mut builder);
    vault::furnish(&mut builder);
    drone::launch(&mut builder);
    tour_stops::place(&mut builder);
    let start = Transform::from_xyz(7.2, 1.62, 8.9).looking_at(DVec3::new(3.0, 1.9, 1.0), DVec3::Y);
    let start = builder.camera(START_CAMERA, start);
    world.entity_mut(start).insert(ActiveCamera);
    // Ambient light for moving objects, which baked light does not reach: a fraction of the rooms' mean.
    world.insert_resource(SceneSettings {
        ambient: Vec3::new(0.030, 0.030, 0.034),
        ..SceneSettings::default()
    });
    lumbre_scene::update_transforms(world);
}

#[cfg(test)]
mod tests;
