//! Light sampling for paths: chooses one lamp in proportion to its unoccluded light at a surface point, and
//! one point on the emissive triangles, of which `emitter_tree` chooses one. Visibility is not tested here.
//! Where there are many lamps, `light_tree` first selects the few that are weighed one by one.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use lumbre_optics::{LightKind, LightSample, evaluate_light};
use lumbre_scene::EmissiveLight;

use crate::emitter_tree::{EmitterBounds, EmitterTree};
use crate::light_tree::LightTree;
use crate::lobe_sampling::within_cone;
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
    /// Selects a few lamps where there are more than [`FEW_LAMPS`].
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
}

/// A point on an emissive triangle, sampled for a surface point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterSample {
    /// The object that the triangle belongs to.
    pub object: usize,
    /// Radiance towards the surface.
    pub radiance: DVec3,
    /// Unit vector towards the light.
    pub direction: DVec3,
    pub distance: f64,
    /// Probability density per steradian.
    pub density: f64,
    /// Unit normal of the emissive triangle and its largest coordinate, to which rounding errors are relative.
    pub surface: (DVec3, f64),
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
/// Upper bound of the sine of the half angle that a spherical lamp fills.
const LARGEST_SINE: f64 = 0.99;

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
        let lamps = (0..scene.lights.len()).collect();
        let tree = (scene.lights.len() > FEW_LAMPS).then(|| LightTree::new(scene));
        Self { emitters, emitter_tree, emitter_of, lamps, tree }
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
            Some(tree) => tree.few(scene, point.position, point.normal, choice)?,
            None => (&self.lamps[..], 1.0, choice),
        };
        let mut weights = smallvec::SmallVec::<[(usize, LightSample, f64); 32]>::new();
        let mut total = 0.0;
        for &number in asked {
            let placed = &scene.lights[number];
            let light = &placed.light;
            if light.kind == LightKind::Ambient {
                continue;
            }
            let sample = evaluate_light(light, placed.position, placed.axis, point.position);
            let sized = match light.kind {
                LightKind::Point => light.radius > 0.0,
                LightKind::Directional | LightKind::Ambient => light.angle > 0.0,
            };
            let cosine = point.normal.dot(sample.direction).max(if sized { SIZED_FLOOR } else { 0.0 });
            let color = luminance(sample.diffuse) + luminance(sample.specular);
            let weight = color * sample.attenuation * sample.spot * cosine;
            if weight > 0.0 && weight.is_finite() {
                total += weight;
                weights.push((number, sample, weight));
            }
        }
        let mut left = choice * total;
        let last = weights.len().checked_sub(1)?;
        let (number, sample, weight) = weights.into_iter().enumerate().find_map(|(place, found)| {
            left -= found.2;
            (left < 0.0 || place == last).then_some(found)
        })?;
        let placed = &scene.lights[number];
        let (light, distance) = match placed.light.kind {
            LightKind::Point => {
                let distance = placed.position.distance(point.position);
                on_sphere_lamp(sample, f64::from(placed.light.radius), distance, numbers)
            }
            LightKind::Directional | LightKind::Ambient => {
                let half = 0.5 * f64::from(placed.light.angle);
                (on_disc_of_sky(sample, half, numbers), f64::INFINITY)
            }
        };
        Some(LampSample { number, light, chance: of_asked * weight / total, distance })
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
            object: emitter.object,
            radiance,
            direction,
            distance,
            density,
            surface: (emitter.normal, extent),
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

/// Samples a spherical lamp of uniform radiance: a direction within the cone that it fills, weighted so that
/// the mean over all directions is the light of a lamp at its centre. The distance returned ends on the
/// sphere.
fn on_sphere_lamp(sample: LightSample, radius: f64, distance: f64, numbers: DVec2) -> (LightSample, f64) {
    let sine = (radius / distance.max(f64::MIN_POSITIVE)).clamp(0.0, LARGEST_SINE);
    if sine == 0.0 {
        return (sample, distance);
    }
    let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
    let direction = within_cone(sample.direction, cosine, numbers);
    let along = direction.dot(sample.direction);
    let inner = (radius * radius - distance * distance * (1.0 - along) * (1.0 + along)).max(0.0).sqrt();
    let reach = (distance * along - inner).max(0.0);
    (spread(sample, direction, cosine), reach)
}

/// Samples a distant light that is a disc on the sky.
fn on_disc_of_sky(sample: LightSample, half_angle: f64, numbers: DVec2) -> LightSample {
    if half_angle <= 0.0 {
        return sample;
    }
    let cosine = half_angle.min(0.5 * PI).cos();
    spread(sample, within_cone(sample.direction, cosine, numbers), cosine)
}

/// Makes up for the cosine: its mean over a cone is (1 + cos)/2 times that of the cone's axis.
fn spread(sample: LightSample, direction: DVec3, cosine: f64) -> LightSample {
    LightSample { direction, attenuation: sample.attenuation * 2.0 / (1.0 + cosine), ..sample }
}
