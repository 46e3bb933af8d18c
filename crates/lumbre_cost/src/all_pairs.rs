//! Form factors as the documents compute them: each pair of patches by itself, with a ray that asks whether one
//! sees the other. The time grows with the square of the number of patches. The baker does not do this: the rays
//! that it casts from each patch find whom the patch sees.

use glam::Vec3;
use lumbre_rays::{Bvh, Ray};

use crate::ErrorOf;

/// Square patches on the inner sides of a cube with sides of 1.
pub struct CubeOfPatches {
    centres: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// Area of each patch.
    area: f64,
    bvh: Bvh,
}

/// The result of exchanging light between all pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllPairs {
    /// Number of form factors that were computed.
    pub form_factors: u64,
    /// Largest distance of a patch's sum of form factors from 1, which is what a closed room has.
    pub off: f64,
    /// Mean form factor from a side of the cube to the opposite one, and to one that meets it.
    pub between_opposite: f64,
    pub between_adjacent: f64,
}

/// Form factors between opposite and between adjacent sides of a cube in closed form (Howell, "A Catalog of Radiation
/// Heat Transfer Configuration Factors", C-11 and C-14).
pub const OPPOSITE: f64 = 0.199824895698387;
pub const ADJACENT: f64 = 0.200043776075403;

impl AllPairs {
    /// Returns the error of the form factors between sides: the root mean square over the one opposite and the four
    /// adjacent sides, relative to the exact ones, and the largest difference.
    pub fn error(&self) -> ErrorOf {
        let [opposite, adjacent] = [self.between_opposite - OPPOSITE, self.between_adjacent - ADJACENT];
        let squares = opposite.powi(2) + 4.0 * adjacent.powi(2);
        let relative_rmse = (squares / (OPPOSITE.powi(2) + 4.0 * ADJACENT.powi(2))).sqrt();
        ErrorOf { relative_rmse, largest: opposite.abs().max(adjacent.abs()), ..ErrorOf::default() }
    }
}

impl CubeOfPatches {
    /// Creates `side` × `side` patches on each of the six sides.
    pub fn new(side: u32) -> Self {
        let (mut centres, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (normal, across, along) in
            [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)]
        {
            for inward in [normal, -normal] {
                let corner = -0.5 * inward - 0.5 * across - 0.5 * along;
                let at = |u: f32, v: f32| corner + across * u + along * v;
                let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
                triangles.extend([[a, b, c], [a, c, d]]);
                for row in 0..side {
                    for column in 0..side {
                        let [u, v] = [column, row].map(|place| (place as f32 + 0.5) / side as f32);
                        centres.push(at(u, v));
                        normals.push(inward);
                    }
                }
            }
        }
        let area = f64::from(side).powi(-2);
        Self { centres, normals, area, bvh: Bvh::build(&triangles) }
    }

    /// Returns the number of patches.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Computes the form factor of every ordered pair: that from a point to a disc of the patch's area,
    /// F = A cos θ_i cos θ_j / (π r² + A), or 0 if something lies between.
    pub fn exchange(&self) -> AllPairs {
        let mut off = 0.0_f64;
        let mut form_factors = 0;
        let side = self.len() / 6;
        // Opposite sides follow each other. A flat side sees nothing of itself.
        let (mut opposite, mut adjacent) = (0.0, 0.0);
        for from in 0..self.len() {
            let mut sum = 0.0;
            for to in (0..self.len()).filter(|to| *to != from) {
                let factor = self.form_factor(from, to);
                match (from / side) ^ 1 == to / side {
                    true => opposite += factor,
                    false => adjacent += factor,
                }
                sum += factor;
                form_factors += 1;
            }
            off = off.max((sum - 1.0).abs());
        }
        let count = self.len() as f64;
        let (between_opposite, between_adjacent) = (opposite / count, adjacent / (4.0 * count));
        AllPairs { form_factors, off, between_opposite, between_adjacent }
    }

    fn form_factor(&self, from: usize, to: usize) -> f64 {
        let between = self.centres[to] - self.centres[from];
        let square = f64::from(between.length_squared());
        let cosines = f64::from(self.normals[from].dot(between)) * f64::from(-self.normals[to].dot(between));
        if cosines <= 0.0 || self.hides(from, to) {
            return 0.0;
        }
        self.area * cosines / square / (std::f64::consts::PI * square + self.area)
    }

    /// Returns true if something lies between the centres of two patches.
    fn hides(&self, from: usize, to: usize) -> bool {
        let ray = Ray::segment(self.centres[from], self.centres[to]);
        self.bvh.any_hit(&ray.with_range(1e-4, 1.0 - 1e-4))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_closed_room_form_factors_add_up_to_one() {
        let off = |side| CubeOfPatches::new(side).exchange();
        let (coarse, fine) = (off(4), off(12));
        // Point to disc is exact for far patches, and off along the edges, where patches touch.
        assert!(fine.off < coarse.off && fine.off < 0.2, "{coarse:?} {fine:?}");
        assert_eq!(coarse.form_factors, 96 * 95);
        // Between sides they approach the closed form; a factor that is a tenth too small would be twice as far off.
        let [far, near] = [coarse, fine].map(|found| found.error().relative_rmse);
        assert!(near < 0.5 * far && near < 0.05, "{far} {near}");
        // The opposite side of a unit cube has the form factor 0.1998 (Howell, C-11); over a patch in the middle
        // it is 0.2395.
        let cube = CubeOfPatches::new(11);
        let middle = 60;
        let opposite: f64 = (121..242).map(|to| cube.form_factor(middle, to)).sum();
        assert!((opposite - 0.2395).abs() < 1e-3, "{opposite}");
    }

    #[test]
    fn what_lies_between_hides() {
        let mut cube = CubeOfPatches::new(1);
        assert!(cube.form_factor(0, 1) > 0.1);
        // A wall in the middle, across x.
        let [a, b, c] = [Vec3::new(0.0, -9.0, -9.0), Vec3::new(0.0, 9.0, -9.0), Vec3::new(0.0, 0.0, 9.0)];
        cube.bvh = Bvh::build(&[[a, b, c]]);
        assert_eq!(cube.form_factor(0, 1), 0.0);
    }
}
