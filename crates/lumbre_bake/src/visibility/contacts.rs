//! Contact lines: where other surfaces stand on a triangle or pass through it, and the outlines of what lies on it. Light differs from
//! one side of such a line to the other, however small a patch is. Not the cutting of patches along them: that is `bsp`.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};

use crate::scene::{BakeScene, SceneTriangle};

/// A frame in the plane of a triangle: origin at its first corner, unit axes.
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

    /// A point's place in the plane.
    pub fn flat(&self, point: DVec3) -> DVec2 {
        let d = point - self.origin;
        DVec2::new(d.dot(self.right), d.dot(self.up))
    }

    fn height(&self, point: DVec3) -> f64 {
        (point - self.origin).dot(self.normal)
    }
}

/// What hovers above a patch by less than this share of its side stands or lies on it.
const REACH: f64 = 0.1;
/// The height at which what stands on a triangle is cut, as a share of that: above the rounding of its corners.
const LEVEL: f64 = 1.0 / 64.0;
/// Cosine between the normals of surfaces above which one lies on the other instead of standing on it.
const LYING: f64 = 0.98;

/// The segments in which others meet a triangle's plane near it, in that plane's frame; what is `side` wide counts as a patch. A mesh's next
/// triangle, beyond an edge that both share, meets it nowhere else.
pub(crate) fn contacts(scene: &BakeScene, index: u32, frame: &PlaneFrame, side: f32) -> Vec<[DVec2; 2]> {
    let triangle = &scene.triangles[index as usize];
    let reach = REACH * f64::from(side);
    let [a, b, c] = triangle.corners;
    let margin = Vec3::splat(reach as f32);
    let (low, high) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
    let mut found = Vec::new();
    let mut outlines: HashMap<[[u32; 3]; 2], Option<[DVec2; 2]>> = HashMap::new();
    scene.boxes.near(low, high, |other| {
        let other_triangle = &scene.triangles[other as usize];
        if other == index {
            return;
        }
        let corners = other_triangle.corners.map(|corner| corner.as_dvec3());
        let cosine = f64::from(other_triangle.normal.dot(triangle.normal));
        if cosine.abs() <= LYING {
            // What rises from one of its edges stands beside it and not on it.
            if common_corners(&triangle.corners, &other_triangle.corners) < 2 {
                found.extend(contact(frame, &corners, reach, triangle.two_sided));
            }
        } else if lies_on(frame, &corners, reach, cosine, triangle.two_sided) {
            for i in 0..3 {
                let (a, b) = (i, (i + 1) % 3);
                let mut ends = [other_triangle.corners[a], other_triangle.corners[b]]
                    .map(|p| p.to_array().map(f32::to_bits));
                ends.sort_unstable();
                // An edge that two share is not on the outline.
                let line = [frame.flat(corners[a]), frame.flat(corners[b])];
                outlines.entry(ends).and_modify(|line| *line = None).or_insert(Some(line));
            }
        }
    });
    let mut outlines: Vec<_> = outlines.into_iter().filter_map(|(ends, line)| Some((ends, line?))).collect();
    outlines.sort_unstable_by_key(|(ends, _)| *ends);
    found.extend(outlines.into_iter().map(|(_, line)| line));
    found
}

/// How many corners of a triangle are in one place with one of another's, bit by bit.
fn common_corners(own: &[Vec3; 3], other: &[Vec3; 3]) -> usize {
    own.iter().filter(|corner| other.contains(corner)).count()
}

/// Whether a triangle about parallel to a plane lies on it, and is no part of the same surface.
fn lies_on(frame: &PlaneFrame, corners: &[DVec3; 3], reach: f64, cosine: f64, both_sides: bool) -> bool {
    let mut heights = corners.map(|corner| frame.height(corner));
    if both_sides && heights.iter().sum::<f64>() < 0.0 {
        heights = heights.map(|height| -height);
    }
    let margin = reach * LEVEL;
    let coplanar = heights.iter().all(|height| height.abs() <= margin);
    heights.iter().all(|&height| (-margin..=reach).contains(&height)) && (cosine < 0.0 || !coplanar)
}

/// Where a triangle is cut at the height of a plane, or just above its lowest point if that is at most `reach` over the plane.
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

    fn ground() -> PlaneFrame {
        PlaneFrame { origin: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, normal: DVec3::Z }
    }

    #[test]
    fn what_stands_hovers_a_little_or_passes_through_makes_contact() {
        let wall = |z: f64| [DVec3::new(0.0, 1.0, z), DVec3::new(2.0, 1.0, z), DVec3::new(0.0, 1.0, z + 1.0)];
        for (z, expected) in [(0.0, 2.0), (0.005, 2.0), (-0.5, 1.0)] {
            let [p, q] = contact(&ground(), &wall(z), 0.01, false).expect("it meets the ground");
            assert!((p.y - 1.0).abs() < 1e-12 && (q.y - 1.0).abs() < 1e-12);
            // Cut a little above its lowest points, where it is narrower by as little.
            assert!((p.distance(q) - expected).abs() < 0.01 && p.x.min(q.x).abs() < 0.01, "{z}: {p} {q}");
        }
        assert_eq!(contact(&ground(), &wall(0.02), 0.01, false), None);
        // Below: it meets the back.
        let below = wall(0.0).map(|corner| DVec3::new(corner.x, corner.y, -corner.z));
        assert_eq!(contact(&ground(), &below, 0.01, false), None);
        assert!(contact(&ground(), &below, 0.01, true).is_some());
    }
}
