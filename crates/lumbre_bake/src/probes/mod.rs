//! Irradiance probes: the baked light in the space between surfaces, for what moves there. Not the lightmaps, and not the drawing.
//!
//! A probe holds what a moving object does not get from lights in real time: bounces of everything that is baked, the sky, and emissive faces
//! (those with an `EmissiveLight` apart, which are polygon lights in a frame). The direct light of point, spot and directional lights is
//! left out, also of static ones: a frame lights what has no lightmap with them.
//!
//! ```text
//!   grid: cells over the static scene and what moves ─► light: six sides per cell, inside or not ─► fill: cells inside geometry
//! ```

mod fill;
mod grid;
mod light;

use lumbre_scene::{AmbientCube, IrradianceVolume};

pub(crate) use light::ProbeSample;

use self::grid::Grid;
use crate::chunks::in_chunks_uncheckpointed;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::monitor::{BakeMonitor, Stage};
use crate::scene::{BakeScene, StaticScene};
use crate::sources::light_sources::Sources;
use crate::{BakeError, BakeOptions, BakeReport, ProbeReport, Quality};

/// A volume and where it is.
pub(crate) struct PlacedVolume {
    pub volume: IrradianceVolume,
    pub grid: Grid,
}

/// Bakes the probes, if they are called for; the report says why not.
pub(crate) fn bake(
    input: &StaticScene,
    scene: &BakeScene,
    sources: &Sources<'_>,
    cache: Option<&RadianceCache<'_>>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<Option<PlacedVolume>, BakeError> {
    if let Err(reason) = input.calls_for_probes(options) {
        report.skipped.push(format!("probes: {reason}"));
        return Ok(None);
    }
    // A surface of the scene is a primitive.
    let lights_frames: Vec<bool> = input.primitives().map(|primitive| primitive.lights_frames).collect();
    let in_frames = |triangle: u32| {
        let surface = scene.triangles[triangle as usize].surface;
        lights_frames.get(surface as usize).copied().unwrap_or(false)
    };
    let emitters = sources.only_emitters(|emitter| !in_frames(emitter.triangle));
    if emitters.is_empty() && cache.is_none() {
        report
            .skipped
            .push("probes: nothing bounces, and no face shines that is not lit in real time".into());
        return Ok(None);
    }
    monitor.stage(Stage::Probes, report)?;
    let grid = Grid::new(scene, input.moving_points(), options.probe_spacing, &mut report.warnings);
    let clock = monitor.clock();
    let seen: Vec<ProbeSample> = in_chunks_uncheckpointed(grid.count(), monitor, |index| {
        // A complete volume, whatever time it takes: roughly, once the time is up.
        let quality = if clock.is_over() { Quality::Draft } else { options.quality };
        let light = light::ProbeLight { scene, emitters: &emitters, cache, effort: effort(quality) };
        light.at(grid.position(index), options.seed, index as u32)
    })?;
    report.rays += seen.iter().map(|seen| seen.rays).sum::<u64>();
    let valid: Vec<bool> = seen.iter().map(|seen| !seen.inside).collect();
    let mut cubes: Vec<AmbientCube> = seen.iter().map(|seen| seen.cube).collect();
    fill::fill(grid.resolution, &valid, &mut cubes);
    report.probes = ProbeReport {
        resolution: grid.resolution.to_array(),
        spacing: grid.spacing(scene.space).to_array(),
        inside: valid.iter().filter(|valid| !**valid).count(),
        estimated_error: light::relative_error(&seen),
    };
    if report.probes.inside == grid.count() {
        report.warnings.push(
            "every probe lies inside geometry and is dark; give a smaller probe spacing, or turn the faces \
             of the walls to the inside"
                .into(),
        );
    }
    let inside = if valid.contains(&false) { valid.iter().map(|valid| !valid).collect() } else { Vec::new() };
    let volume = IrradianceVolume { resolution: grid.resolution, cubes, inside };
    Ok(Some(PlacedVolume { volume, grid }))
}

/// Rays of a probe over the sphere for each of four replicates, and to the emitters for each of its sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProbeEffort {
    sphere: u32,
    shadow: u32,
}

fn effort(quality: Quality) -> ProbeEffort {
    match quality {
        Quality::Draft => ProbeEffort { sphere: 32, shadow: 16 },
        Quality::Final => ProbeEffort { sphere: 128, shadow: 64 },
        Quality::Reference => ProbeEffort { sphere: 1024, shadow: 512 },
    }
}
