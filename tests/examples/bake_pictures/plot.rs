//! Error against time, both logarithmic, from the table that `error_against_time` prints. Not the measuring.

use plotters::prelude::*;

use crate::drawing::{Area, GRID, INK, Outcome, drawing, rounded, text, ticks};

/// A row of the table.
struct Row {
    scene: String,
    variant: String,
    /// Of all processors: what others do on the machine hardly counts.
    seconds: f64,
    stated: f64,
    found: f64,
}

fn rows(table: &str) -> Vec<Row> {
    let row = |line: &str| {
        let cells: Vec<&str> = line.strip_prefix("| ")?.split(" | ").collect();
        let number = |at: usize| cells.get(at)?.parse::<f64>().ok().filter(|value| *value > 0.0);
        let (scene, variant) = ((*cells.first()?).to_owned(), (*cells.get(1)?).to_owned());
        Some(Row { scene, variant, seconds: number(4)?, stated: number(5)?, found: number(6)? })
    };
    table.lines().filter_map(row).collect()
}

const COLORS: [RGBColor; 4] =
    [RGBColor(20, 90, 180), RGBColor(215, 95, 15), RGBColor(30, 140, 60), RGBColor(140, 60, 150)];
/// Width and height of a panel, and the height of the names below all of them.
const PANEL: (u32, u32) = (560, 430);
const NAMES: u32 = 30;
/// Half the side of a square.
const MARK: i32 = 4;

/// One panel for each scene, side by side, over the names of the variants.
pub fn draw(table: &str) -> Outcome<String> {
    let rows = rows(table);
    let scenes = each_once(rows.iter().map(|row| row.scene.as_str()));
    let variants = each_once(rows.iter().map(|row| row.variant.as_str()));
    if scenes.is_empty() {
        return Err("the table has no rows".into());
    }
    let size = (PANEL.0 * scenes.len() as u32, PANEL.1 + NAMES);
    drawing(size, |root| {
        let (panels, names) = root.split_vertically(PANEL.1);
        for (panel, scene) in panels.split_evenly((1, scenes.len())).iter().zip(&scenes) {
            let own: Vec<&Row> = rows.iter().filter(|row| row.scene == *scene).collect();
            panel_of(panel, scene, &variants, &own)?;
        }
        for (place, variant) in variants.iter().enumerate() {
            let x = 80 + 150 * place as i32;
            square(&names, (x, 12), color_of(place), true)?;
            names.draw(&Text::new((*variant).to_owned(), (x + 12, 5), text()))?;
        }
        Ok(())
    })
}

/// Names in the order in which they first come.
fn each_once<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

fn color_of(place: usize) -> RGBColor {
    COLORS[place % COLORS.len()]
}

fn panel_of(panel: &Area<'_>, scene: &str, variants: &[&str], rows: &[&Row]) -> Outcome<()> {
    let range = |values: &dyn Fn(&Row) -> [f64; 2]| {
        let all = || rows.iter().flat_map(|row| values(row));
        [rounded(all().fold(f64::INFINITY, f64::min), false), rounded(all().fold(0.0, f64::max), true)]
    };
    let [seconds, percent] = [range(&|row| [row.seconds; 2]), range(&|row| [row.stated, row.found])];
    let mut chart = ChartBuilder::on(panel)
        .caption(scene, text())
        .margin(10)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d(
            (seconds[0]..seconds[1]).log_scale().with_key_points(ticks(seconds)),
            (percent[0]..percent[1]).log_scale().with_key_points(ticks(percent)),
        )?;
    chart
        .configure_mesh()
        .x_desc("processor seconds, all threads together")
        .y_desc("error, %")
        .x_label_formatter(&|value| format!("{value}"))
        .y_label_formatter(&|value| format!("{value}"))
        .label_style(text())
        .axis_desc_style(text())
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (place, variant) in variants.iter().enumerate() {
        let own = || rows.iter().filter(|row| row.variant == *variant);
        let color = color_of(place);
        let stated: Vec<(f64, f64)> = own().map(|row| (row.seconds, row.stated)).collect();
        let found: Vec<(f64, f64)> = own().map(|row| (row.seconds, row.found)).collect();
        chart.draw_series(DashedLineSeries::new(stated.clone(), 5, 5, color.stroke_width(1)))?;
        chart.draw_series(LineSeries::new(found.clone(), color.stroke_width(2)))?;
        let area = chart.plotting_area();
        let pixel = |at: &(f64, f64)| area.map_coordinate(at);
        stated.iter().try_for_each(|at| square(panel, within(panel, pixel(at)), color, false))?;
        found.iter().try_for_each(|at| square(panel, within(panel, pixel(at)), color, true))?;
    }
    Ok(())
}

/// A pixel of the whole drawing as one of a part of it.
fn within(part: &Area<'_>, (x, y): (i32, i32)) -> (i32, i32) {
    let (left, top) = part.get_base_pixel();
    (x - left, y - top)
}

fn square(area: &Area<'_>, (x, y): (i32, i32), color: RGBColor, full: bool) -> Outcome<()> {
    let corners = [(x - MARK, y - MARK), (x + MARK, y + MARK)];
    if full {
        area.draw(&Rectangle::new(corners, color.filled()))?;
    } else {
        area.draw(&Rectangle::new(corners, WHITE.filled()))?;
        area.draw(&Rectangle::new(corners, color.stroke_width(2)))?;
    }
    Ok(())
}
