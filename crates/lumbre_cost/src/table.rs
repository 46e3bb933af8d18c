//! Writes a report as a table, with one row per point and the same columns for all studies.

use std::collections::BTreeSet;

use crate::{CostReport, Point};

/// Returns comma-separated values with a header line. Cells are empty where a point has no such value.
///
/// # Errors
/// The error of the CSV writer.
pub fn write_table(report: &CostReport) -> Result<Vec<u8>, csv::Error> {
    let points = || report.studies.iter().flat_map(|study| study.points.iter());
    let names = |of: fn(&Point) -> Vec<&String>| -> BTreeSet<&String> { points().flat_map(of).collect() };
    let parameters = names(|point| point.parameters.keys().collect());
    let counts = names(|point| point.counts.keys().collect());
    let figures = names(|point| point.figures.keys().collect());
    let mut table = csv::Writer::from_writer(Vec::new());
    let fixed = [
        "study",
        "series",
        "label",
        "ms",
        "ms lower quartile",
        "ms upper quartile",
        "rounds",
        "relative RMSE",
        "uncertainty",
        "largest",
        "FLIP",
        "picture",
        "command",
    ];
    let varying = parameters.iter().chain(&counts).chain(&figures).map(|name| name.as_str());
    table.write_record(fixed.into_iter().chain(varying))?;
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for study in &report.studies {
        for point in &study.points {
            let (time, error) = (point.milliseconds, point.error);
            let mut row = vec![
                study.name.clone(),
                point.series.clone(),
                point.label.clone(),
                number(time.map(|time| time.median)),
                number(time.map(|time| time.lower)),
                number(time.map(|time| time.upper)),
                number(time.map(|time| time.rounds as f64)),
                number(error.map(|error| error.relative_rmse)),
                number(error.map(|error| error.uncertainty)),
                number(error.map(|error| error.largest)),
                number(error.and_then(|error| error.flip)),
                point.picture.as_ref().map_or(String::new(), |files| format!("{}.exr", files.picture)),
                point.command.clone(),
            ];
            row.extend(parameters.iter().map(|name| number(point.parameters.get(*name).copied())));
            row.extend(counts.iter().map(|name| number(point.counts.get(*name).copied())));
            row.extend(figures.iter().map(|name| number(point.figures.get(*name).copied())));
            table.write_record(row)?;
        }
    }
    table.into_inner().map_err(|error| csv::Error::from(std::io::Error::other(error.to_string())))
}
