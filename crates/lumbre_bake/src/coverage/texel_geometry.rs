//! The geometry of what texels show: its points, whether it is flat, and a rectangle around it. Groups of texels are in
//! `texel_groups`.

use glam::{DVec3, Vec3};

use super::footprint::{Footprint, Texel};
use crate::bounds::Bounds;
use crate::scene::BakeScene;
use crate::visibility::Area;
use crate::visibility::shaft::contact;

/// Appends points whose convex hull contains everything that a texel shows.
pub(crate) fn positions_of(scene: &BakeScene, texel: &Texel, positions: &mut Vec<Vec3>) {
    let mut add = |triangle: u32, (u, v)| positions.push(scene.triangles[triangle as usize].position(u, v));
    match &texel.footprint {
        Footprint::Whole(_) => {
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                if let Some(point) = texel.point(scene, x, y) {
                    add(point.triangle, point.at);
                }
            }
        }
        Footprint::Points(points) => points.iter().for_each(|point| add(point.triangle, point.at)),
        Footprint::Hidden => {}
    }
}

/// Whether everything that a texel shows is flat and has the normal of `triangle`.
pub(crate) fn shows_plane(scene: &BakeScene, texel: &Texel, triangle: u32) -> bool {
    let normal = scene.triangles[triangle as usize].normal;
    let has_same_normal = |index: u32| {
        let other = &scene.triangles[index as usize];
        index == triangle || (other.flat && other.normal.dot(normal) > 0.9999)
    };
    match &texel.footprint {
        Footprint::Whole(index) => has_same_normal(*index),
        Footprint::Points(points) => points.iter().all(|point| has_same_normal(point.triangle)),
        Footprint::Hidden => true,
    }
}

/// A rectangle around some points in the plane of a flat triangle; `None` if they are not in that plane.
pub(crate) fn bounding_area(scene: &BakeScene, triangle: u32, positions: &[Vec3]) -> Option<Area> {
    let triangle = &scene.triangles[triangle as usize];
    let (origin, normal) = (triangle.corners[0].as_dvec3(), triangle.normal.as_dvec3().try_normalize()?);
    if !triangle.flat || positions.is_empty() {
        return None;
    }
    // The rectangle's axes: along the map's rows, and perpendicular to them.
    let [p, q, r] = triangle.corners.map(|corner| corner.as_dvec3());
    let [a, b, c] = triangle.uv;
    let row = (q - p) * f64::from((c - a).y) - (r - p) * f64::from((b - a).y);
    let row = (row - normal * row.dot(normal)).try_normalize()?;
    let across = normal.cross(row);
    // In the frame of these axes and the normal.
    let mut bounds = Bounds::<DVec3>::default();
    for position in positions {
        let position = position.as_dvec3() - origin;
        let height = position.dot(normal);
        if height.abs() > contact(normal, f64::from(triangle.extent)) {
            return None;
        }
        bounds.extend([DVec3::new(position.dot(row), position.dot(across), height)]);
    }
    let Bounds { low, high } = bounds;
    let corner = |x: f64, y: f64| -> DVec3 { origin + row * x + across * y };
    let corners =
        [corner(low.x, low.y), corner(high.x, low.y), corner(high.x, high.y), corner(low.x, high.y)];
    Some(Area { corners, normal })
}
