//! Exact surfaces for the ray tracer: planes, spheres, cylinders, cones and general quadrics that replace an
//! entity's mesh. The rasterizer draws the mesh instead, which is made in `quadric_mesh` where there is none. Ray
//! intersection is in the tracer.

use bevy_ecs::prelude::*;
use glam::DVec3;
use thiserror::Error;

/// The exact surface of an entity in its local space; the entity's transform applies, including scale and
/// shear.
///
/// An entity without a [`Mesh`](crate::Mesh) gets a tessellation of the surface when this component is
/// inserted, and a new one when it is inserted again; frames draw that.
#[derive(Component, Clone, Debug, PartialEq)]
#[component(on_insert = crate::quadric_mesh::insert_mesh)]
pub struct Quadric {
    /// The shape.
    pub shape: QuadricShape,
    /// Minimum and maximum corner of a box in local space; the surface outside of it is cut away. Components
    /// may be infinite, where the box is open.
    pub trim: Option<[DVec3; 2]>,
}

/// The shape of a quadric, in canonical position: fronts face outwards, and the axis of revolution is the y
/// axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum QuadricShape {
    /// The plane y = 0, with its front towards +y.
    Plane,
    /// A sphere about the origin.
    Sphere {
        /// Radius in metres, greater than 0.
        radius: f64,
    },
    /// A cylinder from y = -height/2 to y = height/2.
    Cylinder {
        /// Radius in metres, greater than 0.
        radius: f64,
        /// Height in metres, greater than 0.
        height: f64,
        /// Whether its ends are closed by discs.
        closed: bool,
    },
    /// A cone with its base at y = -height/2 and its apex at y = height/2.
    Cone {
        /// Radius of the base in metres, greater than 0.
        radius: f64,
        /// Height in metres, greater than 0.
        height: f64,
        /// Whether its base is closed by a disc.
        closed: bool,
    },
    /// a x² + b y² + c z² + d xy + e yz + f xz + g x + h y + i z + j = 0; the front is where the left side is
    /// positive.
    General {
        /// The coefficients a to j.
        coefficients: [f64; 10],
    },
}

/// Why a quadric is invalid.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum QuadricError {
    /// A length is not a positive number up to [`Quadric::MAX_VALUE`].
    #[error("{field} is {value}; give metres greater than 0, and at most 1e100")]
    Length {
        /// The name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The coefficients of a general quadric define no surface: a to i are all 0, or one of a to j is NaN or
    /// beyond [`Quadric::MAX_VALUE`].
    #[error(
        "coefficients a to i are all 0, or one of a to j is not a number up to 1e100; give an equation that has points"
    )]
    NoSurface,
    /// The trim box is empty.
    #[error("the trim's min is not below its max; give min and max of a box")]
    Trim,
}

impl Quadric {
    /// The largest absolute value of a length or coefficient, so that its square is finite in f64.
    pub const MAX_VALUE: f64 = 1e100;

    /// A shape without a trim box.
    pub fn new(shape: QuadricShape) -> Self {
        Self { shape, trim: None }
    }

    /// A sphere about the origin.
    pub fn sphere(radius: f64) -> Self {
        Self::new(QuadricShape::Sphere { radius })
    }

    /// Checks the lengths or coefficients of the shape, and the trim box.
    ///
    /// # Errors
    /// [`QuadricError`] for the first fault found.
    pub fn validate(&self) -> Result<(), QuadricError> {
        let length = |field: &'static str, value: f64| match value > 0.0 && value <= Self::MAX_VALUE {
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
                let representable = coefficients.iter().all(|value| value.abs() <= Self::MAX_VALUE);
                if !representable || coefficients[..9].iter().all(|&value| value == 0.0) {
                    return Err(QuadricError::NoSurface);
                }
            }
        }
        match self.trim {
            Some([low, high]) if !low.cmplt(high).all() => Err(QuadricError::Trim),
            _ => Ok(()),
        }
    }

    /// A bounding box of the trimmed surface in local space; infinite along axes that neither shape nor trim
    /// bounds. A general quadric is bounded by its trim only.
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
        assert!(Quadric::sphere(2.0 * Quadric::MAX_VALUE).validate().is_err());
        let general = |coefficients| Quadric::new(QuadricShape::General { coefficients }).validate();
        assert_eq!(general([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), Err(QuadricError::NoSurface));
        assert_eq!(general([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0]), Ok(()));
        let trim = Some([DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0)]);
        assert_eq!(Quadric { trim, ..Quadric::sphere(1.0) }.validate(), Err(QuadricError::Trim));
        let half_space = Some([DVec3::NEG_INFINITY.with_y(0.0), DVec3::INFINITY]);
        assert_eq!(Quadric { trim: half_space, ..Quadric::sphere(1.0) }.validate(), Ok(()));
        for nowhere in [[DVec3::INFINITY; 2], [DVec3::NEG_INFINITY; 2], [DVec3::ZERO, DVec3::NAN]] {
            let cut = Quadric { trim: Some(nowhere), ..Quadric::sphere(1.0) };
            assert_eq!(cut.validate(), Err(QuadricError::Trim));
        }
    }

    #[test]
    fn bounds_are_the_smaller_of_equation_and_trim() {
        let cut = Quadric { trim: Some([DVec3::splat(-9.0), DVec3::splat(0.5)]), ..Quadric::sphere(2.0) };
        assert_eq!(cut.bounds(), [DVec3::splat(-2.0), DVec3::splat(0.5)]);
    }
}
