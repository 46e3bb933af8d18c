//! Imports LUMBRE_irradiance_volume with its 3D KTX2 image.

use super::document::shortened;
use super::error::LoadProblem;
use super::extensions::IrradianceVolumeExtension;
use super::limits::{Budget, LoadLimits};
use super::uri::{self, Base};
use crate::IrradianceVolume;
use crate::lightmap_files::{Ktx2Error, Ktx2Header};

/// The irradiance volume of a node.
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
    // Each texel is held as bytes, as a packed texel and as a colour.
    budget.charge(header.texels, 4 + 4 + 12, || place.clone())?;
    let volume = IrradianceVolume::from_ktx2(&bytes, header.texels).map_err(unreadable)?;
    let inside = marks(&source.inside, volume.cubes.len()).ok_or_else(|| LoadProblem::Value {
        place: place.clone(),
        field: "inside".to_owned(),
        value: format!("a list of {} numbers", source.inside.len()),
        expected: format!(
            "it must be runs of probes, first and how many, in order and among the {} of the image; bake again",
            volume.cubes.len()
        ),
    })?;
    Ok(IrradianceVolume { inside, ..volume })
}

/// Expands runs to one flag per probe. Returns an empty list if there are no runs, and `None` if they are not
/// ascending or exceed the number of probes.
fn marks(runs: &[u32], probes: usize) -> Option<Vec<bool>> {
    if runs.is_empty() {
        return Some(Vec::new());
    }
    let mut marks = Vec::with_capacity(probes);
    for run in runs.chunks(2) {
        let &[first, count] = run else { return None };
        let (first, end) = (first as usize, first as usize + count as usize);
        if first < marks.len() || end > probes {
            return None;
        }
        marks.resize(first, false);
        marks.resize(end, true);
    }
    marks.resize(probes, false);
    Some(marks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_in_order_and_among_the_probes() {
        assert_eq!(marks(&[], 3), Some(vec![]));
        assert_eq!(marks(&[1, 2, 4, 1], 6), Some(vec![false, true, true, false, true, false]));
        assert_eq!(marks(&[0, 3], 3), Some(vec![true; 3]));
        for faulty in [&[1][..], &[0, 4], &[2, 1, 1, 1], &[u32::MAX, u32::MAX], &[0, 1, 2]] {
            assert_eq!(marks(faulty, 3), None, "{faulty:?}");
        }
    }
}
