//! The tests' own path tracer against closed forms and against another's measured irradiance.

use bevy_ecs::world::World;
use glam::DVec3;

mod common;
mod held_out;

use held_out::path_tracer::{Effort, PathTracer};
use held_out::reference_points::read;

#[test]
fn agrees_with_another_path_tracer() {
    for (model, points) in [
        ("conformance/bake/alcove.glb", "conformance/bake/alcove.csv"),
        ("models/cornell_box.glb", "conformance/bake/cornell_box.csv"),
    ] {
        let (Some(model), Some(points)) = (common::shared(model), common::shared(points)) else { return };
        let mut world = World::new();
        lumbre_scene::load(&mut world, &model).expect("the model loads");
        let expected: Vec<_> = read(&points).into_iter().take(60).collect();
        // The file rounds positions to six digits: off the surface by more than that.
        let places: Vec<(DVec3, DVec3)> = expected
            .iter()
            .map(|p| (p.position + p.normal * (1e-5 * p.position.length()), p.normal))
            .collect();
        let found = PathTracer::new(&mut world).at(&places, Effort::fixed(8, 24), 5);
        let (mut difference, mut variance, mut sum) = (0.0, 0.0, 0.0);
        for (own, other) in found.iter().zip(&expected) {
            for channel in (0..3).filter(|&c| other.value[c].is_finite()) {
                difference += own.value[channel] - other.value[channel];
                variance += own.error[channel].powi(2) + other.error[channel].powi(2);
                sum += other.value[channel];
            }
        }
        println!(
            "{}: bias {:.3} % +- {:.3} %",
            model.display(),
            100.0 * difference / sum,
            100.0 * variance.sqrt() / sum
        );
        // Channels of one path go together, so that three times the variance of independent ones bounds it: five sigma.
        assert!(difference.abs() < 5.0 * (3.0 * variance).sqrt(), "{}: {difference}", model.display());
    }
}
