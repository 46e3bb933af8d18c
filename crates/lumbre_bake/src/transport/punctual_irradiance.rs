//! What a point, spot or directional light sends to a point, whatever lies between. Not its shadows: those are `punctual`'s.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lumbre_optics::{Light, LightKind, evaluate_light};

use super::direct::Receiver;
use crate::scene::{BakeScene, PlacedLight};

/// What arrives at a point from a light, whatever lies between.
pub(super) struct PunctualIrradiance {
    /// Towards its centre.
    pub axis: DVec3,
    /// Metres; infinite for directional lights.
    pub distance: f64,
    /// Irradiance across the axis, per unit of its colour.
    pub strength: f64,
}

/// `None` where nothing arrives.
pub(super) fn punctual_irradiance(
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
pub(super) fn of_center(scene: &BakeScene, placed: &PlacedLight, receiver: &Receiver) -> f32 {
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

/// A light's factor at a distance in metres, without the floor that a frame sets at a centimetre: a model of a few centimetres has the
/// light of one of metres. At the light itself the floor counts.
pub(super) fn attenuation(light: &Light, distance: f64) -> f64 {
    let law = &light.attenuation;
    let [constant, linear, quadratic] = law.coefficients().as_dvec3().to_array();
    let factor = 1.0 / (constant + (linear + quadratic * distance) * distance);
    if !(factor > 0.0 && factor.is_finite() && law.range > 0.0) {
        return law.factor(distance);
    }
    let window = (1.0 - (distance / f64::from(law.range)).min(1.0).powi(4)).max(0.0);
    window * if law.clamp { factor.min(1.0) } else { factor }
}
