//! Divided texels: a wall thinner than a texel crosses them, and surface on both sides of the wall is in the open, so
//! that one value stands for both sides. The map shows that value, but gather rays that hit there read the patches
//! instead, which end at the wall. Texels that are partly hidden are not divided: they hold the light of their open
//! part.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::contact_lines::ContactLines;
use super::footprint::{Footprint, Texel};
use crate::scene::{BakeScene, LightmapLayout, SceneTriangle};
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::visibility::PlaneFrame;
use crate::visibility::clipping::clip_segment;
use crate::visibility::contacts::{Contact, contacts};

/// Length, in texels, below which a contact line does not divide a texel.
const MIN_LENGTH: f64 = 0.25;
/// Distance from a line, in texels, up to which a point counts as on the line and not beyond it.
const MARGIN: f64 = 0.05;

/// The contact lines on everything that the maps show.
#[derive(Default)]
pub(crate) struct FoundLines {
    pub all: ContactLines,
    /// Those beside which something may be hidden.
    pub hiding: ContactLines,
}

/// Finds the contact lines on all triangles but those for which [`has_contact_lines`] is false.
pub(crate) fn contact_lines(scene: &BakeScene, layout: &LightmapLayout) -> FoundLines {
    let mut lines: Vec<(MapTexel, Contact)> = (0..scene.triangles.len())
        .into_par_iter()
        .flat_map_iter(|index| texels_crossed_on(scene, layout, index))
        .collect();
    // Where a mesh is as fine as its texels there are millions of lines to sort.
    if scene.stop.is_cancelled() {
        return FoundLines::default();
    }
    lines.par_sort_by_key(|(texel, _)| *texel);
    let line = |(texel, contact): (MapTexel, Contact)| (texel, contact.line);
    let hiding = lines.iter().filter(|(_, contact)| contact.may_hide).copied().map(line).collect();
    let all = lines.into_iter().map(line).collect();
    FoundLines { all: ContactLines::new(all), hiding: ContactLines::new(hiding) }
}

/// Those of the crossed texels that their contact lines divide, in ascending order. `open_by_place` holds the texel at
/// each place of the maps.
pub(crate) fn divided_texels(
    texels: &[Texel],
    open_by_place: &[Option<CoveredTexel>],
    contacts: &ContactLines,
) -> Vec<CoveredTexel> {
    let crossed = contacts.iter().filter_map(|&(place, line)| Some((open_by_place[place.place()]?, line)));
    let mut divided: Vec<CoveredTexel> = Vec::new();
    for (texel, line) in crossed {
        if divided.last() != Some(&texel) && is_divided(&texels[texel.place()], line) {
            divided.push(texel);
        }
    }
    divided
}

/// Whether contact lines on a triangle are searched for: it is at least as large as a texel, and no coincident triangle
/// replaces it. Even then some are missing: short ones, and those of surfaces that cross it at a small angle.
pub(crate) fn has_contact_lines(triangle: &SceneTriangle) -> bool {
    let [a, b, c] = triangle.uv.map(|uv| uv.as_dvec2());
    let doubled_area = (b - a).perp_dot(c - a).abs();
    !triangle.is_hidden_duplicate && doubled_area.is_finite() && doubled_area > 2.0
}

/// The texels that contact lines on a triangle cross, each with the part of the line in the texel, in the texel's
/// unit square.
fn texels_crossed_on(scene: &BakeScene, layout: &LightmapLayout, index: usize) -> Vec<(MapTexel, Contact)> {
    let triangle = &scene.triangles[index];
    let map = &layout.maps[triangle.map.place()];
    if scene.stop.is_cancelled() || !has_contact_lines(triangle) {
        return Vec::new();
    }
    let [a, b, c] = triangle.uv.map(|uv| uv.as_dvec2());
    let doubled_area = (b - a).perp_dot(c - a).abs();
    let side = (2.0 * f64::from(triangle.area) / doubled_area).sqrt();
    let frame = PlaneFrame::new(triangle);
    let [p, q, r] = triangle.corners.map(|corner| frame.flat(corner.as_dvec3()));
    let to_texels = DMat2::from_cols(b - a, c - a) * DMat2::from_cols(q - p, r - p).inverse();
    if !to_texels.is_finite() {
        return Vec::new();
    }
    let mut crossed = Vec::new();
    for Contact { line, may_hide } in contacts(scene, index as u32, &frame, side as f32) {
        // Contacts are found in the triangle's plane; beyond the triangle's edges they do not matter.
        let Some(segment) = clip_segment(&[p, q, r], line) else { continue };
        let [start, end] = segment.map(|point| a + to_texels * (point - p));
        // Shorter segments come from surfaces that touch the triangle with a corner only.
        if start.distance(end) < MARGIN {
            continue;
        }
        let Some((from, to)) =
            clip_to_box(start, end, DVec2::ZERO, DVec2::new(map.width.into(), map.height.into()))
        else {
            continue;
        };
        // Parameters at which the line passes from one texel to the next.
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
                let line = [pair[0], pair[1]].map(|t| start.lerp(end, t) - corner);
                crossed.push((map.texel(x, y), Contact { line, may_hide }));
            }
        }
    }
    crossed
}

/// The interval of a segment's parameter, in [0, 1], within a box; `None` if it is empty.
fn clip_to_box(start: DVec2, end: DVec2, low: DVec2, high: DVec2) -> Option<(f64, f64)> {
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

/// Whether a texel shows some surface on both sides of a line through it.
fn is_divided(texel: &Texel, [from, to]: [DVec2; 2]) -> bool {
    let along = to - from;
    if along.length() < MIN_LENGTH {
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

    use glam::{DAffine3, DVec3, Quat, Vec3};
    use lumbre_mesh::{TriangleMesh, shapes};
    use lumbre_optics::Material;

    use super::*;
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedPrimitive, SceneObject, StaticScene};
    use crate::{BakeOptions, Density};

    /// How many texels contact lines cross in a scene of meshes at these positions, and how many lines that may hide
    /// something do; the outside may be dark.
    fn count_crossed(meshes: Vec<(TriangleMesh, DVec3)>, dark_outside: bool) -> [usize; 2] {
        let object = |(mesh, place): (TriangleMesh, DVec3)| {
            let transform = DAffine3::from_translation(place);
            let material = Material { double_sided: true, ..Material::default() };
            let primitive =
                PlacedPrimitive { mesh: Arc::new(mesh), transform, material, ..Default::default() };
            SceneObject::new("", vec![primitive])
        };
        let objects = meshes.into_iter().map(object).collect();
        let input = StaticScene { objects, sky: Vec3::ONE, ..StaticScene::default() }.checked().unwrap();
        let options = BakeOptions { density: Density::TexelsPerMeter(8.0), ..BakeOptions::default() };
        let (layout, mut scene) = laid_out(&input.objects, input.space(), &options);
        scene.dark_outside = dark_outside;
        let FoundLines { all, hiding } = super::contact_lines(&scene, &layout);
        [all, hiding].map(|lines| {
            let mut texels: Vec<MapTexel> = lines.iter().map(|(texel, _)| *texel).collect();
            texels.dedup();
            texels.len()
        })
    }

    #[test]
    fn only_objects_that_stand_on_a_surface_cross_its_texels() {
        // A room seen from inside: its triangles meet only along edges that they share.
        let mut room = shapes::cuboid(Vec3::new(4.0, 3.0, 4.0), 4);
        room.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
        room.normals.iter_mut().for_each(|normal| *normal = -*normal);
        assert_eq!(count_crossed(vec![(room.clone(), DVec3::ZERO)], false), [0, 0]);
        // A block of 1 m stands on its floor: the 4 m outline on the floor, and the 4 m along the bottoms of its sides,
        // each cross about 8 texels per metre.
        let block = shapes::cuboid(Vec3::ONE, 1);
        let block = (block, DVec3::new(0.3, -1.0, 0.4));
        let [crossed, hiding] = count_crossed(vec![(room.clone(), DVec3::ZERO), block.clone()], false);
        assert!((56..90).contains(&crossed) && hiding == crossed, "{crossed} {hiding}");
        // Ten leaves that cross each other divide texels, but nothing is hidden beside them: only below the block.
        let leaf = |number: usize| {
            let turn = Quat::from_rotation_x(1.5) * Quat::from_rotation_z(0.3 * number as f32);
            let mut leaf = shapes::plane(1.0, 1.0, 1, 1);
            leaf.positions.iter_mut().for_each(|position| *position = turn * *position);
            (leaf, DVec3::new(-0.8, 0.0, -0.8))
        };
        let meshes: Vec<_> = [(room, DVec3::ZERO), block].into_iter().chain((0..10).map(leaf)).collect();
        let [with_leaves, hiding] = count_crossed(meshes.clone(), false);
        assert!(with_leaves > 2 * crossed && hiding == crossed, "{with_leaves} {hiding}");
        assert_eq!(count_crossed(meshes, true), [with_leaves; 2], "beyond a sheet it may be dark");
    }
}
