//! The cone of directions in which a lamp with a size is visible from a point: a sphere of uniform radiance for a
//! point light with a radius, and a disc on the sky for a directional light with an angle. Paths sample it, and
//! find lamps by it along rays that the lobes of a surface have sampled. Lamps without a size fill no cone.
//!
//! The unoccluded light of a lamp with a size is that of its centre, so that its radiance over the cone is
//! D f_att/sin² of the cone's half angle, whatever its attenuation. With the inverse square of the distance that
//! is D over the square of the radius, from everywhere.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};
use lumbre_optics::{LightKind, LightSample};

use crate::lobe_sampling::within_cone;
use crate::scene::PlacedLight;

/// A lamp with a size, seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampCone {
    /// Unit vector to the lamp's centre.
    axis: DVec3,
    /// Of half of the opening angle.
    sine: f64,
    cosine: f64,
    /// Metres to the lamp's centre, and its radius; `None` for distant lights.
    sphere: Option<(f64, f64)>,
}

/// Upper bound of the sine of the half angle that a spherical lamp fills. Nearer points see a smaller lamp.
const LARGEST_SINE: f64 = 0.99;

impl LampCone {
    /// Returns the cone of a lamp at a point; `None` if it has no size.
    pub fn new(lamp: &PlacedLight, point: DVec3) -> Option<Self> {
        match lamp.light.kind {
            LightKind::Point => {
                let radius = f64::from(lamp.light.radius);
                let to = lamp.position - point;
                let distance = to.length();
                let sine = (radius / distance.max(f64::MIN_POSITIVE)).clamp(0.0, LARGEST_SINE);
                let axis = to.normalize_or_zero();
                (sine > 0.0).then(|| Self::with_sine(axis, sine, Some((distance, radius))))
            }
            LightKind::Directional => {
                let half = (0.5 * f64::from(lamp.light.angle)).min(FRAC_PI_2);
                (half > 0.0).then(|| Self::with_sine(-lamp.axis, half.sin(), None))
            }
            LightKind::Ambient => None,
        }
    }

    fn with_sine(axis: DVec3, sine: f64, sphere: Option<(f64, f64)>) -> Self {
        Self { axis, sine, cosine: ((1.0 - sine) * (1.0 + sine)).sqrt(), sphere }
    }

    /// Samples a direction uniformly over the solid angle, by two numbers in [0, 1).
    pub fn sample(&self, numbers: DVec2) -> DVec3 {
        within_cone(self.axis, self.cosine, numbers)
    }

    /// Returns true if a unit vector points to the lamp.
    pub fn holds(&self, direction: DVec3) -> bool {
        // For narrow cones the cosine has too few digits.
        let along = self.axis.dot(direction);
        along > 0.0 && (direction - self.axis * along).length() <= self.sine
    }

    /// Returns the solid angle of the cone, sr.
    pub fn solid_angle(&self) -> f64 {
        // 2π (1 - cos), without cancellation.
        TAU * self.sine * self.sine / (1.0 + self.cosine)
    }

    /// Returns the metres to the lamp's surface in a direction of the cone; infinite for distant lights.
    pub fn reach(&self, direction: DVec3) -> f64 {
        let Some((distance, radius)) = self.sphere else { return f64::INFINITY };
        let along = direction.dot(self.axis);
        let inner = (radius * radius - distance * distance * (1.0 - along) * (1.0 + along)).max(0.0).sqrt();
        (distance * along - inner).max(0.0)
    }

    /// Returns the light from one direction of the cone, whose mean over all directions lights a surface that
    /// faces the lamp as much as its centre does. `sample` is the light of the centre.
    pub fn spread(&self, sample: LightSample, direction: DVec3) -> LightSample {
        // The mean of the cosine over a cone is (1 + cos)/2 times that of its axis.
        LightSample { direction, attenuation: sample.attenuation * 2.0 / (1.0 + self.cosine), ..sample }
    }

    /// Returns the radiance from any direction of the cone over D f_att, the radiance that a white matt surface
    /// reflects which faces the lamp's centre.
    pub fn concentration(&self) -> f64 {
        1.0 / (self.sine * self.sine)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use lumbre_optics::Light;

    use super::*;
    use crate::random::Numbers;

    fn lamps() -> [PlacedLight; 4] {
        let placed = |light: Light| PlacedLight {
            light,
            position: DVec3::new(0.3, 2.0, -0.4),
            axis: DVec3::new(-0.1, -1.0, 0.2).normalize(),
            name: "lamp".to_owned(),
            bulbs: Vec::new(),
        };
        let bulb = |radius: f32| placed(Light { radius, ..Light::point(glam::Vec3::ONE) });
        let sun = |angle: f32| placed(Light { angle, ..Light::directional(glam::Vec3::ONE) });
        [bulb(1e-5), bulb(1.5), sun(0.0093), sun(1.2)]
    }

    #[test]
    fn every_sample_is_in_the_cone_and_ends_on_the_lamp() {
        for lamp in lamps() {
            let cone = LampCone::new(&lamp, DVec3::ZERO).expect("it has a size");
            for number in 0..1000 {
                let direction = cone.sample(Numbers::new(3, 0, number).pair());
                let along = cone.axis.dot(direction);
                let aside = (direction - cone.axis * along).length();
                assert!(
                    cone.holds(direction) || aside < cone.sine * (1.0 + 1e-9),
                    "{aside} of {}",
                    cone.sine
                );
                if lamp.light.kind == LightKind::Point {
                    let end = direction * cone.reach(direction);
                    let off = end.distance(lamp.position) / f64::from(lamp.light.radius) - 1.0;
                    // By sines near 1 a ray grazes the sphere, within the rounding of the square root.
                    assert!(off.abs() < 1e-4, "{off}");
                }
                // Negative control: twice as far from the axis there is no lamp.
                let outside = cone.axis + 2.1 * cone.sine * cone.axis.any_orthonormal_vector();
                assert!(!cone.holds(outside.normalize()) || cone.sine > 0.4);
            }
        }
    }

    /// The light of both ways to find a lamp: that of sampled directions, as in next-event estimation, and the
    /// lamp's radiance integrated over its solid angle, as paths find it.
    #[test]
    fn both_ways_bring_the_light_of_the_centre() {
        for lamp in lamps() {
            let cone = LampCone::new(&lamp, DVec3::ZERO).expect("it has a size");
            let sample = LightSample { attenuation: 0.7, direction: cone.axis, ..LightSample::DARK };
            let (mut sampled, mut found) = (0.0, 0.0);
            let count = 1 << 12;
            for number in 0..count {
                let direction = cone.sample(Numbers::new(5, 0, number).pair());
                let cosine = direction.dot(cone.axis) / f64::from(count);
                sampled += cone.spread(sample, direction).attenuation * cosine;
                // A white matt surface reflects 1/π of the irradiance, which is the integral of the radiance times
                // the cosine.
                let radiance = sample.attenuation * cone.concentration();
                found += cone.solid_angle() * radiance * cosine / PI;
            }
            assert!((sampled / 0.7 - 1.0).abs() < 1e-3, "{sampled}");
            assert!((found / 0.7 - 1.0).abs() < 1e-3, "{found}");
        }
    }
}
