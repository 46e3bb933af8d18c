//! Irradiance probes: the baked light in the space between surfaces, for moving objects. Lightmaps are not made here,
//! and probes are not drawn here.
//!
//! A probe holds the light that a moving object does not get from lights in real time: bounces of everything that is
//! baked, the sky, and emissive faces (except those with an `EmissiveLight`, which are polygon lights in a frame). The
//! direct light of point, spot and directional lights is left out, even of static ones: a frame lights objects without
//! a lightmap by them.
//!
//! ```text
//!   grid: cells over the static scene and what moves ─► light: six sides per cell, inside or not
//!                                                    ─► fill: cells inside geometry
//! ```

mod fill;
mod grid;
mod light;

use lumbre_scene::{AmbientCube, IrradianceVolume};

pub(crate) use light::ProbeSample;

use self::grid::Grid;
use crate::chunks::in_chunks_uncheckpointed;
use crate::final_gather::RadianceCache;
use crate::monitor::BakeMonitor;
use crate::report::StageNotes;
use crate::scene::StaticScene;
use crate::sources::Sources;
use crate::{BakeError, BakeOptions, ProbeReport, Quality};

/// An irradiance volume, and where it is.
pub(crate) struct PlacedVolume {
    pub volume: IrradianceVolume,
    pub grid: Grid,
    pub report: ProbeReport,
}

/// The emissive faces whose light probes hold, as sources: those that are not lit in real time. `has_bounces` says
/// whether surfaces reflect light to the probes as well.
///
/// # Errors
/// Why there are no probes.
pub(crate) fn emitters_of_probes<'a>(
    input: &StaticScene,
    sources: &Sources<'a>,
    has_bounces: bool,
    options: &BakeOptions,
) -> Result<Sources<'a>, &'static str> {
    input.calls_for_probes(options)?;
    // The scene's surfaces are the input's primitives, in the same order.
    let lights_frames: Vec<bool> = input.primitives().map(|primitive| primitive.lights_frames).collect();
    let is_lit_in_real_time = |triangle: u32| {
        let surface = sources.scene.triangles[triangle as usize].surface;
        lights_frames.get(surface as usize).copied().unwrap_or(false)
    };
    let emitters = sources.only_emitters(|emitter| !is_lit_in_real_time(emitter.triangle));
    match emitters.is_empty() && !has_bounces {
        true => Err("nothing bounces, and no face shines that is not lit in real time"),
        false => Ok(emitters),
    }
}

/// Bakes the probes, which get light from these `emitters` and by bounces from what is in the `cache`.
pub(crate) fn bake(
    input: &StaticScene,
    emitters: &Sources<'_>,
    cache: Option<&RadianceCache<'_>>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(PlacedVolume, StageNotes), BakeError> {
    let scene = emitters.scene;
    let mut notes = StageNotes::default();
    let grid = Grid::new(scene, input.moving_points(), options.probe_spacing, &mut notes.warnings);
    let clock = monitor.clock();
    let probes: Vec<ProbeSample> = in_chunks_uncheckpointed(grid.count(), monitor, |index| {
        // The volume must be complete, so that the remaining probes are sampled roughly once the time is up.
        let quality = if clock.is_over() { Quality::Draft } else { options.quality };
        let light = light::ProbeLight { scene, emitters, cache, effort: effort(quality) };
        light.at(grid.position(index), options.seed, index as u32)
    })?;
    notes.rays = probes.iter().map(|probe| probe.rays).sum::<u64>();
    let valid: Vec<bool> = probes.iter().map(|probe| !probe.inside).collect();
    let mut cubes: Vec<AmbientCube> = probes.iter().map(|probe| probe.cube).collect();
    fill::fill(grid.resolution, &valid, &mut cubes);
    let report = ProbeReport {
        resolution: grid.resolution.to_array(),
        spacing: grid.spacing(scene.space).to_array(),
        inside: valid.iter().filter(|valid| !**valid).count(),
        estimated_error: light::relative_error(&probes),
    };
    if report.inside == grid.count() {
        notes.warnings.push(
            "every probe lies inside geometry and is dark; give a smaller probe spacing, or turn the faces \
             of the walls to the inside"
                .into(),
        );
    }
    let inside = if valid.contains(&false) { valid.iter().map(|valid| !valid).collect() } else { Vec::new() };
    let volume = IrradianceVolume { resolution: grid.resolution, cubes, inside };
    Ok((PlacedVolume { volume, grid, report }, notes))
}

/// Numbers of a probe's samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProbeEffort {
    /// Rays over the sphere, for each of four replicates.
    sphere: u32,
    /// Samples of the emitters, for each side.
    shadow: u32,
}

fn effort(quality: Quality) -> ProbeEffort {
    match quality {
        Quality::Draft => ProbeEffort { sphere: 32, shadow: 16 },
        Quality::Final => ProbeEffort { sphere: 128, shadow: 64 },
        Quality::Reference => ProbeEffort { sphere: 1024, shadow: 512 },
    }
}
