//! The general quadric: every surface of the second degree, by its ten coefficients.

use glam::{DMat3, DVec3};

use super::ImplicitSurface;

/// f(p) = a x² + b y² + c z² + d xy + e yz + f xz + g x + h y + i z + j.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneralQuadric {
    /// The coefficients a to j.
    pub coefficients: [f64; 10],
}

impl GeneralQuadric {
    /// A box around the surface if it is an ellipsoid: from its centre m = -A⁻¹ b / 2 by √(k (A⁻¹)ᵢᵢ) along
    /// axis i, where f(p) = p·A p + b·p + j and k = -f(m). `None` for surfaces without an end, and for
    /// equations without a point.
    pub fn ellipsoid_bounds(&self) -> Option<[DVec3; 2]> {
        let (second, first) = (self.second(), self.first());
        // Definite, by the leading minors (Sylvester's criterion); a negative one is turned around.
        let sign = second.x_axis.x.signum();
        let second = second * sign;
        let minor = second.x_axis.x * second.y_axis.y - second.x_axis.y * second.y_axis.x;
        if !(second.x_axis.x > 0.0 && minor > 0.0 && second.determinant() > 0.0) {
            return None;
        }
        let inverse = second.inverse();
        let middle = inverse * first * (-0.5 * sign);
        let size = -sign * self.value(middle);
        let half = (DVec3::new(inverse.x_axis.x, inverse.y_axis.y, inverse.z_axis.z) * size).map(f64::sqrt);
        (half.is_finite() && half.min_element() > 0.0).then_some([middle - half, middle + half])
    }

    /// The symmetric matrix of the terms of the second degree.
    fn second(&self) -> DMat3 {
        let [a, b, c, d, e, f, ..] = self.coefficients;
        let [d, e, f] = [0.5 * d, 0.5 * e, 0.5 * f];
        DMat3::from_cols(DVec3::new(a, d, f), DVec3::new(d, b, e), DVec3::new(f, e, c))
    }

    fn first(&self) -> DVec3 {
        let [.., g, h, i, _] = self.coefficients;
        DVec3::new(g, h, i)
    }
}

impl ImplicitSurface for GeneralQuadric {
    fn value(&self, point: DVec3) -> f64 {
        point.dot(self.second() * point) + self.first().dot(point) + self.coefficients[9]
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        self.second() * point * 2.0 + self.first()
    }
}
