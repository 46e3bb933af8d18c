//! Which texels' direct light a change can have affected: those from which the way to some source leads through a box that a changed object
//! filled or fills. Never too few: texels and sources count as the spheres around them. Not the light itself.

use std::collections::HashMap;

use glam::Vec3;
use lumbre_optics::LightKind;
use rayon::prelude::*;

use super::changed_box::ChangedBox;
use crate::coverage::footprint::{Texel, receiver};
use crate::coverage::texel_geometry::positions_of;
use crate::coverage::texel_groups::TexelGroups;
use crate::scene::{Canonical, PlacedLight};
use crate::sources::emitters::lamps;
use crate::sources::light_sources::Sources;

/// A ball, canonical units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sphere {
    center: Vec3,
    radius: f32,
}

impl Sphere {
    fn around(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let (low, high) = points.clone().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| {
            (low.min(point), high.max(point))
        });
        let center = 0.5 * (low + high);
        Self { center, radius: points.map(|point| point.distance(center)).fold(0.0, f32::max) }
    }
}

/// Where light comes from.
enum Source {
    Near(Sphere),
    /// From so far away that it comes from one direction, or a cone about it (half its angle, radians).
    Far {
        towards: Vec3,
        angle: f32,
    },
}

/// Texels along the side of a block that is asked as a whole.
const BLOCK: u32 = 8;
/// Longer than any way through a scene whose coordinates are below 2.25.
const FAR: f32 = 16.0;
/// Where a texel of a smooth surface is asked how far it is above its facets.
const LIFTED: [(f32, f32); 5] = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
/// What rounding may make of the spheres, relative to the scene.
const SLACK: f32 = 1e-4;

/// The ways on which a box may stand, or have stood, in the light.
pub(crate) struct ShadowVolumes {
    sources: Vec<Source>,
    boxes: Vec<Sphere>,
}

impl ShadowVolumes {
    pub fn new(sources: &Sources<'_>, boxes: &[ChangedBox]) -> Self {
        let boxes = boxes.iter().map(|b| Sphere { center: b.center(), radius: b.radius() + SLACK });
        Self { sources: spheres(sources), boxes: boxes.collect() }
    }

    /// Whether that may be so for some of these places, or any between them.
    pub fn cross(&self, places: &[Vec3]) -> bool {
        if places.is_empty() {
            return false;
        }
        let own = Sphere::around(places.iter().copied());
        self.sources.iter().any(|source| self.boxes.iter().any(|between| source.meets(own, *between)))
    }
}

/// Per covered texel, whether a box may stand, or have stood, in its light.
pub(crate) fn shadowed(
    sources: &Sources<'_>,
    texels: &[Texel],
    charts: &[u32],
    boxes: &[ChangedBox],
) -> Vec<bool> {
    let scene = sources.scene;
    let volumes = ShadowVolumes::new(sources, boxes);
    let blocks = TexelGroups::blocks(texels, charts, BLOCK);
    let reached: Vec<bool> = blocks
        .members
        .par_iter()
        .map(|members| {
            let mut shown = Vec::new();
            for texel in members.iter().map(|&member| &texels[member as usize]) {
                positions_of(scene, texel, &mut shown);
                if !scene.triangles[texel.triangle as usize].flat {
                    // The smooth surface lies above its facets, most of all in their middle.
                    let lifted = LIFTED.into_iter().filter_map(|(x, y)| texel.point(scene, x, y));
                    shown.extend(lifted.map(|point| receiver(scene, &point).position));
                }
            }
            volumes.cross(&shown)
        })
        .collect();
    blocks.group_of.iter().map(|&block| reached[block as usize]).collect()
}

fn spheres(sources: &Sources<'_>) -> Vec<Source> {
    let mut of_lamps: HashMap<u32, Vec<Vec3>> = HashMap::new();
    for (emitter, lamp) in sources.emitters.iter().zip(lamps(sources.scene, &sources.emitters)) {
        of_lamps.entry(lamp).or_default().extend(emitter.corners);
    }
    let lamps = of_lamps.values().map(|points| Source::Near(Sphere::around(points.iter().copied())));
    let lights = sources.lights.iter().map(|light| Source::of_light(light, sources.scene.space));
    lamps.chain(lights).collect()
}

impl Source {
    fn of_light(placed: &PlacedLight, space: Canonical) -> Self {
        // What is no size counts as none, as in the bake.
        let size = |size: f32| if size > 0.0 { size } else { 0.0 };
        let radius = (f64::from(size(placed.light.radius)) * space.scale) as f32;
        match placed.light.kind {
            LightKind::Directional => {
                Self::Far { towards: -placed.axis.as_vec3(), angle: 0.5 * size(placed.light.angle) }
            }
            _ => Self::Near(Sphere { center: space.position(placed.position), radius }),
        }
    }

    /// Whether some way from `own` to this leads through `between`.
    fn meets(&self, own: Sphere, between: Sphere) -> bool {
        let end = match *self {
            Self::Near(sphere) => sphere,
            Self::Far { towards, angle } => Sphere {
                center: own.center + towards * FAR,
                // Beyond what it may be, nothing is excluded.
                radius: own.radius + FAR * angle.min(1.5).tan(),
            },
        };
        hull_distance(own, end, between.center) <= between.radius
    }
}

/// Distance of a point to the convex hull of two spheres; at most 0 inside. The least of the distances to the spheres whose centres and
/// radii run evenly from the one to the other, found in closed form: it is a convex function.
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
    // The one contains the other, or they are in one place.
    if length == 0.0 || slope.abs() >= 1.0 {
        return from.min(to);
    }
    let along = to_point.dot(axis) / length;
    let apart = (to_point.length_squared() - along * along).max(0.0).sqrt();
    let nearest = along + apart * slope / (1.0 - slope * slope).sqrt();
    from.min(to).min(at(nearest.max(0.0).min(length)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream};

    #[test]
    fn the_hull_is_that_of_all_spheres_between() {
        // Against a search along the axis: the least of 4096 spheres is a bound from above, by at most the step.
        for case in 0..200u32 {
            let sequence = Sequence::new(3, Stream::Test(1), case);
            let mut at = 0;
            let mut vector = || {
                at += 1;
                let [x, y, z, _] = sequence.point(at, 0);
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
            let found = hull_distance(a, b, point);
            assert!(found <= searched + 1e-5 && found >= searched - 2e-3, "{case}: {found} {searched}");
        }
    }

    #[test]
    fn a_sphere_in_another_has_the_hull_of_the_larger() {
        let large = Sphere { center: Vec3::ZERO, radius: 2.0 };
        let small = Sphere { center: Vec3::X * 0.5, radius: 0.5 };
        let point = Vec3::new(0.0, 3.0, 0.0);
        assert!((hull_distance(large, small, point) - 1.0).abs() < 1e-6);
        assert!((hull_distance(small, large, point) - 1.0).abs() < 1e-6);
        assert!((hull_distance(large, large, point) - 1.0).abs() < 1e-6);
    }
}
