//! The light and the reflectance of whole texels, for rays that hit them. Not where rays go: that is `incident`.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::coverage::footprint::{Footprint, FootprintPoint, Texel};
use crate::final_gather::gather_sums::GatherSums;
use crate::radiosity::patches::Patches;
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout};
use crate::texel_index::MapTexel;

/// The irradiance by bounces that an earlier round of the gather has found in every texel. It is more accurate than
/// that of the patches, so rays that read it need no further bounce.
#[derive(Clone, Debug, Default)]
pub(crate) struct GatheredLight {
    /// Per texel of all maps; NaN irradiance where it is not known.
    texels: Vec<TexelLight>,
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

impl GatheredLight {
    /// `gathered`, `light` and `variances` are per covered texel; `direct`, per texel of all maps, is NaN where one
    /// value does not hold for the whole texel.
    pub fn new(
        texels: &[Texel],
        gathered: &[GatherSums],
        light: &[Vec3],
        variances: &[f32],
        direct: &[Vec3],
    ) -> Self {
        let unknown = TexelLight { irradiance: Vec3::NAN, variance: 0.0, patch_error: Vec2::ZERO };
        let mut known = vec![unknown; direct.len()];
        for (place, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            let (irradiance, variance) = (light[place], variances[place]);
            let patch_error = gathered[place].patch_error();
            let is_finite = irradiance.is_finite() && variance.is_finite() && patch_error.is_finite();
            if is_finite && !direct[texel.index.place()].is_nan() {
                known[texel.index.place()] = TexelLight { irradiance, variance, patch_error };
            }
        }
        Self { texels: known }
    }

    /// The light of a texel, if it is known.
    #[inline]
    pub fn at(&self, texel: MapTexel) -> Option<&TexelLight> {
        self.texels.get(texel.place()).filter(|texel| !texel.irradiance.x.is_nan())
    }
}

/// The points of a whole texel over which its reflectance is averaged, in the unit square: one in each of four columns
/// and of four rows.
const POINTS: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Per texel of all maps, the mean reflectance of its front, where a texture makes it vary over the triangle; NaN
/// elsewhere, and where light passes through parts of the surface, since rays hit only the rest. Empty where no texel
/// has such a mean.
pub(crate) fn mean_reflectances(
    scene: &BakeScene,
    layout: &LightmapLayout,
    patches: &Patches,
    texels: &[Texel],
) -> Vec<Vec3> {
    let at_point = |point: &FootprintPoint| {
        let triangle = &scene.triangles[point.triangle as usize];
        let surface = &scene.surfaces[triangle.surface as usize];
        let is_uniform = patches.reflectance(point.triangle, Side::Front).is_some();
        if scene.stop.is_cancelled() || is_uniform || surface.is_masked() {
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
    let means: Vec<(MapTexel, Vec3)> = texels.par_iter().filter_map(of_texel).collect();
    let mut by_place = if means.is_empty() { Vec::new() } else { vec![Vec3::NAN; layout.texels] };
    for (texel, reflectance) in means {
        by_place[texel.place()] = reflectance;
    }
    by_place
}
