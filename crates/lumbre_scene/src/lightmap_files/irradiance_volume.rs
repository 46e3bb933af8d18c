//! A grid of ambient cubes for what moves, and its KTX2 file as Bevy's `IrradianceVolume` has it. Not the gathering of its light.
//!
//! The file is a 3D texture of (Rx, 2 Ry, 3 Rz) texels. The side of the cube (x, y, z) that surfaces with a normal along +X, +Y or +Z see is at
//! (x, y, z + axis · Rz), that of the opposite normal at (x, y + Ry, z + axis · Rz), with axis 0 for X, 1 for Y and 2 for Z. (Bevy's shader
//! adds half the height where a component of the normal is negative. The table in its documentation has the two signs the other way
//! round, as it names sides by where their light goes.)
//!
//! Bevy stretches the grid over the unit cube around the origin of the entity, and rotates neither normals nor sides: volumes are aligned
//! with the world's axes.

use bevy_ecs::component::Component;
use glam::{UVec3, Vec3};

use super::{EncodingError, Ktx2Error, Ktx2Texture, LightmapFileError, PackedFormat, Supercompression};
use crate::Transform;

/// The light at a point: E/π for surfaces that face +X, −X, +Y, −Y, +Z and −Z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AmbientCube(pub [Vec3; 6]);

impl AmbientCube {
    /// E/π for a surface with a normal of unit length: the three sides that it faces, weighted by the squares of its components
    /// (Mitchell, McTaggart and Green, "Shading in Valve's Source Engine", 2006).
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let weights = (normal * normal).to_array();
        let negative = normal.cmplt(Vec3::ZERO);
        (0..3).map(|axis| weights[axis] * self.0[2 * axis + usize::from(negative.test(axis))]).sum()
    }
}

/// Ambient cubes at the centres of the cells of a grid: the baked light for what moves.
///
/// The entity's transform maps the unit cube [-1/2, 1/2]^3 to the grid; it may move and stretch it, but not rotate it.
#[derive(Component, Clone, Debug, PartialEq)]
#[require(Transform)]
pub struct IrradianceVolume {
    /// Cells along x, y and z.
    pub resolution: UVec3,
    /// Along x first, then y, then z.
    pub cubes: Vec<AmbientCube>,
    /// In the same order, whether a probe lies inside of geometry, where nothing is lit; empty where none does, or nobody has looked. Its cube is what the bake put
    /// there in place of nothing, for readers that ask no further. The KTX2 file does not hold these marks, the glTF that names it does.
    pub inside: Vec<bool>,
}

impl IrradianceVolume {
    /// The file, and what its encoding costs over all sides of all cubes.
    ///
    /// # Errors
    /// [`LightmapFileError`] if there are no cubes, not as many as the resolution says, or light that is not finite (its row counts
    /// through all slices).
    pub fn to_ktx2(
        &self,
        format: PackedFormat,
        supercompression: Supercompression,
    ) -> Result<(Vec<u8>, EncodingError), LightmapFileError> {
        let count = self.cubes.len();
        let UVec3 { x: width, y, z } = self.resolution;
        // Products of the sizes fit once they are the number of cubes; the texture's sides are checked to.
        let expected = u128::from(width) * u128::from(y) * u128::from(z);
        let sides = (y.checked_mul(2), z.checked_mul(3));
        let (Some(height), Some(depth), true) = (sides.0, sides.1, expected == count as u128 && count > 0)
        else {
            let size = format!("{width} x {y} x {z}");
            return Err(Ktx2Error::Size { texels: count, size }.into());
        };
        let colors: Vec<Vec3> = (0..6 * count)
            .map(|at| place(self.resolution, at))
            .map(|(cube, side)| self.cubes[cube].0[side])
            .collect();
        let mut texels = Vec::with_capacity(colors.len());
        for (at, color) in colors.iter().enumerate() {
            let (column, row) = (at % width as usize, at / width as usize);
            texels.push(format.encode(*color).ok_or(LightmapFileError::NotFinite { column, row })?);
        }
        let texture = Ktx2Texture { format, width, height, depth: Some(depth), texels };
        let error = EncodingError::between(&colors, texture.colors(), [Vec3::ZERO, format.largest()]);
        Ok((texture.to_bytes(supercompression)?, error))
    }

    /// Reads a file of at most `most_texels` (six per cube).
    ///
    /// # Errors
    /// [`Ktx2Error`] if it is no KTX2 file of the kind, has other sides than such a volume, or holds infinity or NaN.
    pub fn from_ktx2(bytes: &[u8], most_texels: u64) -> Result<Self, Ktx2Error> {
        let texture = Ktx2Texture::from_bytes(bytes, most_texels)?;
        let sides = [("pixelHeight", texture.height, 2), ("pixelDepth", texture.depth.unwrap_or(0), 3)];
        for (field, found, divisor) in sides {
            if found == 0 || found % divisor != 0 {
                let expected = format!("a multiple of {divisor}");
                return Err(Ktx2Error::Field { field, found: found.into(), expected });
            }
        }
        let resolution = UVec3::new(texture.width, sides[0].1 / 2, sides[1].1 / 3);
        let mut cubes = vec![AmbientCube::default(); texture.texels.len() / 6];
        for (at, color) in texture.colors().enumerate() {
            if !color.is_finite() {
                let (field, found) = ("texel", at as u64);
                return Err(Ktx2Error::Field { field, found, expected: "finite light".to_owned() });
            }
            let (cube, side) = place(resolution, at);
            cubes[cube].0[side] = color;
        }
        Ok(Self { resolution, cubes, inside: Vec::new() })
    }
}

/// The cube and its side that a texel of the file holds.
fn place(resolution: UVec3, at: usize) -> (usize, usize) {
    let [width, height, depth] = resolution.to_array().map(|side| side as usize);
    let (s, t, p) = (at % width, at / width % (2 * height), at / width / (2 * height));
    let (y, negative) = (t % height, t / height);
    let (z, axis) = (p % depth, p / depth);
    ((z * height + y) * width + s, 2 * axis + negative)
}
