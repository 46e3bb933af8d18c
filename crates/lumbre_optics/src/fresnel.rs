//! Fresnel reflectance for unpolarized light: exact for dielectrics and conductors, and Schlick's approximation.
//! The direction of the transmitted light is in `snell`.

use glam::DVec3;

/// Avoids 0/0 where cosines are divided; its square is still an f32.
const TINY_COSINE: f64 = 1e-15;
/// Avoids 0/0 where squared cosines are divided.
const TINY: f64 = 1e-30;
/// Optical constants are clamped to this. It is above any measured constant, and its fourth power is still an f32.
pub(crate) const LARGEST_CONSTANT: f64 = 1e4;
/// Smallest relative index of refraction. It keeps f32 from dividing by a square that underflows.
const SMALLEST_INDEX: f64 = 1e-4;

/// Returns the fraction of the light that a smooth dielectric reflects, in [0, 1].
///
/// `cos_incident` is n·l on the side that the light comes from, clamped to [0, 1]; `eta` = η_t/η_i is the index
/// behind the surface over the index in front. The result is 1 under total internal reflection (sin θ_i > eta) and
/// at 90 degrees, 0 for `eta` = 1, and ((eta - 1)/(eta + 1))² at normal incidence.
///
/// # Error of the f32 twin
///
/// Each amplitude (x - g)/(x + g), with x = cos θ_i or eta² cos θ_i, is off by 2 (g δx + x δg)/(x + g)² and 7 u of
/// itself; F is off by the amplitudes times their errors, half of the squared errors, and 2 u. g² is off by u (3
/// |eta² - 1| + cos² + g²), g by the root of that and 9 u, eta² cos by 3 u. That is about 10 u away from the
/// critical angle. At the critical angle g may have any value up to 3·10⁻⁴, so F is off by up to .01: a cosine
/// rounded to f32 determines it no better.
pub fn fresnel_dielectric(cos_incident: f64, eta: f64) -> f64 {
    let cosine = cos_incident.clamp(0.0, 1.0);
    let index = eta.clamp(SMALLEST_INDEX, LARGEST_CONSTANT);
    // g = eta cos θ_t and g² = eta² - sin² θ_i, computed from the cosine so that for eta = 1 it equals the cosine.
    let g_squared = (index - 1.0) * (index + 1.0) + cosine * cosine;
    if g_squared < 0.0 {
        return 1.0;
    }
    let g = g_squared.sqrt();
    let across = (cosine - g) / (cosine + g).max(TINY_COSINE);
    let along = (index * index * cosine - g) / (index * index * cosine + g).max(TINY_COSINE);
    0.5 * (across * across + along * along)
}

/// Returns [`fresnel_dielectric`], or `None` for a cosine outside [0, 1] or an index outside [10⁻⁴, 10⁴], which
/// that function clamps.
pub fn try_fresnel_dielectric(cos_incident: f64, eta: f64) -> Option<f64> {
    let usable = (0.0..=1.0).contains(&cos_incident) && (SMALLEST_INDEX..=LARGEST_CONSTANT).contains(&eta);
    usable.then(|| fresnel_dielectric(cos_incident, eta))
}

/// Returns the fraction of the light that a conductor in vacuum or air reflects, per channel, in [0, 1].
///
/// `eta` and `absorption` are the real and imaginary parts of its index of refraction. With no absorption and
/// eta ≥ 1 it equals [`fresnel_dielectric`].
///
/// # Error of the f32 twin
///
/// The real part η² - k² - sin² is off by 3 u of each term, its modulus by that and 11 u, the larger of a and b by
/// half of that and 9 u, the smaller by 7 u more. Each quotient of sums of squares is off by the errors of its
/// terms, twice, and 5 u. That is about 20 u for metals. With neither absorption nor a step in the index (η = 1, k
/// = 0) at exactly 90 degrees all terms vanish, and the reflectance may be anything in [0, 1].
pub fn fresnel_conductor(cos_incident: f64, eta: DVec3, absorption: DVec3) -> DVec3 {
    let channel = |eta: f64, absorption: f64| {
        let cosine = cos_incident.clamp(0.0, 1.0);
        let eta = eta.clamp(0.0, LARGEST_CONSTANT);
        let absorption = absorption.clamp(0.0, LARGEST_CONSTANT);
        let sine_squared = (1.0 - cosine) * (1.0 + cosine);
        // a + ib = sqrt((eta + ik)² - sin²). The smaller of a and b comes from a b = eta k, which avoids
        // cancellation.
        let real = (eta - absorption) * (eta + absorption) - sine_squared;
        let modulus = (real * real + 4.0 * eta * eta * absorption * absorption).sqrt();
        let larger = (0.5 * (modulus + real.abs())).sqrt();
        let smaller = eta * absorption / larger.max(TINY);
        let (a, b) = if real > 0.0 { (larger, smaller) } else { (smaller, larger) };
        let square = |x: f64| x * x;
        let across = (square(cosine - a) + b * b) / (square(cosine + a) + b * b).max(TINY);
        let along = (square(cosine * a - sine_squared) + square(cosine * b))
            / (square(cosine * a + sine_squared) + square(cosine * b)).max(TINY);
        0.5 * across * (1.0 + along)
    };
    DVec3::new(channel(eta.x, absorption.x), channel(eta.y, absorption.y), channel(eta.z, absorption.z))
}

/// Returns [`fresnel_conductor`], or `None` for a cosine outside [0, 1]; for constants outside [0, 10⁴], which that
/// function clamps; for an index of 0 (neither part is positive); and where there is no boundary at all (η = 1, k =
/// 0) at exactly 90 degrees.
pub fn try_fresnel_conductor(cos_incident: f64, eta: DVec3, absorption: DVec3) -> Option<DVec3> {
    let usable = |channel: usize| {
        let (eta, absorption) = (eta[channel], absorption[channel]);
        let constants = 0.0..=LARGEST_CONSTANT;
        constants.contains(&eta)
            && constants.contains(&absorption)
            && (eta > 0.0 || absorption > 0.0)
            && !(cos_incident == 0.0 && eta == 1.0 && absorption == 0.0)
    };
    let defined = (0.0..=1.0).contains(&cos_incident) && (0..3).all(usable);
    defined.then(|| fresnel_conductor(cos_incident, eta, absorption))
}

/// Schlick's approximation: f0 + (1 - f0)(1 - cos θ)⁵, with f0 the reflectance at normal incidence.
///
/// Off by at most .036 at eta = 1.5 and .198 for chromium. For light leaving the denser side, pass cos θ_t in place
/// of cos θ_i; otherwise it is off by up to .96.
///
/// # Error of the f32 twin
///
/// 10 u (1 - f0)(1 - cos)⁵ and u of the sum: the difference's u enters five times, then three products and two
/// more.
pub fn fresnel_schlick(cos_incident: f64, f0: DVec3) -> DVec3 {
    let away = 1.0 - cos_incident.clamp(0.0, 1.0);
    let squared = away * away;
    f0 + (DVec3::ONE - f0) * (squared * squared * away)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_and_grazing() {
        assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-16);
        assert_eq!(fresnel_dielectric(0.0, 1.5), 1.0);
        assert_eq!(fresnel_dielectric(0.0, 2.0 / 3.0), 1.0);
    }

    #[test]
    fn no_boundary_reflects_nothing() {
        for cosine in [0.0, 1e-9, 0.3, 1.0] {
            assert!(fresnel_dielectric(cosine, 1.0) < 1e-15, "{cosine}");
        }
    }

    #[test]
    fn at_brewsters_angle_only_the_crossing_part_is_left() {
        // tan θ = η: r_p = 0, r_s = (1 - η²)/(1 + η²).
        let eta: f64 = 1.5;
        let expected = 0.5 * ((1.0 - eta * eta) / (1.0 + eta * eta)).powi(2);
        assert!((fresnel_dielectric(eta.atan().cos(), eta) - expected).abs() < 1e-15);
    }

    #[test]
    fn both_sides_of_the_critical_angle() {
        let eta: f64 = 2.0 / 3.0;
        let critical = eta.asin();
        assert_eq!(fresnel_dielectric((critical + 1e-9).cos(), eta), 1.0);
        // Just inside, g² = 2 eta cos θ δ. Each amplitude is (1 - x)/(1 + x), and its square 1 - 4 x + 8 x² - 12 x³
        // + ….
        let inside = fresnel_dielectric((critical - 1e-9).cos(), eta);
        let (cosine, g) = (critical.cos(), (2.0 * eta * critical.cos() * 1e-9).sqrt());
        let (across, along) = (g / cosine, g / (eta * eta * cosine));
        let expected = 1.0 - 2.0 * (across + along) + 4.0 * (across * across + along * along);
        // x is 10⁻⁴, so the next term is 10⁻¹¹. δ itself is known to 10⁻¹⁶/10⁻⁹, an error that g turns into about
        // as much.
        assert!((inside - expected).abs() < 1e-10, "{inside} {expected}");
    }

    #[test]
    fn the_same_light_back_reflects_the_same() {
        // F(θ_i, eta) = F(θ_t, 1/eta).
        let eta = 1.7;
        for degrees in [5.0, 30.0, 60.0, 85.0] {
            let incident = f64::to_radians(degrees);
            let transmitted = (incident.sin() / eta).asin();
            let there = fresnel_dielectric(incident.cos(), eta);
            assert!((there - fresnel_dielectric(transmitted.cos(), 1.0 / eta)).abs() < 1e-14);
        }
    }

    #[test]
    fn a_conductor_without_absorption_is_a_dielectric() {
        for cosine in [0.0, 0.01, 0.5, 0.9, 1.0] {
            let conductor = fresnel_conductor(cosine, DVec3::new(1.1, 1.5, 3.0), DVec3::ZERO);
            for (channel, eta) in [1.1, 1.5, 3.0].into_iter().enumerate() {
                assert!((conductor[channel] - fresnel_dielectric(cosine, eta)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_conductor_at_normal_incidence_and_grazing() {
        // ((η-1)² + k²)/((η+1)² + k²), chromium at 650 nm: η = 3.11, k = 3.31.
        let expected = (2.11f64.powi(2) + 3.31f64.powi(2)) / (4.11f64.powi(2) + 3.31f64.powi(2));
        let (eta, absorption) = (DVec3::splat(3.11), DVec3::splat(3.31));
        assert!((fresnel_conductor(1.0, eta, absorption).x - expected).abs() < 1e-15);
        assert!((fresnel_conductor(0.0, eta, absorption).x - 1.0).abs() < 1e-15);
    }

    #[test]
    fn constants_that_are_none_have_no_reflectance() {
        assert_eq!(try_fresnel_dielectric(0.5, 1.5), Some(fresnel_dielectric(0.5, 1.5)));
        for (cosine, eta) in [(-0.1, 1.5), (1.1, 1.5), (0.5, 0.0), (0.5, -1.5), (0.5, 2e4), (0.5, f64::NAN)] {
            assert_eq!(try_fresnel_dielectric(cosine, eta), None, "{cosine} {eta}");
        }
        let conductor = |cosine, eta, absorption| {
            try_fresnel_conductor(cosine, DVec3::new(0.2, eta, 1.4), DVec3::new(3.0, absorption, 2.0))
        };
        assert!(conductor(0.5, 0.0, 2.0).is_some() && conductor(0.5, 1.5, 0.0).is_some());
        let bad = [
            (1.5, 1.0, 1.0),
            (0.5, 0.0, 0.0),
            (0.5, -0.1, 1.0),
            (0.5, 1.0, -0.1),
            (0.5, f64::NAN, 1.0),
            (0.5, 1.0, f64::INFINITY),
            (0.0, 1.0, 0.0),
        ];
        for (cosine, eta, absorption) in bad {
            assert_eq!(conductor(cosine, eta, absorption), None, "{cosine} {eta} {absorption}");
        }
    }

    #[test]
    fn schlick_is_off_by_at_most_what_is_known() {
        let worst = (0..=1000)
            .map(|step| f64::from(step) / 1000.0)
            .map(|c| (fresnel_schlick(c, DVec3::splat(0.04)).x - fresnel_dielectric(c, 1.5)).abs())
            .fold(0.0, f64::max);
        // .036 is published to two digits.
        assert!((worst - 0.036).abs() < 0.0005, "{worst}");
    }

    #[test]
    fn every_input_gives_a_fraction() {
        let hard = [f64::MIN, -1.0, 0.0, 1e-300, 0.5, 1.0, 1.0 + 1e-9, 1e300, f64::MAX];
        for cosine in hard {
            for eta in hard {
                let dielectric = fresnel_dielectric(cosine, eta);
                assert!((0.0..=1.0 + 1e-15).contains(&dielectric), "{cosine} {eta}: {dielectric}");
                for absorption in hard {
                    let f = fresnel_conductor(cosine, DVec3::splat(eta), DVec3::splat(absorption)).x;
                    assert!((0.0..=1.0 + 1e-15).contains(&f), "{cosine} {eta} {absorption}: {f}");
                }
            }
        }
    }
}
