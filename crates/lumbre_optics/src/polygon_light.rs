//! An emissive polygon as a light (document \[I\]'s distributed sources): Lambert's closed form for the diffuse
//! part, a sum over a few points for the specular part. Visibility is not considered: nothing here is between the
//! polygon and the point. The baker has its own shadows.
//!
//! # Diffuse part
//! The factor on k_d is irradiance/π, which for a polygon of uniform radiance L is L F. F is the form factor from
//! the point to the polygon, clipped to the point's horizon: F = Σ θ_i n·Γ_i / 2π over the edges, with θ_i the
//! angle that edge i subtends and Γ_i the unit normal of the plane through it and the point (Lambert 1760; Baum,
//! Rushmeier and Winget 1989).
//!
//! Evaluated directly, this sum cancels: for a polygon of size s at distance d its terms are of order s/d and F is
//! of order (s/d)², so that f32 loses a relative ε d/s. Here the edge goes from corner a to corner b = a + e,
//! relative to the point, so that θ Γ = θ/sin θ · (a × e)/(|a||b|). With c the polygon's middle and α the corners
//! relative to it, w Σ a × e = w Σ α × e for any w, because Σ c × e = 0. So each term is
//!
//! ```text
//!   (a × e)/(|a||b|) · [(θ/sin θ - 1) + (1 - w |a||b|)]  +  w α × e,      w = 1/(|c|² + mean |α|²)
//! ```
//!
//! Both parts in brackets are of order (s/d)² and are computed without cancellation: the first as a polynomial in
//! tan²(θ/2), the second from |c|² - |a|² = -(2c + α)·α. The error of F in f32, relative to its value for a surface
//! that faces the polygon, is then a few ε times the polygon's aspect ratio at every distance (measured: 2·10⁻⁷ for
//! squares from 0.5 to 10⁴ sizes away, 5·10⁻⁶ for 1:100), and 10⁻⁵ absolute closer than a hundredth of its size,
//! away from its edges. No inverse trigonometric function of WGSL is used, as those are only good to 2⁻¹¹.
//!
//! # Specular part
//! The integral of the specular factor over the polygon has no short closed form for the models here. It is
//! approximated by the sum over 4 x 4 points. Each is a point light, with the solid angle of its part of the
//! polygon over π, and goes through the same function as every other light. The points are the middles of strata
//! that are denser around the point where the mirrored line of sight meets the polygon's plane. That keeps a
//! highlight as smooth at n = 10⁴ as at n = 20, and a sharp one shows the polygon's edges.
//!
//! The error over a floor under a ceiling panel, a triangle and a wall panel, relative to the brightest point of
//! the highlight, is at most 6 % for n from 20 to 10⁴ (Torrance-Sparrow 8 %) and 4 % in the mean; it falls with the
//! square of the number of points along an edge. Beside a wall lamp that almost touches the floor, models with an
//! exponent of n·h below 20 are off by up to 20 % on the last decimetres. With as many evenly spaced points the
//! error would exceed the highlight itself from n = 500 on.
//!
//! These models are 1 at their peak for every exponent, so the highlight of a lamp that is wider than the lobe
//! decreases as 2/(n + 1) (Phong), as would the sum over any number of point lights.
//!
//! # Cost
//! On a software rasterizer a polygon costs about as much as 12 point lights on a matt surface and 16 on a shiny
//! one (`--test frames what_a_polygon_costs -- --nocapture` prints it). It is not evaluated for objects that are
//! entirely behind it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::normalization::{TINY_LENGTH_SQUARED, safe_normalize};
use crate::shade::{Contribution, SurfaceSample, light_contribution, model_exponent};
use crate::{LightSample, ReflectionModel};

/// Number of sample points along each edge of a polygon for its highlight.
pub const HIGHLIGHT_SAMPLES: u32 = 4;
/// Half width of the density of the sample points, in standard deviations of the lobe. It lies between 1.9, where
/// four points sum a Gaussian lobe exactly, and 2.6, where they cover its tails; this value minimizes the largest
/// error of the test cases.
const LOBE_REACH: f64 = 2.1;
/// Smaller exponents do not make the lobe any wider.
const SMALLEST_EXPONENT: f64 = 0.01;
/// Smallest reach of a lobe, in lengths of the edge.
const SMALLEST_REACH: f64 = 1e-6;
/// How far outside an edge the middle of a lobe may be, in lengths of the edge.
const FARTHEST_MIDDLE: f64 = 8.0;
/// Lower limit of the cosines that are divided by.
const GRAZING_COSINE: f64 = 1e-3;

/// A triangle or parallelogram that emits evenly from its front, the side on which its corners run
/// counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolygonLight {
    /// A corner, in metres.
    pub corner: DVec3,
    /// From `corner` to the next corner, counter-clockwise.
    pub edge_u: DVec3,
    /// From `corner` to the previous corner.
    pub edge_v: DVec3,
    /// Whether it is a triangle; if not, `corner + edge_u + edge_v` is the fourth corner.
    pub triangle: bool,
    /// Linear RGB, W/(m² sr).
    pub radiance: DVec3,
}

impl PolygonLight {
    /// Area times the unit normal of the front, in m².
    pub fn area_vector(&self) -> DVec3 {
        self.edge_u.cross(self.edge_v) * if self.triangle { 0.5 } else { 1.0 }
    }

    /// The same polygon emitting to the other side.
    pub fn turned(&self) -> Self {
        Self { edge_u: self.edge_v, edge_v: self.edge_u, ..*self }
    }
}

/// Returns the light that the polygon adds to a surface at `point`, which is none behind its front. `normal` is
/// unit or zero, `viewer` unit; positions are in metres and world space. The f32 twin is valid for distances up to
/// 10⁹ m.
///
/// ```
/// use glam::DVec3;
/// use lumbre_optics::{Material, PolygonLight, ReflectionModel, SurfaceSample, polygon_light_contribution};
///
/// // A ceiling panel of 2 m by 2 m, 1 m above.
/// let panel = PolygonLight {
///     corner: DVec3::new(-1.0, 1.0, -1.0),
///     edge_u: DVec3::X * 2.0,
///     edge_v: DVec3::Z * 2.0,
///     triangle: false,
///     radiance: DVec3::ONE,
/// };
/// assert!(panel.area_vector().y < 0.0, "it faces down");
/// let paper = Material::matt(glam::Vec3::ONE);
/// let surface = SurfaceSample::new(&paper, true);
/// let lit =
///     polygon_light_contribution(ReflectionModel::Phong, surface, &panel, DVec3::ZERO, DVec3::Y, DVec3::Y);
/// assert!((lit.diffuse.x - 0.554126423979572).abs() < 1e-14);
/// ```
pub fn polygon_light_contribution(
    model: ReflectionModel,
    surface: SurfaceSample,
    light: &PolygonLight,
    point: DVec3,
    normal: DVec3,
    viewer: DVec3,
) -> Contribution {
    let factor = polygon_form_factor(light.corner, light.edge_u, light.edge_v, light.triangle, point, normal);
    let highlight = if surface.specular.max_element() > 0.0 {
        polygon_highlight(model, surface, light, point, normal, viewer, HIGHLIGHT_SAMPLES)
    } else {
        DVec3::ZERO
    };
    Contribution {
        ambient: DVec3::ZERO,
        diffuse: surface.diffuse * light.radiance * factor,
        specular: highlight,
    }
}

/// Returns the unoccluded form factor from `point` with the unit `normal` to a polygon's front, clipped to the
/// point's horizon, in [0, 1]. It is 0 behind the polygon, in its plane, for a polygon without area and for a zero
/// normal.
///
/// # Error of the f32 twin
///
/// Farther away than the polygon's size: 10⁻⁶ plus 3·10⁻⁷ times its aspect ratio, relative to the form factor for a
/// surface that faces it. Nearer: 2·10⁻⁵ (1 + aspect/10), plus 8 u times its size over the distance to its nearest
/// edge, the line of the horizon included, because a corner relative to the point is rounded by u of the size, and
/// that turns a near edge by as much. In the polygon's own plane within rounding and on the polygon, it may be
/// anything in [0, 1], as the point is either in front of the polygon or behind it. Measured against the closed
/// form in f64, not derived operation by operation.
pub fn polygon_form_factor(
    corner: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    triangle: bool,
    point: DVec3,
    normal: DVec3,
) -> f64 {
    let middle = (edge_u + edge_v) * if triangle { 1.0 / 3.0 } else { 0.5 };
    let center = (corner - point) + middle;
    if edge_u.cross(edge_v).dot(center) >= 0.0 {
        return 0.0;
    }
    let spread = 0.25 * (edge_u.length_squared() + edge_v.length_squared());
    let height = normal.dot(center);
    // The corners are 0, u, third, v; for a triangle the third is v again, with an edge of length 0 between the
    // two.
    let third = if triangle { edge_v } else { edge_u + edge_v };
    let mut sum = DVec3::ZERO;
    let mut horizon = None;
    let (mut sets, mut rises) = (DVec3::ZERO, DVec3::ZERO);
    let mut start = -middle;
    let first = height + normal.dot(start);
    let mut before = first;
    for (index, edge) in [edge_u, third - edge_u, edge_v - third, -edge_v].into_iter().enumerate() {
        let end = start + edge;
        // The contour ends where it began, with the same height, so that it crosses the horizon as often downwards
        // as upwards however a corner on it is rounded.
        let after = if index == 3 { first } else { height + normal.dot(end) };
        if before >= 0.0 || after >= 0.0 {
            let (mut visible_start, mut visible_edge) = (start, edge);
            if (before < 0.0) != (after < 0.0) {
                let part = before / (before - after);
                let crossing = start + edge * part;
                if before < 0.0 {
                    rises = crossing;
                    (visible_start, visible_edge) = (crossing, edge * (1.0 - part));
                } else {
                    sets = crossing;
                    visible_edge = edge * part;
                }
                horizon = Some((sets, rises - sets));
            }
            sum += contour_term(center, spread, visible_start, visible_edge);
        }
        (start, before) = (end, after);
    }
    // The edge along the horizon, from where the contour goes below it to where it comes back above.
    if let Some((start, edge)) = horizon {
        sum += contour_term(center, spread, start, edge);
    }
    (-normal.dot(sum) / TAU).clamp(0.0, 1.0)
}

/// Returns one edge's term θ Γ of the contour integral, minus what cancels over a closed contour. `start` is
/// relative to `center`, and `center` to the point.
fn contour_term(center: DVec3, spread: f64, start: DVec3, edge: DVec3) -> DVec3 {
    let end = start + edge;
    let (a, b) = (center + start, center + end);
    let (a_squared, b_squared) = (a.length_squared(), b.length_squared());
    let a_inverse = 1.0 / a_squared.max(TINY_LENGTH_SQUARED).sqrt();
    let b_inverse = 1.0 / b_squared.max(TINY_LENGTH_SQUARED).sqrt();
    // a × b / (|a||b|), using a × edge = b × edge, from the shorter of a and b, whose direction is more precise.
    let turn = if a_squared < b_squared {
        (a * a_inverse).cross(edge * b_inverse)
    } else {
        (b * b_inverse).cross(edge * a_inverse)
    };
    let sine = turn.length();
    let cosine = (a * a_inverse).dot(b * b_inverse);
    // 1 - |a||b|/(|center|² + spread), from differences that do not cancel.
    let reference = 1.0 / (center.length_squared() + spread).max(f64::MIN_POSITIVE);
    let a_short = reference * (spread - (2.0 * center + start).dot(start));
    let b_short = reference * (spread - (2.0 * center + end).dot(end));
    let product = reference * (a_squared * a_inverse) * (b_squared * b_inverse);
    let defect = (b_short + reference * b_squared * a_short) / (1.0 + product);
    let tangent = sine / (1.0 + cosine.abs());
    let excess = if cosine < 0.0 {
        (PI - 2.0 * tangent.atan()) / sine.max(1e-15) - 1.0
    } else {
        arc_excess(tangent * tangent)
    };
    turn * (excess + defect) + reference * start.cross(edge)
}

/// Returns θ/sin θ - 1 for θ up to a right angle, from tan²(θ/2) in [0, 1].
fn arc_excess(tangent_squared: f64) -> f64 {
    if tangent_squared < 1e-8 {
        // The next term is a fifth of the square, below 10⁻¹⁷.
        return tangent_squared * 2.0 / 3.0;
    }
    let tangent = tangent_squared.sqrt();
    (1.0 + tangent_squared) * tangent.atan() / tangent - 1.0
}

/// Returns k_s L times the sum over `samples` x `samples` points of the polygon, each a point light of its solid
/// angle over π. This is the specular part of [`polygon_light_contribution`] with a variable number of points, 1 to
/// 1000 along an edge.
pub fn polygon_highlight(
    model: ReflectionModel,
    surface: SurfaceSample,
    light: &PolygonLight,
    point: DVec3,
    normal: DVec3,
    viewer: DVec3,
    samples: u32,
) -> DVec3 {
    let area_vector = light.edge_u.cross(light.edge_v);
    let front = safe_normalize(area_vector);
    let area = area_vector.dot(front);
    let to_point = point - light.corner;
    let height = to_point.dot(front);
    if area <= 0.0 || height <= 0.0 {
        return DVec3::ZERO;
    }
    // Where the mirrored line of sight meets the polygon's plane, and the lobe's standard deviations there.
    let view_cosine = normal.dot(viewer);
    let reflected = 2.0 * view_cosine * normal - viewer;
    let fall = (-reflected.dot(front)).max(GRAZING_COSINE);
    let hit_distance = height / fall;
    let hit = to_point + reflected * hit_distance;
    let exponent = model_exponent(model, surface.lobe, surface.shininess);
    let width = lobe_width(model, exponent, view_cosine) * hit_distance;
    let sideways = safe_normalize(normal.cross(viewer));
    let axis = |dual: DVec3| lobe_axis(dual, front, reflected, fall, hit, sideways, width);
    let u_axis = axis(light.edge_v.cross(front) / area);
    let v_axis = axis(front.cross(light.edge_u) / area);
    let mut sum = DVec3::ZERO;
    for row in 0..samples {
        let u = axis_sample(u_axis, 1.0, row, samples);
        let v_end = if light.triangle { 1.0 - u.place } else { 1.0 };
        for column in 0..samples {
            let v = axis_sample(v_axis, v_end, column, samples);
            let to_light = light.edge_u * u.place + light.edge_v * v.place - to_point;
            let squared = to_light.length_squared().max(TINY_LENGTH_SQUARED);
            let inverse = 1.0 / squared.sqrt();
            let seen_area = area * u.length * v.length * (height * inverse).min(1.0);
            // The solid angle that the point stands for, never more than the hemisphere.
            let solid_angle = seen_area / (squared + seen_area / TAU);
            let sample = LightSample {
                specular: light.radiance,
                direction: to_light * inverse,
                attenuation: solid_angle / PI,
                spot: 1.0,
                ..LightSample::DARK
            };
            sum += light_contribution(model, surface, &sample, normal, viewer).specular;
        }
    }
    sum
}

/// Standard deviations of the model's highlight around the mirror direction, in radians: in the plane of incidence
/// (x) and perpendicular to it (y). A half vector turns half as far as the light in the plane, and less
/// perpendicular to it at grazing angles.
fn lobe_width(model: ReflectionModel, shininess: f64, cosine: f64) -> DVec2 {
    let width = 1.0 / shininess.max(SMALLEST_EXPONENT).sqrt();
    let across = cosine.max(GRAZING_COSINE);
    match model {
        ReflectionModel::Phong => DVec2::new(width, width),
        ReflectionModel::Blinn | ReflectionModel::TorranceSparrow => {
            DVec2::new(2.0 * width, 2.0 * width * across)
        }
        ReflectionModel::Blinn4n => DVec2::new(width, width * across),
        ReflectionModel::BlinnMatched => DVec2::new(width, width * across) / across.sqrt(),
    }
}

/// The distribution of sample points along one edge: the middle of the lobe and its reach, in lengths of that edge.
#[derive(Clone, Copy, Debug)]
struct LobeAxis {
    middle: f64,
    reach: f64,
}

/// Returns the lobe's middle and reach along the edge with the dual vector `dual`. `hit` is relative to the
/// polygon's corner, `width` in metres.
fn lobe_axis(
    dual: DVec3,
    front: DVec3,
    reflected: DVec3,
    fall: f64,
    hit: DVec3,
    sideways: DVec3,
    width: DVec2,
) -> LobeAxis {
    let middle = hit.dot(dual);
    // How far the hit moves along the edge as the line of sight turns.
    let gradient = dual + front * (reflected.dot(dual) / fall);
    let across = gradient.dot(sideways);
    let along_squared = (gradient.length_squared() - across * across).max(0.0);
    let reach = LOBE_REACH * (width.x * width.x * along_squared + width.y * width.y * across * across).sqrt();
    // If the lobe's middle is outside the polygon, only its tail is on it, which is at least as wide as a fraction
    // of the distance.
    let beside = (-middle).max(middle - 1.0).max(0.0);
    let reach = reach.max(beside / 3.0);
    // Far outside, middle and reach are scaled down together; otherwise positions on the edge would be small
    // differences of large numbers.
    let nearer = (FARTHEST_MIDDLE / beside.max(SMALLEST_REACH)).min(1.0);
    LobeAxis {
        middle: middle.clamp(-FARTHEST_MIDDLE, 1.0 + FARTHEST_MIDDLE),
        reach: (reach * nearer).max(SMALLEST_REACH),
    }
}

/// A sample point along one edge, and how much of the edge it stands for.
#[derive(Clone, Copy, Debug)]
struct AxisSample {
    place: f64,
    length: f64,
}

/// Returns the middle of stratum `index` of `count` over [0, end]. The strata have equal parts of the density (1 +
/// x²)^(-3/2), with x the distance from the lobe's middle over its reach. Wide lobes give even strata.
fn axis_sample(axis: LobeAxis, end: f64, index: u32, count: u32) -> AxisSample {
    let x_start = -axis.middle / axis.reach;
    let x_end = (end - axis.middle) / axis.reach;
    let y_start = x_start / (1.0 + x_start * x_start).sqrt();
    let y_end = x_end / (1.0 + x_end * x_end).sqrt();
    let stride = (y_end - y_start) / f64::from(count);
    let y = y_start + stride * (f64::from(index) + 0.5);
    let stretch = 1.0 / (1.0 - y * y).max(SMALLEST_REACH).sqrt();
    let place = axis.middle + axis.reach * y * stretch;
    AxisSample { place: place.clamp(0.0, end), length: axis.reach * stride * stretch * stretch * stretch }
}

#[cfg(test)]
mod tests;
