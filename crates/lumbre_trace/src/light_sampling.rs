//! Light sampling for paths: chooses one lamp in proportion to its unoccluded light at a surface point, and
//! one point on the emissive triangles, of which `emitter_tree` chooses one. Visibility is not tested here.
//! Where there are many lamps, `light_tree` first selects the few that are weighed one by one.
//!
//! What is sampled has a density, so that paths can weigh it against finding the same light by themselves: the
//! emissive triangles that they hit, and the lamps with a size that lie along their rays.

use glam::{DVec2, DVec3};
use lumbre_optics::{Light, LightKind, LightSample, evaluate_light};
use lumbre_scene::EmissiveLight;
use smallvec::SmallVec;

use crate::coplanar::EndSurface;
use crate::direct_light::reach;
use crate::emitter_tree::{EmitterBounds, EmitterTree};
use crate::lamp_cone::LampCone;
use crate::light_tree::LightTree;
use crate::metering::luminance;
use crate::scene::{Object, Passage, Scene, sample_color};
use crate::surface_point::SurfacePoint;

/// The lights of a scene, prepared for sampling.
#[derive(Debug)]
pub(crate) struct LightSampler {
    emitters: Vec<Emitter>,
    /// Chooses one of the emitters.
    emitter_tree: EmitterTree,
    /// Indices of all lights, which are weighed one by one if there is no tree.
    lamps: Vec<usize>,
    /// Indices of the lights that have a size, which rays may find; of the distant ones alone if there is a tree.
    sized: Vec<usize>,
    /// Selects a few lamps, and finds those with a size along rays, where there are more than [`FEW_LAMPS`].
    tree: Option<LightTree>,
    /// Index of the emitter that each triangle of the scene is, by the triangle's index, or [`NO_EMITTER`];
    /// empty without emitters.
    emitter_of: Vec<u32>,
}

/// An emissive triangle.
#[derive(Clone, Copy, Debug)]
struct Emitter {
    object: usize,
    /// Index in its object.
    number: u32,
    corners: [DVec3; 3],
    /// Unit vector, to the front.
    normal: DVec3,
    area: f64,
}

/// A point on a lamp, sampled for a surface point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampSample {
    /// Index of the light in the scene.
    pub number: usize,
    /// The lamp's light from the sampled direction.
    pub light: LightSample,
    /// Probability that this lamp was chosen.
    pub chance: f64,
    /// Metres; infinite for distant lights.
    pub distance: f64,
    /// The solid angle of the lamp, over which directions are uniform, sr; 0 for lamps without a size.
    pub solid_angle: f64,
}

/// A lamp with a size that a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetLamp {
    /// Index of the light in the scene.
    pub number: usize,
    /// Radiance for the diffuse and for the specular lobe of the surface that reflects it.
    pub radiance: [DVec3; 2],
    /// Metres to its surface; infinite for distant lights.
    pub distance: f64,
    /// Steradians, as seen from the start of the ray.
    pub solid_angle: f64,
}

/// Lamps with their light at a point and the weights by which one of them is chosen, and the sum of the weights.
type WeighedLamps = (SmallVec<[(usize, LightSample, f64); 32]>, f64);

/// A point on an emissive triangle, sampled for a surface point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterSample {
    /// Radiance towards the surface.
    pub radiance: DVec3,
    /// Unit vector towards the light.
    pub direction: DVec3,
    pub distance: f64,
    /// Probability density per steradian.
    pub density: f64,
    /// The emissive triangle.
    pub surface: EndSurface,
}

/// Marks triangles that emit nothing.
const NO_EMITTER: u32 = u32::MAX;
/// Up to this many lights are weighed one by one at every point.
const FEW_LAMPS: usize = 16;
/// Lower bound of the emissive texture's luminance where a triangle is weighed: a texture that is dark at the
/// centroid may be bright elsewhere.
const MIN_TINT: f64 = 0.1;
/// Lower bound of the cosine with which a lamp with a size is weighed: part of it may be above the horizon
/// where its centre is not.
const SIZED_FLOOR: f64 = 0.1;

impl LightSampler {
    pub fn new(scene: &Scene) -> Self {
        let mut emitters = Vec::new();
        let mut bounds = Vec::new();
        let mut emitter_of = Vec::new();
        for triangle in 0..scene.geometry.triangle_count() as u32 {
            let (index, number) = scene.geometry.owner(triangle);
            let object = &scene.objects[index];
            let sides = EmissiveLight::radiance(&object.material).map(|color| luminance(color.as_dvec3()));
            let [front, back] = sides;
            // Emitters with alpha are not sampled: only paths that happen to hit them find their light.
            if front + back <= 0.0 || matches!(object.passage(), Passage::Cut | Passage::Covering) {
                continue;
            }
            let first = 3 * number as usize;
            let corners = object.corners([0, 1, 2].map(|next| object.shape.indices[first + next]));
            let [a, b, c] = corners;
            let cross = (b - a).cross(c - a);
            let area = 0.5 * cross.length();
            if area > 0.0 && area.is_finite() {
                let normal = cross / (2.0 * area);
                let tint = luminance(tint(object, number, [1.0 / 3.0; 2])).max(MIN_TINT);
                if emitter_of.is_empty() {
                    emitter_of = vec![NO_EMITTER; scene.geometry.triangle_count()];
                }
                emitter_of[triangle as usize] = emitters.len() as u32;
                emitters.push(Emitter { object: index, number, corners, normal, area });
                bounds.push(EmitterBounds {
                    low: a.min(b).min(c),
                    high: a.max(b).max(c),
                    power: area * (front + back) * tint,
                    normal: if front > 0.0 { normal } else { -normal },
                    two_sided: front > 0.0 && back > 0.0,
                });
            }
        }
        let emitter_tree = EmitterTree::new(&bounds);
        let lamps: Vec<usize> = (0..scene.lights.len()).collect();
        let tree = (scene.lights.len() > FEW_LAMPS).then(|| LightTree::new(scene));
        let is_asked =
            |light: &Light| has_size(light) && (tree.is_none() || light.kind == LightKind::Directional);
        let sized = lamps.iter().copied().filter(|&number| is_asked(&scene.lights[number].light)).collect();
        Self { emitters, emitter_tree, emitter_of, lamps, sized, tree }
    }

    /// Samples a lamp for a point, and a direction towards it; `None` if no lamp sends light there.
    pub fn lamp(
        &self,
        scene: &Scene,
        point: &SurfacePoint,
        choice: f64,
        numbers: DVec2,
    ) -> Option<LampSample> {
        let (asked, of_asked, choice) = match &self.tree {
            Some(tree) => tree.few(point.position, point.normal, choice)?,
            None => (&self.lamps[..], 1.0, choice),
        };
        let (weights, total) = weighed(scene, asked, point.position, point.normal);
        let mut left = choice * total;
        let last = weights.len().checked_sub(1)?;
        let (number, sample, weight) = weights.into_iter().enumerate().find_map(|(place, found)| {
            left -= found.2;
            (left < 0.0 || place == last).then_some(found)
        })?;
        let placed = &scene.lights[number];
        let chance = of_asked * weight / total;
        let Some(cone) = LampCone::new(placed, point.position) else {
            return Some(LampSample {
                number,
                light: sample,
                chance,
                distance: reach(placed, point),
                solid_angle: 0.0,
            });
        };
        let direction = cone.sample(numbers);
        Some(LampSample {
            number,
            light: cone.spread(sample, direction),
            chance,
            distance: cone.reach(direction),
            solid_angle: cone.solid_angle(),
        })
    }

    /// Returns the probability with which [`lamp`](Self::lamp) chooses a lamp for a point.
    pub fn lamp_chance(&self, scene: &Scene, point: &SurfacePoint, lamp: usize) -> f64 {
        let (position, normal) = (point.position, point.normal);
        let asked = match &self.tree {
            Some(tree) => tree.few_with(lamp, position, normal),
            None => Some((&self.lamps[..], 1.0)),
        };
        let Some((asked, of_asked)) = asked else { return 0.0 };
        let (weights, total) = weighed(scene, asked, position, normal);
        let own = weights.iter().find(|(number, ..)| *number == lamp);
        own.map_or(0.0, |(_, _, weight)| of_asked * weight / total)
    }

    /// Returns the lamps with a size that lie along a ray, whatever is in front of them.
    pub fn met(&self, scene: &Scene, origin: DVec3, direction: DVec3) -> SmallVec<[MetLamp; 2]> {
        let met = |number: usize| {
            let placed = &scene.lights[number];
            let cone = LampCone::new(placed, origin).filter(|cone| cone.holds(direction))?;
            let sample = evaluate_light(&placed.light, placed.position, placed.axis, origin);
            let strength = sample.attenuation * sample.spot * cone.concentration();
            let radiance = [sample.diffuse, sample.specular].map(|color| color * strength);
            let is_finite = radiance.iter().all(|color| color.is_finite());
            let (distance, solid_angle) = (cone.reach(direction), cone.solid_angle());
            (strength > 0.0 && is_finite).then_some(MetLamp { number, radiance, distance, solid_angle })
        };
        let mut lamps: SmallVec<[MetLamp; 2]> = self.sized.iter().copied().filter_map(met).collect();
        if let Some(tree) = &self.tree {
            tree.along(origin, direction, |number| lamps.extend(met(number)));
            // The order of the scene, in which their light is added up.
            lamps.sort_unstable_by_key(|lamp| lamp.number);
        }
        lamps
    }

    /// Samples a point on the emissive triangles for a surface point; `None` where the triangle's side emits
    /// nothing, or if there are no emitters.
    pub fn emitter(
        &self,
        scene: &Scene,
        point: &SurfacePoint,
        choice: f64,
        numbers: DVec2,
    ) -> Option<EmitterSample> {
        let (chosen, chance) = self.emitter_tree.choose(point.position, point.normal, choice)?;
        let emitter = &self.emitters[chosen];
        let root = numbers.x.sqrt();
        let weights = [root * (1.0 - numbers.y), root * numbers.y];
        let [a, b, c] = emitter.corners;
        let at = a * (1.0 - root) + b * weights[0] + c * weights[1];
        let to = at - point.position;
        let distance = to.length();
        if distance.is_nan() || distance <= 0.0 {
            return None;
        }
        let direction = to / distance;
        let cosine = -direction.dot(emitter.normal);
        let object = &scene.objects[emitter.object];
        let radiance = emitted(object, emitter.number, weights, cosine > 0.0);
        let density = chance / emitter.area * distance * distance / cosine.abs();
        let extent = emitter.corners.iter().fold(0.0_f64, |extent, at| extent.max(at.abs().max_element()));
        (radiance != DVec3::ZERO && density.is_finite() && density > 0.0).then_some(EmitterSample {
            radiance,
            direction,
            distance,
            density,
            surface: EndSurface { object: emitter.object, normal: emitter.normal, extent },
        })
    }

    /// Returns the density per steradian with which [`emitter`](Self::emitter) chooses a point of a triangle
    /// for a surface point and the normal there, seen at a distance and at a cosine to the triangle's normal; 0
    /// for triangles that are never chosen.
    pub fn density(
        &self,
        triangle: Option<u32>,
        (point, normal): (DVec3, DVec3),
        distance: f64,
        cosine: f64,
    ) -> f64 {
        let emitter = triangle.and_then(|triangle| self.emitter_of.get(triangle as usize)).copied();
        let Some(emitter) = emitter.filter(|&emitter| emitter != NO_EMITTER) else { return 0.0 };
        let chance = self.emitter_tree.chance(emitter as usize, point, normal);
        let area = self.emitters[emitter as usize].area;
        chance / area * distance * distance / cosine.abs().max(1e-12)
    }
}

/// Returns the radiance of one side of a triangle, as far as it lights other surfaces.
pub(crate) fn emitted(object: &Object, number: u32, weights: [f64; 2], front: bool) -> DVec3 {
    let radiance = EmissiveLight::radiance(&object.material)[usize::from(!front)].as_dvec3();
    if radiance == DVec3::ZERO { radiance } else { radiance * tint(object, number, weights) }
}

/// Returns the emissive texture's colour at a place in a triangle.
fn tint(object: &Object, number: u32, weights: [f64; 2]) -> DVec3 {
    let Some(texture) = &object.textures.emissive else { return DVec3::ONE };
    let (vertices, weights) = object.vertices(number, weights);
    sample_color(texture, object.coordinates(texture.tex_coord, vertices, weights)).truncate()
}

/// Weighs lamps by their unoccluded light at a point with a normal. Those that send none are left out.
fn weighed(scene: &Scene, lamps: &[usize], point: DVec3, normal: DVec3) -> WeighedLamps {
    let mut weights = SmallVec::new();
    let mut total = 0.0;
    for &number in lamps {
        let placed = &scene.lights[number];
        if placed.light.kind == LightKind::Ambient {
            continue;
        }
        let sample = evaluate_light(&placed.light, placed.position, placed.axis, point);
        let lowest = if has_size(&placed.light) { SIZED_FLOOR } else { 0.0 };
        let cosine = normal.dot(sample.direction).max(lowest);
        let color = luminance(sample.diffuse) + luminance(sample.specular);
        let weight = color * sample.attenuation * sample.spot * cosine;
        if weight > 0.0 && weight.is_finite() {
            total += weight;
            weights.push((number, sample, weight));
        }
    }
    (weights, total)
}

fn has_size(light: &Light) -> bool {
    match light.kind {
        LightKind::Point => light.radius > 0.0,
        LightKind::Directional => light.angle > 0.0,
        LightKind::Ambient => false,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bevy_ecs::world::World;
    use glam::Vec3;
    use lumbre_mesh::shapes;
    use lumbre_optics::Material;
    use lumbre_scene::{Mesh, Transform, update_transforms};

    use super::*;
    use crate::geometry::SpaceRay;
    use crate::random::Numbers;

    /// Lamps of every kind over a floor, with and without a size, so many that there is a tree if `count` is large.
    fn lamps(count: u32) -> Scene {
        let mut numbers = Numbers::new(11, 0, 0);
        let mut world = World::new();
        world.spawn((Mesh(Arc::new(shapes::plane(9.0, 9.0, 1, 1))), Material::matt(Vec3::ONE)));
        for number in 0..count {
            let place = DVec3::new(numbers.next(), numbers.next(), numbers.next());
            let color = Vec3::splat(numbers.next() as f32);
            let (radius, angle) = (0.2 * (number % 3) as f32, 0.3 * (number % 2) as f32);
            let light = if number % 9 == 0 { Light::directional(color) } else { Light::point(color) };
            let at = Transform::from_translation(8.0 * place - DVec3::new(4.0, -0.1, 4.0));
            world.spawn((Light { radius, angle, ..light }, at.looking_at(DVec3::ZERO, DVec3::X)));
        }
        update_transforms(&mut world);
        Scene::new(&mut world, DVec3::ZERO, None, [false; 2]).expect("the world can be read")
    }

    #[test]
    fn a_lamps_probability_is_that_of_its_choice() {
        for count in [12, 200] {
            let scene = lamps(count);
            let sampler = LightSampler::new(&scene);
            assert_eq!(sampler.tree.is_some(), count > FEW_LAMPS as u32);
            let mut numbers = Numbers::new(5, 0, 1);
            let mut sized = 0;
            for _ in 0..300 {
                let from = DVec3::new(8.0 * numbers.next() - 4.0, 1.0, 8.0 * numbers.next() - 4.0);
                let ray = SpaceRay::new(from, DVec3::NEG_Y);
                let hit = scene.geometry.closest(&ray, 9.0, |_| true).expect("the floor");
                let point = SurfacePoint::new(&scene, &ray, &hit);
                let Some(lamp) = sampler.lamp(&scene, &point, numbers.next(), numbers.pair()) else {
                    continue;
                };
                let chance = sampler.lamp_chance(&scene, &point, lamp.number);
                assert!((chance - lamp.chance).abs() <= 1e-12 * chance, "{chance} for {}", lamp.chance);
                // The sampled direction finds the lamp, at the same distance and with the same solid angle.
                if lamp.solid_angle > 0.0 {
                    sized += 1;
                    let met = sampler.met(&scene, point.position, lamp.light.direction);
                    let own = met.iter().find(|met| met.number == lamp.number);
                    let own = own.expect("the direction is in the lamp's cone");
                    assert!(own.distance == lamp.distance && own.solid_angle == lamp.solid_angle);
                }
            }
            assert!(sized > 50, "{sized}");
        }
    }

    /// With the boxes around the lamps' centres alone this fails.
    #[test]
    fn the_tree_finds_the_lamps_with_a_size_along_a_ray() {
        let scene = lamps(400);
        let sampler = LightSampler::new(&scene);
        assert!(sampler.tree.is_some());
        let mut numbers = Numbers::new(9, 0, 1);
        let (mut met_at_all, mut point) =
            (0, || 2.0 * DVec3::new(numbers.next(), numbers.next(), numbers.next()) - 1.0);
        for number in 0..4000 {
            // From among the lamps and from afar, along an axis and in any direction.
            let origin = point() * if number % 2 == 0 { 5.0 } else { 5000.0 };
            let direction = match number % 3 {
                0 => DVec3::AXES[number / 3 % 3] * -origin.signum(),
                _ => 4.0 * point() - origin,
            };
            let direction = direction.normalize();
            let met: Vec<usize> =
                sampler.met(&scene, origin, direction).iter().map(|lamp| lamp.number).collect();
            let along = |&lamp: &usize| {
                let cone = LampCone::new(&scene.lights[lamp], origin);
                let sample = evaluate_light(
                    &scene.lights[lamp].light,
                    scene.lights[lamp].position,
                    scene.lights[lamp].axis,
                    origin,
                );
                cone.is_some_and(|cone| cone.holds(direction)) && sample.attenuation * sample.spot > 0.0
            };
            let expected: Vec<usize> = (0..scene.lights.len()).filter(along).collect();
            assert_eq!(met, expected, "from {origin} towards {direction}");
            met_at_all +=
                met.iter().filter(|&&lamp| scene.lights[lamp].light.kind == LightKind::Point).count();
        }
        assert!(met_at_all > 1000, "{met_at_all}");
    }

    #[test]
    fn lamps_are_chosen_as_often_as_their_probabilities_say() {
        const CHOICES: u32 = 2000;
        for count in [12, 200] {
            let scene = lamps(count);
            let sampler = LightSampler::new(&scene);
            let mut numbers = Numbers::new(7, 0, 1);
            let mut chosen_at_all = 0;
            for _ in 0..20 {
                let from = DVec3::new(8.0 * numbers.next() - 4.0, 1.0, 8.0 * numbers.next() - 4.0);
                let ray = SpaceRay::new(from, DVec3::NEG_Y);
                let hit = scene.geometry.closest(&ray, 9.0, |_| true).expect("the floor");
                let point = SurfacePoint::new(&scene, &ray, &hit);
                let mut chosen = vec![0_u32; count as usize];
                for number in 0..CHOICES {
                    let choice = (f64::from(number) + 0.5) / f64::from(CHOICES);
                    if let Some(lamp) = sampler.lamp(&scene, &point, choice, DVec2::splat(0.5)) {
                        chosen[lamp.number] += 1;
                    }
                }
                for (lamp, &times) in chosen.iter().enumerate() {
                    let share = f64::from(times) / f64::from(CHOICES);
                    let chance = sampler.lamp_chance(&scene, &point, lamp);
                    // Each lamp has one interval of choices, at whose ends the count is off by less than one. Without
                    // the probability of a leaf of the tree, both where lamps are chosen and where it is asked for,
                    // this fails, and the test above does not.
                    assert!(
                        (share - chance).abs() < 1.01 / f64::from(CHOICES),
                        "{lamp}: {share} of {chance}"
                    );
                }
                chosen_at_all += chosen.iter().sum::<u32>();
            }
            assert!(chosen_at_all > 10 * CHOICES, "{chosen_at_all}");
        }
    }
}
