//! What is known of the light and the colour of whole texels, for rays that hit them. Not where rays go: that is `incident`.

use glam::Vec3;
use rayon::prelude::*;

use super::footprint::Texel;
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout};
use crate::transport::patches::Patches;

/// The irradiance by bounces that a former round of the gather has found in every texel: closer than that of the patches, so that rays that read it
/// need no further bounce.
#[derive(Clone, Debug, Default)]
pub(crate) struct GatheredLight {
    /// Per texel of all maps, irradiance by bounces; NaN where it is not known.
    pub irradiance: Vec<Vec3>,
    /// Of that, its expected squared error, mean of the channels.
    pub variance: Vec<f32>,
}

impl GatheredLight {
    /// `light` and `variances` are those of the covered texels; `direct`, per texel of all maps, is NaN where a texel has more than one light.
    pub fn new(texels: &[Texel], light: &[Vec3], variances: &[f32], direct: &[Vec3]) -> Self {
        let mut found = Self { irradiance: vec![Vec3::NAN; direct.len()], variance: vec![0.0; direct.len()] };
        for (place, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            let index = texel.index as usize;
            if !direct[index].is_nan() {
                found.irradiance[index] = light[place];
                found.variance[index] = variances[place];
            }
        }
        found
    }

    /// Of a texel in the row of all maps, the irradiance and its squared error, if they are known.
    #[inline]
    pub fn at(&self, texel: usize) -> Option<(Vec3, f32)> {
        let irradiance = *self.irradiance.get(texel)?;
        (!irradiance.x.is_nan()).then(|| (irradiance, self.variance[texel]))
    }
}

/// The points of a texel that its reflectance is the mean of, in the unit square: one in each of four columns and of four rows.
const POINTS: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Per texel of all maps, the mean reflectance of its front, where a texture makes it differ over the triangle; NaN elsewhere. Empty where that
/// is nowhere.
pub(crate) fn mean_reflectances(
    scene: &BakeScene,
    layout: &LightmapLayout,
    patches: &Patches,
    texels: &[Texel],
) -> Vec<Vec3> {
    let of_texel = |texel: &Texel| -> Option<(u32, Vec3)> {
        let at_point = |&[x, y]: &[f32; 2]| {
            let point = texel.point(scene, x, y)?;
            if scene.stop.is_set() || patches.reflectance(point.triangle, Side::Front).is_some() {
                return None;
            }
            let triangle = &scene.triangles[point.triangle as usize];
            let (u, v) = point.at;
            let surface = &scene.surfaces[triangle.surface as usize];
            Some(surface.reflectance(Side::Front, triangle.vertices, [1.0 - u - v, u, v]))
        };
        // All or none: beside a surface of one colour, that of the point tells.
        let found: Option<Vec<Vec3>> = POINTS.iter().map(at_point).collect();
        Some((texel.index, found?.into_iter().sum::<Vec3>() / POINTS.len() as f32))
    };
    let found: Vec<(u32, Vec3)> = texels.par_iter().filter_map(of_texel).collect();
    let mut all = if found.is_empty() { Vec::new() } else { vec![Vec3::NAN; layout.texels] };
    for (index, reflectance) in found {
        all[index as usize] = reflectance;
    }
    all
}
