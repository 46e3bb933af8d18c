//! What a point, spot or directional light sends to a point, whatever lies between. Not its shadows: those are `punctual`'s.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lumbre_optics::{Light, LightKind, evaluate_light};

use crate::scene::Receiver;
use crate::scene::{BakeScene, PlacedLight};
use crate::visibility::solid_angle::of_parallelogram;

/// What arrives at a point from a light, whatever lies between.
pub(crate) struct PunctualIrradiance {
    /// Towards its centre.
    pub axis: DVec3,
    /// Metres; infinite for directional lights.
    pub distance: f64,
    /// Irradiance across the axis, per unit of its colour.
    pub strength: f64,
}

/// `None` where nothing arrives.
pub(crate) fn punctual_irradiance(
    scene: &BakeScene,
    placed: &PlacedLight,
    position: Vec3,
) -> Option<PunctualIrradiance> {
    let light = &placed.light;
    let position = scene.space.world(position);
    let arriving = evaluate_light(light, placed.position, placed.axis, position);
    let directional = light.kind == LightKind::Directional;
    let distance = if directional { f64::INFINITY } else { placed.position.distance(position) };
    let weakened = if directional { arriving.attenuation } else { attenuation(light, distance) };
    let strength = PI * weakened * arriving.spot;
    (strength > 0.0).then_some(PunctualIrradiance { axis: arriving.direction, distance, strength })
}

/// Irradiance by a light without size, per unit of its colour, whatever lies between.
pub(crate) fn of_center(scene: &BakeScene, placed: &PlacedLight, receiver: &Receiver) -> f32 {
    let Some(PunctualIrradiance { axis, strength, .. }) =
        punctual_irradiance(scene, placed, receiver.position)
    else {
        return 0.0;
    };
    if axis.dot(receiver.geometric_normal.as_dvec3()) <= 0.0 {
        return 0.0;
    }
    let light = (strength * axis.dot(receiver.normal.as_dvec3()).max(0.0)) as f32;
    if light.is_finite() { light } else { 0.0 }
}

/// Of the side of a parallelogram, how far a light may be from its middle to count as near: beyond, a few points tell the mean to 0.02 %.
const NEAR: f64 = 4.0;

/// Of a light's range, how far all of it may be from the light: there the window is above 0.998.
const WELL_IN_RANGE: f64 = 0.2;

/// The mean over a parallelogram (its corners one after the other, canonical units) of a near light without size, per unit of its colour, whatever
/// lies between: what a law of inverse squares sends through a surface is its solid angle, however close the light is. The window of a
/// range and what a smooth normal differs by are those of the point nearest to the light, where most of it falls. `None` for other laws, for
/// cones, for ranges that end not far beyond, and for lights that are not near.
pub(crate) fn over_parallelogram(
    scene: &BakeScene,
    placed: &PlacedLight,
    corners: &[DVec3; 4],
    middle: &Receiver,
) -> Option<f32> {
    let (light, law) = (&placed.light, &placed.light.attenuation);
    let is_inverse_square = law.constant == 0.0 && law.linear == 0.0 && !law.clamp;
    if light.kind != LightKind::Point || light.spot.is_some() || !is_inverse_square {
        return None;
    }
    let eye = scene.space.place(placed.position);
    let [a, right, _, up] = corners.map(|corner| corner - eye);
    let (along, across) = (right - a, up - a);
    let area = along.cross(across).length();
    let to_middle = a + 0.5 * (along + across);
    if area == 0.0 || to_middle.length_squared() > NEAR * NEAR * area {
        return None;
    }
    let farthest = corners.map(|corner| (corner - eye).length()).into_iter().fold(0.0, f64::max);
    if farthest > WELL_IN_RANGE * f64::from(law.range) * scene.space.scale {
        return None;
    }
    // The light's foot, or the nearest to it that there is.
    let [u, v] =
        [along, across].map(|edge| (0.5 - to_middle.dot(edge) / edge.length_squared()).clamp(0.0, 1.0));
    let nearest = Receiver { position: (corners[0] + along * u + across * v).as_vec3(), ..*middle };
    let PunctualIrradiance { axis, distance, strength } =
        punctual_irradiance(scene, placed, nearest.position)?;
    let [cosine, facet] =
        [nearest.normal, nearest.geometric_normal].map(|normal| axis.dot(normal.as_dvec3()));
    if facet <= 0.0 {
        return None;
    }
    let intensity = strength * distance * distance;
    let solid_angle = of_parallelogram(corners.map(|corner| corner - eye));
    let mean = intensity * solid_angle * scene.space.scale.powi(2) / area * (cosine.max(0.0) / facet);
    let mean = mean as f32;
    mean.is_finite().then_some(mean)
}

/// A light's factor at a distance in metres, without the floor that a frame sets at a centimetre: a model of a few centimetres has the
/// light of one of metres. At the light itself the floor counts.
pub(crate) fn attenuation(light: &Light, distance: f64) -> f64 {
    let law = &light.attenuation;
    let [constant, linear, quadratic] = law.coefficients().as_dvec3().to_array();
    let factor = 1.0 / (constant + (linear + quadratic * distance) * distance);
    if !(factor > 0.0 && factor.is_finite() && law.range > 0.0) {
        return law.factor(distance);
    }
    let window = (1.0 - (distance / f64::from(law.range)).min(1.0).powi(4)).max(0.0);
    window * if law.clamp { factor.min(1.0) } else { factor }
}
