//! What is known of the light and the colour of whole texels, for rays that hit them. Not where rays go: that is `incident`.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::coverage::footprint::{Footprint, FootprintPoint, Texel};
use crate::final_gather::gather_sums::GatherSums;
use crate::radiosity::patches::Patches;
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout};
use crate::texel_index::MapTexel;

/// The irradiance by bounces that a former round of the gather has found in every texel: closer than that of the patches, so that rays that read it
/// need no further bounce.
#[derive(Clone, Debug, Default)]
pub(crate) struct GatheredLight {
    /// Per texel of all maps; NaN irradiance where it is not known.
    texels: Vec<TexelLight>,
}

/// Of a texel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelLight {
    /// By bounces, W/m².
    pub irradiance: Vec3,
    /// The variance that noise and smoothing leave in that, mean of the channels.
    pub variance: f32,
    /// What the patches' errors add to it, each with its sign.
    pub patch_error: Vec2,
}

impl GatheredLight {
    /// Lists are those of the covered texels; `direct`, per texel of all maps, is NaN where a texel has more than one light.
    pub fn new(
        texels: &[Texel],
        gathered: &[GatherSums],
        light: &[Vec3],
        variances: &[f32],
        direct: &[Vec3],
    ) -> Self {
        let unknown = TexelLight { irradiance: Vec3::NAN, variance: 0.0, patch_error: Vec2::ZERO };
        let mut found = vec![unknown; direct.len()];
        for (place, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            let (irradiance, variance) = (light[place], variances[place]);
            let patch_error = gathered[place].patch_error();
            let finite = irradiance.is_finite() && variance.is_finite() && patch_error.is_finite();
            if finite && !direct[texel.index.place()].is_nan() {
                found[texel.index.place()] = TexelLight { irradiance, variance, patch_error };
            }
        }
        Self { texels: found }
    }

    /// That of a texel, if it is known.
    #[inline]
    pub fn at(&self, texel: MapTexel) -> Option<&TexelLight> {
        self.texels.get(texel.place()).filter(|texel| !texel.irradiance.x.is_nan())
    }
}

/// The points of a whole texel that its reflectance is the mean of, in the unit square: one in each of four columns and of four rows.
const POINTS: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Per texel of all maps, the mean reflectance of its front, where a texture makes it differ over the triangle; NaN elsewhere, and where light
/// passes through some of it, as rays meet the rest alone. Empty where that is nowhere.
pub(crate) fn mean_reflectances(
    scene: &BakeScene,
    layout: &LightmapLayout,
    patches: &Patches,
    texels: &[Texel],
) -> Vec<Vec3> {
    let at_point = |point: &FootprintPoint| {
        let triangle = &scene.triangles[point.triangle as usize];
        let surface = &scene.surfaces[triangle.surface as usize];
        let one_for_all = patches.reflectance(point.triangle, Side::Front).is_some();
        if scene.stop.is_cancelled() || one_for_all || surface.is_masked() {
            return None;
        }
        let (u, v) = point.at;
        Some(surface.reflectance(Side::Front, triangle.vertices, [1.0 - u - v, u, v]))
    };
    let of_texel = |texel: &Texel| -> Option<(MapTexel, Vec3)> {
        // All or none: beside a surface of one colour, that of the point tells.
        let found: Option<Vec<Vec3>> = match &texel.footprint {
            Footprint::Points(points) => points.iter().map(at_point).collect(),
            _ => POINTS.iter().map(|&[x, y]| at_point(&texel.point(scene, x, y)?)).collect(),
        };
        let found = found.filter(|found| !found.is_empty())?;
        Some((texel.index, found.iter().sum::<Vec3>() / found.len() as f32))
    };
    let found: Vec<(MapTexel, Vec3)> = texels.par_iter().filter_map(of_texel).collect();
    let mut all = if found.is_empty() { Vec::new() } else { vec![Vec3::NAN; layout.texels] };
    for (index, reflectance) in found {
        all[index.place()] = reflectance;
    }
    all
}
