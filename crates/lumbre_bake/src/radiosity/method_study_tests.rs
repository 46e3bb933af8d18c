//! Both ways to count form factors: what they cost and what is left of their error, by number of rays, against converged ones. The figures
//! that docs/decisions.md compares, printed with `--nocapture`.

use std::ops::ControlFlow;
use std::time::Instant;

use bevy_ecs::world::World;
use glam::Vec3;

use super::exchange::patch_direct;
use super::exchange_tests::{MODELS, model};
use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use super::patches::Patches;
use super::solution::gather;
use crate::monitor::BakeMonitor;
use crate::options::{FormFactorMethod, Solver};
use crate::sampling::{Sequence, Stream};
use crate::scene::from_world;
use crate::scene::laid_out::laid_out;
use crate::sources::emitters::emitters;
use crate::sources::light_sources::Sources;
use crate::{BakeError, BakeOptions, Density, Quality};

/// The two methods.
const METHODS: [FormFactorMethod; 2] = [FormFactorMethod::CosineRays, FormFactorMethod::GlobalLines];

/// How good the form factors of one method are.
#[derive(Clone, Copy, Debug)]
struct FormFactorErrors {
    /// How they were counted.
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

/// The form factors of a world's static objects by both methods with so many rays each, against those of both with `converged` rays.
/// Patches are as many as `options.quality` asks for.
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
    let patches = Patches::new(&scene, (2.0 * area / options.effort().patches as f32).sqrt());
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
            patch_direct(&scene, &sources, &patches, index, references[0].open[index.place()], sequence).0
        })
        .collect();
    let irradiance = |factors: &FormFactors| solution(factors, &patches, &direct, sources.sky);
    let expected: Vec<Vec<f64>> = references.iter().map(irradiance).collect();
    let mut found = Vec::new();
    for method in METHODS {
        for &count in rays {
            let (factors, seconds) = sample(method, count, options.seed)?;
            let own = irradiance(&factors);
            // The references' own errors are the same for all.
            let mean = |of: &dyn Fn(usize) -> f64| (0.5 * (of(0).powi(2) + of(1).powi(2))).sqrt();
            found.push(FormFactorErrors {
                method,
                rays: factors.rays,
                seconds,
                exchange: mean(&|at| exchange_apart(&factors, &references[at])),
                irradiance: mean(&|at| irradiance_apart(&own, &expected[at], &references[at])),
            });
        }
    }
    Ok(found)
}

#[test]
fn cosine_rays_and_global_lines_converge_to_the_same() {
    for name in MODELS {
        let Some(mut world) = model(name) else { continue };
        let options =
            BakeOptions { density: Density::MapSize(16), quality: Quality::Draft, ..BakeOptions::default() };
        let rows = form_factor_errors(&mut world, &options, &[150_000, 2_400_000], 4_000_000).unwrap();
        for method in METHODS {
            let own: Vec<_> = rows.iter().filter(|row| row.method == method).collect();
            for row in &own {
                let [exchange, irradiance] = [row.exchange, row.irradiance].map(|share| 100.0 * share);
                println!(
                    "{name} {method:?}: {} rays, {:.3} s, exchange {exchange:.2} % off, irradiance {irradiance:.3} %",
                    row.rays, row.seconds
                );
            }
            // Against the mean of both: sixteen times the rays, a quarter of the noise, but for what the references have themselves.
            let rays = own[1].rays as f64 / own[0].rays as f64;
            let gain = own[0].irradiance / own[1].irradiance;
            assert!(gain > 0.55 * rays.sqrt(), "{name} {method:?}: {gain} by {rays} times the rays: {own:?}");
        }
    }
}

/// Irradiance by bounces and by the sky of each patch, mean of the channels.
fn solution(factors: &FormFactors, patches: &Patches, direct: &[Vec3], sky: Vec3) -> Vec<f64> {
    let grey = |color: Vec3| f64::from(color.element_sum()) / 3.0;
    let reflectance: Vec<f64> = patches.list.iter().map(|patch| grey(patch.reflectance)).collect();
    let sky: Vec<f64> = factors.sky.iter().map(|&share| f64::from(share) * grey(sky)).collect();
    let emission: Vec<f64> = (0..direct.len()).map(|i| reflectance[i] * (grey(direct[i]) + sky[i])).collect();
    let solved = Solver::default().solve(factors, &reflectance, &emission, 1e-8);
    gather(factors, &solved.radiosity).iter().zip(sky).map(|(bounced, sky)| bounced + sky).collect()
}

/// |G - G*| / |G*|, over all entries of either.
fn exchange_apart(found: &FormFactors, expected: &FormFactors) -> f64 {
    let (mut apart, mut all) = (0.0, 0.0);
    for i in PatchIndex::all(expected.len()) {
        let mut own = found.row(i).peekable();
        for (j, g) in expected.row(i) {
            while let Some((_, other)) = own.next_if(|&(k, _)| k < j) {
                apart += other * other;
            }
            let other = own.next_if(|&(k, _)| k == j).map_or(0.0, |(_, other)| other);
            apart += (other - g).powi(2);
            all += g * g;
        }
        apart += own.map(|(_, other)| other * other).sum::<f64>();
    }
    if all > 0.0 { (apart / all).sqrt() } else { 0.0 }
}

fn irradiance_apart(found: &[f64], expected: &[f64], factors: &FormFactors) -> f64 {
    let (mut apart, mut all, mut area) = (0.0, 0.0, 0.0);
    for ((found, expected), &own) in found.iter().zip(expected).zip(&factors.areas) {
        let own = f64::from(own);
        apart += own * (found - expected).powi(2);
        all += own * expected;
        area += own;
    }
    if all > 0.0 { (apart / area).sqrt() * area / all } else { 0.0 }
}
