//! Texels that a wall thinner than themselves crosses, with surface in the open on both sides of it: one value for both. They show that
//! value, but do not hand it on: rays read the patches there, which end at the wall. Not texels that are hidden in part: those hold the light of the part in the open.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::footprint::{Footprint, Texel};
use crate::scene::{BakeScene, LightmapLayout};
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::visibility::clipping::clip_segment;
use crate::visibility::contacts::{PlaneFrame, contacts};

/// Texels of a contact line below which it divides nothing.
const SHORTEST: f64 = 0.25;
/// Texels beside a line that do not count as beyond it.
const MARGIN: f64 = 0.05;

/// Texels that contact lines cross, by their place in the row of all maps, with the line's part in the texel's unit square; ascending.
pub(crate) fn crossed(scene: &BakeScene, layout: &LightmapLayout) -> Vec<(MapTexel, [DVec2; 2])> {
    let mut lines: Vec<(MapTexel, [DVec2; 2])> = (0..scene.triangles.len())
        .into_par_iter()
        .flat_map_iter(|index| divisions(scene, layout, index))
        .collect();
    // Millions, where a mesh is as fine as its texels.
    if scene.stop.is_cancelled() {
        return Vec::new();
    }
    lines.par_sort_by_key(|(place, _)| *place);
    lines
}

/// Of the texels that lines cross, those that they divide, in the order of the maps.
pub(crate) fn divided_texels(
    layout: &LightmapLayout,
    texels: &[Texel],
    crossed: &[(MapTexel, [DVec2; 2])],
) -> Vec<CoveredTexel> {
    let mut covered = vec![None; layout.texels];
    for (place, texel) in texels.iter().enumerate() {
        covered[texel.index.place()] = Some(CoveredTexel::new(place));
    }
    let mut found: Vec<CoveredTexel> = Vec::new();
    for &(index, line) in crossed {
        let Some(texel) = covered[index.place()] else { continue };
        if found.last() != Some(&texel) && is_divided(&texels[texel.place()], line) {
            found.push(texel);
        }
    }
    found
}

/// The texels that contact lines of a triangle cross, with the lines' parts in their unit squares.
fn divisions(scene: &BakeScene, layout: &LightmapLayout, index: usize) -> Vec<(MapTexel, [DVec2; 2])> {
    let triangle = &scene.triangles[index];
    let map = &layout.maps[triangle.object as usize];
    let [a, b, c] = triangle.uv.map(|uv| uv.as_dvec2());
    let texels = (b - a).perp_dot(c - a).abs();
    if triangle.is_hidden_duplicate || scene.stop.is_cancelled() || !(texels.is_finite() && texels > 2.0) {
        return Vec::new();
    }
    let side = (2.0 * f64::from(triangle.area) / texels).sqrt();
    let frame = PlaneFrame::new(triangle);
    let [p, q, r] = triangle.corners.map(|corner| frame.flat(corner.as_dvec3()));
    let to_texels = DMat2::from_cols(b - a, c - a) * DMat2::from_cols(q - p, r - p).inverse();
    if !to_texels.is_finite() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for segment in contacts(scene, index as u32, &frame, side as f32) {
        // Beyond its edges the plane is not what anything stands on.
        let Some(segment) = clip_segment(&[p, q, r], segment) else { continue };
        let [start, end] = segment.map(|point| a + to_texels * (point - p));
        // What touches with a corner only.
        if start.distance(end) < MARGIN {
            continue;
        }
        let Some((from, to)) =
            within(start, end, DVec2::ZERO, DVec2::new(map.width.into(), map.height.into()))
        else {
            continue;
        };
        // Places along the line where it goes from one texel to another.
        let mut stops = vec![from, to];
        for axis in 0..2 {
            let (s, e) = (start[axis], end[axis]);
            let (low, high) = (s + (e - s) * from, s + (e - s) * to);
            let whole = low.min(high).ceil() as i64..=low.max(high).floor() as i64;
            stops.extend(whole.map(|x| (x as f64 - s) / (e - s)).filter(|t| *t > from && *t < to));
        }
        stops.sort_by(f64::total_cmp);
        for pair in stops.windows(2) {
            let middle = start.lerp(end, 0.5 * (pair[0] + pair[1]));
            let (x, y) = (middle.x as u32, middle.y as u32);
            if x < map.width && y < map.height {
                let corner = DVec2::new(x.into(), y.into());
                let part = [pair[0], pair[1]].map(|t| start.lerp(end, t) - corner);
                found.push((map.texel(x, y), part));
            }
        }
    }
    found
}

/// The part of a line's parameter, in [0, 1], within a box.
fn within(start: DVec2, end: DVec2, low: DVec2, high: DVec2) -> Option<(f64, f64)> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let (s, d) = (start[axis], end[axis] - start[axis]);
        if d == 0.0 {
            if !(low[axis]..=high[axis]).contains(&s) {
                return None;
            }
            continue;
        }
        let (a, b) = ((low[axis] - s) / d, (high[axis] - s) / d);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (from < to).then_some((from, to))
}

/// Whether a texel shows something on both sides of a line through it.
fn is_divided(texel: &Texel, [from, to]: [DVec2; 2]) -> bool {
    let along = to - from;
    if along.length() < SHORTEST {
        return false;
    }
    let normal = along.normalize().perp();
    let beyond = |p: DVec2, sign: f64| sign * normal.dot(p - from) > MARGIN;
    [1.0, -1.0].into_iter().all(|sign| match &texel.footprint {
        Footprint::Whole(_) => {
            [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].into_iter().any(|corner| beyond(corner, sign))
        }
        Footprint::Points(points) => points.iter().any(|point| beyond(point.offset.as_dvec2(), sign)),
        Footprint::Hidden => false,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3, Vec3};
    use lumbre_mesh::{TriangleMesh, shapes};

    use super::*;
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedPrimitive, SceneObject, StaticScene};
    use crate::{BakeOptions, Density};

    /// How many texels are crossed in a scene of meshes at their places.
    fn crossed_texels(meshes: Vec<(TriangleMesh, DVec3)>) -> usize {
        let object = |(mesh, place): (TriangleMesh, DVec3)| {
            let transform = DAffine3::from_translation(place);
            let mesh = Arc::new(mesh);
            SceneObject::new("", vec![PlacedPrimitive { mesh, transform, ..PlacedPrimitive::default() }])
        };
        let objects = meshes.into_iter().map(object).collect();
        let input = StaticScene { objects, sky: Vec3::ONE, ..StaticScene::default() }.checked().unwrap();
        let options = BakeOptions { density: Density::TexelsPerMeter(8.0), ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let mut texels: Vec<MapTexel> =
            crossed(&scene, &layout).into_iter().map(|(texel, _)| texel).collect();
        texels.dedup();
        texels.len()
    }

    #[test]
    fn folds_of_one_surface_cross_nothing_and_what_stands_on_it_does() {
        // A room seen from inside: every corner of it is an edge that two of its triangles share.
        let mut room = shapes::cuboid(Vec3::new(4.0, 3.0, 4.0), 4);
        room.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
        room.normals.iter_mut().for_each(|normal| *normal = -*normal);
        assert_eq!(crossed_texels(vec![(room.clone(), DVec3::ZERO)]), 0);
        // A block of 1 m stands on its floor: 4 m of outline there and 4 m along the feet of its sides cross some 8 texels a metre.
        let block = shapes::cuboid(Vec3::ONE, 1);
        let standing = crossed_texels(vec![(room, DVec3::ZERO), (block, DVec3::new(0.3, -1.0, 0.4))]);
        assert!((56..90).contains(&standing), "{standing}");
    }
}
