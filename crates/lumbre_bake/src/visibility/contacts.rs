//! Contact lines on a triangle: where other surfaces stand on it or pass through it, and the outlines of surfaces that
//! lie on it. The light changes abruptly across such a line, however small the patches are. `radiosity::bsp` cuts
//! patches along them.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};

use crate::bounds::Bounds;
use crate::scene::{BakeScene, SceneTriangle};

/// A coordinate frame in the plane of a triangle, with its origin at the first corner and unit axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneFrame {
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    normal: DVec3,
}

impl PlaneFrame {
    pub fn new(triangle: &SceneTriangle) -> Self {
        let [a, b, c] = triangle.corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or(triangle.normal.as_dvec3());
        let right = (b - a).normalize_or(normal.any_orthonormal_vector());
        Self { origin: a, right, up: normal.cross(right), normal }
    }

    /// The coordinates of a point's projection onto the plane.
    pub fn flat(&self, point: DVec3) -> DVec2 {
        let d = point - self.origin;
        DVec2::new(d.dot(self.right), d.dot(self.up))
    }

    /// Signed distance of a point from the plane.
    fn height(&self, point: DVec3) -> f64 {
        (point - self.origin).dot(self.normal)
    }
}

/// A contact line on a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Its ends: in the frame of the triangle's plane, unless stated otherwise.
    pub line: [DVec2; 2],
    /// Whether the surface on one side of it may be hidden: under something that lies there, or inside a solid. A sheet
    /// that stands there hides nothing, as light reaches both of its sides.
    pub may_hide: bool,
}

/// Height above a patch, as a fraction of the patch's side, up to which a surface counts as standing or lying on it.
pub(crate) const REACH: f64 = 0.1;
/// Height at which a surface that stands on a triangle is intersected, as a fraction of the reach: above the rounding
/// error of its corners.
const LEVEL: f64 = 1.0 / 64.0;
/// Cosine between the normals of two surfaces above which one lies on the other instead of standing on it.
const LYING: f64 = 0.98;

/// The contact lines of other triangles on triangle `index`, in `frame`, the frame of its plane. `side` is the side of a
/// patch. Adjacent triangles of a mesh, which share an edge, make no contact.
pub(crate) fn contacts(scene: &BakeScene, index: u32, frame: &PlaneFrame, side: f32) -> Vec<Contact> {
    let triangle = &scene.triangles[index as usize];
    let reach = REACH * f64::from(side);
    let Bounds::<Vec3> { low, high } = triangle.corners.into_iter().collect();
    let place = Bounds { low: low - reach as f32, high: high + reach as f32 };
    let mut lines = Vec::new();
    let mut outlines: HashMap<[[u32; 3]; 2], Option<[DVec2; 2]>> = HashMap::new();
    scene.boxes.near(&place, |other| {
        let other_triangle = &scene.triangles[other as usize];
        if other == index {
            return;
        }
        let corners = other_triangle.corners.map(|corner| corner.as_dvec3());
        let cosine = f64::from(other_triangle.normal.dot(triangle.normal));
        if cosine.abs() <= LYING {
            // A triangle that shares an edge with it stands beside it and not on it.
            if common_corners(&triangle.corners, &other_triangle.corners) < 2 {
                let line = contact(frame, &corners, reach, triangle.two_sided);
                // Beyond a sheet there may still be the dark outside of a room.
                let may_hide = !other_triangle.two_sided || scene.dark_outside;
                lines.extend(line.map(|line| Contact { line, may_hide }));
            }
        } else if lies_on(frame, &corners, reach, cosine, triangle.two_sided) {
            for i in 0..3 {
                let (a, b) = (i, (i + 1) % 3);
                let mut ends = [other_triangle.corners[a], other_triangle.corners[b]]
                    .map(|p| p.to_array().map(f32::to_bits));
                ends.sort_unstable();
                // An edge that two triangles share is not on the outline.
                let line = [frame.flat(corners[a]), frame.flat(corners[b])];
                outlines.entry(ends).and_modify(|line| *line = None).or_insert(Some(line));
            }
        }
    });
    let mut outlines: Vec<_> = outlines.into_iter().filter_map(|(ends, line)| Some((ends, line?))).collect();
    outlines.sort_unstable_by_key(|(ends, _)| *ends);
    lines.extend(outlines.into_iter().map(|(_, line)| Contact { line, may_hide: true }));
    lines
}

/// Number of corners that two triangles have in common, with exactly equal coordinates.
fn common_corners(first: &[Vec3; 3], second: &[Vec3; 3]) -> usize {
    first.iter().filter(|corner| second.contains(corner)).count()
}

/// Whether a triangle that is about parallel to the plane lies on it without being part of the same surface. `cosine`
/// is that between the normals.
fn lies_on(frame: &PlaneFrame, corners: &[DVec3; 3], reach: f64, cosine: f64, both_sides: bool) -> bool {
    let mut heights = corners.map(|corner| frame.height(corner));
    if both_sides && heights.iter().sum::<f64>() < 0.0 {
        heights = heights.map(|height| -height);
    }
    let margin = reach * LEVEL;
    let coplanar = heights.iter().all(|height| height.abs() <= margin);
    heights.iter().all(|&height| (-margin..=reach).contains(&height)) && (cosine < 0.0 || !coplanar)
}

/// The segment in which a triangle crosses the plane, or, if its lowest point is at most `reach` above the plane, in
/// which it is cut just above that point. With `both_sides`, a triangle below the plane is treated as its mirror image
/// above it.
fn contact(frame: &PlaneFrame, corners: &[DVec3; 3], reach: f64, both_sides: bool) -> Option<[DVec2; 2]> {
    let mut heights = corners.map(|corner| frame.height(corner));
    let margin = reach * LEVEL;
    if heights.iter().all(|&height| height < margin) {
        if !both_sides {
            return None;
        }
        heights = heights.map(|height| -height);
    }
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    if lowest > reach {
        return None;
    }
    let level = (lowest + margin).max(0.0);
    let mut ends = [DVec2::ZERO; 2];
    let mut count = 0;
    for i in 0..3 {
        let (p, q) = (heights[i] - level, heights[(i + 1) % 3] - level);
        if (p < 0.0) != (q < 0.0) && count < 2 {
            ends[count] = frame.flat(corners[i].lerp(corners[(i + 1) % 3], p / (p - q)));
            count += 1;
        }
    }
    (count == 2 && ends[0].is_finite() && ends[1].is_finite()).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn horizontal_plane() -> PlaneFrame {
        PlaneFrame { origin: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, normal: DVec3::Z }
    }

    #[test]
    fn surfaces_that_stand_on_hover_just_above_or_cross_the_plane_make_contact() {
        let wall = |z: f64| [DVec3::new(0.0, 1.0, z), DVec3::new(2.0, 1.0, z), DVec3::new(0.0, 1.0, z + 1.0)];
        for (z, expected) in [(0.0, 2.0), (0.005, 2.0), (-0.5, 1.0)] {
            let [p, q] = contact(&horizontal_plane(), &wall(z), 0.01, false).expect("it meets the plane");
            assert!((p.y - 1.0).abs() < 1e-12 && (q.y - 1.0).abs() < 1e-12);
            // It is cut slightly above its lowest points, where it is slightly narrower.
            assert!((p.distance(q) - expected).abs() < 0.01 && p.x.min(q.x).abs() < 0.01, "{z}: {p} {q}");
        }
        assert_eq!(contact(&horizontal_plane(), &wall(0.02), 0.01, false), None);
        // Below the plane, it is in contact with the back.
        let below = wall(0.0).map(|corner| DVec3::new(corner.x, corner.y, -corner.z));
        assert_eq!(contact(&horizontal_plane(), &below, 0.01, false), None);
        assert!(contact(&horizontal_plane(), &below, 0.01, true).is_some());
    }
}
