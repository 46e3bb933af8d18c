//! Scenes that no constant was tuned on, without texture coordinates, against the tests' own path tracer: two rooms joined by a doorway
//! and lit from one of them, and a hall with columns. At a density that a test has time for; the examples `held_out_scenes`, `bake_file`
//! and `judge` do the same at any.

#![allow(clippy::print_stdout, reason = "the figures are what one wants to see of it")]

use std::path::Path;

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_bake::{Bake, BakeOptions, Density};

use crate::held_out::judgement::{Judgement, judge};
use crate::held_out::reference_points::read;
use crate::held_out::scenes;

fn baked(scene: fn(u64, f64) -> World, name: &str, density: f64) -> Judgement {
    let mut world = scene(0, 1.0);
    let options =
        BakeOptions { density: Density::TexelsPerMeter(density), error: 0.02, ..BakeOptions::default() };
    Bake::new(&options).run(&mut world).expect("the scene bakes");
    let points = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(format!("{name}.csv"));
    let found = judge(&mut world, &read(&points));
    println!("{name}: {found}");
    assert_eq!(found.missed, 0);
    found
}

/// Bias over some points, in shares of their own mean irradiance, and the standard error that the reference leaves in it.
fn bias(found: &Judgement, some: impl Fn(DVec3) -> bool) -> (f64, f64) {
    let rows: Vec<_> = found.rows.iter().filter(|row| some(row[0])).collect();
    let sum = |column: usize| rows.iter().map(|row| row[column].element_sum()).sum::<f64>();
    // The channels of a point are measured by the same paths.
    let noise = rows.iter().map(|row| row[4].element_sum().powi(2)).sum::<f64>().sqrt();
    ((sum(2) - sum(3)) / sum(3), noise / sum(3))
}

#[test]
fn two_rooms_and_a_doorway() {
    let found = baked(scenes::rooms, "rooms_0", 20.0);
    let (lit, lit_noise) = bias(&found, |p| p.x <= 0.0);
    let (dark, dark_noise) = bias(&found, |p| p.x >= 0.15);
    println!(
        "lit room {:+.2} ± {:.2} %, dark room {:+.2} ± {:.2} % of their own light",
        100.0 * lit,
        100.0 * lit_noise,
        100.0 * dark,
        100.0 * dark_noise
    );
    // Texels of 5 cm, a third of the default density: the median is the sampling's; the tail is the map's resolution.
    assert!(found.median < 0.01 && found.p95 < 0.05 && found.bias.abs() < 0.005, "{found}");
    // Patches that the wall between the rooms cut in two made the dark one 3.8 % too bright.
    assert!(lit.abs() < 0.006 && dark.abs() < 0.025, "{lit} {dark}");
    // In the closed cupboard there is no light.
    assert_eq!(found.leaks.0, 0, "{found}");
}

#[test]
fn a_hall_with_columns() {
    let found = baked(scenes::hall, "hall_0", 10.0);
    assert!(found.median < 0.01 && found.p95 < 0.05 && found.bias.abs() < 0.005, "{found}");
}
