//! The tables of the page: the conditions of the measurement, and all points with their numbers.

use std::collections::BTreeSet;

use maud::{Markup, html};

use crate::findings::{counted, milliseconds, rounded};
use crate::{CostReport, Point, Study};

/// Returns the list of machine and settings.
pub fn conditions(report: &CostReport) -> Markup {
    let (machine, settings) = (&report.machine, &report.settings);
    let (width, height) = settings.size;
    let effort = match (settings.quick, settings.counts_only) {
        (true, true) => "quick: fewer points; only counts",
        (true, false) => "quick: fewer points and rounds",
        (false, true) => "only counts",
        (false, false) => "full",
    };
    let rows = [
        ("Processor", format!("{}, {} threads", machine.processor, machine.threads)),
        ("System", machine.system.clone()),
        ("Device", machine.adapter.clone()),
        ("Program", machine.version.clone()),
        ("Pictures", format!("{width} x {height} pixels")),
        ("Effort", effort.to_owned()),
        ("Seed", settings.seed.to_string()),
    ];
    html! {
        dl class="conditions" {
            @for (name, value) in rows { div { dt { (name) } dd { (value) } } }
            @if !settings.files.is_empty() {
                div { dt { "Scenes" } dd { @for file in &settings.files { code { (file) } " " } } }
            }
        }
    }
}

/// Returns the table of all points, and the commands that reproduce them.
pub fn points(study: &Study) -> Markup {
    let names =
        |of: fn(&Point) -> Vec<&String>| -> BTreeSet<&String> { study.points.iter().flat_map(of).collect() };
    let parameters = names(|point| point.parameters.keys().collect());
    let figures = names(|point| point.figures.keys().collect());
    let counts = names(|point| point.counts.keys().collect());
    let number = |value: Option<f64>| value.map_or(String::new(), rounded);
    let has_flip = study.points.iter().any(|point| point.error.is_some_and(|error| error.flip.is_some()));
    let error = |point: &Point| {
        point.error.map_or(String::new(), |error| match error.uncertainty {
            0.0 => rounded(100.0 * error.relative_rmse),
            _ if error.is_below_uncertainty() => format!("at most {}", rounded(100.0 * error.reached())),
            open => format!("{} ± {}", rounded(100.0 * error.relative_rmse), rounded(100.0 * open)),
        })
    };
    html! {
        div class="scroll" tabindex="0" role="region" aria-label=(format!("Numbers of the study {}", study.title)) {
            table {
                thead {
                    tr {
                        th scope="col" { "choice" }
                        th scope="col" { "setting" }
                        th scope="col" { "time" }
                        th scope="col" { "RMSE, %" }
                        @if has_flip { th scope="col" { "FLIP" } }
                        th scope="col" { "largest" }
                        @for name in parameters.iter().chain(&figures).chain(&counts) { th scope="col" { (name) } }
                    }
                }
                tbody {
                    @for point in &study.points {
                        tr {
                            th scope="row" { (point.series) }
                            td class="label" { (point.label) }
                            td { (point.milliseconds.map_or(String::new(), |time| milliseconds(&time))) }
                            td { (error(point)) }
                            @if has_flip { td { (number(point.error.and_then(|error| error.flip))) } }
                            td { (number(point.error.map(|error| error.largest))) }
                            @for name in &parameters { td { (point.parameters.get(*name).copied().map_or(String::new(), counted)) } }
                            @for name in &figures { td { (number(point.figures.get(*name).copied())) } }
                            @for name in &counts { td { (point.counts.get(*name).copied().map_or(String::new(), counted)) } }
                        }
                    }
                }
            }
        }
        details class="commands" {
            summary { "Commands that reproduce these points" }
            dl {
                @for point in &study.points {
                    dt { (point.series) ", " (point.label) }
                    dd { code { (point.command) } }
                }
            }
        }
    }
}
