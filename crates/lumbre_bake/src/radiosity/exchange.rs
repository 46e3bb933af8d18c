//! The exchange of light between patches: cuts the scene, samples form factors, finds the patches' direct light, solves
//! each channel. Not the texels.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use super::patches::{Patch, Patches};
use super::sampling_guide::SamplingGuide;
use super::size_error::size_error;
use super::solution::gather;
use crate::chunks::in_chunks;
use crate::monitor::{BakeMonitor, Stage};
use crate::options::Solver;
use crate::sampling::{Sequence, Stream, triangle_point};
use crate::scene::material::Side;
use crate::scene::{BakeScene, Receiver};
use crate::sources::light_sources::Sources;
use crate::{BakeError, BakeOptions, BakeReport};

/// The solution that the final gather reads.
pub(crate) struct Exchange {
    pub patches: Patches,
    /// Direct irradiance of each patch's open part.
    pub direct: Vec<Vec3>,
    /// Irradiance by bounces, and by the sky, of each patch.
    pub indirect: Vec<Vec3>,
    /// Errors of that, with their signs: a sample of how the form factors' noise spreads, and what the patches' size leaves. Mean of the
    /// channels.
    pub indirect_error: Vec<Vec2>,
    /// Of each patch, the distance below which it is too coarse to read, canonical units.
    pub near: Vec<f32>,
    /// Where each patch's light by bounces comes from.
    pub guide: SamplingGuide,
    /// What leaves each patch without emission, W/m².
    pub exitance: Vec<Vec3>,
}

/// How finely the exchange of light is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Resolution {
    /// Side of a patch, canonical units.
    pub patch_side: f32,
    /// Rays for all form factors together.
    pub form_factor_rays: usize,
}

/// Relative residual at which the solver stops: well below what form factors are known to.
const TOLERANCE: f64 = 1e-5;

/// Shadow rays of a patch to each source, in each half.
const SHADOW_RAYS: u32 = 8;

impl Exchange {
    /// With the form factors that it came from, which a change since a former bake is estimated by. `None` where nothing bounces; the report then
    /// says why. `direct_light` tells the direct irradiance of patches by two halves of what is known of it; where it tells none, rays do.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn new(
        scene: &BakeScene,
        sources: &Sources<'_>,
        options: &BakeOptions,
        resolution: Resolution,
        direct_light: impl FnOnce(&Patches) -> Vec<Option<[Vec3; 2]>>,
        monitor: &mut BakeMonitor<'_>,
        report: &mut BakeReport,
    ) -> Result<Option<(Self, FormFactors)>, BakeError> {
        let side = resolution.patch_side;
        monitor.stage(Stage::FormFactors, report)?;
        let patches = monitor.run_interruptible(0.0, || Patches::new(scene, side))?;
        report.patches = patches.list.len();
        report.warnings.extend(patches.warnings.iter().cloned());
        if patches.list.iter().all(|patch| patch.reflectance == Vec3::ZERO) {
            let skipped = match sources.has_sky() {
                true => {
                    "form factors and radiosity: no surface reflects (rho = 0); the final gather finds the sky"
                }
                false => "form factors, radiosity and final gather: no surface reflects (rho = 0)",
            };
            report.skipped.push(skipped.into());
            let black = || sources.has_sky().then(|| Self::black(scene, patches, side));
            return monitor.run_interruptible(0.5, black);
        }
        let (method, rays) = (options.form_factors, resolution.form_factor_rays);
        let (factors, halves) = FormFactors::sample(scene, &patches, method, rays, options.seed, monitor)?;
        report.rays += factors.rays;
        report.form_factors = factors.columns.len();
        report.energy_lost = factors.energy_lost;

        monitor.stage(Stage::Radiosity, report)?;
        let known = monitor.run_interruptible(0.1, || direct_light(&patches))?;
        let mut direct_halves = [Vec::new(), Vec::new()];
        for (half, of_half) in (0..).zip(&mut direct_halves) {
            let found: Vec<(Vec3, u32)> = in_chunks(patches.list.len(), monitor, |place| {
                match known.get(place) {
                    Some(Some(halves)) if factors.open[place] > 0.0 => return (halves[half as usize], 0),
                    _ => {}
                }
                let index = PatchIndex::new(place);
                let sequence = Sequence::new(options.seed, Stream::PatchLight(half), index.0);
                patch_direct(scene, sources, &patches, index, factors.open[place], sequence)
            })?;
            report.rays += found.iter().map(|(_, rays)| u64::from(*rays)).sum::<u64>();
            *of_half = found.into_iter().map(|(direct, _)| direct).collect::<Vec<Vec3>>();
        }
        let [even, odd] = &direct_halves;
        let direct: Vec<Vec3> = even.iter().zip(odd).map(|(even, odd)| 0.5 * (*even + *odd)).collect();
        let dark = |(direct, patch): (&Vec3, &Patch)| *direct * patch.reflectance == Vec3::ZERO;
        if !sources.has_sky() && direct.iter().zip(&patches.list).all(dark) {
            report
                .skipped
                .push("radiosity and final gather: no light reaches a surface that reflects".into());
            return Ok(None);
        }
        monitor.advance(0.5)?;
        let sky = |factors: &FormFactors| -> Vec<Vec3> {
            factors.sky.iter().map(|&share| share * sources.sky).collect()
        };
        let sky_halves = halves.each_ref().map(&sky);
        let sky = sky(&factors);
        let indirect = monitor.run_interruptible(0.5, || {
            solve(options.solver, &factors, &patches.list, &direct, &sky, report)
        })?;
        let noise = monitor.run_interruptible(0.6, || {
            solution_error(options.solver, &halves, &direct_halves, &sky_halves, &patches.list)
        })?;
        let grey = |color: Vec3| f64::from(color.element_sum()) / 3.0;
        let reflectance: Vec<f64> = patches.list.iter().map(|patch| grey(patch.reflectance)).collect();
        let first: Vec<f64> = direct.iter().zip(&sky).map(|(direct, sky)| grey(*direct + *sky)).collect();
        let light = (reflectance.as_slice(), first.as_slice());
        let of_size = monitor.run_interruptible(0.7, || {
            size_error(scene, &patches, side, &factors, light, (options.solver, TOLERANCE))
        })?;
        let indirect_error = noise.iter().zip(of_size).map(|(&noise, size)| Vec2::new(noise, size)).collect();
        let leaves = |(index, patch): (usize, &Patch)| patch.reflectance * (direct[index] + indirect[index]);
        let exitance: Vec<Vec3> = patches.list.iter().enumerate().map(leaves).collect();
        let radiosity: Vec<f32> = exitance.iter().map(|exitance| exitance.element_sum()).collect();
        let guide = monitor.run_interruptible(0.8, || {
            SamplingGuide::new(scene, &patches, side, &factors, &radiosity, &sky)
        })?;
        let near = patches.near_distances(scene, side);
        Ok(Some((Self { patches, direct, indirect, indirect_error, near, guide, exitance }, factors)))
    }
}

impl Exchange {
    /// What leaves each object without emission, W/m²: the least and the most of its patches, by channel. Backs that light does not meet are black.
    pub fn exitance_of(&self, scene: &BakeScene, objects: usize) -> Vec<[Vec3; 2]> {
        let mut ranges = vec![[Vec3::INFINITY, Vec3::ZERO]; objects];
        for (patch, exitance) in self.patches.list.iter().zip(&self.exitance) {
            let triangle = &scene.triangles[patch.triangle as usize];
            let [least, most] = &mut ranges[triangle.object as usize];
            let black_back = !triangle.closed && !triangle.two_sided;
            *least = least.min(if black_back { Vec3::ZERO } else { *exitance });
            *most = most.max(*exitance);
        }
        let of_nothing =
            |[least, most]: [Vec3; 2]| [if least.is_finite() { least } else { Vec3::ZERO }, most];
        ranges.into_iter().map(of_nothing).collect()
    }

    /// Of surfaces that reflect nothing.
    fn black(scene: &BakeScene, patches: Patches, side: f32) -> (Self, FormFactors) {
        let none = vec![Vec3::ZERO; patches.list.len()];
        let zeros = vec![0.0; patches.list.len()];
        let exact = vec![Vec2::ZERO; patches.list.len()];
        let factors = FormFactors::none(&patches);
        let guide = SamplingGuide::new(scene, &patches, side, &factors, &zeros, &none);
        let exchange = Self {
            direct: none.clone(),
            indirect: none.clone(),
            indirect_error: exact,
            near: patches.near_distances(scene, side),
            patches,
            guide,
            exitance: none,
        };
        (exchange, factors)
    }
}

/// Direct irradiance of a patch. What other geometry covers receives nothing: the rest has it all.
pub(crate) fn patch_direct(
    scene: &BakeScene,
    sources: &Sources<'_>,
    patches: &Patches,
    index: PatchIndex,
    open: f32,
    sequence: Sequence,
) -> (Vec3, u32) {
    let patch = &patches.list[index.place()];
    // What reflects nothing, a lamp mostly, hands nothing on.
    if open <= 0.0 || patch.reflectance == Vec3::ZERO {
        return (Vec3::ZERO, 0);
    }
    let triangle = &scene.triangles[patch.triangle as usize];
    let point = |x: f32, y: f32| {
        let (u, v) = patches.point(patch, triangle_point(x, y));
        let normal = triangle.side_normal(patch.side);
        let position = triangle.position(u, v);
        let origin = scene.off_surface(patch.triangle, patch.side, position);
        let smooth = triangle.shading_normal(u, v);
        let smooth = if patch.side == Side::Front { smooth } else { -smooth };
        Some(Receiver { position, origin, geometric_normal: normal, normal: smooth })
    };
    let direct = sources.irradiance(sequence, SHADOW_RAYS, &point);
    (direct.total() / open, direct.rays)
}

/// Half the difference of the solutions by two independent halves of the rays, for grey light.
fn solution_error(
    solver: Solver,
    halves: &[FormFactors; 2],
    direct: &[Vec<Vec3>; 2],
    sky: &[Vec<Vec3>; 2],
    patches: &[Patch],
) -> Vec<f32> {
    let grey = |color: Vec3| f64::from(color.element_sum()) / 3.0;
    let reflectance: Vec<f64> = patches.iter().map(|patch| grey(patch.reflectance)).collect();
    let [a, b] = [0, 1].map(|half| {
        let factors = &halves[half];
        let lit = direct[half].iter().zip(&sky[half]).zip(patches);
        let emission: Vec<f64> =
            lit.map(|((light, sky), patch)| grey((*light + *sky) * patch.reflectance)).collect();
        let solution = solver.solve(factors, &reflectance, &emission, TOLERANCE);
        let gathered = gather(factors, &solution.radiosity);
        gathered.iter().zip(&sky[half]).map(|(light, sky)| light + grey(*sky)).collect::<Vec<f64>>()
    });
    a.iter().zip(&b).map(|(a, b)| (0.5 * (a - b)) as f32).collect()
}

/// Irradiance by the sky and by bounces: Σ_j F_ij B_j, with B the solution for what direct light and the sky have left on the patches.
fn solve(
    solver: Solver,
    factors: &FormFactors,
    patches: &[Patch],
    direct: &[Vec3],
    sky: &[Vec3],
    report: &mut BakeReport,
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
    if report.residual > 2.0 * TOLERANCE {
        report.warnings.push(format!(
            "the radiosity system was solved to a residual of {:.1e} only, after {} iterations; {TOLERANCE:.0e} was wanted",
            report.residual,
            report.iterations.into_iter().max().unwrap_or_default()
        ));
    }
    let [red, green, blue] = [0, 1, 2].map(|channel| &channels[channel].0);
    (0..patches.len()).map(|i| sky[i] + DVec3::new(red[i], green[i], blue[i]).as_vec3()).collect()
}
