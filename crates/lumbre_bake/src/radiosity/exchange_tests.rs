//! The exchange as a whole: solvers against each other. Both ways to count form factors: that is `method_study_tests`.

use std::ops::ControlFlow;
use std::path::Path;

use bevy_ecs::world::World;
use glam::Vec3;

use super::exchange::{Exchange, Resolution};
use super::patches::Patches;
use crate::monitor::BakeMonitor;
use crate::options::Solver;
use crate::scene::from_world;
use crate::scene::laid_out::laid_out;
use crate::sources::emitters::emitters;
use crate::sources::light_sources::Sources;
use crate::{BakeOptions, BakeReport, Density, Quality};

pub(crate) const MODELS: [&str; 2] = ["models/cornell_box.glb", "conformance/bake/alcove.glb"];

/// Measured data beside the checkout; `None`, loudly, where it is missing.
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

/// The light by bounces of all patches, and what the report says of the solver.
fn solved(world: &mut World, solver: Solver) -> (Vec<Vec3>, BakeReport) {
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
    let mut report = BakeReport::default();
    let area: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
    let resolution = Resolution { patch_side: (2.0 * area / 2000.0).sqrt(), form_factor_rays: 200_000 };
    let by_rays = |_: &Patches| Vec::new();
    let exchange =
        Exchange::new(&scene, &sources, &options, resolution, by_rays, &mut monitor, &mut report).unwrap();
    (exchange.expect("light bounces").0.indirect, report)
}

#[test]
fn solvers_agree_on_cornell_and_alcove() {
    for name in MODELS {
        let Some(mut world) = model(name) else { continue };
        let solvers = [Solver::ConjugateGradients, Solver::GaussSeidel, Solver::Jacobi];
        let found = solvers.map(|solver| solved(&mut world, solver));
        let (expected, first) = &found[0];
        let largest = expected.iter().map(|light| light.max_element()).fold(0.0, f32::max);
        assert!(largest > 0.0 && first.residual > 0.0, "{name}");
        for ((light, report), solver) in found.iter().zip(solvers) {
            // Both solutions are off by the residual over 1 - ρ, as a norm; a single patch by what that is of its own.
            let bound = (100.0 * (first.residual_bound + report.residual_bound)) as f32;
            for (a, b) in light.iter().zip(expected) {
                assert!((*a - *b).abs().max_element() <= bound * largest, "{name} {solver:?}: {a} {b}");
            }
            assert!(report.residual <= 1e-5 && report.residual_bound < 1e-3, "{name} {solver:?}: {report:?}");
            assert!(report.iterations.iter().all(|&n| n > 0), "{name} {solver:?}");
        }
        // Reading what the same sweep has found is never slower.
        let [_, seidel, jacobi] = found.each_ref().map(|(_, report)| report.iterations[0]);
        assert!(seidel < jacobi, "{name}: {seidel} {jacobi}");
    }
}
