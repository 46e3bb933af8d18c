//! The texels whose direct light must be found at the very points that rays hit, as one value for the whole texel would
//! not do: those over which direct light changes much, such as around a lamp that hangs just below the ceiling. Of such
//! a texel, rays from the room may reach only the dark part. Light is read in `radiance_cache`.

use glam::Vec3;

use crate::color::channel_mean;
use crate::coverage::CoveredTexels;
use crate::direct_light::LocalLight;
use crate::texel_index::MapTexel;

/// A texel's direct light is steep if that of the texels around it differs by more than this share of the brightest.
const STEEP: f32 = 0.5;
/// It matters only if the brightest of them has this many times the light around the texel: the edge of a shadow is
/// steep too, but rays reach both of its sides.
const MIN_LIGHT: f64 = 2.0;

/// Which texels of all maps have steep direct light. `direct` is per texel of all maps, NaN where it is not known.
pub(crate) fn steep_texels(texels: &CoveredTexels<'_>, direct: &[Vec3], local: &LocalLight) -> Vec<bool> {
    let mut steep = vec![false; direct.len()];
    for (covered, texel) in texels.open() {
        let map = &texels.layout.maps[texel.map.place()];
        let light = |near: MapTexel| channel_mean(direct[near.place()]);
        let around = map.neighbourhood(texel.x, texel.y, 1).map(light).filter(|light| light.is_finite());
        let (least, most) =
            around.fold((f32::INFINITY, 0.0f32), |(least, most), light| (least.min(light), most.max(light)));
        steep[texel.index.place()] =
            most - least > STEEP * most && f64::from(most) > MIN_LIGHT * local.at(covered);
    }
    steep
}
