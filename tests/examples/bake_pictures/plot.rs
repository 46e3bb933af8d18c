//! Plots error against time, both on logarithmic axes, from the table that `error_against_time` prints.

use image::{Rgb, RgbImage};

use crate::dots;

const BLACK: Rgb<u8> = Rgb([40, 40, 40]);
const GREY: Rgb<u8> = Rgb([222, 222, 222]);

/// A row of the table.
struct Row {
    scene: String,
    variant: String,
    /// Summed over all processors, so that other load on the machine hardly matters.
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

/// The mapping from numbers to pixels.
struct Axes {
    left: f64,
    top: f64,
    size: [f64; 2],
    seconds: [f64; 2],
    percent: [f64; 2],
}

impl Axes {
    fn place(&self, seconds: f64, percent: f64) -> [f64; 2] {
        let part = |value: f64, [low, high]: [f64; 2]| (value / low).ln() / (high / low).ln();
        [
            self.left + part(seconds, self.seconds) * self.size[0],
            self.top + (1.0 - part(percent, self.percent)) * self.size[1],
        ]
    }
}

/// Returns the nearest number above or below that is a power of ten times one, two or five.
fn round(value: f64, up: bool) -> f64 {
    let mut steps = (-4..5).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(power)));
    if up {
        steps.find(|step| *step >= value).unwrap_or(value)
    } else {
        steps.rfind(|step| *step <= value).unwrap_or(value)
    }
}

fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let steps = (-4..5).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(power)));
    steps.filter(|step| (low * 0.999..=high * 1.001).contains(step)).collect()
}

fn line(picture: &mut RgbImage, from: [f64; 2], to: [f64; 2], color: Rgb<u8>, dashed: bool) {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]).ceil().max(1.0);
    for step in 0..=length as u32 {
        if dashed && step % 10 >= 5 {
            continue;
        }
        let part = f64::from(step) / length;
        let [x, y] = [0, 1].map(|axis| (from[axis] + (to[axis] - from[axis]) * part).round() as i64);
        for place in [[x, y], [x + 1, y], [x, y + 1]] {
            dots::put(picture, place, color);
        }
    }
}

fn square(picture: &mut RgbImage, [x, y]: [f64; 2], color: Rgb<u8>, full: bool) {
    let reach = 4i64;
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let rim = dx.abs() >= reach - 1 || dy.abs() >= reach - 1;
            let paint = if full || rim { color } else { Rgb([255; 3]) };
            dots::put(picture, [x.round() as i64 + dx, y.round() as i64 + dy], paint);
        }
    }
}

/// Pixels for the symbol before a name and the gap after it.
const BESIDE_A_NAME: u32 = 36;

const COLORS: [Rgb<u8>; 4] =
    [Rgb([20, 90, 180]), Rgb([215, 95, 15]), Rgb([30, 140, 60]), Rgb([140, 60, 150])];

/// Draws one panel for each scene, side by side.
pub fn draw(table: &str) -> Option<RgbImage> {
    let rows = rows(table);
    let mut scenes: Vec<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    scenes.dedup();
    let (width, height) = (560, 460);
    let mut picture = RgbImage::from_pixel(width * scenes.len() as u32, height, Rgb([255; 3]));
    for (panel, scene) in scenes.iter().enumerate() {
        let own: Vec<&Row> = rows.iter().filter(|row| row.scene == *scene).collect();
        panel_of(&mut picture, f64::from(width) * panel as f64, scene, &own);
    }
    (!scenes.is_empty()).then_some(picture)
}

fn panel_of(picture: &mut RgbImage, left: f64, scene: &str, rows: &[&Row]) {
    let range = |values: &dyn Fn(&Row) -> [f64; 2]| {
        let all = || rows.iter().flat_map(|row| values(row));
        [all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max)]
    };
    let [fast, slow] = range(&|row| [row.seconds; 2]);
    let [small, large] = range(&|row| [row.stated, row.found]);
    let axes = Axes {
        left: left + 78.0,
        top: 40.0,
        size: [450.0, 330.0],
        seconds: [round(fast, false), round(slow, true)],
        percent: [round(small, false), round(large, true)],
    };
    let [right, bottom] = [axes.left + axes.size[0], axes.top + axes.size[1]];
    dots::write(picture, scene, [axes.left as i64, 12], BLACK);
    for seconds in ticks(axes.seconds) {
        let [x, _] = axes.place(seconds, axes.percent[0]);
        line(picture, [x, axes.top], [x, bottom], GREY, false);
        let label = format!("{seconds}");
        dots::write(
            picture,
            &label,
            [x as i64 - i64::from(dots::width(&label) / 2), bottom as i64 + 8],
            BLACK,
        );
    }
    for percent in ticks(axes.percent) {
        let [_, y] = axes.place(axes.seconds[0], percent);
        line(picture, [axes.left, y], [right, y], GREY, false);
        let label = format!("{percent} %");
        let x = axes.left as i64 - 8 - i64::from(dots::width(&label));
        dots::write(picture, &label, [x, y as i64 - i64::from(dots::HEIGHT / 2)], BLACK);
    }
    let title = "processor seconds, all threads together";
    dots::write(picture, title, [(right - f64::from(dots::width(title))) as i64, bottom as i64 + 32], BLACK);
    let mut variants: Vec<&str> = Vec::new();
    rows.iter().for_each(|row| {
        if !variants.contains(&row.variant.as_str()) {
            variants.push(&row.variant)
        }
    });
    for (place, variant) in variants.iter().enumerate() {
        let color = COLORS[place % COLORS.len()];
        let own: Vec<&&Row> = rows.iter().filter(|row| row.variant == *variant).collect();
        for (found, dashed) in [(false, true), (true, false)] {
            let at = |row: &Row| axes.place(row.seconds, if found { row.found } else { row.stated });
            own.windows(2).for_each(|pair| line(picture, at(pair[0]), at(pair[1]), color, dashed));
            own.iter().for_each(|row| square(picture, at(row), color, found));
        }
        // The legend below, in a row.
        let before: u32 = variants[..place].iter().map(|before| dots::width(before) + BESIDE_A_NAME).sum();
        let [x, y] = [axes.left + f64::from(before) - 60.0, bottom + 62.0];
        square(picture, [x, y], color, true);
        dots::write(picture, variant, [x as i64 + 12, y as i64 - 7], color);
    }
}
