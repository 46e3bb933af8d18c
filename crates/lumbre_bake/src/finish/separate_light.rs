//! A finished map's light in two: what arrives straight from what shines, and what arrives by bounces. Not how either is found.

use glam::Vec3;

use super::fill::fill;
use crate::cancel_token::CancelToken;
use crate::coverage::covered_texels::CoveredTexels;
use crate::direct_light::DirectLight;
use crate::final_gather::rounds::IndirectLight;

/// Irradiance of the texels of all maps in two, W/m²; NaN where nothing is known.
pub(crate) struct Separate {
    pub direct: Vec<Vec3>,
    pub bounced: Vec<Vec3>,
}

/// Divides the finished light of all maps (filled, seams closed) as the light of the covered texels divides, channel by channel. What was done to the
/// whole is so done to both in proportion: neither is negative, and they add up to the map.
pub(crate) fn separate(
    texels: &CoveredTexels<'_>,
    (direct, bounced): (&DirectLight, &IndirectLight),
    finished: &[Vec3],
    rings: u32,
    stop: &CancelToken,
) -> Separate {
    let unknown = vec![0.0; texels.list.len()];
    let filled = |light: &[Vec3]| fill(texels, (light, &unknown), rings, stop).0;
    let straight: Vec<Vec3> = direct.texels.iter().map(|own| own.baked).collect();
    let by_bounces = match bounced.light.is_empty() {
        true => vec![Vec3::ZERO; texels.list.len()],
        false => bounced.light.clone(),
    };
    let (straight, by_bounces) = (filled(&straight), filled(&by_bounces));
    let divide = |((&whole, &direct), &bounced): ((&Vec3, &Vec3), &Vec3)| {
        let share = direct / (direct + bounced).max(Vec3::splat(f32::MIN_POSITIVE));
        let direct = whole * share.clamp(Vec3::ZERO, Vec3::ONE);
        (direct, whole - direct)
    };
    let (direct, bounced) = finished.iter().zip(&straight).zip(&by_bounces).map(divide).unzip();
    Separate { direct, bounced }
}
