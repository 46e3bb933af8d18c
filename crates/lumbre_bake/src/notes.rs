//! What a bake writes into its report on the way. Not what it computes.

use std::collections::BTreeMap;

use crate::progress::Watch;
use crate::scene::BakeScene;
use crate::scene::Object;
use crate::texels::footprint::{Texel, receiver};
use crate::texels::local_light::LocalLight;
use crate::texels::rounds::{open_sum, relative_to};
use crate::transport::direct::Sources;
use crate::{BakeOptions, BakeReport, ErrorAtTime, RebakeReport, WorstPlace};
use glam::{IVec3, Vec3};

/// Ends the last stage.
pub(crate) fn finish(mut report: BakeReport, watch: &mut Watch<'_>) -> BakeReport {
    watch.end_stage(&mut report);
    // What is still to be done with the result may be interrupted too.
    watch.tape.flush();
    report.seconds = watch.seconds();
    // From here on there is a map of that error.
    if !report.curve.is_empty() {
        report.curve.push(ErrorAtTime { seconds: report.seconds, error: report.estimated_error });
    }
    report.resumed_seconds = watch.tape.resumed;
    report.warnings.append(&mut watch.tape.warnings);
    let casting: f64 = report
        .stages
        .iter()
        .filter(|stage| {
            ["direct light", "form factors", "final gather", "probes", "resolution"]
                .contains(&stage.stage.as_str())
        })
        .map(|stage| stage.seconds)
        .sum();
    report.mega_rays_per_second = if casting > 0.0 { report.rays as f64 * 1e-6 / casting } else { 0.0 };
    report
}

/// The kinds of light that the scene has none of.
pub(crate) fn name_what_is_missing(sources: &Sources<'_>, report: &mut BakeReport) {
    if sources.emitters.is_empty() {
        report.skipped.push("area light: no surface emits".into());
    }
    if !sources.has_sky() {
        report.skipped.push("sky light: the scene has no sky".into());
    }
    if sources.lights.is_empty() {
        report.skipped.push("punctual light: no point, spot or directional light is static or mixed".into());
    }
}

/// The mean over the texels that are not hidden.
pub(crate) fn note_mean(texels: &[Texel], values: &[Vec3], report: &mut BakeReport) {
    let (mut sum, mut count) = (glam::DVec3::ZERO, 0u32);
    for (_, value) in texels.iter().zip(values).filter(|(texel, _)| !texel.is_hidden()) {
        sum += value.as_dvec3();
        count += 1;
    }
    report.mean_irradiance = (sum / f64::from(count.max(1))).to_array();
}

/// The error of a map without bounces.
pub(crate) fn note_direct_error(
    texels: &[Texel],
    variances: &[f32],
    local: &LocalLight,
    options: &BakeOptions,
    report: &mut BakeReport,
) {
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64;
    let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
    report.estimated_error = (open_sum(texels, &local.relative(variances)) / open).sqrt();
    report.error_of_mean = relative_to(mean, open_sum(texels, variances) / open);
    report.error_reached = report.estimated_error <= options.error;
}

/// Places are cubes of this share of the level's longest side.
const PLACE: f32 = 1.0 / 8.0;
/// Places with fewer of the open texels are not told.
const LEAST_TEXELS: f64 = 0.01;
const MOST_PLACES: usize = 3;
const MOST_OBJECTS: usize = 2;

/// What is found in one place.
#[derive(Default)]
struct Place {
    texels: u32,
    position: glam::DVec3,
    squares: f64,
    of_objects: BTreeMap<u32, f64>,
}

/// Where the error is largest.
pub(crate) fn note_worst(
    scene: &BakeScene,
    objects: &[Object],
    texels: &[Texel],
    squares: &[f32],
    report: &mut BakeReport,
) {
    let corners = || scene.triangles.iter().flat_map(|triangle| triangle.corners);
    let (low, high) = corners().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), c| (l.min(c), h.max(c)));
    let side = PLACE * (high - low).max_element();
    let mut places: BTreeMap<[i32; 3], Place> = BTreeMap::new();
    let mut open = 0u32;
    for (texel, &square) in texels.iter().zip(squares).filter(|(texel, _)| !texel.is_hidden()) {
        let Some(point) = texel.point(scene, 0.5, 0.5) else { continue };
        let position = receiver(scene, &point).position;
        let cell: IVec3 = ((position - low) / side).floor().as_ivec3();
        let place = places.entry(cell.to_array()).or_default();
        place.texels += 1;
        place.position += position.as_dvec3();
        place.squares += f64::from(square);
        *place.of_objects.entry(texel.object).or_default() += f64::from(square);
        open += 1;
    }
    // What chance leaves in single texels falls out of the whole: the places' errors add up to that.
    let all: f64 = places.values().map(|place| place.squares).sum();
    let scale = f64::from(open) * report.estimated_error.powi(2) / all.max(f64::MIN_POSITIVE);
    let told = |place: Place| {
        let count = f64::from(place.texels);
        let error = (scale * place.squares / count).sqrt();
        let texels = count / f64::from(open);
        if texels < LEAST_TEXELS || error <= report.estimated_error {
            return None;
        }
        let mut worst: Vec<(u32, f64)> = place.of_objects.into_iter().collect();
        worst.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let name = |&(object, _): &(u32, f64)| objects.get(object as usize).map(|object| object.name.clone());
        let objects = worst.iter().take(MOST_OBJECTS).filter_map(name).collect();
        let center = scene.space.world((place.position / count).as_vec3()).to_array();
        Some(WorstPlace { center, error, texels, objects })
    };
    let mut worst: Vec<WorstPlace> = places.into_values().filter_map(told).collect();
    worst.sort_by(|a, b| b.error.total_cmp(&a.error));
    worst.truncate(MOST_PLACES);
    report.worst = worst;
}

/// What can be used, or in the report why nothing can.
pub(crate) fn note_whole<T>(found: Option<Result<T, String>>, report: &mut BakeReport) -> Option<T> {
    match found? {
        Ok(found) => Some(found),
        Err(whole) => {
            report.rebake = Some(RebakeReport { whole, ..RebakeReport::default() });
            None
        }
    }
}
