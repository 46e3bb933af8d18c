//! Drawings by plotters, as SVG with text that stays text, and pictures within them. Not what is drawn.

use std::error::Error;
use std::io::Cursor;

use image::{ImageFormat, RgbImage};
use plotters::coord::Shift;
use plotters::prelude::*;

/// What is drawn on.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Whatever goes wrong.
pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// Colour of text and axes, and of the lines of a grid.
pub const INK: RGBColor = RGBColor(40, 40, 40);
pub const GRID: RGBColor = RGBColor(222, 222, 222);
/// Pixels of text.
pub const FONT: u32 = 14;

/// Draws on white.
pub fn drawing(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Outcome<()>) -> Outcome<String> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    Ok(svg)
}

/// Puts a picture into a drawing, with its upper left corner there.
pub fn with_picture(svg: &str, picture: &RgbImage, (x, y): (u32, u32)) -> Outcome<String> {
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, ImageFormat::Png)?;
    let (width, height) = picture.dimensions();
    let end = svg.rfind("</svg>").ok_or("a drawing has an end")?;
    Ok(format!(
        r#"{}<image x="{x}" y="{y}" width="{width}" height="{height}" href="data:image/png;base64,{}"/>{}"#,
        &svg[..end],
        base64::encode(png.into_inner()),
        &svg[end..]
    ))
}

/// How text is written.
pub fn text<'a>() -> TextStyle<'a> {
    ("sans-serif", FONT).into_font().color(&INK)
}

/// Powers of ten, and two and five of them, within a range.
pub fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let steps = (-4..5).flat_map(|power| [1, 2, 5].map(move |digit| format!("{digit}e{power}")));
    // Read from decimals, a tick is the number that it is written as.
    steps
        .filter_map(|text| text.parse().ok())
        .filter(|step| (low * 0.999..=high * 1.001).contains(step))
        .collect()
}

/// The tick at or below a number, or at or above it.
pub fn rounded(value: f64, up: bool) -> f64 {
    let all = ticks([1e-4, 9e4]);
    let found =
        if up { all.iter().find(|step| **step >= value) } else { all.iter().rfind(|step| **step <= value) };
    found.copied().unwrap_or(value)
}
