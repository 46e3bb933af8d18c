//! Unoccluded light that a point, spot or directional light sends to a point. Shadows are in `punctual`.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lumbre_optics::{Light, LightKind, evaluate_light};

use crate::scene::Receiver;
use crate::scene::{BakeScene, PlacedLight};
use crate::visibility::solid_angle::of_parallelogram;

/// Light that arrives at a point from a light, ignoring occlusion.
pub(crate) struct PunctualIrradiance {
    /// Unit vector towards the light's centre.
    pub axis: DVec3,
    /// Distance in metres; infinite for directional lights.
    pub distance: f64,
    /// Irradiance on a surface perpendicular to the axis, per unit of the light's colour.
    pub strength: f64,
}

/// The light that arrives at a canonical position; `None` if there is none.
pub(crate) fn punctual_irradiance(
    scene: &BakeScene,
    placed: &PlacedLight,
    position: Vec3,
) -> Option<PunctualIrradiance> {
    let light = &placed.light;
    let position = scene.space.world(position);
    let arriving = evaluate_light(light, placed.position, placed.axis, position);
    let is_directional = light.kind == LightKind::Directional;
    let distance = if is_directional { f64::INFINITY } else { placed.position.distance(position) };
    let attenuation = if is_directional { arriving.attenuation } else { attenuation(light, distance) };
    let strength = PI * attenuation * arriving.spot;
    (strength > 0.0).then_some(PunctualIrradiance { axis: arriving.direction, distance, strength })
}

/// Unoccluded irradiance by the centre of a light, per unit of the light's colour.
pub(crate) fn center_irradiance(scene: &BakeScene, placed: &PlacedLight, receiver: &Receiver) -> f32 {
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

/// Distance from a parallelogram's middle up to which a light counts as near, relative to the parallelogram's side. For
/// lights further away, a few points give the mean to 0.02 %.
const NEAR: f64 = 4.0;

/// Largest distance from the light to a corner, relative to the light's range; up to here the attenuation window is
/// above 0.998.
const WELL_IN_RANGE: f64 = 0.2;

/// Mean unoccluded irradiance over a parallelogram by a near light without size, per unit of the light's colour. With
/// inverse-square attenuation, the flux through a surface is proportional to its solid angle, however close the light
/// is. The attenuation window and the cosine of a smooth normal are taken at the point nearest to the light, which
/// receives most of the light. `None` for other attenuations, for spot lights, if the range ends not far beyond, and if
/// the light is not near. `corners` are in order around the parallelogram, in canonical units.
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
    // The foot of the perpendicular from the light, or the parallelogram's point nearest to it.
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

/// A light's attenuation at a distance in metres, without the renderer's lower bound of a centimetre on the distance,
/// so that a model of a few centimetres is lit like one of metres. The bound applies only where the result would not be
/// finite.
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
