//! An irradiance volume placed in the world: whether it is usable there, and the light it gives at a point,
//! in f64. Its file format and its baking are elsewhere.

use bevy_ecs::prelude::*;
use glam::{BVec3, DVec3, DVec4, UVec3};
use lumbre_optics::{ambient_cube, probe_grid_cell};

use crate::{GlobalTransform, IrradianceVolume};

/// The largest side of a 3D texture that every GPU supports. The six sides of the cubes take 1 x 2 x 3 times
/// the texels of the grid along x, y and z.
const MAX_TEXELS: u32 = 2048;
/// Smallest length of a cell in metres. Coordinates in cells then stay within f32 wherever a camera can be.
const SHORTEST_CELL: f64 = 1e-9;
/// Largest off-diagonal part of a matrix relative to its largest entry that still counts as unrotated: the
/// f32 rounding of a file.
const ROTATION: f64 = 1e-5;

/// Why an irradiance volume is unusable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IrradianceVolumeError {
    /// The number of ambient cubes does not match the number of cells, or there are no cells.
    #[error("it has {found} ambient cubes for {resolution} cells; give it one for each, and at least one")]
    Cubes {
        /// Number of cubes.
        found: usize,
        /// Cells along x, y and z.
        resolution: UVec3,
    },
    /// There are more cells along an axis than a texture has room for.
    #[error("it has {resolution} cells, and a texture has room for 2048, 1024 and 682; give it fewer")]
    TooManyCells {
        /// Cells along x, y and z.
        resolution: UVec3,
    },
    /// The number of `inside` flags does not match the number of cells.
    #[error("its `inside` has {found} entries for {cells} probes; give one for each of them, or none")]
    Inside {
        /// Number of flags.
        found: usize,
        /// Number of cells.
        cells: usize,
    },
    /// A cube holds light that is infinite or NaN.
    #[error("its ambient cube {cube} holds {light}; all light must be finite")]
    NotFinite {
        /// Index of the cube.
        cube: usize,
        /// Its value.
        light: glam::Vec3,
    },
    /// It has no finite transform.
    #[error("it has no place: give it a finite Transform")]
    NoPlace,
    /// It is rotated or sheared.
    #[error(
        "it is rotated; volumes lie along the world's axes: remove the rotation of its node and of the nodes above it"
    )]
    Rotated,
    /// Its box has no thickness along an axis.
    #[error(
        "its box measures {size} m, and every cell must be at least a nanometre thick: give its Transform a scale"
    )]
    Flat {
        /// Side lengths of the box in metres.
        size: DVec3,
    },
}

/// The mapping from world space to cell coordinates of a volume: along each axis, cell = scale · point +
/// offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePlace {
    /// Cells per metre; negative where the volume is mirrored.
    pub scale: DVec3,
    /// Cell coordinates of the world origin.
    pub offset: DVec3,
    /// Cells along x, y and z.
    pub resolution: UVec3,
}

impl VolumePlace {
    /// The cell coordinates of a world point: 0 and the resolution at the faces of the box.
    pub fn cells(&self, point: DVec3) -> DVec3 {
        self.scale * point + self.offset
    }

    /// The same mapping for points that are given relative to `origin`.
    pub fn seen_from(&self, origin: DVec3) -> Self {
        Self { offset: self.cells(origin), ..*self }
    }

    /// Distance from a point to the box in metres; 0 inside of it.
    pub fn distance(&self, point: DVec3) -> f64 {
        let cells = self.cells(point);
        let outside = (-cells).max(cells - self.resolution.as_dvec3()).max(DVec3::ZERO);
        (outside / self.scale).length()
    }

    /// Volume of a cell in m³.
    pub fn cell_size(&self) -> f64 {
        1.0 / self.scale.abs().element_product()
    }
}

impl IrradianceVolume {
    /// Interpolation weight of a probe inside geometry, relative to 1 in the open. The light of such a probe
    /// is a substitute made by the bake; the weight is so small that it shows only where all neighbouring
    /// probes are inside geometry.
    pub const INSIDE: f32 = 1.0 / 1024.0;

    /// The weight of a probe: 1 in the open, [`INSIDE`](Self::INSIDE) inside geometry.
    pub fn openness(&self, probe: usize) -> f32 {
        if self.inside.get(probe).copied().unwrap_or(false) { Self::INSIDE } else { 1.0 }
    }

    /// Checks the resolution, cubes and flags of the volume, independent of its transform.
    ///
    /// # Errors
    /// [`IrradianceVolumeError`] for the first fault found.
    pub fn validate(&self) -> Result<(), IrradianceVolumeError> {
        let (resolution, found) = (self.resolution, self.cubes.len());
        let cells: u128 = resolution.to_array().into_iter().map(u128::from).product();
        if cells == 0 || cells != found as u128 {
            return Err(IrradianceVolumeError::Cubes { found, resolution });
        }
        let room = [MAX_TEXELS, MAX_TEXELS / 2, MAX_TEXELS / 3];
        if resolution.cmpgt(UVec3::from_array(room)).any() {
            return Err(IrradianceVolumeError::TooManyCells { resolution });
        }
        if !self.inside.is_empty() && self.inside.len() != found {
            return Err(IrradianceVolumeError::Inside { found: self.inside.len(), cells: found });
        }
        for (cube, sides) in self.cubes.iter().enumerate() {
            if let Some(&light) = sides.0.iter().find(|light| !light.is_finite()) {
                return Err(IrradianceVolumeError::NotFinite { cube, light });
            }
        }
        Ok(())
    }

    /// The mapping from world space to the cells of a volume with this resolution under a transform, which
    /// maps the unit cube around the origin to the grid.
    ///
    /// # Errors
    /// [`IrradianceVolumeError`] if the transform is missing or not finite, or rotates, shears or flattens
    /// the box.
    pub fn place(
        resolution: UVec3,
        transform: Option<&GlobalTransform>,
    ) -> Result<VolumePlace, IrradianceVolumeError> {
        let affine = transform
            .map(|place| place.0)
            .filter(|affine| affine.is_finite())
            .ok_or(IrradianceVolumeError::NoPlace)?;
        let matrix = affine.matrix3;
        let size = DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z);
        let beside = (matrix.x_axis - size.x * DVec3::X).abs()
            + (matrix.y_axis - size.y * DVec3::Y).abs()
            + (matrix.z_axis - size.z * DVec3::Z).abs();
        let largest = size.abs().max_element().max(beside.max_element());
        if beside.max_element() > ROTATION * largest {
            return Err(IrradianceVolumeError::Rotated);
        }
        let cells = resolution.as_dvec3();
        let scale = cells / size;
        let thick: BVec3 = (size / cells).abs().cmpge(DVec3::splat(SHORTEST_CELL));
        if !(thick.all() && scale.is_finite()) {
            return Err(IrradianceVolumeError::Flat { size });
        }
        Ok(VolumePlace { scale, offset: 0.5 * cells - scale * affine.translation, resolution })
    }

    /// E/π at a world point for a surface with this unit normal: trilinear interpolation between the probes,
    /// each weighted by its [`openness`](Self::openness). Points outside of the box of probe centres are
    /// clamped to it.
    ///
    /// The volume must be valid; if cubes are missing, the result is black.
    pub fn light(&self, place: &VolumePlace, point: DVec3, normal: DVec3) -> DVec3 {
        let size = self.resolution.as_dvec3();
        let cell = probe_grid_cell(point, place.scale, place.offset, size) - DVec3::splat(0.5);
        let low = cell.floor();
        let part = cell - low;
        let mut sides = [DVec4::ZERO; 3];
        for corner in 0..8u32 {
            let step = DVec3::new(f64::from(corner & 1), f64::from(corner >> 1 & 1), f64::from(corner >> 2));
            let weight = (DVec3::ONE - part + step * (2.0 * part - DVec3::ONE)).element_product();
            // Beyond the last probe the weight is 0.
            let at = (low + step).min(size - DVec3::ONE).max(DVec3::ZERO).as_uvec3();
            let probe = ((at.z * self.resolution.y + at.y) * self.resolution.x + at.x) as usize;
            let Some(cube) = self.cubes.get(probe) else { return DVec3::ZERO };
            let openness = weight * f64::from(self.openness(probe));
            for (axis, side) in sides.iter_mut().enumerate() {
                let light = cube.0[2 * axis + usize::from(normal[axis] < 0.0)].as_dvec3();
                *side += openness * light.extend(1.0);
            }
        }
        ambient_cube(normal, sides[0], sides[1], sides[2])
    }
}

/// The volume that lights an object with this centre: the nearest one; among volumes that contain the centre,
/// the one with the smallest cells; among equals, the first. An object that moves from one volume to another
/// switches when its centre does.
pub fn nearest_volume<T>(volumes: &[T], place: impl Fn(&T) -> &VolumePlace, middle: DVec3) -> Option<&T> {
    let distance = |volume: &T| (place(volume).distance(middle), place(volume).cell_size());
    volumes.iter().min_by(|a, b| {
        let ((far, large), (other_far, other_large)) = (distance(a), distance(b));
        far.total_cmp(&other_far).then(large.total_cmp(&other_large))
    })
}

/// Number of irradiance volumes of a World that are valid and placed. Global transforms must be up to date.
pub fn usable_irradiance_volumes(world: &mut World) -> usize {
    let mut query = world.query::<(&IrradianceVolume, Option<&GlobalTransform>)>();
    let is_usable = |(volume, transform): &(&IrradianceVolume, Option<&GlobalTransform>)| {
        volume.validate().is_ok() && IrradianceVolume::place(volume.resolution, *transform).is_ok()
    };
    query.iter(world).filter(is_usable).count()
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat, Vec3};

    use super::*;
    use crate::AmbientCube;

    fn volume(lights: &[f32]) -> IrradianceVolume {
        let cubes = lights.iter().map(|light| AmbientCube([Vec3::splat(*light); 6])).collect();
        IrradianceVolume { resolution: UVec3::new(lights.len() as u32, 1, 1), cubes, inside: Vec::new() }
    }

    fn at(size: DVec3, translation: DVec3) -> GlobalTransform {
        GlobalTransform(DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, translation))
    }

    #[test]
    fn light_runs_straight_between_open_probes_and_stays_outside() {
        // Probes at x = 11, 13, 15 with 1, 3, 7.
        let mut volume = volume(&[1.0, 3.0, 7.0]);
        let place =
            IrradianceVolume::place(volume.resolution, Some(&at(DVec3::new(6.0, 2.0, 2.0), DVec3::X * 13.0)));
        let place = place.unwrap();
        let light =
            |volume: &IrradianceVolume, x: f64| volume.light(&place, DVec3::new(x, 9.0, 0.0), DVec3::Y).x;
        for (x, expected) in [(11.0, 1.0), (12.0, 2.0), (14.5, 6.0), (15.0, 7.0), (2.0, 1.0), (90.0, 7.0)] {
            assert!((light(&volume, x) - expected).abs() < 1e-12, "{x}: {}", light(&volume, x));
        }
        assert_eq!(
            (place.distance(DVec3::new(12.0, 0.5, 0.0)), place.distance(DVec3::new(18.0, 0.0, 5.0))),
            (0.0, 20f64.sqrt())
        );
        // Probe 1 is inside a wall, and bright: beside it its light is all but ignored, and at the probe
        // itself it is used.
        volume.inside = vec![false, true, false];
        assert!((light(&volume, 12.0) - 1.0).abs() < 3e-3 && (light(&volume, 14.0) - 7.0).abs() < 5e-3);
        assert!((light(&volume, 13.0) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn mirrored_volumes_turn_their_cells_and_not_their_sides() {
        let mut volume = volume(&[1.0, 3.0]);
        volume.cubes[0].0[0] = Vec3::splat(5.0);
        let place =
            IrradianceVolume::place(volume.resolution, Some(&at(DVec3::new(-4.0, 1.0, 1.0), DVec3::ZERO)));
        let place = place.unwrap();
        assert_eq!(volume.light(&place, DVec3::X, DVec3::X), DVec3::splat(5.0));
        assert_eq!(volume.light(&place, DVec3::X, DVec3::NEG_X), DVec3::ONE);
        assert_eq!(volume.light(&place, DVec3::NEG_X, DVec3::X), DVec3::splat(3.0));
        assert_eq!(place.cell_size(), 2.0);
    }

    #[test]
    fn the_smallest_cells_of_the_nearest_volumes() {
        let place = |side: f64, x: f64| {
            let transform = at(DVec3::splat(side), DVec3::X * x);
            IrradianceVolume::place(UVec3::splat(2), Some(&transform)).unwrap()
        };
        // A hall, an alcove in it, and a shed next to it.
        let volumes = [place(20.0, 0.0), place(4.0, 0.0), place(4.0, 30.0)];
        let chosen = |x: f64| {
            let nearest = nearest_volume(&volumes, |place| place, DVec3::X * x).unwrap();
            volumes.iter().position(|place| place == nearest).unwrap()
        };
        assert_eq!([0.0, 1.9, 2.1, 10.0, 18.0, 20.0, 99.0].map(chosen), [1, 1, 0, 0, 0, 2, 2]);
        assert_eq!(nearest_volume(&volumes[..0], |place| place, DVec3::ZERO), None);
    }

    #[test]
    fn faults_are_named() {
        use IrradianceVolumeError as VolumeError;
        let fine = volume(&[1.0, 3.0]);
        assert_eq!(fine.validate(), Ok(()));
        let empty = IrradianceVolume { resolution: UVec3::ZERO, ..volume(&[]) };
        assert!(matches!(empty.validate(), Err(VolumeError::Cubes { found: 0, .. })));
        let short = IrradianceVolume { resolution: UVec3::splat(2), ..fine.clone() };
        assert!(matches!(short.validate(), Err(VolumeError::Cubes { found: 2, .. })));
        // The product of the sizes overflows 64 bits.
        let huge = IrradianceVolume { resolution: UVec3::MAX, ..fine.clone() };
        assert!(matches!(huge.validate(), Err(VolumeError::Cubes { .. })));
        let long = volume(&vec![1.0; 2049]);
        assert!(matches!(long.validate(), Err(VolumeError::TooManyCells { .. })));
        let mut dark = volume(&[1.0, f32::NAN]);
        assert!(matches!(dark.validate(), Err(VolumeError::NotFinite { cube: 1, .. })));
        dark.cubes[1].0[3].y = f32::INFINITY;
        assert!(dark.validate().is_err());
        let marks = IrradianceVolume { inside: vec![true], ..fine.clone() };
        assert_eq!(marks.validate(), Err(VolumeError::Inside { found: 1, cells: 2 }));

        let placed = |transform: Option<DAffine3>| {
            IrradianceVolume::place(fine.resolution, transform.map(GlobalTransform).as_ref()).err()
        };
        assert_eq!(placed(Some(DAffine3::IDENTITY)), None);
        assert_eq!(placed(None), Some(VolumeError::NoPlace));
        assert_eq!(placed(Some(DAffine3::from_translation(DVec3::NAN))), Some(VolumeError::NoPlace));
        assert_eq!(placed(Some(DAffine3::from_rotation_y(0.1))), Some(VolumeError::Rotated));
        let flat = DVec3::new(1.0, 0.0, 1.0);
        assert_eq!(placed(Some(DAffine3::from_scale(flat))), Some(VolumeError::Flat { size: flat }));
        assert!(matches!(placed(Some(DAffine3::from_scale(DVec3::ZERO))), Some(VolumeError::Flat { .. })));
    }
}
