//! Tests of the exchange as a whole: the solvers agree with each other, and finely meshed surfaces exchange the same
//! light as coarse ones. The two ways to count form factors are compared
//! in `method_study_tests`.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DAffine3, DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light};

use super::exchange::{Exchange, ExchangeReport};
use super::subdivision::Subdivision;
use super::transport::{PatchResolution, Transport};
use crate::monitor::BakeMonitor;
use crate::options::Solver;
use crate::sampling::{Sequence, Stream, sphere_direction};
use crate::scene::laid_out::laid_out;
use crate::scene::{
    BakeScene, PlacedLight, PlacedPrimitive, SceneObject, StaticScene, SurfaceHit, from_world,
};
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
    let (exchange, report) = exchanged(&scene, &input, 2000.0, 200_000, &options);
    (exchange.indirect, report)
}

/// The exchange of light in a scene with so many patches and rays.
fn exchanged(
    scene: &BakeScene,
    input: &StaticScene,
    patches: f32,
    form_factor_rays: usize,
    options: &BakeOptions,
) -> (Exchange, ExchangeReport) {
    let sources = Sources::new(scene, emitters(scene), input.lights.clone(), input.sky);
    let mut carry_on = |_| ControlFlow::Continue(());
    let mut monitor = BakeMonitor::new(&mut carry_on, None);
    let area: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
    let patch_side = (2.0 * area / patches).sqrt();
    let resolution = PatchResolution {
        subdivision: Subdivision::new(scene, patch_side),
        texture_points: 64,
        form_factor_rays,
        memory_bytes: 0,
    };
    let (transport, _) = Transport::new(scene, &resolution, options, &mut monitor).unwrap();
    let ((exchange, report), _) = Exchange::new(&sources, transport, &[], options, &mut monitor).unwrap();
    (exchange.expect("light bounces").0, report)
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

/// A room of 4 x 3 x 4 m with a partition that reaches to a third of its depth and a block, all of squares with so many
/// cells along an edge, and a lamp on one side.
fn room(cells: u32) -> StaticScene {
    let mut walls = shapes::cuboid(Vec3::new(4.0, 3.0, 4.0), cells);
    walls.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
    walls.normals.iter_mut().for_each(|normal| *normal = -*normal);
    let object = |mesh: TriangleMesh, at: DVec3| {
        let transform = DAffine3::from_translation(at);
        let placed = PlacedPrimitive { mesh: Arc::new(mesh), transform, ..PlacedPrimitive::default() };
        SceneObject::new("object", vec![placed])
    };
    let objects = vec![
        object(walls, DVec3::ZERO),
        object(shapes::cuboid(Vec3::new(0.05, 3.0, 2.6), cells), DVec3::new(0.4, 0.0, 0.7)),
        object(shapes::cuboid(Vec3::splat(0.8), cells), DVec3::new(-1.0, -1.1, 0.2)),
    ];
    let lamp = Light { radius: 0.1, bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    let lights = vec![PlacedLight { light: lamp, position: DVec3::new(-1.0, 1.0, 1.0), axis: DVec3::NEG_Y }];
    StaticScene { objects, lights, ..StaticScene::default() }.checked().unwrap()
}

/// The number of patches of a room, and the light by bounces that rays find which leave three points in it.
fn light_found(input: &StaticScene) -> (usize, Vec<Vec3>) {
    let options = BakeOptions { density: Density::MapSize(32), ..BakeOptions::default() };
    let (_, scene) = laid_out(&input.objects, input.space(), &options);
    let (exchange, _) = exchanged(&scene, input, 4000.0, 3_000_000, &options);
    let from = |point: [f64; 3], number: u32| {
        let (scene, exchange) = (&scene, &exchange);
        let origin = scene.space.position(DVec3::from(point));
        (0..400).map(move |ray| {
            let [u, v, ..] = Sequence::new(1, Stream::Test(96), number).point(ray, 0);
            let hit = scene.first_hit(origin, sphere_direction(u, v));
            let SurfaceHit::Lit { triangle, side, at, .. } = hit else { panic!("{hit:?} in a closed room") };
            exchange.indirect[exchange.patches.at(triangle, side, at).expect("a patch").place()]
        })
    };
    let points = [[-1.0, 0.3, 0.5], [1.2, 0.2, 1.0], [0.2, -0.8, -1.5]];
    let light = points.into_iter().zip(0..).flat_map(|(point, number)| from(point, number)).collect();
    (exchange.patches.list.len(), light)
}

#[test]
fn a_finely_meshed_room_has_about_as_many_patches_and_the_same_light() {
    let (patches, expected) = light_found(&room(1));
    let (patches_of_fine, found) = light_found(&room(96));
    assert!(patches_of_fine < 2 * patches, "{patches_of_fine} patches of 331,776 triangles, {patches} of 36");
    let mean = expected.iter().map(|light| light.x).sum::<f32>() / expected.len() as f32;
    let squares: f32 = found.iter().zip(&expected).map(|(a, b)| (a.x - b.x).powi(2)).sum();
    let rmse = (squares / found.len() as f32).sqrt() / mean;
    let bias = found.iter().zip(&expected).map(|(a, b)| a.x - b.x).sum::<f32>() / found.len() as f32 / mean;
    println!(
        "{patches} and {patches_of_fine} patches, {:.2} % apart, {:.2} % bias",
        100.0 * rmse,
        100.0 * bias
    );
    // Rays and the size of patches make up as much in either room.
    assert!(rmse < 0.04 && bias.abs() < 0.005, "{rmse} {bias}");
}
