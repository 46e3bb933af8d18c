//! A study of the two ways to count form factors: their time and their error by number of rays, against converged form
//! factors. The figures are those that docs/decisions.md compares; `--nocapture` prints them. It is a test as well: the
//! errors must fall about as 1/√rays, which also means that both methods converge to the same light.

use std::ops::ControlFlow;
use std::time::Instant;

use bevy_ecs::world::World;
use glam::Vec3;

use super::exchange::mean_reflectances;
use super::exchange_tests::{MODELS, model};
use super::form_factor_tests::patches_of;
use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use super::patch_light::patch_direct;
use super::patches::Patches;
use super::solution::gather;
use crate::color::wide_channel_mean;
use crate::monitor::BakeMonitor;
use crate::options::{FormFactorMethod, Solver};
use crate::sampling::{Sequence, Stream};
use crate::scene::from_world;
use crate::scene::laid_out::laid_out;
use crate::sources::Sources;
use crate::sources::emitters::emitters;
use crate::{BakeError, BakeOptions, Density, Quality};

/// The two methods.
const METHODS: [FormFactorMethod; 2] = [FormFactorMethod::CosineRays, FormFactorMethod::GlobalLines];

/// How good the form factors of one method are.
#[derive(Clone, Copy, Debug)]
struct FormFactorErrors {
    method: FormFactorMethod,
    /// Rays or lines cast.
    rays: u64,
    /// Wall-clock seconds.
    seconds: f64,
    /// Relative error of the matrix of exchange areas, in the Frobenius norm.
    exchange: f64,
    /// RMSE of the patches' irradiance by bounces and by the sky, by area, relative to its mean.
    irradiance: f64,
}

/// The errors of the form factors between a world's static objects, by both methods with each number of rays in `rays`,
/// against those by both methods with `converged` rays. There are as many patches as `options.quality` asks for.
fn form_factor_errors(
    world: &mut World,
    options: &BakeOptions,
    rays: &[usize],
    converged: usize,
) -> Result<Vec<FormFactorErrors>, BakeError> {
    let input = from_world(world).0.checked()?;
    let (_, scene) = laid_out(&input.objects, input.space(), options);
    let sources = Sources::new(&scene, emitters(&scene), input.lights, input.sky);
    let area: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
    let patches = patches_of(&scene, (2.0 * area / options.effort().patches as f32).sqrt());
    let mut carry_on = |_| ControlFlow::Continue(());
    let mut monitor = BakeMonitor::new(&mut carry_on, None);
    let mut sample = |method, rays, seed| {
        let begun = Instant::now();
        let (factors, _) = FormFactors::sample(&scene, &patches, method, rays, seed, &mut monitor)?;
        Ok::<_, BakeError>((factors, begun.elapsed().as_secs_f64()))
    };
    let mut references = Vec::new();
    for method in METHODS {
        let (factors, _) = sample(method, converged, options.seed.wrapping_add(1))?;
        references.push(factors);
    }
    let direct: Vec<Vec3> = PatchIndex::all(patches.list.len())
        .map(|index| {
            let sequence = Sequence::new(options.seed, Stream::PatchLight(0), index.0);
            patch_direct(&sources, &patches, index, references[0].open[index.place()], 8, sequence).0
        })
        .collect();
    let irradiance = |factors: &FormFactors| solution(factors, &patches, &direct, sources.sky);
    let expected: Vec<Vec<f64>> = references.iter().map(irradiance).collect();
    let mut errors = Vec::new();
    for method in METHODS {
        for &count in rays {
            let (factors, seconds) = sample(method, count, options.seed)?;
            let irradiance = irradiance(&factors);
            // The mean over both references, whose own errors then add the same to the errors of both methods.
            let mean = |error: &dyn Fn(usize) -> f64| (0.5 * (error(0).powi(2) + error(1).powi(2))).sqrt();
            errors.push(FormFactorErrors {
                method,
                rays: factors.rays,
                seconds,
                exchange: mean(&|reference| exchange_error(&factors, &references[reference])),
                irradiance: mean(&|reference| {
                    irradiance_error(&irradiance, &expected[reference], &references[reference])
                }),
            });
        }
    }
    Ok(errors)
}

#[test]
fn cosine_rays_and_global_lines_converge_to_the_same_light() {
    for name in MODELS {
        let Some(mut world) = model(name) else { continue };
        let options =
            BakeOptions { density: Density::MapSize(16), quality: Quality::Draft, ..BakeOptions::default() };
        let rows = form_factor_errors(&mut world, &options, &[150_000, 2_400_000], 4_000_000).unwrap();
        for method in METHODS {
            let rows: Vec<_> = rows.iter().filter(|row| row.method == method).collect();
            for row in &rows {
                let [exchange, irradiance] = [row.exchange, row.irradiance].map(|share| 100.0 * share);
                println!(
                    "{name} {method:?}: {} rays, {:.3} s, exchange {exchange:.2} % off, irradiance {irradiance:.3} %",
                    row.rays, row.seconds
                );
            }
            // Sixteen times the rays give a quarter of the noise, except for the references' own noise.
            let rays = rows[1].rays as f64 / rows[0].rays as f64;
            let gain = rows[0].irradiance / rows[1].irradiance;
            assert!(
                gain > 0.55 * rays.sqrt(),
                "{name} {method:?}: {gain} by {rays} times the rays: {rows:?}"
            );
        }
    }
}

/// Irradiance of each patch by bounces and by the sky, mean of the channels.
fn solution(factors: &FormFactors, patches: &Patches, direct: &[Vec3], sky: Vec3) -> Vec<f64> {
    let reflectance = mean_reflectances(&patches.list);
    let sky: Vec<f64> = factors.sky.iter().map(|&share| f64::from(share) * wide_channel_mean(sky)).collect();
    let emission: Vec<f64> =
        (0..direct.len()).map(|i| reflectance[i] * (wide_channel_mean(direct[i]) + sky[i])).collect();
    let solved = Solver::default().solve(factors, &reflectance, &emission, 1e-8);
    gather(factors, &solved.radiosity).iter().zip(sky).map(|(bounced, sky)| bounced + sky).collect()
}

/// |G - G*| / |G*| in the Frobenius norm, where G* is `expected`.
fn exchange_error(factors: &FormFactors, expected: &FormFactors) -> f64 {
    let (mut squared_error, mut squared_norm) = (0.0, 0.0);
    for i in PatchIndex::all(expected.len()) {
        let mut row = factors.row(i).peekable();
        for (j, expected) in expected.row(i) {
            // Entries that only `factors` has.
            while let Some((_, g)) = row.next_if(|&(k, _)| k < j) {
                squared_error += g * g;
            }
            let g = row.next_if(|&(k, _)| k == j).map_or(0.0, |(_, g)| g);
            squared_error += (g - expected).powi(2);
            squared_norm += expected * expected;
        }
        squared_error += row.map(|(_, g)| g * g).sum::<f64>();
    }
    if squared_norm > 0.0 { (squared_error / squared_norm).sqrt() } else { 0.0 }
}

/// RMSE of irradiances, weighted by area, relative to their mean.
fn irradiance_error(irradiance: &[f64], expected: &[f64], factors: &FormFactors) -> f64 {
    let (mut squared_error, mut flux, mut total_area) = (0.0, 0.0, 0.0);
    for ((irradiance, expected), &area) in irradiance.iter().zip(expected).zip(&factors.areas) {
        let area = f64::from(area);
        squared_error += area * (irradiance - expected).powi(2);
        flux += area * expected;
        total_area += area;
    }
    if flux > 0.0 { (squared_error / total_area).sqrt() * total_area / flux } else { 0.0 }
}
