//! Splits a finished map's light into direct light and light by bounces. Not how either is computed.

use glam::Vec3;

use super::fill::fill;
use crate::final_gather::LitTexels;

/// The two parts of the irradiance, per texel of all maps, W/m²; NaN where nothing is known.
pub(crate) struct Separate {
    pub direct: Vec<Vec3>,
    pub bounced: Vec<Vec3>,
}

/// Splits the finished light of all maps (filled, seams closed) in the proportion of the covered texels' direct light
/// and light by bounces, channel by channel. So whatever finishing did to the whole it does to both parts: neither is
/// negative, and they add up to the map.
pub(crate) fn separate(lit: &LitTexels<'_>, finished: &[Vec3], rings: u32) -> Separate {
    let LitTexels { texels, direct, indirect, .. } = *lit;
    // The errors that come out are not used.
    let no_errors = vec![0.0; texels.list.len()];
    let filled = |light: &[Vec3]| fill(texels, light, &no_errors, rings).0;
    let direct: Vec<Vec3> = direct.texels.iter().map(|direct| direct.baked).collect();
    let bounced = match indirect.light.is_empty() {
        true => vec![Vec3::ZERO; texels.list.len()],
        false => indirect.light.clone(),
    };
    let (direct, bounced) = (filled(&direct), filled(&bounced));
    let split = |((&whole, &direct), &bounced): ((&Vec3, &Vec3), &Vec3)| {
        let share = direct / (direct + bounced).max(Vec3::splat(f32::MIN_POSITIVE));
        let direct = whole * share.clamp(Vec3::ZERO, Vec3::ONE);
        (direct, whole - direct)
    };
    let (direct, bounced) = finished.iter().zip(&direct).zip(&bounced).map(split).unzip();
    Separate { direct, bounced }
}
