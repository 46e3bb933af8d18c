//! Values at texel centres from values at the middles of what texels show: a texel half outside its chart or half under a
//! box is moved to its centre along its neighbours' slope, and empty texels beside a chart continue it, so that bilinear
//! filtering up to the very border reads what is there. Never across charts that have texels of their own to say.

use glam::{DMat2, DVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::cancel_token::CancelToken;
use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::{Footprint, Texel};
use crate::scene::LightmapLayout;

/// Square texels of spread below which a slope counts as unknown.
const RIDGE: f64 = 0.002;

/// A gap that is asked for bicubic filtering.
const BICUBIC_RINGS: u32 = 4;

/// What is known of a texel of a map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelValue {
    pub value: Vec3,
    /// Squared error, mean of the channels.
    pub variance: f32,
    /// Where in the texel's unit square.
    pub middle: Vec2,
    pub chart: u32,
}

/// One map's texels from those known; `None` where nothing is within reach. `rings` is how far values are carried out of
/// the charts; into texels that other geometry hides they go only where a point in the open reads them.
fn fill_map(
    (width, height): (u32, u32),
    known: &[Option<TexelValue>],
    hidden: &[Hidden],
    rings: u32,
    stop: &CancelToken,
) -> Vec<Option<TexelValue>> {
    // The charts' own texels first, moved to their centres.
    let mut current: Vec<Option<TexelValue>> = (0..known.len())
        .into_par_iter()
        .map(|index| {
            let own = known[index].filter(|_| !stop.is_cancelled())?;
            let offset = Vec2::splat(0.5) - own.middle;
            // A tenth of a texel is below what a slope can be told from.
            if offset.abs().max_element() < 0.1 {
                return Some(own);
            }
            let (x, y) = (index as u32 % width, index as u32 / width);
            let (value, variance) =
                continued(width, height, known, x, y, own.chart, true).unwrap_or((own.value, own.variance));
            Some(TexelValue { value, variance, middle: Vec2::splat(0.5), ..own })
        })
        .collect();
    for ring in 0..rings.max(2) {
        let next: Vec<Option<TexelValue>> = (0..current.len())
            .into_par_iter()
            .map(|index| {
                let wanted = match hidden[index] {
                    Hidden::No => ring < rings,
                    Hidden::ReadFromTheOpen => true,
                    Hidden::Deep => false,
                };
                if current[index].is_some() || !wanted || stop.is_cancelled() {
                    return current[index];
                }
                let (x, y) = (index as u32 % width, index as u32 / width);
                let chart = nearest_chart(width, height, &current, x, y)?;
                let (value, variance) = continued(width, height, &current, x, y, chart, false)?;
                Some(TexelValue { value, variance, middle: Vec2::splat(0.5), chart })
            })
            .collect();
        current = next;
    }
    current
}

/// Whether other geometry hides a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Hidden {
    /// It does not.
    #[default]
    No,
    /// It does, but bilinear filtering reads it from a point in the open, less than a texel away.
    ReadFromTheOpen,
    /// It does, and nobody sees it: its light is none.
    Deep,
}

/// The chart of the nearest of the eight neighbours.
fn nearest_chart(width: u32, height: u32, known: &[Option<TexelValue>], x: u32, y: u32) -> Option<u32> {
    let mut best: Option<(u32, u32)> = None;
    for (nx, ny) in around(width, height, x, y, 1) {
        if let Some(neighbour) = &known[(ny * width + nx) as usize] {
            let distance = x.abs_diff(nx) + y.abs_diff(ny);
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, neighbour.chart));
            }
        }
    }
    best.map(|(_, chart)| chart)
}

/// The value at a texel's centre by a plane through its chart's texels around, held within their range (and a little
/// more): weighted least squares. With it comes its squared error: by errors that have nothing to do with each other or by errors that are
/// all alike, whichever is more, as smoothed texels are in between.
fn continued(
    width: u32,
    height: u32,
    known: &[Option<TexelValue>],
    x: u32,
    y: u32,
    chart: u32,
    own_counts: bool,
) -> Option<(Vec3, f32)> {
    let center = Vec2::new(x as f32, y as f32) + 0.5;
    let mut moments = [0.0f64; 6];
    let mut sums = [glam::DVec3::ZERO; 3];
    // Of the texels next to it, and of those one further.
    let mut ranges = [(Vec3::INFINITY, Vec3::NEG_INFINITY); 2];
    let mut nearest = (f32::INFINITY, Vec3::ZERO, 0.0);
    // Weights, places and squared errors.
    let mut terms = [(0.0f64, DVec2::ZERO, 0.0f64); 25];
    let mut count = 0;
    for (nx, ny) in around(width, height, x, y, 2) {
        if !own_counts && nx == x && ny == y {
            continue;
        }
        let Some(other) = known[(ny * width + nx) as usize].filter(|other| other.chart == chart) else {
            continue;
        };
        let d = Vec2::new(nx as f32, ny as f32) + other.middle - center;
        let weight = f64::from((-0.7 * d.length_squared()).exp());
        terms[count] = (weight, d.as_dvec2(), f64::from(other.variance));
        count += 1;
        let (dx, dy, value) = (f64::from(d.x), f64::from(d.y), other.value.as_dvec3());
        for (moment, term) in moments.iter_mut().zip([1.0, dx, dy, dx * dx, dx * dy, dy * dy]) {
            *moment += weight * term;
        }
        for (sum, term) in sums.iter_mut().zip([1.0, dx, dy]) {
            *sum += value * (weight * term);
        }
        let range = &mut ranges[usize::from(x.abs_diff(nx).max(y.abs_diff(ny)) > 1)];
        *range = (range.0.min(other.value), range.1.max(other.value));
        if d.length() < nearest.0 {
            nearest = (d.length(), other.value, other.variance);
        }
    }
    if nearest.0 == f32::INFINITY {
        return None;
    }
    let [_, sx, sy, sxx, sxy, syy] = moments.map(|moment| moment / moments[0]);
    // About the middle of those known: a row of texels, which knows no slope across itself, makes none up.
    let spread = DMat2::from_cols(
        DVec2::new(sxx - sx * sx + RIDGE, sxy - sx * sy),
        DVec2::new(sxy - sx * sy, syy - sy * sy + RIDGE),
    );
    let towards = spread.inverse() * DVec2::new(-sx, -sy);
    let [mean, with_x, with_y] = sums.map(|sum| sum / moments[0]);
    let value = (mean + (with_x - mean * sx) * towards.x + (with_y - mean * sy) * towards.y).as_vec3();
    // A shadow's edge two texels away does not reach a texel whose neighbours know nothing of it.
    let (low, high) = if ranges[0].0.x <= ranges[0].1.x { ranges[0] } else { ranges[1] };
    let reach = (high - low) * 0.5;
    let value = value.clamp((low - reach).max(Vec3::ZERO), high + reach);
    let (mut apart, mut alike) = (0.0, 0.0);
    for (weight, d, variance) in &terms[..count] {
        let share = weight / moments[0] * (1.0 + (*d - DVec2::new(sx, sy)).dot(towards));
        apart += share * share * variance;
        alike += share * variance.sqrt();
    }
    let variance = apart.max(alike * alike) as f32;
    Some(if value.is_finite() && variance.is_finite() { (value, variance) } else { (nearest.1, nearest.2) })
}

/// Texels within `radius` of one, itself among them.
fn around(width: u32, height: u32, x: u32, y: u32, radius: u32) -> impl Iterator<Item = (u32, u32)> {
    let columns = x.saturating_sub(radius)..=(x + radius).min(width - 1);
    let rows = y.saturating_sub(radius)..=(y + radius).min(height - 1);
    rows.flat_map(move |ny| columns.clone().map(move |nx| (nx, ny)))
}

/// Fills all maps from values and squared errors per covered texel; NaN where nothing is known, and errors also where no surface is shown.
pub(crate) fn fill(
    texels: &CoveredTexels<'_>,
    (values, variances): (&[Vec3], &[f32]),
    rings: u32,
    stop: &CancelToken,
) -> (Vec<Vec3>, Vec<f32>) {
    let CoveredTexels { layout, list: texels, charts, .. } = texels;
    let mut known: Vec<Option<TexelValue>> = vec![None; layout.texels];
    for (texel, (&value, &variance)) in texels.iter().zip(values.iter().zip(variances)) {
        if !texel.is_hidden() {
            let chart = charts[texel.triangle as usize];
            known[texel.index.place()] = Some(TexelValue { value, variance, middle: texel.middle(), chart });
        }
    }
    let hidden = hidden(layout, texels, if rings >= BICUBIC_RINGS { 2 } else { 1 });
    let mut filled = Vec::with_capacity(layout.texels);
    let mut errors = Vec::with_capacity(layout.texels);
    for map in &layout.maps {
        let own = map.first..map.first + (map.width * map.height) as usize;
        let all = fill_map((map.width, map.height), &known[own.clone()], &hidden[own.clone()], rings, stop);
        filled.extend(all.iter().map(|known| known.map_or(Vec3::NAN, |known| known.value)));
        let shown = all.iter().zip(&known[own]);
        errors.extend(
            shown.map(|(all, own)| all.filter(|_| own.is_some()).map_or(f32::NAN, |all| all.variance)),
        );
    }
    (filled, errors)
}

/// `reach`: how far in texels filtering reads.
fn hidden(layout: &LightmapLayout, texels: &[Texel], reach: u32) -> Vec<Hidden> {
    let mut hidden = vec![Hidden::No; layout.texels];
    for texel in texels.iter().filter(|texel| texel.is_hidden()) {
        hidden[texel.index.place()] = Hidden::Deep;
    }
    for texel in texels {
        let map = &layout.maps[texel.object as usize];
        for (x, y) in around(map.width, map.height, texel.x, texel.y, reach) {
            let other = &mut hidden[map.first + (y * map.width + x) as usize];
            if *other == Hidden::Deep {
                let center = Vec2::new(x as f32 - texel.x as f32, y as f32 - texel.y as f32) + 0.5;
                let reads = match &texel.footprint {
                    Footprint::Whole(_) => true,
                    Footprint::Points(points) => {
                        points.iter().any(|point| (point.offset - center).abs().max_element() < reach as f32)
                    }
                    Footprint::Hidden => false,
                };
                if reads {
                    *other = Hidden::ReadFromTheOpen;
                }
            }
        }
    }
    hidden
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_continued_exactly_and_moved_to_the_centres() {
        // E = 10 + x + 2y on columns 2..6 of 8; column 2 shows only its right quarter.
        let plane = |x: f32, y: f32| Vec3::splat(10.0 + x + 2.0 * y);
        let mut known = vec![None; 64];
        for y in 0..8u32 {
            for x in 2..6u32 {
                let middle = if x == 2 { Vec2::new(0.875, 0.5) } else { Vec2::splat(0.5) };
                let value = plane(x as f32 + middle.x, y as f32 + middle.y);
                known[(y * 8 + x) as usize] = Some(TexelValue { value, variance: 0.01, middle, chart: 0 });
            }
        }
        let filled = fill_map((8, 8), &known, &[Hidden::No; 64], 1, &CancelToken::default());
        for y in 2..6u32 {
            for x in 1..7u32 {
                let TexelValue { value: found, variance, .. } = filled[(y * 8 + x) as usize].unwrap();
                // What stays where it is keeps its error; what is moved or continued has at least that of errors that are all alike.
                let kept = (3..6).contains(&x);
                assert!(
                    if kept { variance == 0.01 } else { variance > 0.0099 && variance < 0.1 },
                    "{variance}"
                );
                let expected = plane(x as f32 + 0.5, y as f32 + 0.5);
                // The ridge bends the slope by a per cent or two.
                assert!((found - expected).abs().max_element() < 0.06, "{x} {y}: {found} {expected}");
            }
            assert!(filled[(y * 8) as usize].is_none());
        }
    }

    #[test]
    fn charts_do_not_mix() {
        let known: Vec<Option<TexelValue>> = (0..16)
            .map(|index| {
                let (value, chart) = match index % 4 {
                    0 => (1.0, 0),
                    3 => (9.0, 1),
                    _ => return None,
                };
                Some(TexelValue { value: Vec3::splat(value), variance: 0.0, middle: Vec2::splat(0.5), chart })
            })
            .collect();
        let filled = fill_map((4, 4), &known, &[Hidden::No; 16], 2, &CancelToken::default());
        for row in filled.chunks(4) {
            assert_eq!(row.iter().map(|v| v.unwrap().value.x).collect::<Vec<_>>(), [1.0, 1.0, 9.0, 9.0]);
        }
    }
}
