//! The report as a single HTML page that contains its plots, pictures and styles.

mod gallery;
mod tables;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::plot::{PlotSize, SERIES_COLORS, draw_plot, drawn_fronts, drawn_series};
use crate::{CostError, CostReport, Plot, Study};

/// Returns the bytes of a PNG or JPEG by the name with which a point refers to its picture; `None` if it does
/// not exist.
pub type Images<'a> = dyn Fn(&str) -> Option<Vec<u8>> + 'a;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Returns the whole page.
///
/// # Errors
/// [`CostError::Plot`].
pub fn page(report: &CostReport, images: &Images<'_>) -> Result<String, CostError> {
    let mut sections = Vec::new();
    for study in &report.studies {
        sections.push(section(study, images)?);
    }
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "What accuracy costs in time" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "What accuracy costs in time" }
                    p {
                        "Every choice has a time in milliseconds and an error, which is the difference of its result from a reference. Times are medians over rounds in which all choices of a study take turns, with quartiles drawn as lines. Errors are relative root mean square errors. Point at or tap a point of a plot to see what it is, with its picture. "
                        "Measured on this machine, with these settings:"
                    }
                    (tables::conditions(report))
                }
                nav aria-label="Studies" {
                    h2 { "Findings" }
                    ol {
                        @for study in &report.studies {
                            li {
                                a href=(format!("#{}", study.name)) { (study.title) }
                                @if let Some(first) = study.findings.first() { ": " (first) }
                            }
                        }
                    }
                }
                main { @for section in &sections { (section) } }
                footer {
                    p { "The same numbers are in " code { "cost.json" } " and " code { "cost.csv" } ", and pictures with their radiance in " code { "pictures" } ". Commands are to be run in the folder of this page." }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    Ok(page.into_string())
}

fn section(study: &Study, images: &Images<'_>) -> Result<Markup, CostError> {
    let mut plots = Vec::new();
    for plot in &study.plots {
        // A plot has no points if no file called for its quantities.
        if !drawn_series(study, plot).is_empty() {
            plots.push(plot_figure(study, plot)?);
        }
    }
    Ok(html! {
        section id=(study.name) {
            h2 { (study.title) }
            p { (study.question) }
            p class="reference" { "Reference for errors: " (study.reference) "." }
            @if !study.findings.is_empty() {
                ul class="findings" { @for finding in &study.findings { li { (finding) } } }
            }
            div class="plots" { @for plot in &plots { (plot) } }
            (gallery::viewer(study, images))
            (tables::points(study))
            @if !study.notes.is_empty() {
                ul class="notes" { @for note in &study.notes { li { (note) } } }
            }
            p class="effort" {
                (format!("This study took {:.1} s (method {}, {}).", study.seconds, study.method, study.version))
            }
        }
    })
}

fn plot_figure(study: &Study, plot: &Plot) -> Result<Markup, CostError> {
    let drawing = |size, class: &str| -> Result<Markup, CostError> {
        let svg = draw_plot(study, plot, size)?;
        let label = format!("{}: {} over {}", plot.title, plot.up.title(), plot.across.title());
        Ok(html! { div class=(class) role="img" aria-label=(label) { (PreEscaped(svg)) } })
    };
    let (wide, narrow) = (drawing(PlotSize::Wide, "wide")?, drawing(PlotSize::Narrow, "narrow")?);
    Ok(html! {
        figure class="plot" {
            figcaption { (plot.title) }
            (wide)
            (narrow)
            div class="tip" aria-live="polite" hidden { img alt=""; p {} }
            ul class="legend" {
                @for (place, series) in drawn_series(study, plot) {
                    li { (legend_mark(place)) (series) }
                }
                @match drawn_fronts(study, plot).len() {
                    0 => {}
                    1 => { li { span class="front" {} "not beaten in both quantities" } }
                    _ => { li { span class="front" {} "not beaten in both quantities by others with the same reference" } }
                }
                @if plot.equal {
                    li { span class="front" {} "equal" }
                }
            }
        }
    })
}

/// Returns the mark of a series for the legend.
fn legend_mark(series: usize) -> Markup {
    let color = format!("var(--series-{})", series % SERIES_COLORS);
    html! {
        svg class="mark" viewBox="0 0 12 12" aria-hidden="true" {
            @match series % 4 {
                0 => { circle cx="6" cy="6" r="4" fill=(color) {} }
                1 => { rect x="3" y="3" width="6" height="6" fill=(color) {} }
                2 => { path d="M6 1 L10.5 9 H1.5 Z" fill=(color) {} }
                _ => { circle cx="6" cy="6" r="4" fill="none" stroke=(color) stroke-width="2" {} }
            }
        }
    }
}
