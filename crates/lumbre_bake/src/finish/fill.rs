//! Fills maps: the value of a texel that lies half outside its chart or half under a box holds for the middle of what
//! the texel shows, and is moved to the texel's centre along its neighbours' slope; empty texels beside a chart
//! continue the chart, so that bilinear filtering is right up to its border. Charts never mix: a texel takes values
//! from one chart only. Not the closing of seams: that is `seams`.

use glam::{DMat2, DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use crate::bounds::Bounds;
use crate::cancel_token::CancelToken;
use crate::coverage::{ContactLines, CoveredTexels, Footprint, Texel};
use crate::scene::{LightmapLayout, MapLayout};

/// Added to the variance of the neighbours' positions along each axis, in square texels: where that is much smaller,
/// the slope is unknown and taken as zero (ridge regression).
const RIDGE: f64 = 0.002;

/// From this gap on, the maps are meant for bicubic filtering, which reads two texels far.
const BICUBIC_RINGS: u32 = 4;

/// The known value of a texel of a map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelValue {
    pub value: Vec3,
    /// Squared error, mean of the channels.
    pub variance: f32,
    /// The point of the texel's unit square that the value holds for.
    pub middle: Vec2,
    pub chart: u32,
}

/// Fills one map from its known texels; `None` where no known texel is within reach. Values are continued `rings`
/// texels out of the charts; into texels that other geometry hides, only where filtering reads them from a point in the
/// open. A texel's own value is moved to its centre by neighbours on the same side of all `contacts` alone: what lies
/// beyond a thin wall has other light.
fn fill_map(
    map: &MapLayout,
    known: &[Option<TexelValue>],
    contacts: &ContactLines,
    hidden: &[Hidden],
    rings: u32,
    stop: &CancelToken,
) -> Vec<Option<TexelValue>> {
    let width = map.width;
    // First the charts' own texels, moved to their centres.
    let mut current: Vec<Option<TexelValue>> = (0..known.len())
        .into_par_iter()
        .map(|index| {
            let texel = known[index].filter(|_| !stop.is_cancelled())?;
            let offset = Vec2::splat(0.5) - texel.middle;
            // Within a tenth of a texel, moving by an uncertain slope would gain nothing.
            if offset.abs().max_element() < 0.1 {
                return Some(texel);
            }
            let (x, y) = (index as u32 % width, index as u32 / width);
            let middle = Vec2::new(x as f32, y as f32) + texel.middle;
            let is_beside = |place: Vec2| !contacts.separate(map, [middle, place]);
            let (value, variance) = extrapolate(map, known, (x, y), texel.chart, Some(&is_beside))
                .unwrap_or((texel.value, texel.variance));
            Some(TexelValue { value, variance, middle: Vec2::splat(0.5), ..texel })
        })
        .collect();
    for ring in 0..rings.max(2) {
        let next: Vec<Option<TexelValue>> = (0..current.len())
            .into_par_iter()
            .map(|index| {
                let is_wanted = match hidden[index] {
                    Hidden::No => ring < rings,
                    Hidden::ReadFromTheOpen => true,
                    Hidden::Deep => false,
                };
                if current[index].is_some() || !is_wanted || stop.is_cancelled() {
                    return current[index];
                }
                let (x, y) = (index as u32 % width, index as u32 / width);
                let chart = nearest_chart(map, &current, x, y)?;
                let (value, variance) = extrapolate(map, &current, (x, y), chart, None)?;
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
    /// It does, but filtering reads it from a point in the open nearby.
    ReadFromTheOpen,
    /// It does, and filtering never reads it.
    Deep,
}

/// The chart of the nearest known one of the eight neighbours.
fn nearest_chart(map: &MapLayout, known: &[Option<TexelValue>], x: u32, y: u32) -> Option<u32> {
    let mut best: Option<(u32, u32)> = None;
    for (nx, ny) in map.around(x, y, 1) {
        if let Some(neighbour) = &known[(ny * map.width + nx) as usize] {
            let distance = x.abs_diff(nx) + y.abs_diff(ny);
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, neighbour.chart));
            }
        }
    }
    best.map(|(_, chart)| chart)
}

/// The value at a texel's centre by a plane through the texels of a chart around it, and its squared error. With
/// `is_beside` the texel's own value takes part, and of the others those at whose places it is true.
fn extrapolate(
    map: &MapLayout,
    known: &[Option<TexelValue>],
    (x, y): (u32, u32),
    chart: u32,
    is_beside: Option<&dyn Fn(Vec2) -> bool>,
) -> Option<(Vec3, f32)> {
    let center = Vec2::new(x as f32, y as f32) + 0.5;
    let mut plane = PlaneFit::new();
    for (nx, ny) in map.around(x, y, 2) {
        let is_itself = nx == x && ny == y;
        if is_itself && is_beside.is_none() {
            continue;
        }
        let Some(other) = known[(ny * map.width + nx) as usize].filter(|other| other.chart == chart) else {
            continue;
        };
        let place = Vec2::new(nx as f32, ny as f32) + other.middle;
        if !is_itself && is_beside.is_some_and(|is_beside| !is_beside(place)) {
            continue;
        }
        plane.add(place - center, &other, x.abs_diff(nx).max(y.abs_diff(ny)) <= 1);
    }
    plane.at_center()
}

/// A known texel in a fit.
#[derive(Clone, Copy, Default)]
struct FitTerm {
    weight: f64,
    /// From the centre, in texels.
    offset: DVec2,
    /// Squared error.
    variance: f64,
}

/// A plane through the values of known texels around a centre, fitted by weighted least squares.
struct PlaneFit {
    /// Weighted sums of 1, x, y, x², x y and y² of the offsets, and of the values times 1, x and y.
    moments: [f64; 6],
    sums: [DVec3; 3],
    /// Ranges of the values of the nine nearest texels, and of those one texel further out.
    ranges: [Bounds<Vec3>; 2],
    /// Distance, value and squared error.
    nearest: (f32, Vec3, f32),
    terms: [FitTerm; 25],
    count: usize,
}

impl PlaneFit {
    fn new() -> Self {
        Self {
            moments: [0.0; 6],
            sums: [DVec3::ZERO; 3],
            ranges: [Bounds::default(); 2],
            nearest: (f32::INFINITY, Vec3::ZERO, 0.0),
            terms: [FitTerm::default(); 25],
            count: 0,
        }
    }

    /// Adds a known texel at an offset from the centre.
    fn add(&mut self, offset: Vec2, texel: &TexelValue, is_adjacent: bool) {
        let weight = f64::from((-0.7 * offset.length_squared()).exp());
        self.terms[self.count] =
            FitTerm { weight, offset: offset.as_dvec2(), variance: f64::from(texel.variance) };
        self.count += 1;
        let (dx, dy, value) = (f64::from(offset.x), f64::from(offset.y), texel.value.as_dvec3());
        for (moment, term) in self.moments.iter_mut().zip([1.0, dx, dy, dx * dx, dx * dy, dy * dy]) {
            *moment += weight * term;
        }
        for (sum, term) in self.sums.iter_mut().zip([1.0, dx, dy]) {
            *sum += value * (weight * term);
        }
        self.ranges[usize::from(!is_adjacent)].extend([texel.value]);
        if offset.length() < self.nearest.0 {
            self.nearest = (offset.length(), texel.value, texel.variance);
        }
    }

    /// The value at the centre, clamped to the range of the texels and a little more, and its squared error; those of
    /// the nearest texel if they are not finite. `None` if no texel is known.
    fn at_center(&self) -> Option<(Vec3, f32)> {
        if self.nearest.0 == f32::INFINITY {
            return None;
        }
        let [_, sx, sy, sxx, sxy, syy] = self.moments.map(|moment| moment / self.moments[0]);
        // The plane is fitted about the mean position of the known texels, so that a row of texels gets no slope across
        // itself.
        let spread = DMat2::from_cols(
            DVec2::new(sxx - sx * sx + RIDGE, sxy - sx * sy),
            DVec2::new(sxy - sx * sy, syy - sy * sy + RIDGE),
        );
        let to_center = spread.inverse() * DVec2::new(-sx, -sy);
        let [mean, with_x, with_y] = self.sums.map(|sum| sum / self.moments[0]);
        let value =
            (mean + (with_x - mean * sx) * to_center.x + (with_y - mean * sy) * to_center.y).as_vec3();
        // The nearest texels alone give the range, if there are any: a shadow's edge two texels away must not reach
        // this one.
        let [near, far] = self.ranges;
        let Bounds { low, high } = if near.low.x <= near.high.x { near } else { far };
        let margin = (high - low) * 0.5;
        let value = value.clamp((low - margin).max(Vec3::ZERO), high + margin);
        let variance = self.variance(DVec2::new(sx, sy), to_center);
        let (_, nearest_value, nearest_variance) = self.nearest;
        Some(match value.is_finite() && variance.is_finite() {
            true => (value, variance),
            false => (nearest_value, nearest_variance),
        })
    }

    /// The squared error at the centre. The texels' errors are taken as independent or as all the same, whichever gives
    /// more, since smoothed texels are in between.
    fn variance(&self, mean_offset: DVec2, to_center: DVec2) -> f32 {
        let (mut independent, mut correlated) = (0.0, 0.0);
        for FitTerm { weight, offset, variance } in &self.terms[..self.count] {
            let share = weight / self.moments[0] * (1.0 + (*offset - mean_offset).dot(to_center));
            independent += share * share * variance;
            correlated += share * variance.sqrt();
        }
        independent.max(correlated * correlated) as f32
    }
}

/// Fills all maps from values and squared errors per covered texel. Values are NaN where nothing is known; errors are
/// NaN there, too, and wherever a texel shows no surface of its own.
pub(crate) fn fill(
    texels: &CoveredTexels<'_>,
    values: &[Vec3],
    variances: &[f32],
    rings: u32,
) -> (Vec<Vec3>, Vec<f32>) {
    let CoveredTexels { scene, layout, contacts, .. } = texels;
    let mut known: Vec<Option<TexelValue>> = vec![None; layout.texels];
    for (covered, texel) in texels.open() {
        let (value, variance) = (values[covered.place()], variances[covered.place()]);
        let (middle, chart) = (texel.middle(), texels.chart(texel));
        known[texel.index.place()] = Some(TexelValue { value, variance, middle, chart });
    }
    let hidden = hidden(layout, &texels.list, if rings >= BICUBIC_RINGS { 2 } else { 1 });
    let mut filled = Vec::with_capacity(layout.texels);
    let mut errors = Vec::with_capacity(layout.texels);
    for map in &layout.maps {
        let known = &known[map.places()];
        let map = fill_map(map, known, contacts, &hidden[map.places()], rings, &scene.stop);
        filled.extend(map.iter().map(|texel| texel.map_or(Vec3::NAN, |texel| texel.value)));
        let error = |(texel, known): (&Option<TexelValue>, &Option<TexelValue>)| {
            texel.filter(|_| known.is_some()).map_or(f32::NAN, |texel| texel.variance)
        };
        errors.extend(map.iter().zip(known).map(error));
    }
    (filled, errors)
}

/// Per texel of all maps, whether other geometry hides it. `reach` is how far filtering reads, in texels.
fn hidden(layout: &LightmapLayout, texels: &[Texel], reach: u32) -> Vec<Hidden> {
    let mut hidden = vec![Hidden::No; layout.texels];
    for texel in texels.iter().filter(|texel| texel.is_hidden()) {
        hidden[texel.index.place()] = Hidden::Deep;
    }
    for texel in texels {
        let map = &layout.maps[texel.map.place()];
        for (x, y) in map.around(texel.x, texel.y, reach) {
            let other = &mut hidden[map.texel(x, y).place()];
            if *other == Hidden::Deep {
                let center = Vec2::new(x as f32 - texel.x as f32, y as f32 - texel.y as f32) + 0.5;
                let is_read = match &texel.footprint {
                    Footprint::Whole(_) => true,
                    Footprint::Points(points) => {
                        points.iter().any(|point| (point.offset - center).abs().max_element() < reach as f32)
                    }
                    Footprint::Hidden => false,
                };
                if is_read {
                    *other = Hidden::ReadFromTheOpen;
                }
            }
        }
    }
    hidden
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    fn map(side: u32) -> MapLayout {
        MapLayout { width: side, height: side, ..MapLayout::default() }
    }

    /// A wall of three quarters of a texel stands along x = 3.5 to 4.25: what is bright on one side of it does not lighten
    /// the texel that shows a part of the dark side.
    #[test]
    fn light_does_not_come_through_a_thin_wall() {
        let map = map(8);
        let known: Vec<Option<TexelValue>> = (0..64)
            .map(|index| {
                let x = index % 8;
                let value = Vec3::splat(if x < 4 { 1.0 } else { 0.0 });
                let middle = Vec2::new([0.5, 0.5, 0.5, 0.25, 0.625, 0.5, 0.5, 0.5][x], 0.5);
                Some(TexelValue { value, variance: 0.0, middle, chart: 0 })
            })
            .collect();
        let side = |x: f64| [DVec2::new(x, 0.0), DVec2::new(x, 1.0)];
        let lines = (0..8).flat_map(|y| [(map.texel(3, y), side(0.5)), (map.texel(4, y), side(0.25))]);
        let contacts = ContactLines::new(lines.collect());
        let filled =
            |contacts| fill_map(&map, &known, contacts, &[Hidden::No; 64], 1, &CancelToken::default());
        let row = |contacts| filled(contacts)[32..40].iter().map(|v| v.unwrap().value.x).collect::<Vec<_>>();
        assert_eq!(row(&contacts), [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(row(&ContactLines::default())[4] > 0.1, "without the wall it would");
    }

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
        let filled = fill_map(
            &map(8),
            &known,
            &ContactLines::default(),
            &[Hidden::No; 64],
            1,
            &CancelToken::default(),
        );
        for y in 2..6u32 {
            for x in 1..7u32 {
                let TexelValue { value, variance, .. } = filled[(y * 8 + x) as usize].unwrap();
                // A texel that is not moved keeps its error; any other has at least that of neighbours with the same
                // error.
                let is_unmoved = (3..6).contains(&x);
                assert!(
                    if is_unmoved { variance == 0.01 } else { variance > 0.0099 && variance < 0.1 },
                    "{variance}"
                );
                let expected = plane(x as f32 + 0.5, y as f32 + 0.5);
                // The ridge reduces the slope by a per cent or two.
                assert!((value - expected).abs().max_element() < 0.06, "{x} {y}: {value} {expected}");
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
        let filled = fill_map(
            &map(4),
            &known,
            &ContactLines::default(),
            &[Hidden::No; 16],
            2,
            &CancelToken::default(),
        );
        for row in filled.chunks(4) {
            assert_eq!(row.iter().map(|v| v.unwrap().value.x).collect::<Vec<_>>(), [1.0, 1.0, 9.0, 9.0]);
        }
    }
}
