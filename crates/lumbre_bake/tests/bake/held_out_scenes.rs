//! Bakes of scenes that no constant was tuned on, without texture coordinates, against the tests' own path tracer: two
//! rooms joined by a doorway with a lamp in one of them, a hall with columns, and a room whose lamp is behind a grille.
//! The density is low enough for a test; the examples `held_out_scenes`, `bake_file` and `judge` do the same at any density.

#![allow(clippy::print_stdout, reason = "the errors are the result that a reader of the output wants")]

use std::path::Path;

use glam::DVec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density};

use crate::held_out::point_errors::{PointErrors, measure};
use crate::held_out::reference_points::read;
use crate::held_out::scenes;

fn baked(name: &str, density: f64) -> (PointErrors, BakeReport) {
    let (scene, layout) = scenes::find(name).expect("the generators know it");
    let mut world = scene(layout, 1.0);
    let options =
        BakeOptions { density: Density::TexelsPerMeter(density), error: 0.02, ..BakeOptions::default() };
    let report = Bake::new(&options).run(&mut world).expect("the scene bakes");
    let points = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(format!("{name}.csv"));
    let errors = measure(&mut world, &read(&points));
    println!("{name}: {errors}");
    assert_eq!(errors.missed, 0);
    (errors, report)
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
    let (errors, _) = baked("rooms_0", 20.0);
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
    let (errors, _) = baked("hall_0", 10.0);
    assert!(errors.median < 0.01 && errors.p95 < 0.05 && errors.bias.abs() < 0.005, "{errors}");
}

#[test]
fn a_lamp_behind_a_grille() {
    let (errors, report) = baked("grille_1", 20.0);
    let (bias, noise) = bias(&errors, |_| true);
    let rays = report.rays as f64 / (report.coverage * report.texels as f64) - report.gather_rays;
    println!(
        "bias {:+.2} ± {:.2} %, {rays:.0} rays per texel beside the gather's, {report}",
        100.0 * bias,
        100.0 * noise
    );
    assert!(errors.median < 0.015 && errors.p95 < 0.08 && bias.abs() < 0.01 + 2.0 * noise, "{errors}");
    // Nearly all of the room is in the grille's penumbrae. Where each texel found its own visible share of the lamp, it
    // took a thousand rays beside the gather's, and still left too large an error.
    assert!(report.error_reached && rays < 800.0, "{rays} rays per texel: {report}");
}
