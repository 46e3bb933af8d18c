//! The exchange of light between patches: starts with their direct light and solves the radiosity system of each
//! channel. Patches and form factors are found in `transport`; the light of texels is gathered in `final_gather`.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::form_factors::FormFactors;
use super::patch_light::direct_halves;
use super::patches::{Patch, Patches};
use super::sampling_guide::SamplingGuide;
use super::size_error::{MeanSystem, size_error};
use super::solution::{TOLERANCE, gather};
use super::transport::Transport;
use crate::color::wide_channel_mean;
use crate::monitor::BakeMonitor;
use crate::options::Solver;
use crate::report::StageNotes;
use crate::scene::BakeScene;
use crate::sources::Sources;
use crate::{BakeError, BakeOptions};

/// The light of all patches, which the final gather reads.
pub(crate) struct Exchange {
    pub patches: Patches,
    /// Direct irradiance of each patch's open part, W/m².
    pub direct: Vec<Vec3>,
    /// Irradiance of each patch by bounces and by the sky, W/m².
    pub indirect: Vec<Vec3>,
    /// Signed errors of `indirect`, mean of the channels: a sample of the error by the form factors' noise, and an
    /// estimate of the error by the patches' size.
    pub indirect_error: Vec<Vec2>,
    /// Per patch, the distance below which it is too coarse to be read, canonical units.
    pub min_read_distance: Vec<f32>,
    /// Where each patch's light by bounces comes from.
    pub guide: Arc<SamplingGuide>,
    /// Light that leaves each patch, without its emission, W/m².
    pub exitance: Vec<Vec3>,
    /// Bound of the solver's error, relative to the light by bounces.
    pub residual_bound: f64,
}

/// The figures of the exchange of light, as in [`BakeReport`](crate::BakeReport).
#[derive(Debug, Default)]
pub(crate) struct ExchangeReport {
    pub patches: usize,
    pub form_factors: usize,
    pub energy_lost: f64,
    pub iterations: [u32; 3],
    pub residual: f64,
    pub residual_bound: f64,
}

/// The exchange with its form factors, if anything bounces; its figures; and notes.
type ExchangeResult = ((Option<(Exchange, FormFactors)>, ExchangeReport), StageNotes);

impl Exchange {
    /// Finds the light of all patches. Returns the form factors as well, by which `rebake` estimates what changes since
    /// a former bake do to the light. `None` where no light reaches a surface that reflects; the notes then say so.
    /// `known_direct` is the direct irradiance of each patch by two independent halves of samples, or `None` for
    /// patches of which it is not known: those cast shadow rays.
    pub fn new(
        sources: &Sources<'_>,
        transport: Transport,
        known_direct: &[Option<[Vec3; 2]>],
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<ExchangeResult, BakeError> {
        let mut report = ExchangeReport::of(&transport);
        let Transport { patches, factors, halves } = transport;
        let open = factors.open.as_slice();
        let (direct_halves, rays) = direct_halves(sources, &patches, open, known_direct, options, monitor)?;
        let mut notes = StageNotes::of_rays(rays);
        let [even, odd] = &direct_halves;
        let direct: Vec<Vec3> = even.iter().zip(odd).map(|(even, odd)| 0.5 * (*even + *odd)).collect();
        let is_dark = |(direct, patch): (&Vec3, &Patch)| *direct * patch.reflectance == Vec3::ZERO;
        if !sources.has_sky() && direct.iter().zip(&patches.list).all(is_dark) {
            notes.skipped.push("radiosity and final gather: no light reaches a surface that reflects".into());
            return Ok(((None, report), notes));
        }
        monitor.advance(0.5)?;
        let sky = sky_irradiance(&factors, sources);
        let indirect = monitor.run_interruptible(0.5, || {
            solve(options.solver, &factors, &patches.list, &direct, &sky, &mut report)
        })?;
        notes.warnings.extend(report.unsolved());
        let noise = monitor.run_interruptible(0.6, || {
            let sky_halves = halves.each_ref().map(|factors| sky_irradiance(factors, sources));
            sampling_error(options.solver, &halves, &direct_halves, &sky_halves, &patches.list)
        })?;
        let by_size = monitor.run_interruptible(0.7, || {
            let arriving = |(direct, sky): (&Vec3, &Vec3)| wide_channel_mean(*direct + *sky);
            let first = direct.iter().zip(&sky).map(arriving).collect();
            let system =
                MeanSystem { solver: options.solver, reflectance: mean_reflectances(&patches.list), first };
            size_error(sources.scene, &patches, &factors, &system)
        })?;
        let reflected =
            |(index, patch): (usize, &Patch)| patch.reflectance * (direct[index] + indirect[index]);
        let exitance: Vec<Vec3> = patches.list.iter().enumerate().map(reflected).collect();
        let guide = monitor.run_interruptible(0.8, || {
            let radiosity: Vec<f32> = exitance.iter().map(|exitance| exitance.element_sum()).collect();
            SamplingGuide::new(sources.scene, &patches, &factors, &radiosity, &sky)
        })?;
        let exchange = Self {
            min_read_distance: patches.min_read_distances(sources.scene),
            patches,
            direct,
            indirect,
            indirect_error: noise.iter().zip(by_size).map(|(&noise, size)| Vec2::new(noise, size)).collect(),
            guide: Arc::new(guide),
            exitance,
            residual_bound: report.residual_bound,
        };
        Ok(((Some((exchange, factors)), report), notes))
    }

    /// Of a scene whose surfaces reflect nothing: `None` without a sky, which is then all that the gather could find.
    pub fn black(sources: &Sources<'_>, transport: Transport) -> ExchangeResult {
        let (report, has_sky) = (ExchangeReport::of(&transport), sources.has_sky());
        let why = match has_sky {
            true => {
                "form factors and radiosity: no surface reflects (rho = 0); the final gather finds the sky"
            }
            false => "form factors, radiosity and final gather: no surface reflects (rho = 0)",
        };
        let notes = StageNotes::of_skipped(why);
        if !has_sky {
            return ((None, report), notes);
        }
        let Transport { patches, factors, .. } = transport;
        let count = patches.list.len();
        let dark = vec![Vec3::ZERO; count];
        let guide = SamplingGuide::new(sources.scene, &patches, &factors, &vec![0.0; count], &dark);
        let exchange = Self {
            direct: dark.clone(),
            indirect: dark.clone(),
            indirect_error: vec![Vec2::ZERO; count],
            min_read_distance: patches.min_read_distances(sources.scene),
            patches,
            guide: Arc::new(guide),
            exitance: dark,
            residual_bound: 0.0,
        };
        ((Some((exchange, factors)), report), notes)
    }

    /// Light that leaves each object, without its emission, W/m²: the least and the most of its patches, by channel.
    /// Backs that receive no light count as black.
    pub fn exitance_of(&self, scene: &BakeScene, objects: usize) -> Vec<[Vec3; 2]> {
        let mut ranges = vec![[Vec3::INFINITY, Vec3::ZERO]; objects];
        for (patch, exitance) in self.patches.list.iter().zip(&self.exitance) {
            let triangle = &scene.triangles[patch.triangle as usize];
            let [least, most] = &mut ranges[triangle.map.place()];
            let has_black_back = !triangle.closed && !triangle.two_sided;
            *least = least.min(if has_black_back { Vec3::ZERO } else { *exitance });
            *most = most.max(*exitance);
        }
        // An object without patches has no least.
        let range = |[least, most]: [Vec3; 2]| [if least.is_finite() { least } else { Vec3::ZERO }, most];
        ranges.into_iter().map(range).collect()
    }
}

impl ExchangeReport {
    /// Before the radiosity system is solved.
    fn of(transport: &Transport) -> Self {
        Self {
            patches: transport.patches.list.len(),
            form_factors: transport.factors.columns.len(),
            energy_lost: transport.factors.energy_lost,
            ..Self::default()
        }
    }

    /// A warning if the solver has ended too early.
    fn unsolved(&self) -> Option<String> {
        (self.residual > 2.0 * TOLERANCE).then(|| {
            format!(
                "the radiosity system was solved to a residual of {:.1e} only, after {} iterations; {TOLERANCE:.0e} was wanted",
                self.residual,
                self.iterations.into_iter().max().unwrap_or_default()
            )
        })
    }
}

/// Reflectance of each patch, mean of the channels.
pub(crate) fn mean_reflectances(patches: &[Patch]) -> Vec<f64> {
    patches.iter().map(|patch| wide_channel_mean(patch.reflectance)).collect()
}

/// Irradiance of each patch by the sky.
fn sky_irradiance(factors: &FormFactors, sources: &Sources<'_>) -> Vec<Vec3> {
    factors.sky.iter().map(|&share| share * sources.sky).collect()
}

/// A sample of the error of `indirect` by the noise of rays: half the difference of the solutions by two independent
/// halves of the rays, with the mean of the channels as the light.
fn sampling_error(
    solver: Solver,
    halves: &[FormFactors; 2],
    direct: &[Vec<Vec3>; 2],
    sky: &[Vec<Vec3>; 2],
    patches: &[Patch],
) -> Vec<f32> {
    let reflectance = mean_reflectances(patches);
    let [a, b] = [0, 1].map(|half| {
        let factors = &halves[half];
        let lit = direct[half].iter().zip(&sky[half]).zip(patches);
        let emission: Vec<f64> =
            lit.map(|((light, sky), patch)| wide_channel_mean((*light + *sky) * patch.reflectance)).collect();
        let solution = solver.solve(factors, &reflectance, &emission, TOLERANCE);
        let gathered = gather(factors, &solution.radiosity);
        gathered
            .iter()
            .zip(&sky[half])
            .map(|(light, sky)| light + wide_channel_mean(*sky))
            .collect::<Vec<f64>>()
    });
    a.iter().zip(&b).map(|(a, b)| (0.5 * (a - b)) as f32).collect()
}

/// Irradiance of each patch by the sky and by bounces: the latter is Σ_j F_ij B_j, where the radiosity B is the
/// solution for the reflected direct light and skylight as the emission.
fn solve(
    solver: Solver,
    factors: &FormFactors,
    patches: &[Patch],
    direct: &[Vec3],
    sky: &[Vec3],
    report: &mut ExchangeReport,
) -> Vec<Vec3> {
    let first: Vec<Vec3> = direct.iter().zip(sky).map(|(direct, sky)| *direct + *sky).collect();
    let channels: Vec<(Vec<f64>, u32, f64)> = (0..3)
        .into_par_iter()
        .map(|channel| {
            let reflectance: Vec<f64> = patches.iter().map(|p| f64::from(p.reflectance[channel])).collect();
            let emission: Vec<f64> =
                first.iter().zip(&reflectance).map(|(e, &rho)| f64::from(e[channel]) * rho).collect();
            let solution = solver.solve(factors, &reflectance, &emission, TOLERANCE);
            let gathered = gather(factors, &solution.radiosity);
            (gathered, solution.iterations, solution.residual)
        })
        .collect();
    let largest = patches.iter().map(|p| f64::from(p.reflectance.max_element())).fold(0.0, f64::max);
    for (channel, (_, iterations, residual)) in channels.iter().enumerate() {
        report.iterations[channel] = *iterations;
        report.residual = report.residual.max(*residual);
    }
    report.residual_bound = report.residual / (1.0 - largest);
    let [red, green, blue] = [0, 1, 2].map(|channel| &channels[channel].0);
    (0..patches.len()).map(|i| sky[i] + DVec3::new(red[i], green[i], blue[i]).as_vec3()).collect()
}
