//! Scenes that the baker was not tuned on, without lightmap coordinates, each by its kind and a number, at any scale. Irradiance is the
//! same at every scale: radiance stays, a point light's intensity grows with the square.

mod builder;
mod carved;
mod cellar;
mod corridor;
mod furniture;
mod grille;
mod hall;
mod lamps;
pub mod region;
mod revolution;
mod rooms;
mod screen;
mod sign;
mod sunlit_room;
mod wall;

use bevy_ecs::world::World;

pub use hall::hall;
pub use rooms::rooms;
pub use sunlit_room::sunlit_room;

/// What builds a scene, by layout and scale.
pub type Build = fn(u64, f64) -> World;

/// A name, what builds it, and its layout.
pub type Named = (&'static str, Build, u64);

/// Those that are judged at several scales.
pub fn of_any_scale() -> [Named; 6] {
    [
        ("rooms_0", rooms, 0),
        ("rooms_1", rooms, 1),
        ("hall_0", hall, 0),
        ("hall_1", hall, 1),
        ("rooms_2", rooms, 2),
        ("hall_2", hall, 2),
    ]
}

/// Levels in which most of what is looked at is far darker than what lights it.
pub fn levels() -> [Named; 12] {
    [
        ("sunlit_room_0", sunlit_room, 0),
        ("sunlit_room_1", sunlit_room, 1),
        ("sunlit_room_2", sunlit_room, 2),
        ("sunlit_room_3", sunlit_room, 3),
        ("cellar_0", cellar::cellar, 0),
        ("cellar_1", cellar::cellar, 1),
        ("corridor_0", corridor::corridor, 0),
        ("corridor_1", corridor::corridor, 1),
        ("grille_0", grille::grille, 0),
        ("grille_1", grille::grille, 1),
        ("sign_0", sign::sign, 0),
        ("sign_1", sign::sign, 1),
    ]
}

/// One room under few and many lamps; their number stands for the layout.
pub fn many_lamps() -> [Named; 12] {
    [
        ("lamps_1", lamps::lamps, 1),
        ("lamps_10", lamps::lamps, 10),
        ("lamps_100", lamps::lamps, 100),
        ("lamps_1000", lamps::lamps, 1000),
        ("lamps_10000", lamps::lamps, 10_000),
        ("points_1", lamps::points, 1),
        ("points_10", lamps::points, 10),
        ("points_100", lamps::points, 100),
        ("points_1000", lamps::points, 1000),
        ("points_10000", lamps::points, 10_000),
        ("bulb_70000", lamps::bulb, 70_000),
        ("screen_4k", screen::screen, 4096),
    ]
}

/// Every kind, in the layouts that are named somewhere.
pub fn all() -> Vec<Named> {
    of_any_scale().into_iter().chain(levels()).chain(many_lamps()).collect()
}

/// A scene of any layout by its name: of those above, or `KIND_N`.
pub fn find(name: &str) -> Option<(Build, u64)> {
    if let Some((_, build, layout)) = all().into_iter().find(|(known, ..)| *known == name) {
        return Some((build, layout));
    }
    let (kind, number) = name.rsplit_once('_')?;
    let layout = match number.strip_suffix('k') {
        Some(thousands) => 1024 * thousands.parse::<u64>().ok()?,
        None => number.parse().ok()?,
    };
    let of_kind = |(known, ..): &Named| known.rsplit_once('_').is_some_and(|(known, _)| known == kind);
    all().into_iter().find(of_kind).map(|(_, build, _)| (build, layout))
}
