//! LUMBRE_irradiance_volume: reads the 3D KTX2 image beside a baked file. Not the making of such volumes.

use super::document::shortened;
use super::error::LoadProblem;
use super::extensions::IrradianceVolumeExtension;
use super::limits::{Budget, LoadLimits};
use super::uri::{self, Base};
use crate::IrradianceVolume;
use crate::lightmap_files::{Ktx2Error, Ktx2Header};

/// The volume of a node.
pub(crate) fn irradiance_volume(
    source: &IrradianceVolumeExtension,
    place: &str,
    base: Base<'_>,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<IrradianceVolume, LoadProblem> {
    let place = format!("{place}: irradiance volume {}", shortened(&source.image));
    let bytes = uri::fetch(&source.image, base, &place)?;
    let refused = |problem: String| LoadProblem::Image { place: place.clone(), problem };
    let unreadable = |error: Ktx2Error| refused(format!("{error}; bake again"));
    let header = Ktx2Header::read(&bytes).map_err(unreadable)?;
    let sides = [header.width, header.height, header.depth.unwrap_or(1)];
    if let Some(side) = sides.into_iter().find(|&side| side > limits.image_side) {
        let most = limits.image_side;
        return Err(refused(format!("claims {side} texels along a side; at most {most} are allowed")));
    }
    // As bytes, as packed texels and as colours.
    budget.charge(header.texels, 4 + 4 + 12, || place.clone())?;
    IrradianceVolume::from_ktx2(&bytes, header.texels).map_err(unreadable)
}
