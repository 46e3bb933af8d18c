//! The error against time that a bake reports, and what it says that the error is made of. Not whether the error is honest.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density};
use lumbre_optics::{Light, Material};

use crate::corner::corner;

fn baked(world: &mut World, error: f64) -> BakeReport {
    let options = BakeOptions { density: Density::MapSize(24), error, ..BakeOptions::default() };
    Bake::new(&options).run(world).unwrap()
}

/// The squares of the parts add up to that of the whole.
fn is_the_sum_of_its_parts(report: &BakeReport) {
    let sum: f64 = report.error_parts.iter().map(|part| part.error.powi(2)).sum();
    let (found, expected) = (sum.sqrt(), report.estimated_error);
    assert!((found - expected).abs() <= 1e-4 * expected, "{found} {expected}: {:?}", report.error_parts);
    assert!(report.error_parts.is_sorted_by(|a, b| a.error >= b.error), "{:?}", report.error_parts);
    assert!(report.to_string().contains(&format!("made of {}", report.error_parts[0].what)), "{report}");
}

fn is_a_curve(report: &BakeReport) {
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
fn it_goes_forward_and_ends_at_what_is_reported() {
    // Asked for much, there are several rounds; for little, one, and the end.
    let (fine, coarse) = (baked(&mut corner(), 0.003), baked(&mut corner(), 0.5));
    is_a_curve(&fine);
    is_a_curve(&coarse);
    is_the_sum_of_its_parts(&fine);
    is_the_sum_of_its_parts(&coarse);
    assert!(fine.error_parts.iter().any(|part| part.what == "noise of the final gather"), "{fine}");
    assert!(fine.curve.len() >= 3 && coarse.curve.len() == 2, "{:?} {:?}", fine.curve, coarse.curve);
    assert!(fine.curve[0].error > fine.estimated_error);
}

#[test]
fn without_bounces_it_holds_direct_light() {
    let mut world = corner();
    let mut materials = world.query::<&mut Material>();
    materials.iter_mut(&mut world).for_each(|mut material| material.front.diffuse = Vec3::ZERO);
    let report = baked(&mut world, 0.01);
    is_a_curve(&report);
    assert_eq!(report.curve.len(), 2);
    is_the_sum_of_its_parts(&report);
    assert!(report.error_parts.iter().all(|part| !part.what.contains("gather")), "{report}");
}

#[test]
fn without_light_it_is_empty() {
    let mut world = corner();
    let mut materials = world.query::<&mut Material>();
    materials.iter_mut(&mut world).for_each(|mut material| material.front.emission = Vec3::ZERO);
    let mut lights = world.query::<&mut Light>();
    lights.iter_mut(&mut world).for_each(|mut light| light.enabled = false);
    assert!(baked(&mut world, 0.01).curve.is_empty());
}
