//! Computes the errors of a report again from the pictures that it keeps, by the plain formula, for every
//! point of every study that has a picture.

use glam::DVec3;
use lumbre_cost::{CostOptions, ErrorOver, Picture, Point, STUDIES, read_picture};

use super::{measured, options};

/// Root mean square difference divided by that of the reference, and the largest difference of a channel.
fn errors(reference: &Picture, picture: &Picture, over: ErrorOver) -> [f64; 2] {
    let (mut squares, mut size, mut largest) = (0.0, 0.0, 0.0_f64);
    for (wanted, found) in reference.radiance.iter().zip(&picture.radiance) {
        if over == ErrorOver::WhereBothAreLit && (*wanted == DVec3::ZERO || *found == DVec3::ZERO) {
            continue;
        }
        for channel in 0..3 {
            squares += (wanted[channel] - found[channel]).powi(2);
            size += wanted[channel].powi(2);
            largest = largest.max((wanted[channel] - found[channel]).abs());
        }
    }
    [if squares == 0.0 { 0.0 } else { (squares / size).sqrt() }, largest]
}

/// The errors of lightmaps as bakes state them: root mean square and largest difference divided by the mean
/// of the reference, over the texels that both have.
fn errors_of_maps(reference: &Picture, found: &Picture) -> [f64; 2] {
    let (mut squares, mut sum, mut largest, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
    for (wanted, found) in reference.radiance.iter().zip(&found.radiance) {
        if !(wanted.is_finite() && found.is_finite()) {
            continue;
        }
        squares += (*wanted - *found).length_squared() / 3.0;
        sum += wanted.element_sum() / 3.0;
        largest = largest.max((*wanted - *found).abs().max_element());
        count += 1.0;
    }
    let mean = sum / count;
    [(squares / count).sqrt() / mean, largest / mean]
}

/// The error of form factors between the sides of a cube, which has no picture: checks it by those that the point
/// states and by the closed form (Howell, C-11 and C-14).
fn error_of_form_factors(point: &Point) {
    assert_eq!(
        point.series, "form factors of all pairs",
        "{} has an error and no picture of it",
        point.label
    );
    let (opposite, adjacent) = (0.199824895698387, 0.200043776075403);
    let found = |name: &str| point.figures[&format!("form factor of {name} sides")];
    let squares = (found("opposite") - opposite).powi(2) + 4.0 * (found("adjacent") - adjacent).powi(2);
    let relative = (squares / (opposite.powi(2) + 4.0 * adjacent.powi(2))).sqrt();
    let error = point.error.unwrap();
    assert!((relative - error.relative_rmse).abs() < 1e-12 && relative > 0.0, "{relative} {error:?}");
}

#[test]
fn errors_are_those_of_the_pictures_that_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<&str> = STUDIES.iter().map(|study| study.name).collect();
    let asked = CostOptions { size: (48, 32), ..options(&names, Vec::new()) };
    let report = measured(&asked, folder.path());
    assert_eq!(report.studies.len(), STUDIES.len());
    for study in &report.studies {
        let (mut compared, mut different) = (0, 0);
        for point in &study.points {
            let name = format!("{}, {}, {}", study.name, point.series, point.label);
            let error = point.error.unwrap_or_else(|| panic!("{name} has no error"));
            assert!(point.milliseconds.is_some(), "{name} has no time");
            let Some(files) = &point.picture else {
                error_of_form_factors(point);
                continue;
            };
            let read = |name: &String| read_picture(folder.path(), name).unwrap();
            let ([found, largest], noise) = match (&files.maps, files.error_of) {
                (Some(maps), ErrorOver::Beyond) => {
                    // The noise of the reference was subtracted, and is known to a fifth.
                    (errors_of_maps(&read(&maps.reference), &read(&maps.picture)), 5.0 * error.uncertainty)
                }
                (None, over) => (errors(&read(&files.reference), &read(&files.picture), over), 0.0),
                other => panic!("{name}: {other:?}"),
            };
            // Kept pictures are rounded to f32.
            let bound = 1e-6 * found + 1e-7;
            assert!(found - error.relative_rmse > -bound, "{name}: {found} {error:?}");
            assert!(found - error.relative_rmse < bound + noise, "{name}: {found} {error:?}");
            // The difference of two numbers that are rounded to f32 is off by their roundings, however small
            // it is.
            let reference = read(&files.reference);
            let brightest = reference.radiance.iter().map(|pixel| pixel.max_element()).fold(0.0, f64::max);
            assert!(
                (largest - error.largest).abs() <= 1e-6 * largest + 1.2e-7 * brightest.max(found).max(1.0),
                "{name}: {largest} {error:?}"
            );
            for kind in ["png", "heat.png"] {
                assert!(folder.path().join(format!("{}.{kind}", files.picture)).exists(), "{name}");
            }
            compared += 1;
            different += usize::from(found > 0.0);
        }
        assert!(compared >= 4 && different >= compared / 2, "{}: {different} of {compared}", study.name);
    }
}
