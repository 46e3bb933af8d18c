//! Bakes of scenes that no constant was tuned on, without texture coordinates, against the tests' own path tracer: two
//! rooms joined by a doorway with a lamp in one of them, and a hall with columns. The density is low enough for a test;
//! the examples `held_out_scenes`, `bake_file` and `judge` do the same at any density.

#![allow(clippy::print_stdout, reason = "the errors are the result that a reader of the output wants")]

use std::path::Path;

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_bake::{Bake, BakeOptions, Density};

use crate::held_out::point_errors::{PointErrors, measure};
use crate::held_out::reference_points::read;
use crate::held_out::scenes;

fn baked(scene: fn(u64, f64) -> World, name: &str, density: f64) -> PointErrors {
    let mut world = scene(0, 1.0);
    let options =
        BakeOptions { density: Density::TexelsPerMeter(density), error: 0.02, ..BakeOptions::default() };
    Bake::new(&options).run(&mut world).expect("the scene bakes");
    let points = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(format!("{name}.csv"));
    let errors = measure(&mut world, &read(&points));
    println!("{name}: {errors}");
    assert_eq!(errors.missed, 0);
    errors
}

/// The bias over the points at selected positions, relative to their mean irradiance, and its standard error due to the
/// reference's noise.
fn bias(errors: &PointErrors, is_selected: impl Fn(DVec3) -> bool) -> (f64, f64) {
    let rows: Vec<_> = errors.rows.iter().filter(|row| is_selected(row[0])).collect();
    let sum = |column: usize| rows.iter().map(|row| row[column].element_sum()).sum::<f64>();
    // The channels of a point are measured by the same paths, so that their errors add up.
    let noise = rows.iter().map(|row| row[4].element_sum().powi(2)).sum::<f64>().sqrt();
    ((sum(2) - sum(3)) / sum(3), noise / sum(3))
}

#[test]
fn two_rooms_and_a_doorway() {
    let errors = baked(scenes::rooms, "rooms_0", 20.0);
    let (lit, lit_noise) = bias(&errors, |p| p.x <= 0.0);
    let (dark, dark_noise) = bias(&errors, |p| p.x >= 0.15);
    println!(
        "lit room {:+.2} ± {:.2} %, dark room {:+.2} ± {:.2} % of their own light",
        100.0 * lit,
        100.0 * lit_noise,
        100.0 * dark,
        100.0 * dark_noise
    );
    // Texels are 5 cm wide, at a third of the default density: the median is due to sampling, the tail to the
    // resolution.
    assert!(errors.median < 0.01 && errors.p95 < 0.05 && errors.bias.abs() < 0.005, "{errors}");
    // When patches extended across the wall between the rooms, the dark room was 3.8 % too bright.
    assert!(lit.abs() < 0.006 && dark.abs() < 0.025, "{lit} {dark}");
    // The inside of the closed cupboard is dark.
    assert_eq!(errors.leaks.0, 0, "{errors}");
}

#[test]
fn a_hall_with_columns() {
    let errors = baked(scenes::hall, "hall_0", 10.0);
    assert!(errors.median < 0.01 && errors.p95 < 0.05 && errors.bias.abs() < 0.005, "{errors}");
}
