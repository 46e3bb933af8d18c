//! Atmospheric attenuation: OpenGL's three fogs and document \[M\]'s depth cueing.

use glam::{DVec3, Vec3};

/// How the weight of the lit colour falls with the distance z from the viewer, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FogMode {
    /// (end - z)/(end - start), clamped to [0, 1].
    Linear {
        /// Distance in metres where the fog begins.
        start: f32,
        /// Distance in metres where only fog is left.
        end: f32,
    },
    /// exp(-density z), z being the distance.
    Exponential {
        /// Density in 1/m.
        density: f32,
    },
    /// exp(-(density z)²), z being the distance.
    ExponentialSquared {
        /// Density in 1/m.
        density: f32,
    },
    /// Document \[M\]: `near_weight` nearer than `start`, `far_weight` beyond `end`, linear between.
    DepthCue {
        /// d_A in metres.
        start: f32,
        /// d_B in metres.
        end: f32,
        /// S_A in [0, 1].
        near_weight: f32,
        /// S_B in [0, 1].
        far_weight: f32,
    },
}

/// Fog: `weight * lit + (1 - weight) * color`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fog {
    /// How the weight falls with distance.
    pub mode: FogMode,
    /// Linear RGB of the fog.
    pub color: Vec3,
}

impl FogMode {
    /// The feature under which `shaders/optics/fog.wesl` compiles this mode.
    pub fn shader_feature(&self) -> &'static str {
        match self {
            Self::Linear { .. } => "FOG_LINEAR",
            Self::Exponential { .. } => "FOG_EXPONENTIAL",
            Self::ExponentialSquared { .. } => "FOG_EXPONENTIAL_SQUARED",
            Self::DepthCue { .. } => "FOG_DEPTH_CUE",
        }
    }

    /// The four parameters that [`fog_weight`]'s WGSL twin takes: (start, end, 0, 0), (density, 0, 0, 0), or
    /// (start, end, near weight, far weight).
    pub fn parameters(&self) -> [f32; 4] {
        match *self {
            Self::Linear { start, end } => [start, end, 0.0, 0.0],
            Self::Exponential { density } | Self::ExponentialSquared { density } => [density, 0.0, 0.0, 0.0],
            Self::DepthCue { start, end, near_weight, far_weight } => [start, end, near_weight, far_weight],
        }
    }
}

/// Larger distances are clamped to 10¹⁸ m, whose square is still an f32.
const MAXIMUM_DISTANCE: f64 = 1e18;
/// exp(-80) is 2·10⁻³⁵, still well above f32's denormals.
const LARGEST_EXPONENT: f64 = 80.0;

/// Fogs whose end is closer than this to their start, in metres, are a step: f32 cannot divide by numbers near its
/// denormals.
const SMALLEST_SPAN: f64 = 1e-30;

/// Returns how far `distance` is along the way from `start` to `end`, as a fraction from 0 to 1. If the two are
/// equal, the result is a step at `end`.
///
/// # Error of the f32 twin
///
/// 7 u relative: two differences of given numbers, each off by u however much cancels, and a division. A span
/// within 2 u of 10⁻³⁰ m may count as either side of that limit.
pub fn fog_fraction(start: f64, end: f64, distance: f64) -> f64 {
    let span = end - start;
    if span.abs() < SMALLEST_SPAN {
        return if distance < end { 0.0 } else { 1.0 };
    }
    ((distance - start) / span).clamp(0.0, 1.0)
}

/// OpenGL's linear fog: (end - z)/(end - start), clamped to [0, 1].
///
/// # Error of the f32 twin
///
/// 7 u of 1 - weight, plus u of the weight. The error is absolute, so just before the end, where little weight is
/// left, the relative error is larger.
pub fn fog_linear(start: f64, end: f64, distance: f64) -> f64 {
    1.0 - fog_fraction(start, end, distance.abs().min(MAXIMUM_DISTANCE))
}

/// OpenGL's exponential fog: exp(-density z).
///
/// # Error of the f32 twin
///
/// e^r - 1 of the weight, with r = 2 u x + 2 u (3 + 2 x) for x = density z: a product and a clamp to a constant,
/// then exp, good to 3 + 2 x units in the last place. At most 6 u absolute.
pub fn fog_exponential(density: f64, distance: f64) -> f64 {
    let depth = density * distance.abs().min(MAXIMUM_DISTANCE);
    (-depth.clamp(0.0, LARGEST_EXPONENT)).exp()
}

/// OpenGL's squared exponential fog: exp(-(density z)²).
///
/// # Error of the f32 twin
///
/// e^r - 1 of the weight, with r = 4 u x + 2 u (3 + 2 x) for x = (density z)²: three roundings and the rounded root
/// of 80.
pub fn fog_exponential_squared(density: f64, distance: f64) -> f64 {
    // Clamped before squaring: the square overflows f32 sooner than the product does.
    let depth = (density * distance.abs().min(MAXIMUM_DISTANCE)).clamp(0.0, LARGEST_EXPONENT.sqrt());
    (-depth * depth).exp()
}

/// Document \[M\]'s depth cue: S_A nearer than `start`, S_B beyond `end`, linear between.
///
/// # Error of the f32 twin
///
/// 7 u of the fraction f times |S_A - S_B|, plus u (3 S_A (1 - f) + 2 S_B f + S_A f) for the two differences, the
/// products and the sum.
pub fn fog_depth_cue(start: f64, end: f64, near_weight: f64, far_weight: f64, distance: f64) -> f64 {
    let far = fog_fraction(start, end, distance.abs().min(MAXIMUM_DISTANCE));
    near_weight * (1.0 - far) + far_weight * far
}

/// Returns the weight of the lit colour at a distance in metres from the viewer, in [0, 1].
///
/// In WGSL one of the features `FOG_LINEAR`, `FOG_EXPONENTIAL`, `FOG_EXPONENTIAL_SQUARED` and `FOG_DEPTH_CUE`
/// selects the mode.
///
/// # Error of the f32 twin
///
/// That of the mode's function.
pub fn fog_weight(mode: &FogMode, distance: f64) -> f64 {
    let [first, second, near_weight, far_weight] = mode.parameters().map(f64::from);
    match mode {
        FogMode::Linear { .. } => fog_linear(first, second, distance),
        FogMode::Exponential { .. } => fog_exponential(first, distance),
        FogMode::ExponentialSquared { .. } => fog_exponential_squared(first, distance),
        FogMode::DepthCue { .. } => fog_depth_cue(first, second, near_weight, far_weight, distance),
    }
}

/// Returns [`fog_weight`], or `None` where the formula has no value: a linear fog or depth cue that ends where it
/// starts ([`fog_weight`] makes it a step), a number that is not finite, a negative density or distance, or a
/// weight outside [0, 1].
pub fn try_fog_weight(mode: &FogMode, distance: f64) -> Option<f64> {
    let span = |start: f32, end: f32| {
        let span = f64::from(end) - f64::from(start);
        span.is_finite() && span.abs() >= SMALLEST_SPAN
    };
    let usable = match *mode {
        FogMode::Linear { start, end } => span(start, end),
        FogMode::Exponential { density } | FogMode::ExponentialSquared { density } => {
            density.is_finite() && density >= 0.0
        }
        FogMode::DepthCue { start, end, near_weight, far_weight } => {
            span(start, end) && [near_weight, far_weight].iter().all(|weight| (0.0..=1.0).contains(weight))
        }
    };
    let defined = usable && distance.is_finite() && distance >= 0.0;
    defined.then(|| fog_weight(mode, distance))
}

/// Returns `weight * lit + (1 - weight) * fog_color`, linear RGB. Alpha is not affected by fog.
///
/// # Error of the f32 twin
///
/// 2 u of the lit part and 3 u of the fog's, whose weight is a difference.
pub fn apply_fog(weight: f64, lit: DVec3, fog_color: DVec3) -> DVec3 {
    weight * lit + (1.0 - weight) * fog_color
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear() {
        let mode = FogMode::Linear { start: 2.0, end: 10.0 };
        for (distance, weight) in
            [(0.0, 1.0), (2.0, 1.0), (4.0, 0.75), (10.0, 0.0), (1e300, 0.0), (-4.0, 0.75)]
        {
            assert_eq!(fog_weight(&mode, distance), weight, "at {distance}");
        }
    }

    #[test]
    fn a_linear_fog_of_no_depth_is_a_wall() {
        let mode = FogMode::Linear { start: 5.0, end: 5.0 };
        assert_eq!(fog_weight(&mode, 4.999), 1.0);
        assert_eq!(fog_weight(&mode, 5.0), 0.0);
        let mode = FogMode::DepthCue { start: 5.0, end: 5.0, near_weight: 0.75, far_weight: 0.25 };
        assert_eq!(fog_weight(&mode, 4.0), 0.75);
        assert_eq!(fog_weight(&mode, 6.0), 0.25);
        assert_eq!(try_fog_weight(&mode, 6.0), None);
        assert_eq!(try_fog_weight(&FogMode::Linear { start: 5.0, end: 5.0 }, 4.0), None);
    }

    #[test]
    fn fogs_that_have_no_weight() {
        let linear = FogMode::Linear { start: 2.0, end: 10.0 };
        assert_eq!(try_fog_weight(&linear, 4.0), Some(0.75));
        let cue = |near_weight| FogMode::DepthCue { start: 0.0, end: 1.0, near_weight, far_weight: 0.0 };
        assert_eq!(try_fog_weight(&cue(0.5), 0.0), Some(0.5));
        for distance in [-1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(try_fog_weight(&linear, distance), None);
        }
        let bad = [
            FogMode::Linear { start: f32::NAN, end: 1.0 },
            FogMode::Linear { start: 0.0, end: f32::INFINITY },
            FogMode::Exponential { density: -1.0 },
            FogMode::ExponentialSquared { density: f32::NAN },
            cue(1.5),
        ];
        for mode in bad {
            assert_eq!(try_fog_weight(&mode, 1.0), None, "{mode:?}");
        }
    }

    #[test]
    fn exponential_and_squared() {
        assert!((fog_weight(&FogMode::Exponential { density: 0.5 }, 2.0) - (-1f64).exp()).abs() < 1e-16);
        assert!(
            (fog_weight(&FogMode::ExponentialSquared { density: 0.5 }, 4.0) - (-4f64).exp()).abs() < 1e-16
        );
        for mode in [FogMode::Exponential { density: 1e30 }, FogMode::ExponentialSquared { density: 1e30 }] {
            let far = fog_weight(&mode, 1e300);
            // exp(-80), the smallest weight that is returned.
            assert!((0.0..2e-35).contains(&far), "{mode:?}: {far}");
            assert_eq!(fog_weight(&mode, 0.0), 1.0);
        }
        assert_eq!(fog_weight(&FogMode::Exponential { density: -1.0 }, 1e300), 1.0);
    }

    #[test]
    fn depth_cue_is_the_documents_line() {
        let (start, end, near_weight, far_weight) = (2.0, 6.0, 0.875, 0.125);
        let mode = FogMode::DepthCue { start, end, near_weight, far_weight };
        for distance in [2.0f32, 3.0, 4.5, 6.0] {
            let line = far_weight + (distance - end) * (near_weight - far_weight) / (start - end);
            assert_eq!(fog_weight(&mode, f64::from(distance)), f64::from(line));
        }
        assert_eq!(fog_weight(&mode, 0.0), 0.875);
        assert_eq!(fog_weight(&mode, 60.0), 0.125);
    }

    #[test]
    fn the_mix() {
        let (lit, color) = (DVec3::new(1.0, 2.0, 4.0), DVec3::ONE);
        assert_eq!(apply_fog(0.25, lit, color), DVec3::new(1.0, 1.25, 1.75));
        assert_eq!(apply_fog(1.0, lit, color), lit);
        assert_eq!(apply_fog(0.0, lit, color), color);
    }
}
