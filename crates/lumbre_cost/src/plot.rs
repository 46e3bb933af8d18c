//! Draws plots with logarithmic axes as SVG. Colours are those of the page's style sheet.

use maud::{Markup, html};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::findings::{cost_of, counted, rounded};
use crate::fronts::fronts_by_reference;
use crate::{CostError, Plot, Point, Quantity, Study};

/// The size of a plot. Text keeps its size in pixels, so that phones need drawings of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotSize {
    /// For screens and paper.
    Wide,
    /// For phones.
    Narrow,
}

impl PlotSize {
    fn pixels(self) -> (u32, u32) {
        match self {
            Self::Wide => (510, 380),
            Self::Narrow => (350, 320),
        }
    }
}

/// Placeholders in the drawing for the colours of the page's style sheet.
const INK: RGBColor = RGBColor(1, 2, 3);
const GRID: RGBColor = RGBColor(1, 2, 4);
const FRONT: RGBColor = RGBColor(1, 2, 5);
/// Number of colours for series; further series reuse them.
pub const SERIES_COLORS: usize = 7;

fn series_color(series: usize) -> RGBColor {
    RGBColor(2, 2, (series % SERIES_COLORS) as u8)
}

const FONT: u32 = 13;
/// Radius of a mark in pixels.
const MARK: i32 = 4;

/// The position of a point's mark in a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mark {
    /// Index of the point in its study.
    point: usize,
    /// Position in pixels.
    at: (i32, i32),
}

/// Radius in pixels around a mark that reacts to pointers and fingers.
const REACH: i32 = 11;

/// Draws a plot. An invisible circle around every mark reacts to pointers, fingers and the keyboard, and
/// holds the point's details.
///
/// # Errors
/// [`CostError::Plot`].
pub fn draw_plot(study: &Study, plot: &Plot, size: PlotSize) -> Result<String, CostError> {
    let mut svg = String::new();
    let marks = {
        let root = SVGBackend::with_string(&mut svg, size.pixels()).into_drawing_area();
        let drawn = draw(&root, study, plot, size).and_then(|marks| {
            root.present().map_err(|error| error.to_string())?;
            Ok(marks)
        });
        drawn
            .map_err(|reason| CostError::Plot { title: format!("{}: {}", study.title, plot.title), reason })?
    };
    let svg = with_colors_of_the_page(&svg);
    let answering = answering(study, &marks).into_string();
    Ok(match svg.rfind("</svg>") {
        Some(end) => format!("{}{answering}{}", &svg[..end], &svg[end..]),
        None => svg,
    })
}

/// Returns the invisible circles around marks.
fn answering(study: &Study, marks: &[Mark]) -> Markup {
    html! {
        @for mark in marks {
            @if let Some(point) = study.points.get(mark.point) {
                circle class="hit" cx=(mark.at.0) cy=(mark.at.1) r=(REACH) tabindex="0" role="button"
                    data-point=(mark.point) data-details=(details_of(point)) aria-label=(details_of(point)) {}
            }
        }
    }
}

/// Returns a point's details, one per line.
fn details_of(point: &Point) -> String {
    let numbers = point.parameters.iter().chain(&point.figures).chain(&point.counts);
    let flip = point.error.and_then(|error| error.flip).map(|flip| format!("FLIP: {}", rounded(flip)));
    let lines = [format!("{}, {}", point.series, point.label), cost_of(point)].into_iter();
    let lines = lines.chain(flip).chain(numbers.map(|(name, value)| format!("{name}: {}", counted(*value))));
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
}

/// Returns the series that a plot draws, with their indices in the study, which determine their colours.
pub fn drawn_series<'a>(study: &'a Study, plot: &Plot) -> Vec<(usize, &'a str)> {
    let has_numbers = |series: &str| study.of_series(series).any(|point| place(plot, point).is_some());
    let wanted = |series: &str| plot.series.is_empty() || plot.series.iter().any(|name| name == series);
    let all = study.series().into_iter().enumerate();
    all.filter(|(_, series)| wanted(series) && has_numbers(series)).collect()
}

/// Returns the fronts that a plot draws: one for each reference that its points have.
pub fn drawn_fronts<'a>(study: &'a Study, plot: &Plot) -> Vec<Vec<&'a Point>> {
    if !plot.front {
        return Vec::new();
    }
    let series = drawn_series(study, plot);
    let is_drawn =
        |point: &&Point| series.iter().any(|(_, name)| *name == point.series) && place(plot, point).is_some();
    fronts_by_reference(study.points.iter().filter(is_drawn), |point| place(plot, point))
}

/// Returns a point's two values as displayed, if the plot shows it and it has both.
fn place(plot: &Plot, point: &Point) -> Option<(f64, f64)> {
    if plot.varied.as_ref().is_some_and(|name| !point.parameters.contains_key(name)) {
        return None;
    }
    let (across, up) = (plot.across.of(point)? * plot.across.shown(), plot.up.of(point)? * plot.up.shown());
    (across.is_finite() && up.is_finite() && across >= 0.0 && up >= 0.0).then_some((across, up))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(root: &Area<'_>, study: &Study, plot: &Plot, size: PlotSize) -> Result<Vec<Mark>, String> {
    let told = |error: DrawingAreaErrorKind<_>| -> String { format!("{error:?}") };
    let series = drawn_series(study, plot);
    let points: Vec<(usize, &Point, (f64, f64))> = series
        .iter()
        .flat_map(|(color, name)| {
            study.of_series(name).filter_map(|point| Some((*color, point, place(plot, point)?)))
        })
        .collect();
    if points.is_empty() {
        return Err("no point has both numbers".to_owned());
    }
    let (most_across, most_up) = if size == PlotSize::Wide { (7, 7) } else { (5, 6) };
    let across =
        Axis::of(points.iter().flat_map(|(_, point, at)| reach(&plot.across, point, at.0)), most_across);
    let up = Axis::of(points.iter().map(|(.., at)| at.1), most_up);
    let text = |color: &RGBColor| ("sans-serif", FONT).into_font().color(color);
    let mut chart = ChartBuilder::on(root)
        .margin(8)
        .margin_right(16)
        .x_label_area_size(44)
        .y_label_area_size(62)
        .build_cartesian_2d(
            (across.from..across.to).log_scale().with_key_points(across.ticks.clone()),
            (up.from..up.to).log_scale().with_key_points(up.ticks.clone()),
        )
        .map_err(told)?;
    chart
        .configure_mesh()
        .x_desc(plot.across.title())
        .y_desc(plot.up.title())
        .x_labels(across.ticks.len())
        .y_labels(up.ticks.len())
        .x_label_formatter(&|value| tick_label(*value))
        .y_label_formatter(&|value| tick_label(*value))
        .label_style(text(&INK))
        .axis_desc_style(text(&INK))
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(told)?;
    let onto = |(x, y): (f64, f64)| (x.max(across.from), y.max(up.from));

    let fronts = drawn_fronts(study, plot);
    // Labels must not cover lines.
    let mut lines = Vec::new();
    for front in &fronts {
        let corners: Vec<(f64, f64)> =
            front.iter().filter_map(|point| place(plot, point)).map(onto).collect();
        let steps: Vec<(f64, f64)> =
            corners.iter().zip(corners.iter().skip(1)).flat_map(|(a, b)| [*a, (b.0, a.1), *b]).collect();
        lines.push(steps.clone());
        chart.draw_series(DashedLineSeries::new(steps, 4, 4, FRONT.stroke_width(1))).map_err(told)?;
    }
    if plot.equal {
        let ends = [across.from.max(up.from), across.to.min(up.to)].map(|value| (value, value));
        if ends[0] < ends[1] {
            chart.draw_series(DashedLineSeries::new(ends, 2, 4, FRONT.stroke_width(1))).map_err(told)?;
        }
    }

    for (color, name) in &series {
        let own = || points.iter().filter(|(_, point, _)| point.series == *name);
        let style = series_color(*color);
        if plot.joined {
            let mut line: Vec<(f64, f64)> = own().map(|(.., at)| onto(*at)).collect();
            if plot.across != Quantity::Milliseconds {
                line.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
            lines.push(line.clone());
            chart.draw_series(LineSeries::new(line, style.stroke_width(2))).map_err(told)?;
        }
        // The quartiles of times.
        for (_, point, at) in own() {
            let Some(time) = point.milliseconds else { continue };
            let ends = match (&plot.across, &plot.up) {
                (Quantity::Milliseconds, _) => [(time.lower, at.1), (time.upper, at.1)],
                (_, Quantity::Milliseconds) => [(at.0, time.lower), (at.0, time.upper)],
                _ => continue,
            };
            let ends = ends.map(onto);
            lines.push(ends.to_vec());
            chart.draw_series(LineSeries::new(ends, style.stroke_width(1))).map_err(told)?;
        }
    }
    let area = chart.plotting_area();
    let mut taken: Vec<[i32; 4]> = Vec::new();
    let pixels = |line: &[(f64, f64)]| line.iter().map(|at| area.map_coordinate(at)).collect::<Vec<_>>();
    lines.iter().for_each(|line| taken.extend(along(&pixels(line))));
    let mut marks = Vec::new();
    for (color, point, at) in &points {
        let (x, y) = area.map_coordinate(&onto(*at));
        let number = study.points.iter().position(|other| std::ptr::eq(other, *point));
        marks.extend(number.map(|point| Mark { point, at: (x, y) }));
        taken.push([x - MARK, y - MARK, x + MARK, y + MARK]);
        mark(root, *color, (x, y)).map_err(told)?;
    }
    for point in fronts.into_iter().flatten() {
        let Some(at) = place(plot, point) else { continue };
        let (x, y) = area.map_coordinate(&onto(at));
        let Some(label) = Label::beside(&point.label, (x, y), size.pixels(), &taken) else { continue };
        taken.push(label.extent);
        let style = text(&INK).pos(Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(point.label.clone(), label.start, style)).map_err(told)?;
    }
    Ok(marks)
}

/// Returns small boxes along a line.
fn along(line: &[(i32, i32)]) -> Vec<[i32; 4]> {
    let mut boxes = Vec::new();
    for ((x, y), (to_x, to_y)) in line.iter().zip(line.iter().skip(1)) {
        let steps = (to_x - x).abs().max((to_y - y).abs()) / 4 + 1;
        boxes.extend((0..=steps).map(|step| {
            let [x, y] = [x + (to_x - x) * step / steps, y + (to_y - y) * step / steps];
            [x - 1, y - 1, x + 1, y + 1]
        }));
    }
    boxes
}

/// Returns a horizontal value together with the quartiles of its time.
fn reach(across: &Quantity, point: &Point, at: f64) -> Vec<f64> {
    match (across, point.milliseconds) {
        (Quantity::Milliseconds, Some(time)) => vec![time.lower, at, time.upper],
        _ => vec![at],
    }
}

/// Draws a mark. Series differ in shape as well as in colour, for colour-blind readers and for print.
fn mark(
    root: &Area<'_>,
    series: usize,
    (x, y): (i32, i32),
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let style = series_color(series).filled();
    let ring = series_color(series).stroke_width(2);
    match series % 4 {
        0 => root.draw(&Circle::new((x, y), MARK, style)),
        1 => root.draw(&Rectangle::new([(x - MARK + 1, y - MARK + 1), (x + MARK - 1, y + MARK - 1)], style)),
        2 => root.draw(&TriangleMarker::new((x, y), MARK + 1, style)),
        _ => root.draw(&Circle::new((x, y), MARK, ring)),
    }
}

/// The position of a label that covers no other label and no mark.
struct Label {
    start: (i32, i32),
    extent: [i32; 4],
}

impl Label {
    fn beside(
        text: &str,
        (x, y): (i32, i32),
        (width, height): (u32, u32),
        taken: &[[i32; 4]],
    ) -> Option<Self> {
        // The width of the text is not known here; this estimate is generous.
        let long = (text.chars().count() as f64 * 0.56 * f64::from(FONT)).ceil() as i32;
        let high = FONT as i32;
        let starts = [
            (x + MARK + 2, y - high + 1),
            (x + MARK + 4, y),
            (x - long - 2, y + high - 1),
            (x - MARK - 4 - long, y),
            (x - long - 2, y - high + 1),
            (x + MARK + 2, y + high - 1),
            (x - long / 2, y - high - 2),
            (x - long / 2, y + high + 2),
        ];
        let fits = |extent: &[i32; 4]| {
            let inside = extent[0] > 66
                && extent[1] > 4
                && extent[2] < width as i32 - 4
                && extent[3] < height as i32 - 48;
            let free = |other: &[i32; 4]| {
                extent[0] >= other[2]
                    || extent[2] <= other[0]
                    || extent[1] >= other[3]
                    || extent[3] <= other[1]
            };
            inside && taken.iter().all(free)
        };
        let extent = |start: (i32, i32)| [start.0, start.1 - high / 2, start.0 + long, start.1 + high / 2];
        starts
            .into_iter()
            .map(|start| Self { start, extent: extent(start) })
            .find(|label| fits(&label.extent))
    }
}

/// A logarithmic axis with its range and its ticks.
#[derive(Clone, Debug, PartialEq)]
struct Axis {
    from: f64,
    to: f64,
    ticks: Vec<f64>,
}

/// Margin beyond the outermost values, as a factor.
const AIR: f64 = 1.3;
/// Values smaller than this fraction of the largest are drawn at the end of the axis.
const MIN_FRACTION: f64 = 1e-9;

impl Axis {
    /// Returns an axis for some values with at most `most` ticks. Values that are 0 are drawn at its lower
    /// end.
    fn of(numbers: impl Iterator<Item = f64>, most: usize) -> Self {
        let numbers: Vec<f64> = numbers.collect();
        let largest = numbers.iter().copied().fold(0.0, f64::max);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let above = numbers.iter().copied().filter(|number| *number > largest * MIN_FRACTION);
        let smallest = above.fold(largest, f64::min);
        let below = numbers.iter().any(|number| *number <= largest * MIN_FRACTION);
        let (mut from, mut to) = (smallest / if below { 4.0 } else { AIR }, largest * AIR);
        if to / from < 3.0 {
            let middle = (from * to).sqrt();
            (from, to) = (middle / 3f64.sqrt(), middle * 3f64.sqrt());
        }
        Self { from, to, ticks: ticks(from, to, most) }
    }
}

/// Returns powers of ten and round multiples of them within a range, as many as fit.
fn ticks(from: f64, to: f64, most: usize) -> Vec<f64> {
    let powers = || from.log10().floor() as i32..=to.log10().ceil() as i32;
    let with = |digits: &[u32], every: i32| -> Vec<f64> {
        powers()
            .filter(|power| power % every == 0)
            .flat_map(|power| digits.iter().map(move |digit| format!("{digit}e{power}")))
            // Parsed from decimals, a tick is exactly the number that its label shows.
            .filter_map(|text| text.parse::<f64>().ok())
            .filter(|tick| (from..=to).contains(tick))
            .collect()
    };
    let choices = [
        with(&[1, 2, 3, 4, 5, 6, 7, 8, 9], 1),
        with(&[1, 2, 5], 1),
        with(&[1, 3], 1),
        with(&[1], 1),
        with(&[1], 2),
        with(&[1], 4),
    ];
    let fits = |ticks: &&Vec<f64>| ticks.len() <= most;
    choices.iter().find(fits).or_else(|| choices.last()).cloned().unwrap_or_default()
}

fn tick_label(value: f64) -> String {
    if (1e-3..1e6).contains(&value) { format!("{value}") } else { format!("{value:e}") }
}

fn with_colors_of_the_page(svg: &str) -> String {
    let hex = |RGBColor(r, g, b): RGBColor| format!("\"#{r:02X}{g:02X}{b:02X}\"");
    let mut names = vec![
        (hex(INK), "\"var(--ink)\"".to_owned()),
        (hex(GRID), "\"var(--grid)\"".to_owned()),
        (hex(FRONT), "\"var(--front)\"".to_owned()),
    ];
    names.extend((0..SERIES_COLORS).map(|at| (hex(series_color(at)), format!("\"var(--series-{at})\""))));
    names.iter().fold(svg.to_owned(), |svg, (from, to)| svg.replace(from, to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks(0.9, 11.0, 9), [1.0, 2.0, 5.0, 10.0]);
        assert_eq!(ticks(2.5, 6.5, 9), [3.0, 4.0, 5.0, 6.0]);
        assert_eq!(ticks(1e-6, 1e3, 6), [1e-6, 1e-4, 1e-2, 1.0, 1e2]);
        assert_eq!([0.001, 0.3, 1e-5, 1e6].map(tick_label), ["0.001", "0.3", "1e-5", "1e6"]);
    }

    #[test]
    fn an_axis_holds_its_numbers_and_zeros_stand_on_its_end() {
        let axis = Axis::of([0.0, 2.0, 8.0].into_iter(), 9);
        assert!(axis.from < 2.0 && axis.from > 0.0 && axis.to > 8.0, "{axis:?}");
        let narrow = Axis::of([5.0].into_iter(), 9);
        assert!(narrow.to / narrow.from >= 2.99 && narrow.ticks.len() > 1, "{narrow:?}");
    }

    #[test]
    fn names_do_not_lie_over_each_other() {
        let first = Label::beside("depth 3", (200, 100), (680, 400), &[]).expect("there is room");
        let second =
            Label::beside("depth 4", (203, 102), (680, 400), &[first.extent]).expect("there is room");
        let apart = second.extent[1] >= first.extent[3]
            || second.extent[3] <= first.extent[1]
            || second.extent[0] >= first.extent[2]
            || second.extent[2] <= first.extent[0];
        assert!(apart, "{:?} {:?}", first.extent, second.extent);
        assert!(
            Label::beside(
                "a name that is far too long to stand anywhere in so small a drawing",
                (175, 100),
                (350, 320),
                &[]
            )
            .is_none()
        );
    }
}
