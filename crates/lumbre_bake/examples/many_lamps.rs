//! How the time of a bake grows with the number of lamps: `many_lamps [NAME …] [--error X] [--time SECONDS] [--stages]
//! [--plot FILE.svg]` bakes one room under 1 to 10,000 emissive squares of the same total power, under 1 to 10,000
//! point lights, under a bulb of 70,000 triangles, and under a screen of 4096 by 2048 texels, and prints a table. The
//! plot shows the seconds of the first two kinds against the number of lamps.

#![allow(clippy::print_stdout, reason = "a program whose result is text")]

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

use lumbre_bake::{Bake, BakeOptions, BakeReport};

#[path = "../tests/held_out/random.rs"]
mod random;
#[path = "../tests/held_out/scenes/mod.rs"]
mod scenes;

/// The bake of a scene with a number of lamps of one kind.
struct Measurement {
    kind: String,
    count: f64,
    report: BakeReport,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = BakeOptions { error: 0.02, ..BakeOptions::default() };
    let (mut names, mut plot, mut stages) = (Vec::new(), None, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--error" => options.error = value()?.parse()?,
            "--time" => options.time = Some(std::time::Duration::try_from_secs_f64(value()?.parse()?)?),
            "--stages" => stages = true,
            "--plot" => plot = Some(PathBuf::from(value()?)),
            _ => names.push(argument),
        }
    }
    if names.is_empty() {
        names = scenes::many_lamps().iter().map(|(name, ..)| (*name).to_owned()).collect();
    }
    println!(
        "| scene | texels | seconds | against one | direct light s | stated % | million rays | mean E | ended |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut measured: Vec<Measurement> = Vec::new();
    for name in &names {
        let (build, count) = scenes::find(name).ok_or_else(|| format!("{name} is no scene"))?;
        let report = Bake::new(&options).run(&mut build(count, 1.0))?;
        let kind = name.rsplit_once('_').map_or(name.as_str(), |(kind, _)| kind).to_owned();
        // The bulb and the screen are compared with one emissive square.
        let baseline = if kind == "points" { "points" } else { "lamps" };
        let one = measured.iter().find(|one| one.kind == baseline && one.count == 1.0);
        let ratio = one.map_or("-".to_owned(), |one| format!("{:.2}", report.seconds / one.report.seconds));
        let direct = report.stages.iter().filter(|stage| stage.stage == "direct light");
        println!(
            "| {name} | {} | {:.1} | {ratio} | {:.1} | {:.2} | {:.0} | {:.4} | {} |",
            report.texels,
            report.seconds,
            direct.map(|stage| stage.seconds).sum::<f64>(),
            100.0 * report.estimated_error,
            report.rays as f64 * 1e-6,
            report.mean_irradiance.iter().sum::<f64>() / 3.0,
            report.ended.to_string().split(':').next_back().unwrap_or_default().trim()
        );
        if stages {
            println!("\n{report}");
        }
        measured.push(Measurement { kind, count: count as f64, report });
    }
    if let Some(path) = plot {
        std::fs::write(path, plot_svg(&measured))?;
    }
    Ok(())
}

const SIZE: [f64; 2] = [560.0, 340.0];
const MARGIN: f64 = 56.0;

/// Plots the seconds over the number of lamps as an SVG; both axes are logarithmic.
fn plot_svg(measured: &[Measurement]) -> String {
    let kinds = [("lamps", "#c0392b", "emissive squares"), ("points", "#2c6fbb", "point lights")];
    let shown = || measured.iter().filter(|one| kinds.iter().any(|(kind, ..)| one.kind == *kind));
    let decades = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::MAX, 1.0f64), |(low, high), v| (low.min(v), high.max(v)));
        let low = low.log10().floor().min(high.log10().ceil() - 1.0);
        [low, high.log10().ceil().max(low + 1.0)]
    };
    let x_axis = decades(&mut shown().map(|one| one.count));
    let y_axis = decades(&mut shown().map(|one| one.report.seconds));
    let at = |count: f64, seconds: f64| {
        let share = |v: f64, [low, high]: [f64; 2]| (v.log10() - low) / (high - low);
        let x = MARGIN + (SIZE[0] - 1.5 * MARGIN) * share(count, x_axis);
        let y = SIZE[1] - MARGIN - (SIZE[1] - 1.5 * MARGIN) * share(seconds, y_axis);
        (x, y)
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        SIZE[0], SIZE[1]
    );
    let mut line = |from: (f64, f64), to: (f64, f64), text: (f64, f64, &str), label: f64| {
        let _ = writeln!(
            svg,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"#ccc\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{}\">{label}</text>",
            from.0, from.1, to.0, to.1, text.0, text.1, text.2
        );
    };
    let [left, right] = x_axis.map(|power| 10f64.powf(power));
    let [bottom, top] = y_axis.map(|power| 10f64.powf(power));
    for power in x_axis[0] as i32..=x_axis[1] as i32 {
        let (low, high) = (at(10f64.powi(power), bottom), at(10f64.powi(power), top));
        line(low, high, (low.0, low.1 + 18.0, "middle"), 10f64.powi(power));
    }
    for power in y_axis[0] as i32..=y_axis[1] as i32 {
        let (low, high) = (at(left, 10f64.powi(power)), at(right, 10f64.powi(power)));
        line(low, high, (low.0 - 6.0, low.1 + 4.0, "end"), 10f64.powi(power));
    }
    for (row, (kind, color, title)) in kinds.into_iter().enumerate() {
        let mut path = String::new();
        for one in shown().filter(|one| one.kind == kind) {
            let (x, y) = at(one.count, one.report.seconds);
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{color}\"/>");
        }
        let y = 0.5 * MARGIN + 16.0 * (row as f64 + 1.0);
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/><text x=\"{:.1}\" y=\"{y:.1}\" fill=\"{color}\">{title}</text>",
            MARGIN + 10.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">number of lamps</text><text x=\"{:.1}\" y=\"18\">seconds</text>\n</svg>",
        SIZE[0] / 2.0,
        SIZE[1] - 14.0,
        MARGIN - 40.0
    );
    svg
}
