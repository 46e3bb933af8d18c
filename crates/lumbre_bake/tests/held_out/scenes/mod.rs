//! Scenes that the baker was not tuned on, without lightmap coordinates. A scene is built by its kind, a layout number
//! and a scale. The irradiance is the same at every scale: radiance is constant, and the intensity of point lights
//! grows with the square of the scale.

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

/// A function that builds a scene of a given layout and scale.
pub type Build = fn(u64, f64) -> World;

/// The name of a scene, the function that builds it, and its layout.
pub type Named = (&'static str, Build, u64);

/// The scenes that are baked at several scales.
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

/// Levels in which most visible surfaces are far darker than those that light them.
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

/// One room under few and many lamps; the layout is the number of lamps, triangles or texels.
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

/// All scenes of the lists above.
pub fn all() -> Vec<Named> {
    of_any_scale().into_iter().chain(levels()).chain(many_lamps()).collect()
}

/// Finds a scene by its name: one of the lists above, or `KIND_N` with any layout N.
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
