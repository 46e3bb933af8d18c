//! Importance sampling of a surface's lobes: a cosine distribution for the diffuse part, Phong's about the
//! mirrored viewing direction, and Blinn's and the microfacets' by half vectors about the normal; with the
//! density of every direction. The reflectance comes from `lumbre_optics`, whichever strategy sampled the
//! direction.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use lumbre_optics::{
    Contribution, Distribution, LightSample, Lobe, ReflectionModel, SurfaceSample, light_contribution,
    model_exponent, reflected_direction,
};

/// The lobes of a surface for one viewing direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobes {
    model: ReflectionModel,
    surface: SurfaceSample,
    normal: DVec3,
    viewer: DVec3,
    /// Probability of sampling the specular lobe.
    specular: f64,
    shape: Shape,
}

/// The distribution from which the specular lobe is sampled.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// cosⁿ about the mirrored viewing direction.
    Mirrored { exponent: f64 },
    /// cosⁿ⁺¹ of the half vector about the normal.
    HalfVector { exponent: f64 },
    /// Trowbridge and Reitz's distribution (GGX) of the half vector.
    LongTail { alpha_squared: f64 },
}

/// Least probability of a lobe that exists: where the density of one is low, the other may still reflect
/// much.
const MIN_CHANCE: f64 = 0.1;

impl Lobes {
    pub fn new(model: ReflectionModel, surface: &SurfaceSample, normal: DVec3, viewer: DVec3) -> Self {
        let n = surface.shininess;
        let exponent = model_exponent(model, surface.lobe, n);
        let conserves_energy = surface.lobe == Lobe::EnergyConserving;
        let shape = match model {
            ReflectionModel::Phong => Shape::Mirrored { exponent },
            ReflectionModel::Blinn => Shape::HalfVector { exponent: n },
            ReflectionModel::Blinn4n | ReflectionModel::BlinnMatched if conserves_energy => {
                Shape::HalfVector { exponent: n }
            }
            ReflectionModel::Blinn4n | ReflectionModel::BlinnMatched => {
                Shape::HalfVector { exponent: 4.0 * n }
            }
            ReflectionModel::TorranceSparrow
                if conserves_energy || surface.distribution == Distribution::TrowbridgeReitz =>
            {
                Shape::LongTail { alpha_squared: 2.0 / (n + 2.0) }
            }
            ReflectionModel::TorranceSparrow => Shape::HalfVector { exponent: n },
        };
        let diffuse = surface.diffuse.element_sum();
        let share = if conserves_energy { 1.0 } else { 2.0 / (n + 2.0) };
        let shiny = surface.specular.element_sum() * share;
        let specular = match (diffuse > 0.0, surface.specular != DVec3::ZERO) {
            (_, false) => 0.0,
            (false, true) => 1.0 - MIN_CHANCE,
            (true, true) => (shiny / (diffuse + shiny)).clamp(MIN_CHANCE, 1.0 - MIN_CHANCE),
        };
        Self { model, surface: *surface, normal, viewer, specular, shape }
    }

    /// Returns true if no direction reflects anything.
    pub fn are_black(&self) -> bool {
        self.surface.diffuse == DVec3::ZERO && self.surface.specular == DVec3::ZERO
    }

    /// Returns roughly how much light the lobes reflect, for choosing between them and mirrored or
    /// transmitted rays.
    pub fn albedo(&self) -> f64 {
        let share = match self.surface.lobe {
            Lobe::EnergyConserving => 1.0,
            Lobe::Bare => 2.0 / (self.surface.shininess + 2.0),
        };
        (self.surface.diffuse + self.surface.specular * share).element_sum() / 3.0
    }

    /// Samples a direction, by numbers in [0, 1). It may point below the surface.
    pub fn direction(&self, choice: f64, numbers: DVec2) -> DVec3 {
        if choice >= self.specular {
            return around(self.normal, power_of_cosine(numbers, 1.0));
        }
        match self.shape {
            Shape::Mirrored { exponent } => {
                around(reflected_direction(self.normal, self.viewer), power_of_cosine(numbers, exponent))
            }
            Shape::HalfVector { exponent } => {
                let half = around(self.normal, power_of_cosine(numbers, exponent + 1.0));
                reflected_direction(half, self.viewer)
            }
            Shape::LongTail { alpha_squared } => {
                let squared = (1.0 - numbers.x) / (1.0 + (alpha_squared - 1.0) * numbers.x);
                let cosine = squared.clamp(0.0, 1.0).sqrt();
                reflected_direction(around(self.normal, on_sphere(cosine, numbers.y)), self.viewer)
            }
        }
    }

    /// Returns the density with which [`direction`](Self::direction) samples a direction, per steradian.
    pub fn density(&self, direction: DVec3) -> f64 {
        let diffuse = self.normal.dot(direction).max(0.0) / PI;
        if self.specular == 0.0 {
            return diffuse;
        }
        let specular = match self.shape {
            Shape::Mirrored { exponent } => {
                let mirrored = reflected_direction(self.normal, self.viewer);
                density_of_power(mirrored.dot(direction), exponent)
            }
            Shape::HalfVector { exponent } => {
                self.of_half_vector(direction, |cosine| density_of_power(cosine, exponent + 1.0))
            }
            Shape::LongTail { alpha_squared } => self.of_half_vector(direction, |cosine| {
                let root = cosine * cosine * (alpha_squared - 1.0) + 1.0;
                alpha_squared * cosine.max(0.0) / (PI * root * root)
            }),
        };
        self.specular * specular + (1.0 - self.specular) * diffuse
    }

    fn of_half_vector(&self, direction: DVec3, density: impl Fn(f64) -> f64) -> f64 {
        let sum = direction + self.viewer;
        let length = sum.length();
        let half = if length > 0.0 { sum / length } else { return 0.0 };
        let half = if half.dot(self.normal) < 0.0 { -half } else { half };
        // v·h = |l + v|/2.
        density(half.dot(self.normal)) / (4.0 * (0.5 * length).max(1e-12))
    }

    /// Returns the bidirectional reflectance times the cosine, linear RGB, 1/sr: the lighting equation for a
    /// light of unit irradiance.
    pub fn reflectance(&self, direction: DVec3) -> DVec3 {
        let [diffuse, specular] = self.reflectances(direction);
        diffuse + specular
    }

    /// Returns the parts of the [`reflectance`](Self::reflectance) by the diffuse and by the specular lobe.
    pub fn reflectances(&self, direction: DVec3) -> [DVec3; 2] {
        let light = LightSample {
            diffuse: DVec3::splat(1.0 / PI),
            specular: DVec3::splat(1.0 / PI),
            direction,
            attenuation: 1.0,
            spot: 1.0,
            ..LightSample::DARK
        };
        let Contribution { diffuse, specular, .. } =
            light_contribution(self.model, self.surface, &light, self.normal, self.viewer);
        [diffuse, specular]
    }

    /// Returns the diffuse and specular reflection of a light.
    pub fn reflected(&self, light: &LightSample) -> DVec3 {
        let Contribution { diffuse, specular, .. } =
            light_contribution(self.model, self.surface, light, self.normal, self.viewer);
        diffuse + specular
    }
}

/// Samples cosⁿ about +Z from two numbers in [0, 1).
fn power_of_cosine(numbers: DVec2, exponent: f64) -> DVec3 {
    on_sphere((1.0 - numbers.x).powf(1.0 / (exponent + 1.0)), numbers.y)
}

fn density_of_power(cosine: f64, exponent: f64) -> f64 {
    if cosine <= 0.0 { 0.0 } else { (exponent + 1.0) / TAU * cosine.powf(exponent) }
}

/// Returns the unit vector that has this cosine to +Z and this turn about it, in whole turns.
fn on_sphere(cosine: f64, turn: f64) -> DVec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    let (along_y, along_x) = (TAU * turn).sin_cos();
    DVec3::new(sine * along_x, sine * along_y, cosine)
}

/// Rotates a vector so that what was its +Z is an axis.
pub(crate) fn around(axis: DVec3, vector: DVec3) -> DVec3 {
    let (right, up) = axis.any_orthonormal_pair();
    (right * vector.x + up * vector.y + axis * vector.z).normalize_or(axis)
}

/// Samples a direction within a cone about an axis, uniformly.
pub(crate) fn within_cone(axis: DVec3, cosine: f64, numbers: DVec2) -> DVec3 {
    around(axis, on_sphere(1.0 - numbers.x * (1.0 - cosine), numbers.y))
}

#[cfg(test)]
mod tests {
    use lumbre_optics::Fresnel;

    use super::*;
    use crate::random::Numbers;

    fn every_lobe() -> Vec<Lobes> {
        let mut lobes = Vec::new();
        for &model in ReflectionModel::ALL {
            for lobe in [Lobe::Bare, Lobe::EnergyConserving] {
                let spread = model == ReflectionModel::TorranceSparrow && lobe == Lobe::Bare;
                for &distribution in if spread { Distribution::ALL } else { &Distribution::ALL[..1] } {
                    for shininess in [3.0, 40.0, 900.0] {
                        let surface = SurfaceSample {
                            ambient: DVec3::ZERO,
                            diffuse: DVec3::splat(0.3),
                            specular: DVec3::new(0.6, 0.5, 0.4),
                            shininess,
                            ior: 1.5,
                            lobe,
                            distribution,
                            fresnel: Fresnel::Dielectric,
                            peak: 1.0,
                        };
                        for tilt in [0.0, 0.7, 1.3] {
                            let viewer = DVec3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
                            lobes.push(Lobes::new(model, &surface, DVec3::Z, viewer));
                        }
                    }
                }
            }
        }
        lobes
    }

    #[test]
    fn densities_add_up_to_what_is_chosen() {
        for lobes in every_lobe() {
            // The integral of the density over the whole sphere is 1. Part of it may be below the horizon,
            // where half vectors reflect the viewing direction into the surface.
            let count = 100_000u32;
            let (mut whole, mut upper) = (0.0, 0.0);
            for index in 0..count {
                let mut numbers = Numbers::new(7, index >> 16, index & 0xffff);
                let pair = numbers.pair();
                // Half of the directions are uniform and half are sampled from the lobes, so that sharp lobes
                // are resolved; the balance heuristic combines them.
                let direction = if index % 2 == 0 {
                    on_sphere(1.0 - 2.0 * pair.x, pair.y)
                } else {
                    lobes.direction(numbers.next(), pair)
                };
                let density = lobes.density(direction);
                let part = density / (0.5 * density + 0.5 / (4.0 * PI)) / f64::from(count);
                whole += part;
                upper += if direction.z > 0.0 { part } else { 0.0 };
            }
            assert!((whole - 1.0).abs() < 0.01, "{lobes:?}: {whole}");
            assert!(upper <= whole);
        }
    }

    #[test]
    fn chosen_directions_estimate_the_integral_of_the_reflectance() {
        for lobes in every_lobe() {
            // The reference is a sum over a grid on the hemisphere, whose pole is the mirrored direction,
            // where the grid is finest.
            let count = 60_000u32;
            let mut sum = DVec3::ZERO;
            for index in 0..count {
                let mut numbers = Numbers::new(11, index >> 16, index & 0xffff);
                let (pair, choice) = (numbers.pair(), numbers.next());
                let direction = lobes.direction(choice, pair);
                let density = lobes.density(direction);
                if direction.z > 0.0 && density > 0.0 {
                    sum += lobes.reflectance(direction) / density;
                }
            }
            let found = sum / f64::from(count);
            let pole = reflected_direction(DVec3::Z, lobes.viewer);
            let (rows, columns) = (800, 160);
            let mut wanted = DVec3::ZERO;
            for row in 0..rows {
                // The fourth power concentrates the rows at the pole.
                let edge = |row: i32| 2.0 * (f64::from(row) / f64::from(rows)).powi(4);
                let (low, high) = (edge(row), edge(row + 1));
                for column in 0..columns {
                    let turn = (f64::from(column) + 0.5) / f64::from(columns);
                    let direction = around(pole, on_sphere(1.0 - 0.5 * (low + high), turn));
                    if direction.z > 0.0 {
                        wanted += lobes.reflectance(direction) * ((high - low) * TAU / f64::from(columns));
                    }
                }
            }
            let apart = ((found - wanted) / wanted).abs().max_element();
            assert!(apart < 0.02, "{lobes:?}: {found} for {wanted}");
        }
    }
}
