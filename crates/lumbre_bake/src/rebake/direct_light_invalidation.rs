//! Finds the texels whose direct light a change can have affected: those from which a path to some source leads through
//! the box of a changed object, before or after the change. The test is conservative, with bounding spheres for blocks
//! of texels, sources and boxes. The light itself is computed in `direct_light`.

use std::collections::HashMap;

use glam::Vec3;
use lumbre_optics::LightKind;
use rayon::prelude::*;

use super::changed_box::ChangedBox;
use crate::bounds::Bounds;
use crate::coverage::texel_geometry::positions_of;
use crate::coverage::{CoveredTexels, TexelGroups, receiver};
use crate::scene::{Canonical, PlacedLight};
use crate::sources::Sources;

/// Canonical units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sphere {
    center: Vec3,
    radius: f32,
}

impl Sphere {
    /// A sphere that contains all points.
    fn around(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let Bounds { low, high } = points.clone().collect();
        let center = 0.5 * (low + high);
        Self { center, radius: points.map(|point| point.distance(center)).fold(0.0, f32::max) }
    }
}

/// Where light comes from.
enum Source {
    Near(Sphere),
    /// A directional light.
    Far {
        /// Direction to the light.
        towards: Vec3,
        /// Half the light's angular diameter, radians.
        angle: f32,
    },
}

/// Texels along the side of a block that is tested as a whole.
const BLOCK_SIDE: u32 = 8;
/// Longer than any path through a scene whose coordinates are below 2.25.
const FAR: f32 = 16.0;
/// Places in a texel of a smooth surface at which its height above the facets is taken into account.
const SMOOTH_POINTS: [(f32, f32); 5] = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
/// Added to radii to cover rounding, relative to the scene's size.
const SLACK: f32 = 1e-4;

/// The regions of space where changed boxes may block light from a source, or may have blocked it: the convex hulls of
/// a source and a box.
pub(crate) struct ShadowVolumes {
    sources: Vec<Source>,
    boxes: Vec<Sphere>,
}

impl ShadowVolumes {
    pub fn new(sources: &Sources<'_>, boxes: &[ChangedBox]) -> Self {
        let boxes = boxes.iter().map(|b| Sphere { center: b.center(), radius: b.radius() + SLACK });
        Self { sources: bounded_sources(sources), boxes: boxes.collect() }
    }

    /// Whether a box may be, or may have been, between a source and some of these points or any point between them.
    pub fn cross(&self, points: &[Vec3]) -> bool {
        if points.is_empty() {
            return false;
        }
        let receiver = Sphere::around(points.iter().copied());
        self.sources
            .iter()
            .any(|source| self.boxes.iter().any(|blocker| source.may_be_blocked(receiver, *blocker)))
    }
}

/// Per covered texel, whether a box may block light that reaches it, or may have blocked it.
pub(crate) fn shadowed(texels: &CoveredTexels<'_>, volumes: &ShadowVolumes) -> Vec<bool> {
    let CoveredTexels { scene, list, charts, .. } = texels;
    let blocks = TexelGroups::blocks(list, charts, BLOCK_SIDE);
    let is_shadowed: Vec<bool> = blocks
        .members
        .par_iter()
        .map(|members| {
            let mut points = Vec::new();
            for texel in members.iter().map(|member| &list[member.place()]) {
                positions_of(scene, texel, &mut points);
                if !scene.triangles[texel.triangle as usize].flat {
                    // Light is computed at points of the smooth surface, which lies above the facets, most of all in
                    // their middle.
                    let smooth = SMOOTH_POINTS.into_iter().filter_map(|(x, y)| texel.point(scene, x, y));
                    points.extend(smooth.map(|point| receiver(scene, &point).position));
                }
            }
            volumes.cross(&points)
        })
        .collect();
    blocks.group_of.iter().map(|&block| is_shadowed[block as usize]).collect()
}

/// The lights, and the emitters by lamps (connected emissive surfaces).
fn bounded_sources(sources: &Sources<'_>) -> Vec<Source> {
    let mut corners_of_lamps: HashMap<u32, Vec<Vec3>> = HashMap::new();
    for (emitter, lamp) in sources.emitters.iter().zip(&*sources.lamps) {
        corners_of_lamps.entry(*lamp).or_default().extend(emitter.corners);
    }
    let lamps = corners_of_lamps.values().map(|points| Source::Near(Sphere::around(points.iter().copied())));
    let lights = sources.lights.iter().map(|light| Source::of_light(light, sources.scene.space));
    lamps.chain(lights).collect()
}

impl Source {
    fn of_light(placed: &PlacedLight, space: Canonical) -> Self {
        // As in the direct light, sizes that are negative or NaN count as 0.
        let size = |size: f32| if size > 0.0 { size } else { 0.0 };
        let radius = (f64::from(size(placed.light.radius)) * space.scale) as f32;
        match placed.light.kind {
            LightKind::Directional => {
                Self::Far { towards: -placed.axis.as_vec3(), angle: 0.5 * size(placed.light.angle) }
            }
            _ => Self::Near(Sphere { center: space.position(placed.position), radius }),
        }
    }

    /// Whether some path from `receiver` to this source leads through `blocker`.
    fn may_be_blocked(&self, receiver: Sphere, blocker: Sphere) -> bool {
        let end = match *self {
            Self::Near(sphere) => sphere,
            Self::Far { towards, angle } => Sphere {
                center: receiver.center + towards * FAR,
                // The limit keeps the tangent finite; the sphere then is so large that it excludes next to nothing.
                radius: receiver.radius + FAR * angle.min(1.5).tan(),
            },
        };
        hull_distance(receiver, end, blocker.center) <= blocker.radius
    }
}

/// Distance of a point to the convex hull of two spheres; at most 0 inside. It is the least distance to any of the
/// spheres whose centres and radii are interpolated linearly between the two; that distance is a convex function of the
/// place, and its minimum has a closed form.
fn hull_distance(a: Sphere, b: Sphere, point: Vec3) -> f32 {
    let axis = b.center - a.center;
    let length = axis.length();
    let to_point = point - a.center;
    let at = |s: f32| {
        let t = if length > 0.0 { s / length } else { 0.0 };
        (to_point - axis * t).length() - (a.radius + (b.radius - a.radius) * t)
    };
    let (from, to) = (at(0.0), at(length));
    let slope = (b.radius - a.radius) / length;
    // One sphere contains the other, or both have the same centre.
    if length == 0.0 || slope.abs() >= 1.0 {
        return from.min(to);
    }
    let along = to_point.dot(axis) / length;
    let across = (to_point.length_squared() - along * along).max(0.0).sqrt();
    let nearest = along + across * slope / (1.0 - slope * slope).sqrt();
    from.min(to).min(at(nearest.max(0.0).min(length)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream};

    #[test]
    fn hull_distance_is_the_least_of_all_spheres_between() {
        // Compared with a search along the axis: the least distance to 4096 spheres is an upper bound, too large by one
        // step at most.
        for case in 0..200u32 {
            let sequence = Sequence::new(3, Stream::Test(1), case);
            let mut index = 0;
            let mut vector = || {
                index += 1;
                let [x, y, z, _] = sequence.point(index, 0);
                Vec3::new(x, y, z) * 4.0 - 2.0
            };
            let (p, q, point) = (vector(), vector(), vector());
            let [r, s, ..] = sequence.point(0, 0);
            let (a, b) = (Sphere { center: p, radius: r }, Sphere { center: q, radius: 0.5 * s });
            let steps = 4096;
            let searched = (0..=steps)
                .map(|i| i as f32 / steps as f32)
                .map(|t| p.lerp(q, t).distance(point) - (a.radius + (b.radius - a.radius) * t))
                .fold(f32::INFINITY, f32::min);
            let distance = hull_distance(a, b, point);
            assert!(
                distance <= searched + 1e-5 && distance >= searched - 2e-3,
                "{case}: {distance} {searched}"
            );
        }
    }

    #[test]
    fn the_hull_of_a_sphere_within_another_is_the_larger_one() {
        let large = Sphere { center: Vec3::ZERO, radius: 2.0 };
        let small = Sphere { center: Vec3::X * 0.5, radius: 0.5 };
        let point = Vec3::new(0.0, 3.0, 0.0);
        assert!((hull_distance(large, small, point) - 1.0).abs() < 1e-6);
        assert!((hull_distance(small, large, point) - 1.0).abs() < 1e-6);
        assert!((hull_distance(large, large, point) - 1.0).abs() < 1e-6);
    }
}
