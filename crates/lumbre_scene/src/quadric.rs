//! Exact surfaces: planes, spheres, cylinders, cones and general quadrics in place of an entity's mesh, for whoever intersects rays. The mesh
//! beside it is what a rasterizer draws. Not the intersection itself: that is the tracer's.

use bevy_ecs::prelude::*;
use glam::DVec3;
use thiserror::Error;

/// The exact surface of an entity, in its own space: its transform places, scales and shears it.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Quadric {
    /// The equation.
    pub shape: QuadricShape,
    /// Smallest and largest corner of the box outside of which the surface is cut away, in the entity's own space.
    pub trim: Option<[DVec3; 2]>,
}

/// Which surface. Each has its front outside, and the y axis as its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum QuadricShape {
    /// y = 0, its front above.
    Plane,
    /// About the origin.
    Sphere {
        /// Metres, greater than 0.
        radius: f64,
    },
    /// From y = -height/2 to height/2.
    Cylinder {
        /// Metres, greater than 0.
        radius: f64,
        /// Metres, greater than 0.
        height: f64,
        /// Whether discs close its ends.
        closed: bool,
    },
    /// Its base at y = -height/2, its apex at height/2.
    Cone {
        /// Of the base, metres, greater than 0.
        radius: f64,
        /// Metres, greater than 0.
        height: f64,
        /// Whether a disc closes its base.
        closed: bool,
    },
    /// a x² + b y² + c z² + d xy + e yz + f xz + g x + h y + i z + j = 0, its front where that is greater than 0.
    General {
        /// a to j.
        coefficients: [f64; 10],
    },
}

/// Why a surface is none.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum QuadricError {
    /// A length that is none.
    #[error("{field} is {value}; give metres greater than 0")]
    Length {
        /// Which.
        field: &'static str,
        /// What it is.
        value: f64,
    },
    /// No equation.
    #[error("coefficients are all 0, or not all finite, but for the last; give an equation that has points")]
    NoSurface,
    /// A box that holds nothing.
    #[error("the trim's min is not below its max; give min and max of a box")]
    Trim,
}

impl Quadric {
    /// A whole surface.
    pub fn new(shape: QuadricShape) -> Self {
        Self { shape, trim: None }
    }

    /// A sphere about the origin.
    pub fn sphere(radius: f64) -> Self {
        Self::new(QuadricShape::Sphere { radius })
    }

    /// Whether it has points.
    ///
    /// # Errors
    /// [`QuadricError`], the first fault.
    pub fn validate(&self) -> Result<(), QuadricError> {
        let length = |field: &'static str, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => Err(QuadricError::Length { field, value }),
        };
        match self.shape {
            QuadricShape::Plane => {}
            QuadricShape::Sphere { radius } => length("radius", radius)?,
            QuadricShape::Cylinder { radius, height, .. } | QuadricShape::Cone { radius, height, .. } => {
                length("radius", radius)?;
                length("height", height)?;
            }
            QuadricShape::General { coefficients } => {
                let finite = coefficients.iter().all(|value| value.is_finite());
                if !finite || coefficients[..9].iter().all(|&value| value == 0.0) {
                    return Err(QuadricError::NoSurface);
                }
            }
        }
        match self.trim {
            Some([low, high]) if !low.cmplt(high).all() => Err(QuadricError::Trim),
            _ => Ok(()),
        }
    }

    /// The smallest box of its own that holds it, by its equation and its trim; infinite where neither bounds it.
    pub fn bounds(&self) -> [DVec3; 2] {
        let about = |half: DVec3| [-half, half];
        let own = match self.shape {
            QuadricShape::Sphere { radius } => about(DVec3::splat(radius)),
            QuadricShape::Cylinder { radius, height, .. } | QuadricShape::Cone { radius, height, .. } => {
                about(DVec3::new(radius, 0.5 * height, radius))
            }
            QuadricShape::Plane => {
                [DVec3::new(f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY), DVec3::INFINITY.with_y(0.0)]
            }
            QuadricShape::General { .. } => [DVec3::NEG_INFINITY, DVec3::INFINITY],
        };
        match self.trim {
            Some([low, high]) => [own[0].max(low), own[1].min(high)],
            None => own,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_points_is_refused() {
        assert_eq!(Quadric::sphere(2.0).validate(), Ok(()));
        assert_eq!(
            Quadric::sphere(0.0).validate(),
            Err(QuadricError::Length { field: "radius", value: 0.0 })
        );
        assert!(Quadric::sphere(f64::NAN).validate().is_err());
        let general = |coefficients| Quadric::new(QuadricShape::General { coefficients }).validate();
        assert_eq!(general([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), Err(QuadricError::NoSurface));
        assert_eq!(general([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0]), Ok(()));
        let trim = Some([DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0)]);
        assert_eq!(Quadric { trim, ..Quadric::sphere(1.0) }.validate(), Err(QuadricError::Trim));
    }

    #[test]
    fn bounds_are_the_smaller_of_equation_and_trim() {
        let cut = Quadric { trim: Some([DVec3::splat(-9.0), DVec3::splat(0.5)]), ..Quadric::sphere(2.0) };
        assert_eq!(cut.bounds(), [DVec3::splat(-2.0), DVec3::splat(0.5)]);
    }
}
