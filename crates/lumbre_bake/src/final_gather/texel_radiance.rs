//! The light and the reflectance of whole texels, for rays that hit them. Not where rays go: that is `incident`.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::gather_sums::GatherSums;
use super::steep_light::{SteepLight, SteepTexel};
use crate::coverage::{CoveredTexels, Footprint, FootprintPoint, Texel};
use crate::radiosity::Patches;
use crate::scene::Side;
use crate::texel_index::MapTexel;

/// What rays read of every texel of all maps.
#[derive(Clone, Debug)]
pub(crate) struct TexelRadiances(Vec<TexelRadiance>);

/// What rays read of one texel. It is aligned such that a read from anywhere in memory fetches a single cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct TexelRadiance {
    /// Direct irradiance, W/m² (mixed lights included); NaN where the texel shows nothing, and where a wall divides it.
    pub direct: Vec3,
    /// Of a texel over which direct light changes so much that `direct` does not hold for a point.
    pub steep: Option<SteepTexel>,
    /// Mean reflectance where it varies over the triangle; NaN elsewhere.
    pub reflectance: Vec3,
    /// The light by bounces that an earlier round of the gather has found; its irradiance is NaN where it is not known,
    /// and before the first round. It is more accurate than that of the patches, so rays that read it need no further
    /// bounce.
    indirect: TexelLight,
}

/// The light by bounces of one texel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelLight {
    /// By bounces, W/m².
    pub irradiance: Vec3,
    /// The variance that noise and smoothing leave in `irradiance`, mean of the channels.
    pub variance: f32,
    /// The patches' errors in `irradiance`, each with its sign.
    pub patch_error: Vec2,
}

impl TexelRadiance {
    /// Of a texel of which nothing is known.
    pub const UNKNOWN: Self = Self {
        direct: Vec3::NAN,
        steep: None,
        reflectance: Vec3::NAN,
        indirect: TexelLight { irradiance: Vec3::NAN, variance: 0.0, patch_error: Vec2::ZERO },
    };

    /// The direct irradiance, if one value holds for all of the texel.
    pub fn direct(&self) -> Option<Vec3> {
        (!self.direct.x.is_nan()).then_some(self.direct)
    }

    /// The light by bounces, if it is known.
    #[inline]
    pub fn indirect(&self) -> Option<&TexelLight> {
        (!self.indirect.irradiance.x.is_nan()).then_some(&self.indirect)
    }
}

impl TexelRadiances {
    /// Before the first round of the gather. `direct` and `reflectance` are per texel of all maps, and NaN where nothing
    /// is known; `reflectance` may be empty. `steep` are the texels of [`SteepLight`].
    pub fn new(direct: &[Vec3], steep: &[MapTexel], reflectance: &[Vec3]) -> Self {
        let texel = |(place, &direct): (usize, &Vec3)| {
            let reflectance = reflectance.get(place).copied().unwrap_or(Vec3::NAN);
            TexelRadiance { direct, reflectance, ..TexelRadiance::UNKNOWN }
        };
        let mut texels: Vec<TexelRadiance> = direct.iter().enumerate().map(texel).collect();
        for (texel, number) in steep.iter().zip(SteepLight::numbers()) {
            texels[texel.place()].steep = Some(number);
        }
        Self(texels)
    }

    /// Sets the light by bounces that a round of the gather has found. All lists are per covered texel.
    pub fn set_indirect(
        &mut self,
        texels: &[Texel],
        gathered: &[GatherSums],
        light: &[Vec3],
        variances: &[f32],
    ) {
        for (place, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            let (irradiance, variance) = (light[place], variances[place]);
            let patch_error = gathered[place].patch_error();
            let radiance = &mut self.0[texel.index.place()];
            let is_finite = irradiance.is_finite() && variance.is_finite() && patch_error.is_finite();
            radiance.indirect = match is_finite && !radiance.direct.x.is_nan() {
                true => TexelLight { irradiance, variance, patch_error },
                false => TexelRadiance::UNKNOWN.indirect,
            };
        }
    }

    /// What is known of a texel, or of a point that no texel shows.
    #[inline]
    pub fn at(&self, texel: Option<MapTexel>) -> &TexelRadiance {
        texel.map_or(&TexelRadiance::UNKNOWN, |texel| &self.0[texel.place()])
    }
}

/// The points of a whole texel over which its reflectance is averaged, in the unit square: one in each of four columns
/// and of four rows.
const POINTS: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Per texel of all maps, the mean reflectance of its front, where a texture makes it vary over the triangle; NaN
/// elsewhere, and where light passes through parts of the surface, since rays hit only the rest. Empty where no texel
/// has such a mean.
pub(crate) fn mean_reflectances(texels: &CoveredTexels<'_>, patches: &Patches) -> Vec<Vec3> {
    let scene = texels.scene;
    let at_point = |point: &FootprintPoint| {
        let triangle = &scene.triangles[point.triangle as usize];
        let surface = &scene.surfaces[triangle.surface as usize];
        let is_uniform = patches.reflectance(point.triangle, Side::Front).is_some();
        if scene.stop.is_cancelled() || is_uniform || scene.is_masked(point.triangle) {
            return None;
        }
        let (u, v) = point.at;
        Some(surface.reflectance(Side::Front, triangle.vertices, [1.0 - u - v, u, v]))
    };
    let of_texel = |texel: &Texel| -> Option<(MapTexel, Vec3)> {
        // All points or none: a texel that also shows a surface of one colour is read at the point that was hit.
        let reflectances: Option<Vec<Vec3>> = match &texel.footprint {
            Footprint::Points(points) => points.iter().map(at_point).collect(),
            _ => POINTS.iter().map(|&[x, y]| at_point(&texel.point(scene, x, y)?)).collect(),
        };
        let reflectances = reflectances.filter(|reflectances| !reflectances.is_empty())?;
        Some((texel.index, reflectances.iter().sum::<Vec3>() / reflectances.len() as f32))
    };
    let means: Vec<(MapTexel, Vec3)> = texels.list.par_iter().filter_map(of_texel).collect();
    let mut by_place = if means.is_empty() { Vec::new() } else { vec![Vec3::NAN; texels.layout.texels] };
    for (texel, reflectance) in means {
        by_place[texel.place()] = reflectance;
    }
    by_place
}
