//! Where in a level the stated error is largest, so that an artist finds the room and the objects. Not the error
//! itself: that is `error_ledger`.

use std::collections::BTreeMap;

use glam::{DVec3, IVec3};

use crate::WorstPlace;
use crate::bounds::Bounds;
use crate::coverage::{Texel, receiver};
use crate::scene::{BakeScene, SceneObject};
use crate::texel_index::MapIndex;

/// Side of the cubes into which the level is divided, as a share of its longest side.
const CUBE_SIDE: f32 = 1.0 / 8.0;
/// Places with less than this share of the open texels are not reported.
const MIN_TEXELS: f64 = 0.01;
const MAX_PLACES: usize = 3;
const MAX_OBJECTS: usize = 2;

/// Sums over the texels in one cube.
#[derive(Default)]
struct CubeErrors {
    texels: u32,
    position: DVec3,
    squares: f64,
    /// The part of `squares` that belongs to each object.
    object_squares: BTreeMap<MapIndex, f64>,
}

/// The places where the error is largest, the worst first. `squares` are the squared errors of the covered texels,
/// relative to the light around them; `whole` is the error that is stated for the whole map.
pub(crate) fn worst_places(
    scene: &BakeScene,
    objects: &[SceneObject],
    texels: &[Texel],
    squares: &[f32],
    whole: f64,
) -> Vec<WorstPlace> {
    let Bounds { low, high } = scene.triangles.iter().flat_map(|triangle| triangle.corners).collect();
    let side = CUBE_SIDE * (high - low).max_element();
    let mut places: BTreeMap<[i32; 3], CubeErrors> = BTreeMap::new();
    let mut open = 0u32;
    for (texel, &square) in texels.iter().zip(squares).filter(|(texel, _)| !texel.is_hidden()) {
        let Some(point) = texel.point(scene, 0.5, 0.5) else { continue };
        let position = receiver(scene, &point).position;
        let cell: IVec3 = ((position - low) / side).floor().as_ivec3();
        let place = places.entry(cell.to_array()).or_default();
        place.texels += 1;
        place.position += position.as_dvec3();
        place.squares += f64::from(square);
        *place.object_squares.entry(texel.map).or_default() += f64::from(square);
        open += 1;
    }
    // The errors of single texels contain chance that cancels in the whole: they are scaled so that they add up to the
    // whole's.
    let all: f64 = places.values().map(|place| place.squares).sum();
    let scale = f64::from(open) * whole.powi(2) / all.max(f64::MIN_POSITIVE);
    let worst_place = |place: CubeErrors| {
        let count = f64::from(place.texels);
        let error = (scale * place.squares / count).sqrt();
        let texels = count / f64::from(open);
        if texels < MIN_TEXELS || error <= whole {
            return None;
        }
        let mut worst_objects: Vec<(MapIndex, f64)> = place.object_squares.into_iter().collect();
        worst_objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let name =
            |&(object, _): &(MapIndex, f64)| objects.get(object.place()).map(|object| object.name.clone());
        let objects = worst_objects.iter().take(MAX_OBJECTS).filter_map(name).collect();
        let center = scene.space.world((place.position / count).as_vec3()).to_array();
        Some(WorstPlace { center, error, texels, objects })
    };
    let mut worst: Vec<WorstPlace> = places.into_values().filter_map(worst_place).collect();
    worst.sort_by(|a, b| b.error.total_cmp(&a.error));
    worst.truncate(MAX_PLACES);
    worst
}
