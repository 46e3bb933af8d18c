//! What a bake will need, told before it needs it, and kept within what it may take: fewer patches and rays where more would not fit.
//! Not a measurement: a bound that a test holds against the measured peak.

use std::mem::size_of;

use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::{Footprint, FootprintPoint, Texel};
use crate::denoise::replicates::Estimates;
use crate::denoise::texel_rows::BESIDE_A_ROW;
use crate::error::mebibytes;
use crate::final_gather::gather_sums::GatherSums;
use crate::radiosity::exchange::Resolution;
use crate::radiosity::patches::{Patch, Patches};
use crate::rebake::TexelSamples;
use crate::scene::{BakeScene, LightmapLayout, SceneTriangle};
use crate::sources::direct::Direct;
use crate::{BakeError, BakeOptions, BakeReport};

/// Of a triangle: itself, its corners for the hierarchy and with its index while it is built, two nodes of the binary tree that is built first,
/// and of what rays meet: its lane of a block that may be half empty, and its share of nodes of eight (256 bytes each, one in four triangles at worst);
/// of the tree of boxes its number, and a node at worst.
const TRIANGLE_BYTES: u64 =
    (size_of::<SceneTriangle>() + 36 + 40 + 2 * 64 + 2 * 40 + 256 / 4 + 4 + 32) as u64;

/// Of a texel that shows a surface: what it has gathered before and after a round, raw and smoothed estimates with their guides, and
/// sixteen lists of one number each for the errors; the light around it, and its block. (What it has of shared samples is less, and gone by then.)
const COVERED_TEXEL_BYTES: u64 = (size_of::<Texel>()
    + size_of::<Direct>()
    + 2 * size_of::<GatherSums>()
    + 2 * size_of::<Estimates>()
    + 24
    + 16 * 4
    + 3 * 4) as u64;

/// Of a texel of a map: its light, direct and filled, the fill's two lists with their errors, and its error; or, before that and more, the numbers
/// that smoothing keeps in rows: estimates with their bias, those of the weighted fit, guides with the noise, products and nearness. Its place
/// among the covered ones and its surface; its reflectance, and the light that the rounds before have gathered, with its error.
const MAP_TEXEL_BYTES: u64 = 4 * (13 + 12 + 7 + 1 + 1) + 8 + 4 * (3 + 3 + 1 + 2);

/// Of a texel of a map, for direct and bounced light apart: both as they were found, filled, and divided.
const SEPARATE_LIGHT_BYTES: u64 = 6 * 12;

/// Bytes of the texels of all maps.
fn of_maps(layout: &LightmapLayout, options: &BakeOptions) -> u64 {
    let separate = if options.separate_light { SEPARATE_LIGHT_BYTES } else { 0 };
    (layout.texels as u64 + margins(layout)) * MAP_TEXEL_BYTES + layout.texels as u64 * separate
}

/// What rows of texels have beside them, in texels.
fn margins(layout: &LightmapLayout) -> u64 {
    layout.maps.iter().map(|map| u64::from(map.height) * BESIDE_A_ROW as u64).sum()
}

/// Of a patch: itself, its direct light in two halves and together, its rows' heads, and sixteen lists of the solver for each channel; how near it
/// may be read.
const PATCH_BYTES: u64 = (size_of::<Patch>() + 4 * 12 + 6 * 24 + 3 * 16 * 8 + 4) as u64;

/// Of a ray for form factors that meets a patch of its own: the count of it in the rays' half (a list may have grown to twice its
/// length), in the row and in the column, and both entries of the pair in the matrix and in a half's.
const FORM_FACTOR_RAY_BYTES: u64 = 2 * 8 + 8 + 2 * 8 + 2 * 8 + 8;

/// Of a patch, for the guide: its region, its place in the list of that, what leaves it, and at worst a region of its own, with the
/// cut, the head of its list and row, its brightness and exchange.
const GUIDED_PATCH_BYTES: u64 = (4 + 8 + 4 + size_of::<Patch>() + 16 + 24 + 16 + 8 + 8) as u64;

/// Of a pair of regions: the one and the probability, in lists that may have grown to twice their length. A ray makes two.
const GUIDE_PAIR_BYTES: u64 = 2 * 2 * (4 + 4);

/// Of a covered texel, for the next bake: its samples.
pub(crate) const SAMPLES_BYTES: u64 = size_of::<TexelSamples>() as u64;

/// Of a covered texel, by a former bake: its samples, and of those what stays as it is; its change, and its light and direct light before.
pub(crate) const FORMER_SAMPLES_BYTES: u64 =
    (size_of::<TexelSamples>() + size_of::<GatherSums>() + size_of::<Option<Direct>>() + 8 + 4 + 4 + 4 * 12)
        as u64;

/// What nothing counts: threads, buffers, the checkpoint's block.
const OTHER_BYTES: u64 = 32 << 20;

/// Refuses what cannot fit before its texels are listed. `samples` are the bytes of a covered texel for samples of this bake and a former one.
///
/// # Errors
/// [`BakeError::Memory`].
pub(crate) fn check_texels(
    scene: &BakeScene,
    layout: &LightmapLayout,
    samples: u64,
    options: &BakeOptions,
) -> Result<(), BakeError> {
    let Some(limit) = options.memory else { return Ok(()) };
    let area = |t: &SceneTriangle| f64::from((t.uv[1] - t.uv[0]).perp_dot(t.uv[2] - t.uv[0]).abs()) / 2.0;
    let covered = scene.triangles.iter().map(area).sum::<f64>().min(layout.texels as f64) as u64;
    let texels = covered * (COVERED_TEXEL_BYTES + samples) + of_maps(layout, options);
    let needed = texels + scene.triangles.len() as u64 * TRIANGLE_BYTES + OTHER_BYTES;
    if needed > limit {
        return Err(BakeError::Memory { needed, texels, covered, limit });
    }
    Ok(())
}

/// How finely light is exchanged: as the quality asks for and the memory allows. States what will be needed.
///
/// # Errors
/// [`BakeError::Memory`] if the coarsest does not fit.
pub(crate) fn resolution(
    scene: &BakeScene,
    texels: &CoveredTexels<'_>,
    samples: u64,
    options: &BakeOptions,
    report: &mut BakeReport,
) -> Result<Resolution, BakeError> {
    let effort = options.effort();
    let CoveredTexels { layout, list: texels, side: texel_side, .. } = texels;
    let area: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
    let side = (effort.patch_texels * texel_side).max((2.0 * area / effort.patches as f32).sqrt());
    let mut resolution = Resolution { patch_side: side, form_factor_rays: effort.form_factor_rays };
    let triangles = scene.triangles.len() as u64;
    let covered = texels.len() as u64;
    let listed = texels.iter().map(|texel| match &texel.footprint {
        Footprint::Points(points) => points.capacity() as u64,
        Footprint::Whole(_) | Footprint::Hidden => 0,
    });
    let points = listed.sum::<u64>();
    let for_texels = covered * (COVERED_TEXEL_BYTES + samples)
        + points * size_of::<FootprintPoint>() as u64
        + of_maps(layout, options);
    let asked = Patches::count(scene, side);
    let (mut patches, mut fewest) = (asked, false);
    loop {
        let needed =
            for_texels + triangles * TRIANGLE_BYTES + OTHER_BYTES + exchange_bytes(&resolution, patches);
        report.memory_bytes = needed;
        let Some(limit) = options.memory.filter(|&limit| needed > limit) else { break };
        if fewest {
            return Err(BakeError::Memory { needed, texels: for_texels, covered, limit });
        }
        resolution.patch_side *= std::f32::consts::SQRT_2;
        resolution.form_factor_rays /= 2;
        let fewer = Patches::count(scene, resolution.patch_side);
        fewest = fewer == patches && resolution.form_factor_rays == 0;
        patches = fewer;
    }
    if resolution.patch_side > side {
        report.warnings.push(format!(
            "{patches} patches instead of {asked}, and {} form factor rays instead of {}, so that the bake stays within {}",
            resolution.form_factor_rays,
            effort.form_factor_rays,
            mebibytes(options.memory.unwrap_or_default())
        ));
    }
    tracing::info!(
        "this bake needs about {} at most: {covered} texels, {triangles} triangles, {patches} patches",
        mebibytes(report.memory_bytes)
    );
    Ok(resolution)
}

/// Of the patches and their form factors.
fn exchange_bytes(resolution: &Resolution, patches: u64) -> u64 {
    // Every patch casts some, however small it is; no patch meets more others than there are.
    let rays = (resolution.form_factor_rays as u64 + 32 * patches).min(patches.saturating_mul(patches));
    // Regions are fewer than patches, and exchange no more pairs than these.
    patches * (PATCH_BYTES + GUIDED_PATCH_BYTES) + rays * (FORM_FACTOR_RAY_BYTES + GUIDE_PAIR_BYTES)
}
