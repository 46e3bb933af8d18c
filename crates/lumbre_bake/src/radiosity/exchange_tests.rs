//! Tests of the exchange as a whole: the solvers agree with each other. The two ways to count form factors are compared
//! in `method_study_tests`.

use std::ops::ControlFlow;
use std::path::Path;

use bevy_ecs::world::World;
use glam::Vec3;

use super::exchange::{Exchange, ExchangeReport};
use super::transport::{PatchResolution, Transport};
use crate::monitor::BakeMonitor;
use crate::options::Solver;
use crate::scene::from_world;
use crate::scene::laid_out::laid_out;
use crate::sources::Sources;
use crate::sources::emitters::emitters;
use crate::{BakeOptions, Density, Quality};

pub(crate) const MODELS: [&str; 2] = ["models/cornell_box.glb", "conformance/bake/alcove.glb"];

/// Loads a model of the shared data beside the checkout; `None`, with a message, where that is missing.
pub(crate) fn model(name: &str) -> Option<World> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join(name);
    if !path.exists() {
        eprintln!("SKIPPED: {} is missing; nothing was compared", path.display());
        return None;
    }
    let mut world = World::new();
    lumbre_scene::load(&mut world, &path).unwrap();
    Some(world)
}

/// The irradiance by bounces of all patches, and the report.
fn solved(world: &mut World, solver: Solver) -> (Vec<Vec3>, ExchangeReport) {
    let options = BakeOptions {
        density: Density::MapSize(16),
        quality: Quality::Draft,
        solver,
        ..BakeOptions::default()
    };
    let input = from_world(world).0.checked().unwrap();
    let (_, scene) = laid_out(&input.objects, input.space(), &options);
    let sources = Sources::new(&scene, emitters(&scene), input.lights, input.sky);
    let mut carry_on = |_| ControlFlow::Continue(());
    let mut monitor = BakeMonitor::new(&mut carry_on, None);
    let area: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
    let resolution = PatchResolution {
        patch_side: (2.0 * area / 2000.0).sqrt(),
        form_factor_rays: 200_000,
        memory_bytes: 0,
    };
    let (transport, _) = Transport::new(&scene, &resolution, &options, &mut monitor).unwrap();
    let ((exchange, report), _) = Exchange::new(&sources, transport, &[], &options, &mut monitor).unwrap();
    (exchange.expect("light bounces").0.indirect, report)
}

#[test]
fn solvers_agree_on_cornell_and_alcove() {
    for name in MODELS {
        let Some(mut world) = model(name) else { continue };
        let solvers = [Solver::ConjugateGradients, Solver::GaussSeidel, Solver::Jacobi];
        let solutions = solvers.map(|solver| solved(&mut world, solver));
        let (expected, first) = &solutions[0];
        let largest = expected.iter().map(|light| light.max_element()).fold(0.0, f32::max);
        assert!(largest > 0.0 && first.residual > 0.0, "{name}");
        for ((light, report), solver) in solutions.iter().zip(solvers) {
            // The norm of a solution's error is at most the residual over 1 - ρ; the error of a single patch may be
            // larger by the ratio of the whole area to its own.
            let bound = (100.0 * (first.residual_bound + report.residual_bound)) as f32;
            for (a, b) in light.iter().zip(expected) {
                assert!((*a - *b).abs().max_element() <= bound * largest, "{name} {solver:?}: {a} {b}");
            }
            assert!(report.residual <= 1e-5 && report.residual_bound < 1e-3, "{name} {solver:?}: {report:?}");
            assert!(report.iterations.iter().all(|&n| n > 0), "{name} {solver:?}");
        }
        // Reading values that the same sweep has updated is never slower.
        let [_, gauss_seidel, jacobi] = solutions.each_ref().map(|(_, report)| report.iterations[0]);
        assert!(gauss_seidel < jacobi, "{name}: {gauss_seidel} {jacobi}");
    }
}
