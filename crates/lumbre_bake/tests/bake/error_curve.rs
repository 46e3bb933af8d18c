//! The curve of error against time that a bake reports, and the parts of the error that it names. Whether the stated
//! error is true is tested in `honest_error`.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density};
use lumbre_optics::{Light, Material};

use crate::corner::corner;

fn baked(world: &mut World, error: f64) -> BakeReport {
    // On smaller maps the patches' bias is stated from a handful of checks, and may grow from one round to the next.
    let options = BakeOptions { density: Density::MapSize(48), error, ..BakeOptions::default() };
    Bake::new(&options).run(world).unwrap()
}

/// Checks that the squares of the error's parts add up to the square of the estimated error.
fn assert_parts_add_up(report: &BakeReport) {
    let sum: f64 = report.error_parts.iter().map(|part| part.error.powi(2)).sum();
    let (total, expected) = (sum.sqrt(), report.estimated_error);
    assert!((total - expected).abs() <= 1e-4 * expected, "{total} {expected}: {:?}", report.error_parts);
    assert!(report.error_parts.is_sorted_by(|a, b| a.error >= b.error), "{:?}", report.error_parts);
    assert!(report.to_string().contains(&format!("made of {}", report.error_parts[0].what)), "{report}");
}

/// Checks that the curve is ordered by time, ends at the reported error, and is printed and serialized.
fn assert_is_curve(report: &BakeReport) {
    let curve = &report.curve;
    assert!(curve.iter().all(|point| point.seconds >= 0.0 && point.error.is_finite()), "{curve:?}");
    assert!(curve.is_sorted_by(|a, b| a.seconds <= b.seconds), "{curve:?}");
    let last = curve.last().unwrap();
    assert_eq!((last.seconds, last.error), (report.seconds, report.estimated_error));
    assert_eq!(report.to_string().matches("  after ").count(), curve.len());
    let json = serde_json::to_value(report).unwrap();
    assert_eq!(json["curve"].as_array().unwrap().len(), curve.len());
    assert_eq!(json["curve"][0]["error"], curve[0].error);
}

#[test]
fn the_curve_advances_and_ends_at_the_reported_error() {
    // A small target error needs several rounds; a large one needs one round, after which the bake ends.
    let (fine, coarse) = (baked(&mut corner(), 0.003), baked(&mut corner(), 0.5));
    assert_is_curve(&fine);
    assert_is_curve(&coarse);
    assert_parts_add_up(&fine);
    assert_parts_add_up(&coarse);
    assert!(fine.error_parts.iter().any(|part| part.what == "noise of the final gather"), "{fine}");
    assert!(fine.curve.len() >= 3 && coarse.curve.len() == 2, "{:?} {:?}", fine.curve, coarse.curve);
    assert!(fine.curve[0].error > fine.estimated_error, "{fine}");
}

#[test]
fn without_bounces_the_curve_consists_of_direct_light() {
    let mut world = corner();
    let mut materials = world.query::<&mut Material>();
    materials.iter_mut(&mut world).for_each(|mut material| material.front.diffuse = Vec3::ZERO);
    let report = baked(&mut world, 0.01);
    assert_is_curve(&report);
    assert_eq!(report.curve.len(), 2);
    assert_parts_add_up(&report);
    assert!(report.error_parts.iter().all(|part| !part.what.contains("gather")), "{report}");
}

#[test]
fn without_light_the_curve_is_empty() {
    let mut world = corner();
    let mut materials = world.query::<&mut Material>();
    materials.iter_mut(&mut world).for_each(|mut material| material.front.emission = Vec3::ZERO);
    let mut lights = world.query::<&mut Light>();
    lights.iter_mut(&mut world).for_each(|mut light| light.enabled = false);
    assert!(baked(&mut world, 0.01).curve.is_empty());
}
