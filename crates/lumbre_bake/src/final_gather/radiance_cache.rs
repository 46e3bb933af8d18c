//! The light that leaves surfaces, for the gather's rays to read: direct light by texel, light by bounces by patch or,
//! once a round has gathered it, by texel. Not the rays: they are `gather`'s and `incident`'s.

use std::sync::Arc;

use glam::Vec3;

use super::steep_light::SteepLight;
use super::texel_radiance::{TexelRadiance, TexelRadiances, mean_reflectances};
use crate::coverage::CoveredTexels;
use crate::denoise::REPLICATES;
use crate::direct_light::DirectLight;
use crate::monitor::BakeMonitor;
use crate::radiosity::{Discovery, Exchange, SamplingGuide};
use crate::scene::{BakeScene, LightmapLayout, Side};
use crate::sources::Sources;
use crate::texel_index::MapTexel;
use crate::{BakeError, BakeOptions};

/// The light that leaves surfaces, for rays to read.
pub(crate) struct RadianceCache<'a> {
    pub scene: &'a BakeScene,
    pub sources: &'a Sources<'a>,
    pub layout: &'a LightmapLayout,
    /// The light of patches, for points whose texel has none.
    pub exchange: Exchange,
    /// The light and the reflectance of texels.
    pub texels: TexelRadiances,
    /// Direct light within the texels over which it changes much.
    pub steep: SteepLight,
    /// Radius on a surface within which the errors that rounds leave in texels are correlated, canonical units.
    pub correlation_radius: f32,
    /// Which regions the light of each region comes from: as the patches know it, and with all `discoveries`.
    pub guide: Arc<SamplingGuide>,
    /// What the rounds have found so far that the patches' guide had missed.
    pub discoveries: Vec<Discovery>,
    /// Samples of each replicate in the first round.
    pub first_round_samples: u32,
}

/// Radius, in texels, of the disc over which the errors that smoothing leaves are correlated: 4.1 after the first round
/// of the demo level, 5.4 after the second.
const CORRELATED_TEXELS: f32 = 4.5;

/// Share of the stage's progress that the light of steep texels makes up.
const STEEP_PROGRESS: f32 = 0.05;

impl<'a> RadianceCache<'a> {
    /// The cache before the first round: direct light of texels, light by bounces of patches.
    pub fn new(
        sources: &'a Sources<'a>,
        texels: &CoveredTexels<'a>,
        direct: &DirectLight,
        exchange: Exchange,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let (scene, effort) = (sources.scene, options.effort());
        let mut direct_by_place = direct.by_place(texels);
        monitor.pass(STEEP_PROGRESS);
        let (steep, steep_texels) =
            SteepLight::new(sources, texels, direct, &direct_by_place, options, monitor)?;
        // Its one value, a mean of both sides of the wall, would be wrong on either.
        for texel in &texels.divided {
            direct_by_place[texels.list[texel.place()].index.place()] = Vec3::NAN;
        }
        let reflectance = monitor.run_interruptible(0.0, || mean_reflectances(texels, &exchange.patches))?;
        Ok(Self {
            correlation_radius: CORRELATED_TEXELS * texels.side,
            texels: TexelRadiances::new(&direct_by_place, &steep_texels, &reflectance),
            steep,
            scene,
            sources,
            layout: texels.layout,
            guide: Arc::clone(&exchange.guide),
            exchange,
            discoveries: Vec::new(),
            first_round_samples: effort.gather[0] / REPLICATES as u32,
        })
    }
}

impl RadianceCache<'_> {
    /// The exitance of a point of a surface without its emission (all that it reflects, W/m²); zero where there is no
    /// patch.
    pub fn leaving(&self, triangle: u32, side: Side, at: (f32, f32)) -> Vec3 {
        let Some(patch) = self.exchange.patches.at(triangle, side, at) else { return Vec3::ZERO };
        let texel = self.texels.at(self.texel_at(triangle, side, at));
        let gathered = texel.indirect().map(|light| light.irradiance);
        let indirect = gathered.unwrap_or_else(|| self.exchange.indirect[patch.place()]);
        let direct = self.direct_at(texel, triangle, at);
        let direct = direct.unwrap_or_else(|| self.exchange.direct[patch.place()]);
        let irradiance = direct + indirect;
        self.reflectance_at(triangle, side, at) * irradiance
    }

    /// The direct irradiance (mixed lights included) at a point of the triangle that a texel shows, W/m², if the texel
    /// knows it.
    #[inline]
    pub(crate) fn direct_at(&self, texel: &TexelRadiance, triangle: u32, at: (f32, f32)) -> Option<Vec3> {
        let at_point = texel.steep.and_then(|steep| {
            let place = self.scene.triangles[triangle as usize].place_on_map(at);
            self.steep.at(steep, place - place.trunc())
        });
        at_point.or_else(|| texel.direct())
    }

    /// The reflectance at a point of a surface.
    pub(crate) fn reflectance_at(&self, triangle: u32, side: Side, (u, v): (f32, f32)) -> Vec3 {
        self.exchange.patches.reflectance(triangle, side).unwrap_or_else(|| {
            let triangle = &self.scene.triangles[triangle as usize];
            let surface = &self.scene.surfaces[triangle.surface as usize];
            surface.reflectance(side, triangle.vertices, [1.0 - u - v, u, v])
        })
    }

    /// The texel that shows a point of a surface; `None` on backs and outside the map.
    pub(crate) fn texel_at(&self, triangle: u32, side: Side, at: (f32, f32)) -> Option<MapTexel> {
        let texel = self.layout.texel_at(&self.scene.triangles[triangle as usize], at);
        texel.filter(|_| side == Side::Front)
    }
}
