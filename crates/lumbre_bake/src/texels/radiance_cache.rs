//! The light that leaves surfaces, as the gather reads it: direct light by texel, bounces by patch or, once a round has gathered them, by texel. Not where it is asked for: that is `gather`.

use glam::{Vec2, Vec3};

use super::divided_light::DividedLight;
use super::texel_radiance::GatheredLight;
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout};
use crate::transport::patches::Patches;
use crate::transport::sampling_guide::SamplingGuide;

/// The light that leaves surfaces, as the gather reads it.
#[derive(Clone, Copy)]
pub(crate) struct RadianceCache<'a> {
    pub scene: &'a BakeScene,
    pub layout: &'a LightmapLayout,
    pub patches: &'a Patches,
    /// Per texel of all maps, direct irradiance (mixed lights included); NaN where there is none, or more than one.
    pub direct: &'a [Vec3],
    /// Of the texels that have more than one.
    pub divided: &'a DividedLight,
    /// Irradiance that a surface gets of an unhidden sky.
    pub sky: Vec3,
    /// Per patch, direct irradiance.
    pub patch_direct: &'a [Vec3],
    /// Per patch, irradiance by bounces and by the sky.
    pub patch_indirect: &'a [Vec3],
    /// Per patch, the errors of that, with their signs: by the form factors' noise, and by the patches' size.
    pub patch_error: &'a [Vec2],
    /// Per patch, what is nearer to it than this gets a real bounce more, canonical units.
    pub near: &'a [f32],
    /// What the rounds so far have found of the bounces; nothing in the first.
    pub gathered: &'a GatheredLight,
    /// Within this distance on a surface the errors of `gathered` are correlated, canonical units.
    pub correlated: f32,
    /// Per texel of all maps, mean reflectance, where it is not the same all over the triangle; NaN elsewhere, or empty.
    pub reflectance: &'a [Vec3],
    /// Where each patch's light comes from.
    pub guide: &'a SamplingGuide,
    /// Samples of each replicate in the first round.
    pub run: u32,
}

impl RadianceCache<'_> {
    /// What a point of a surface reflects in all (its exitance without emission, W/m²), as far as it is known.
    pub fn leaving(&self, triangle: u32, side: Side, at: (f32, f32)) -> Vec3 {
        let Some(patch) = self.patches.at(triangle, side, at) else { return Vec3::ZERO };
        let texel = self.texel_at(triangle, side, at);
        let gathered = self.gathered.at(texel).map(|texel| texel.irradiance);
        let indirect = gathered.unwrap_or_else(|| self.patch_indirect[patch as usize]);
        let direct = self.direct_of(texel);
        let direct = direct.unwrap_or_else(|| self.direct_of_part(triangle, side, at, patch));
        let irradiance = direct + indirect;
        self.reflectance_at(triangle, side, at) * irradiance
    }

    pub(super) fn reflectance_at(&self, triangle: u32, side: Side, (u, v): (f32, f32)) -> Vec3 {
        self.patches.reflectance(triangle, side).unwrap_or_else(|| {
            let triangle = &self.scene.triangles[triangle as usize];
            let surface = &self.scene.surfaces[triangle.surface as usize];
            surface.reflectance(side, triangle.vertices, [1.0 - u - v, u, v])
        })
    }

    /// The texel that shows a point, in the row of all maps; the greatest number where none does.
    pub(super) fn texel_at(&self, triangle: u32, side: Side, at: (f32, f32)) -> usize {
        let (index, _) = self.place_at(triangle, at);
        index.filter(|_| side == Side::Front).unwrap_or(usize::MAX)
    }

    /// Of a texel, if it has one for all of it.
    pub(super) fn direct_of(&self, texel: usize) -> Option<Vec3> {
        self.direct.get(texel).copied().filter(|direct| !direct.x.is_nan())
    }

    /// Where the texel has none: of its part or of the patch.
    #[cold]
    pub(super) fn direct_of_part(&self, triangle: u32, side: Side, at: (f32, f32), patch: u32) -> Vec3 {
        let (index, uv) = self.place_at(triangle, at);
        let index = index.filter(|_| side == Side::Front);
        let divided = index.and_then(|index| self.divided.at(index as u32, uv.fract()));
        divided.unwrap_or_else(|| self.patch_direct[patch as usize])
    }

    /// The texel at a point, if it is on the map, and the point on the map.
    fn place_at(&self, triangle: u32, (u, v): (f32, f32)) -> (Option<usize>, Vec2) {
        let triangle = &self.scene.triangles[triangle as usize];
        (self.layout.texel_at(triangle, (u, v)), triangle.place_on_map((u, v)))
    }
}
