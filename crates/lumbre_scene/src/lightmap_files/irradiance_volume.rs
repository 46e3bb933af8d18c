//! A grid of ambient cubes that lights moving objects, and its KTX2 file in the layout of Bevy's
//! `IrradianceVolume`. The light itself is gathered by the baker.
//!
//! The file is a 3D texture of (Rx, 2 Ry, 3 Rz) texels. For the cube (x, y, z), the side for surface normals
//! along +X, +Y or +Z is at (x, y, z + axis · Rz) and the side for the opposite normal at (x, y + Ry, z +
//! axis · Rz), where axis is 0 for X, 1 for Y and 2 for Z. (This follows Bevy's shader, which adds half the
//! height where a component of the normal is negative. The table in Bevy's documentation has the two signs
//! swapped, because it names a side by the direction in which its light travels.)
//!
//! Bevy stretches the grid over the unit cube around the entity's origin and rotates neither normals nor
//! sides, so volumes must be aligned with the world axes.

use bevy_ecs::component::Component;
use glam::{UVec3, Vec3};

use super::{EncodingError, Ktx2Error, Ktx2Texture, LightmapFileError, PackedFormat, Supercompression};
use crate::Transform;

/// The light at a point: E/π for surfaces with the normals +X, −X, +Y, −Y, +Z and −Z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AmbientCube(pub [Vec3; 6]);

impl AmbientCube {
    /// E/π for a surface with this unit normal: the three sides that face it, weighted by the squares of the
    /// normal's components (Mitchell, McTaggart and Green, "Shading in Valve's Source Engine", 2006).
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let weights = (normal * normal).to_array();
        let negative = normal.cmplt(Vec3::ZERO);
        (0..3).map(|axis| weights[axis] * self.0[2 * axis + usize::from(negative.test(axis))]).sum()
    }
}

/// Ambient cubes at the cell centres of a grid: the baked light for moving objects.
///
/// The entity's transform maps the unit cube [-1/2, 1/2]^3 to the grid. It may translate and scale it, but
/// not rotate it.
#[derive(Component, Clone, Debug, PartialEq)]
#[require(Transform)]
pub struct IrradianceVolume {
    /// Cells along x, y and z.
    pub resolution: UVec3,
    /// One cube per cell; x varies fastest, then y, then z.
    pub cubes: Vec<AmbientCube>,
    /// For each probe, in the same order, whether it lies inside geometry and thus receives no light; empty
    /// if none does or if this is unknown. The cube of such a probe holds substitute light from the bake, for
    /// readers that ignore these flags. The KTX2 file does not store them; the glTF file that refers to it
    /// does.
    pub inside: Vec<bool>,
}

impl IrradianceVolume {
    /// Encodes the volume as a KTX2 file. Also returns the encoding error over all sides of all cubes.
    ///
    /// # Errors
    /// [`LightmapFileError`] if there are no cubes, if their number does not match the resolution, or if
    /// light is not finite (the row in that error counts through all slices).
    pub fn to_ktx2(
        &self,
        format: PackedFormat,
        supercompression: Supercompression,
    ) -> Result<(Vec<u8>, EncodingError), LightmapFileError> {
        let count = self.cubes.len();
        let UVec3 { x: width, y, z } = self.resolution;
        // Once the product equals the number of cubes, the smaller products fit as well; the sides of the
        // texture are checked separately.
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

    /// Decodes a KTX2 file of at most `most_texels` texels (six per cube).
    ///
    /// # Errors
    /// [`Ktx2Error`] if the file is not a supported KTX2 file, its sides are not those of such a volume, or a
    /// texel is infinite or NaN.
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

/// The cube and the side of it that a texel of the file stores.
fn place(resolution: UVec3, at: usize) -> (usize, usize) {
    let [width, height, depth] = resolution.to_array().map(|side| side as usize);
    let (s, t, p) = (at % width, at / width % (2 * height), at / width / (2 * height));
    let (y, negative) = (t % height, t / height);
    let (z, axis) = (p % depth, p / depth);
    ((z * height + y) * width + s, 2 * axis + negative)
}
