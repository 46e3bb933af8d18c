//! Surfaces given by equations, and their normals: the plane through three points, implicit surfaces,
//! parametric surfaces, sphere, cylinder, cone and torus in both forms, and general quadrics. Meshes of them are in
//! [`shapes`](crate::shapes), [`parametric_mesh`] and [`implicit_mesh`].
//!
//! ```text
//!   plane_normal        three points       (p1 - p0) x (p2 - p0)                     [I] Vectores normales
//!   implicit_normal     f(p) = 0           gradient of f                             [I] Vectores normales
//!   parametric_normal   p(u, v)            dp/du x dp/dv, its limit at a pole        [I] Vectores normales
//!   averaged            a mesh             normals::compute_smooth_normals           [I] Gouraud, [M] 1.6.2, fig. 2.5
//! ```
//!
//! Computations are in f64, in metres and radians. A normal is a unit vector, or an error that says why there
//! is none.
//!
//! ```
//! use glam::DVec3;
//! use lumbre_mesh::surfaces::{ParametricSurface, SurfaceError, Torus, implicit_normal};
//!
//! // An ellipsoid by its equation alone: the gradient comes from central differences.
//! let ellipsoid = |p: DVec3| p.x * p.x + 4.0 * p.y * p.y + p.z * p.z - 1.0;
//! let normal = implicit_normal(&ellipsoid, DVec3::new(0.0, 0.5, 0.0))?;
//! assert!((normal - DVec3::Y).length() < 1e-9);
//!
//! // A torus at a quarter of its tube: straight up, exactly.
//! let torus = Torus { major_radius: 2.0, minor_radius: 0.5 };
//! let top = torus.normal(0.3, std::f64::consts::FRAC_PI_2)?;
//! assert!((top - DVec3::Y).length() < 1e-15);
//! assert!((torus.point(0.3, std::f64::consts::FRAC_PI_2).y - 0.5).abs() < 1e-15);
//! # Ok::<(), SurfaceError>(())
//! ```

mod cone;
mod cylinder;
mod implicit;
mod marching_tetrahedra;
mod mesher;
mod parametric;
mod plane;
mod pole;
mod quadric;
mod sphere;
mod torus;

pub use cone::Cone;
pub use cylinder::Cylinder;
pub use implicit::{ImplicitSurface, central_difference_gradient, implicit_normal};
pub use marching_tetrahedra::{MAX_CELLS, implicit_mesh};
pub use mesher::parametric_mesh;
pub use parametric::{ParametricSurface, difference_partials, parametric_normal};
pub use plane::plane_normal;
pub use quadric::GeneralQuadric;
pub use sphere::Sphere;
pub use torus::Torus;

pub(crate) use mesher::push_surface;

use glam::DVec3;

/// Why a surface has no normal at a place, or cannot be meshed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// Three points lie on one line.
    #[error("the three points lie on one line, so no plane goes through them alone; move one of them")]
    Collinear,
    /// A coordinate or a value of the surface's function is infinite or NaN.
    #[error("the surface is not finite at {place}")]
    NotFinite {
        /// The point in metres, or (u, v, 0).
        place: DVec3,
    },
    /// The gradient of an implicit surface vanishes, as at a centre, an apex or a self-intersection.
    #[error("the gradient vanishes at {point}: the surface has no tangent plane there")]
    Singular {
        /// The point in metres.
        point: DVec3,
    },
    /// The partial derivatives span no plane, and the normals nearby do not converge to one, as at an apex or
    /// a crease.
    #[error("the surface has no tangent plane at u = {u}, v = {v}")]
    NoTangentPlane {
        /// The parameter u.
        u: f64,
        /// The parameter v.
        v: f64,
    },
    /// A grid has no cells, or more than a mesh may have.
    #[error("a grid of {columns} by {rows} cells; both must be 1 to {largest}")]
    Grid {
        /// Cells along u.
        columns: u32,
        /// Cells along v.
        rows: u32,
        /// Largest number of either.
        largest: u32,
    },
}

/// The direction of a finite vector, or `None` if it is zero or not finite. The vector is scaled first, so
/// that squares neither overflow nor underflow.
fn direction(vector: DVec3) -> Option<DVec3> {
    let largest = vector.abs().max_element();
    if largest > 0.0 && vector.is_finite() { Some((vector / largest).normalize()) } else { None }
}

/// The distance of a point from the y axis and the unit direction away from it; +x on the axis itself.
fn from_axis(point: DVec3) -> (f64, DVec3) {
    let distance = point.x.hypot(point.z);
    (distance, DVec3::new(point.x, 0.0, point.z).try_normalize().unwrap_or(DVec3::X))
}

/// The unit direction at an angle around the y axis, from +x towards -z, and its derivative with respect to
/// the angle.
fn around(angle: f64) -> [DVec3; 2] {
    let (sin, cos) = angle.sin_cos();
    [DVec3::new(cos, 0.0, -sin), DVec3::new(-sin, 0.0, -cos)]
}
