//! The surface of an object as lights fall on it: the properties that determine the error of interpolated
//! lighting. It is created from a frame's record of an object, or from the World.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};
use lumbre_mesh::{NormalCone, SurfacePatch, SurfaceSpread};
use lumbre_optics::TriangleSpread;
use lumbre_scene::{GlobalTransform, ObjectTraits};

use crate::extract::{Reflectance, world_box};

/// An object in the form that predictions need.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitSurface<'a> {
    pub traits: &'a ObjectTraits,
    pub reflectance: Reflectance,
    spread: &'a SurfaceSpread,
    world_from_mesh: DAffine3,
    world_from_mesh_normal: DMat3,
    stretch: Stretch,
}

impl<'a> LitSurface<'a> {
    pub fn new(
        traits: &'a ObjectTraits,
        reflectance: Reflectance,
        spread: &'a SurfaceSpread,
        world_from_mesh: DAffine3,
    ) -> Self {
        let world_from_mesh_normal = GlobalTransform(world_from_mesh).normal_matrix();
        let stretch = Stretch::of(world_from_mesh.matrix3);
        Self { traits, reflectance, spread, world_from_mesh, world_from_mesh_normal, stretch }
    }

    /// Returns the whole surface as one patch in world space; `None` for a mesh without area.
    pub fn whole(&self) -> Option<WorldPatch> {
        self.spread.whole.as_ref().map(|patch| self.in_world(patch))
    }

    /// Returns its patches in world space.
    pub fn patches(&self) -> impl Iterator<Item = WorldPatch> + '_ {
        self.spread.patches.iter().map(|patch| self.in_world(patch))
    }

    fn in_world(&self, patch: &SurfacePatch) -> WorldPatch {
        let Stretch { longest, bend } = self.stretch;
        let chord = |chord: f64| match bend {
            1.0 => chord,
            bend => chord_of((bend * angle_of(chord)).min(PI)),
        };
        let (center, half_size, radius) =
            world_box(patch.center, patch.half_size, &GlobalTransform(self.world_from_mesh));
        let normals = patch.cone.and_then(|NormalCone { axis, half_angle }| {
            let axis = (self.world_from_mesh_normal * axis).try_normalize()?;
            Some(NormalCone { axis, half_angle: (bend * half_angle).min(PI) })
        });
        let (edge, normal_difference) = (longest * patch.edge, chord(patch.normals));
        let triangle =
            TriangleSpread { edge, normals: normal_difference, face_normals: chord(patch.face_normals) };
        WorldPatch { center, half_size, radius, normals, triangle }
    }
}

/// A part of a surface in world space: its box and the sphere around it, the cone of its normals, and the
/// bounds on size and curvature of its triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldPatch {
    pub center: DVec3,
    pub half_size: DVec3,
    pub radius: f64,
    pub normals: Option<NormalCone>,
    pub triangle: TriangleSpread,
}

impl WorldPatch {
    /// Returns the distance in metres from a point to the nearest point of its box, and an upper bound of the
    /// distance to any point of the box.
    pub fn distances(&self, from: DVec3) -> [f64; 2] {
        let apart = (from - self.center).abs();
        [(apart - self.half_size).max(DVec3::ZERO).length(), (apart + self.half_size).length()]
    }

    /// Returns the half angle in radians of the cone of directions from its points to all points within
    /// `room` of a point at this distance from its centre.
    pub fn half_angle(&self, distance: f64, room: f64) -> f64 {
        let within = self.radius + room;
        if distance > within { (within / distance).asin() } else { PI }
    }
}

fn angle_of(chord: f64) -> f64 {
    2.0 * (0.5 * chord).min(1.0).asin()
}

fn chord_of(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin()
}

/// Upper bounds on how a matrix changes lengths and angles.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Factor on a length.
    longest: f64,
    /// Factor on an angle between directions, including normals: the ratio of the largest to the smallest
    /// singular value.
    bend: f64,
}

impl Stretch {
    fn of(matrix: DMat3) -> Self {
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let lengths = columns.map(DVec3::length);
        let longest = lengths.into_iter().fold(0.0, f64::max);
        let shortest = lengths.into_iter().fold(f64::INFINITY, f64::min);
        let pairs = [(0, 1), (1, 2), (0, 2)];
        let orthogonal =
            pairs.iter().all(|(a, b)| columns[*a].dot(columns[*b]).abs() <= 1e-9 * lengths[*a] * lengths[*b]);
        match orthogonal {
            true if longest <= shortest * (1.0 + 1e-6) => Self { longest, bend: 1.0 },
            true => Self { longest, bend: longest / shortest.max(f64::MIN_POSITIVE) },
            // The Frobenius norm f is at least the largest singular value, and f³ divided by the determinant
            // is at least the ratio.
            false => {
                let norm = lengths.into_iter().map(|length| length * length).sum::<f64>().sqrt();
                let determinant = matrix.determinant().abs().max(f64::MIN_POSITIVE);
                Self { longest: norm, bend: norm.powi(3) / determinant }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_bend_nothing_and_scales_no_more_than_is_said() {
        let turned = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.3) * 2.0;
        let Stretch { longest, bend } = Stretch::of(turned);
        assert!((longest - 2.0).abs() < 1e-12 && bend == 1.0);
        let squeezed = DMat3::from_rotation_y(0.7) * DMat3::from_diagonal(DVec3::new(1.0, 3.0, 0.5));
        let sheared =
            squeezed * DMat3::from_rotation_x(0.4) * DMat3::from_diagonal(DVec3::new(2.0, 1.0, 1.0));
        for matrix in [squeezed, sheared] {
            let Stretch { longest, bend } = Stretch::of(matrix);
            let normals = matrix.inverse().transpose();
            for step in 0..400 {
                let t = f64::from(step);
                let a = DVec3::new((t * 0.37).sin(), (t * 0.73).sin(), (t * 0.11).cos()).normalize();
                let b =
                    (a + DVec3::new((t * 0.9).cos(), (t * 0.2).sin(), (t * 0.5).sin()) * 0.05).normalize();
                assert!((matrix * a).length() <= longest * (1.0 + 1e-9));
                for matrix in [matrix, normals] {
                    let after = (matrix * a).angle_between(matrix * b);
                    assert!(after <= bend * a.angle_between(b) * (1.0 + 1e-6), "{after} {bend}");
                }
            }
        }
    }
}
