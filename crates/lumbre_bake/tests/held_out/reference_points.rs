//! Reads and writes reference points as CSV: the columns of the conformance suite, and two more for a level's points.
//! The path tracer computes them.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;

use super::path_tracer::Irradiance;

const COLUMNS: &str = "x,y,z,nx,ny,nz,E_r,E_g,E_b,se_r,se_g,se_b";

/// Reads points with their standard errors; a channel that is unknown is NaN. Without the last two columns, no point
/// counts as near an edge and all count as inside the region.
pub fn read(path: &Path) -> Vec<Irradiance> {
    let text = std::fs::read_to_string(path).expect("the reference file is readable text");
    let rows = text.lines().skip(1).map(|line| {
        let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect();
        let column = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
        Irradiance {
            position: column(0),
            normal: column(3),
            value: column(6),
            error: column(9),
            edge: v.get(12).is_some_and(|&edge| edge != 0.0),
            inside: v.get(13).is_none_or(|&inside| inside != 0.0),
        }
    });
    rows.collect()
}

/// Writes points with six significant digits, their standard errors with three.
pub fn write(path: &Path, points: &[Irradiance]) -> std::io::Result<()> {
    let mut text = format!("{COLUMNS},edge,inside\n");
    for p in points {
        let fields = [p.position, p.normal, p.value].map(|v| v.to_array().map(|x| rounded(x, 5)));
        let errors = p.error.to_array().map(|x| rounded(x, 2));
        let fields: Vec<String> =
            fields.as_flattened().iter().chain(&errors).map(|number| number.to_string()).collect();
        let _ = writeln!(text, "{},{},{}", fields.join(","), u8::from(p.edge), u8::from(p.inside));
    }
    std::fs::write(path, text)
}

/// Rounds to `digits` decimal digits after the first significant one.
fn rounded(x: f64, digits: usize) -> f64 {
    // Values this small are rounding errors of 0.
    if x.abs() < 1e-12 { 0.0 } else { format!("{x:.digits$e}").parse().unwrap_or(x) }
}
