//! Estimates the memory of a bake beforehand and keeps it within [`BakeOptions::memory`], by fewer patches and form
//! factor rays where more would not fit. The estimate is an upper bound; the test `peak_memory` compares it with the
//! measured peak.

use std::mem::size_of;

use crate::coverage::{CoveredTexels, Footprint, FootprintPoint, Texel};
use crate::denoise::texel_rows::BESIDE_A_ROW;
use crate::denoise::{Estimates, Nearness};
use crate::error::mebibytes;
use crate::final_gather::{GatherSums, TexelRadiance};
use crate::radiosity::{Patch, PatchResolution, Patches, Subdivision};
use crate::report::StageNotes;
use crate::scene::{BakeScene, LightmapLayout, SceneTriangle};
use crate::sources::{Direct, Sources};
use crate::{BakeError, BakeOptions};

/// Per triangle of the scene: the triangle itself; while the hierarchy is built, its corners without and with an index,
/// and two nodes of the binary tree; in the finished hierarchy, its lane of a block that may be half empty, and its
/// share of the nodes of eight (256 bytes each, at worst one per four triangles); in the tree of boxes, its number and
/// at worst one node; its neighbours for face clusters; where its patches are, its number and its share in a cluster, with
/// what is allocated ahead, both among the patches and among the larger ones. (The edges by which neighbours are found
/// take less than the building of the hierarchy.)
const TRIANGLE_BYTES: u64 =
    (size_of::<SceneTriangle>() + 36 + 40 + 2 * 64 + 2 * 40 + 256 / 4 + 4 + 32 + 12 + 2 * (48 + 4 + 2 * 12))
        as u64;

/// Per covered texel, at the peak during the final gather: the texel and its direct light, its sums before and after a
/// round, raw and smoothed estimates with their features, its nearness, nineteen lists of one number each for the
/// errors and what a round aims at, its chart, the light around it, its block with its share of what is in view from
/// there, and a cell of steep light. (The sums of the shared samples of direct light need less, and are freed by then.)
const COVERED_TEXEL_BYTES: u64 = (size_of::<Texel>()
    + size_of::<Direct>()
    + 2 * size_of::<GatherSums>()
    + 2 * size_of::<Estimates>()
    + 24
    + size_of::<Nearness>()
    + 19 * 4
    + 7 * 4
    + 12) as u64;

/// Per texel of a map. In the rows of the smoothing, which need more than the maps of light that are filled later:
/// estimates with their bias, the numbers of the weighted fit, features with the noise, products, and nearness.
/// Besides, its place among the covered texels and its surface, and what rays that hit it read.
const MAP_TEXEL_BYTES: u64 = 4 * (13 + 12 + 7 + 1 + 3) + 8 + size_of::<TexelRadiance>() as u64;

/// Per texel of a map, for separate maps of direct and bounced light: both as computed, as filled, and as divided.
const SEPARATE_LIGHT_BYTES: u64 = 6 * 12;

/// Bytes for the texels of all maps, covered or not.
fn map_bytes(layout: &LightmapLayout, options: &BakeOptions) -> u64 {
    let separate = if options.separate_light { SEPARATE_LIGHT_BYTES } else { 0 };
    (layout.texels as u64 + margin_texels(layout)) * MAP_TEXEL_BYTES + layout.texels as u64 * separate
}

/// Number of texels in the margins that the smoothing adds to each row.
fn margin_texels(layout: &LightmapLayout) -> u64 {
    layout.maps.iter().map(|map| u64::from(map.height) * BESIDE_A_ROW as u64).sum()
}

/// Per patch: the patch itself, its direct light in two halves and their mean, the heads of its matrix rows, sixteen
/// lists of the solver for each channel, and the distance below which it is too coarse to read.
const PATCH_BYTES: u64 = (size_of::<Patch>() + 4 * 12 + 6 * 24 + 3 * 16 * 8 + 4) as u64;

/// Per form factor ray, at worst, when each hits a different patch: its count in its half of the rays (a list may have
/// grown to twice its length), in the row and in the column, and both entries of the pair in the matrix and in that of
/// the half.
const FORM_FACTOR_RAY_BYTES: u64 = 2 * 8 + 8 + 2 * 8 + 2 * 8 + 8;

/// Per patch, for the sampling guide: the number of its region, its place in the region's list, its exitance, its
/// probability and its density in the region, and at worst a region of its own, with its cut, the heads of its lists
/// and row, its brightness, its exchange, its place and its cube.
const GUIDED_PATCH_BYTES: u64 =
    (4 + 8 + 4 + 8 + 8 + size_of::<Patch>() + 16 + 28 + 16 + 8 + 8 + 28 + 2 * 16) as u64;

/// Per form factor ray, for the sampling guide: two pairs of regions and as many guesses, each an index and a
/// probability, in lists that may have grown to twice their length. What the guide learns between rounds doubles that, but
/// by then the form factors themselves are freed, which need as much.
const GUIDE_PAIR_BYTES: u64 = 2 * 2 * 2 * (4 + 4);

/// Memory that is not counted above: threads, buffers, the checkpoint's block.
const OTHER_BYTES: u64 = 32 << 20;

/// Checks, before the covered texels are listed, whether they can fit at all. `sample_bytes` are the bytes per covered
/// texel for samples of this bake and a previous one.
///
/// # Errors
/// [`BakeError::Memory`].
pub(crate) fn check_texels(
    sources: &Sources<'_>,
    layout: &LightmapLayout,
    sample_bytes: u64,
    options: &BakeOptions,
) -> Result<(), BakeError> {
    let Some(limit) = options.memory else { return Ok(()) };
    let scene = sources.scene;
    let area = |t: &SceneTriangle| f64::from((t.uv[1] - t.uv[0]).perp_dot(t.uv[2] - t.uv[0]).abs()) / 2.0;
    let covered = scene.triangles.iter().map(area).sum::<f64>().min(layout.texels as f64) as u64;
    let texels = covered * (COVERED_TEXEL_BYTES + sample_bytes) + map_bytes(layout, options);
    let needed = texels + scene_bytes(sources) + OTHER_BYTES;
    if needed > limit {
        return Err(BakeError::Memory { needed, texels, covered, limit });
    }
    Ok(())
}

/// Chooses the resolution of the patches and form factors: that of the quality, or the finest that fits into memory.
/// Warns if it was reduced.
///
/// # Errors
/// [`BakeError::Memory`] if even the coarsest resolution does not fit.
pub(crate) fn patch_resolution(
    sources: &Sources<'_>,
    texels: &CoveredTexels<'_>,
    sample_bytes: u64,
    options: &BakeOptions,
) -> Result<(PatchResolution, StageNotes), BakeError> {
    let effort = options.effort();
    let CoveredTexels { scene, layout, list: texels, contacts, side: texel_side, .. } = texels;
    let area = scene.triangles.iter().map(|triangle| f64::from(triangle.area)).sum::<f64>() as f32;
    let side = (effort.patch_texels * texel_side).max((2.0 * area / effort.patches as f32).sqrt());
    let requested_rays = effort.form_factor_rays(texels.len(), options.error);
    let (subdivision, requested_patches) = choose_subdivision(scene, side, effort.pieces_by_cuts);
    let mut resolution = PatchResolution {
        subdivision,
        texture_points: effort.texture_points,
        form_factor_rays: requested_rays,
        memory_bytes: 0,
    };
    let covered = texels.len() as u64;
    let footprint_points = texels.iter().map(|texel| match &texel.footprint {
        Footprint::Points(points) => points.capacity() as u64,
        Footprint::Whole(_) | Footprint::Hidden => 0,
    });
    let texel_bytes = covered * (COVERED_TEXEL_BYTES + sample_bytes)
        + footprint_points.sum::<u64>() * size_of::<FootprintPoint>() as u64
        + contacts.bytes()
        + map_bytes(layout, options);
    let (mut patches, mut is_coarsest) = (requested_patches, false);
    loop {
        let needed = texel_bytes + scene_bytes(sources) + OTHER_BYTES + exchange_bytes(&resolution, patches);
        resolution.memory_bytes = needed;
        let Some(limit) = options.memory.filter(|&limit| needed > limit) else { break };
        if resolution.form_factor_rays > effort.form_factor_rays {
            // The rays that only a large level gets go first.
            resolution.form_factor_rays = effort.form_factor_rays;
            continue;
        }
        if is_coarsest {
            return Err(BakeError::Memory { needed, texels: texel_bytes, covered, limit });
        }
        let larger = resolution.subdivision.side * std::f32::consts::SQRT_2;
        let (subdivision, fewer) = choose_subdivision(scene, larger, effort.pieces_by_cuts);
        resolution.subdivision = subdivision;
        resolution.form_factor_rays /= 2;
        is_coarsest = fewer == patches && resolution.form_factor_rays == 0;
        patches = fewer;
    }
    let mut notes = StageNotes::default();
    let most_lines = resolution.subdivision.most_lines;
    if resolution.subdivision.has_few_lines() {
        notes.warnings.push(format!(
            "so many surfaces stand on or cross each other that at most {most_lines} of their lines cut a patch; light that bounces off \
             near the lines left out mixes (not so with the final quality, an error below 0.04 and enough time)"
        ));
    }
    if resolution.subdivision.side > side {
        notes.warnings.push(format!(
            "{patches} patches instead of {requested_patches}, and {} form factor rays instead of {requested_rays}, so that the bake stays within {}",
            resolution.form_factor_rays,
            mebibytes(options.memory.unwrap_or_default())
        ));
    }
    tracing::info!(
        "this bake needs about {} at most: {covered} texels, {} triangles, {patches} patches",
        mebibytes(resolution.memory_bytes),
        scene.triangles.len()
    );
    Ok((resolution, notes))
}

/// Patches of about `side` canonical units, with as many lines to cut cells along as add no more than `most_pieces`
/// patches, but at least one; and the number of patches.
fn choose_subdivision(scene: &BakeScene, side: f32, most_pieces: Option<u64>) -> (Subdivision, u64) {
    let mut subdivision = Subdivision::new(scene, side);
    loop {
        let fewer = subdivision.with_fewer_lines();
        let most_pieces = most_pieces.filter(|_| fewer.is_some()).unwrap_or(u64::MAX);
        match (Patches::count(scene, &subdivision, most_pieces), fewer) {
            (None, Some(fewer)) => subdivision = fewer,
            (count, _) => return (subdivision, count.unwrap_or_default()),
        }
    }
}

/// Bytes for the scene and its emitters. A bake with probes may list the emitters that light them once more.
fn scene_bytes(sources: &Sources<'_>) -> u64 {
    sources.scene.triangles.len() as u64 * TRIANGLE_BYTES + 2 * sources.emitter_bytes()
}

/// Bytes for the patches, their form factors and the sampling guide.
fn exchange_bytes(resolution: &PatchResolution, patches: u64) -> u64 {
    // Every patch casts a minimum of rays, however small it is. There can be no more pairs than pairs of patches.
    let rays = (resolution.form_factor_rays as u64 + 32 * patches).min(patches.saturating_mul(patches));
    // The guide's regions are no more than the patches, and their pairs no more than those of the patches.
    patches * (PATCH_BYTES + GUIDED_PATCH_BYTES) + rays * (FORM_FACTOR_RAY_BYTES + GUIDE_PAIR_BYTES)
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};

    use super::*;
    use crate::radiosity::form_factor_tests::scene;

    #[test]
    fn where_leaves_cross_each_other_few_lines_cut_them_if_pieces_are_limited() {
        let leaf = |number: i32| {
            let turn =
                Quat::from_rotation_y(0.13 * number as f32) * Quat::from_rotation_z(0.2 * number as f32);
            let corner = |x: f32, y: f32| turn * Vec3::new(x, y, 0.1);
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            [[a, b, c], [a, c, d]]
        };
        let leaves: Vec<[Vec3; 3]> = (0..24).flat_map(leaf).collect();
        let scene = scene(&[&leaves]);
        let side = 0.5 * scene.space.scale as f32;
        let [all, few, least] =
            [None, Some(4000), Some(0)].map(|most_pieces| choose_subdivision(&scene, side, most_pieces));
        assert!(!all.0.has_few_lines() && few.0.has_few_lines());
        assert!(all.1 > few.1 && few.1 > least.1, "{} {} {}", all.1, few.1, least.1);
        assert_eq!(least.0.most_lines, 1, "a wall at least is cut along");
        for (subdivision, count) in [all, few, least] {
            assert_eq!(Patches::outlines(&scene, &subdivision).list.len() as u64, count);
        }
    }
}
