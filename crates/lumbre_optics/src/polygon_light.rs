//! An emissive polygon as a light (document \[I\]'s distributed sources): Lambert's closed form for the diffuse part, a few points for
//! the specular one. Not its visibility: nothing here stands between the polygon and the point. The baker has shadows of its own.
//!
//! # Diffuse part
//! What multiplies k_d is irradiance/π, for a polygon of radiance L just L F: the form factor F from the point to the polygon,
//! clipped to the point's horizon, F = Σ θ_i n·Γ_i / 2π over the edges, θ_i the angle that edge i subtends and Γ_i the unit normal of
//! its plane with the point (Lambert 1760; Baum, Rushmeier and Winget 1989).
//!
//! As it stands the sum cancels: its terms are of size s/d and F of size (s/d)² for a polygon of size s at distance d, so that f32
//! loses ε d/s. Here, with corners a and b = a + e of an edge relative to the point, θ Γ = θ/sin θ · (a × e)/(|a||b|), and
//! w Σ a × e = w Σ α × e for any w and the corners α relative to the polygon's middle c, because Σ c × e = 0. So each term is
//!
//! ```text
//!   (a × e)/(|a||b|) · [(θ/sin θ - 1) + (1 - w |a||b|)]  +  w α × e,      w = 1/(|c|² + mean |α|²)
//! ```
//!
//! where both parts in brackets are of order (s/d)² and found without cancellation: the first is a polynomial in tan²(θ/2), the
//! second comes from |c|² - |a|² = -(2c + α)·α. The error of F in f32 relative to the polygon's value face on is then a few ε times
//! its aspect ratio at every distance (measured: 2·10⁻⁷ for squares from 0.5 to 10⁴ sizes away, 5·10⁻⁶ for 1:100), and 10⁻⁵
//! absolute closer than a hundredth of its size, away from its edges. No inverse trigonometric function is called: WGSL's are good to 2⁻¹¹ only.
//!
//! # Specular part
//! The integral of the model's factor over the polygon has no short closed form for the models here. It is the sum over 4 x 4 points,
//! each a point light of the solid angle it stands for over π, through the same function as every other light. The points are the
//! middles of strata that crowd where the mirrored line of sight meets the polygon's plane: a highlight is as smooth at n = 10⁴ as
//! at n = 20, and a sharp one shows the polygon's edges.
//!
//! Error, over a floor under a ceiling panel, a triangle and a wall panel, relative to the brightest point of the highlight: at most
//! 6 % for n from 20 to 10⁴ (Torrance-Sparrow 8 %), 4 % in the mean; it falls with the square of the number of points along an edge.
//! Beside a wall lamp that all but touches the floor, models with an exponent of n·h below 20 are off by up to 20 % on the last
//! decimetres. Evenly spread, as many points would be off by more than the highlight itself from n = 500 on.
//!
//! These models are 1 at their peak whatever their exponent, so the highlight of a lamp that is wider than the lobe falls as
//! 2/(n + 1) (Phong): so would the sum over any number of point lights.
//!
//! # Cost
//! On a software rasterizer a polygon costs about 12 point lights on a matt surface and 16 on a shiny one (`--test frames
//! what_a_polygon_costs -- --nocapture` prints it). Objects wholly behind a polygon do not evaluate it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::normalization::{TINY_LENGTH_SQUARED, safe_normalize};
use crate::shade::{Contribution, SurfaceSample, light_contribution, model_exponent};
use crate::{LightSample, ReflectionModel};

/// Points along each edge that make a polygon's highlight.
pub const HIGHLIGHT_SAMPLES: u32 = 4;
/// Half width of the points' density in standard deviations of the lobe. Between 1.9, where four points sum a Gaussian lobe exactly, and
/// 2.6, where they cover its tails: the least largest error of the cases in the tests.
const LOBE_REACH: f64 = 2.1;
/// Exponents below this make no wider lobe.
const SMALLEST_EXPONENT: f64 = 0.01;
/// In lengths of an edge.
const SMALLEST_REACH: f64 = 1e-6;
/// How far beside an edge the middle of a lobe may lie, in its lengths.
const FARTHEST_MIDDLE: f64 = 8.0;
/// Cosines are kept above this where they are divided by.
const GRAZING_COSINE: f64 = 1e-3;

/// A triangle or parallelogram that shines evenly to its front, from which its corners run counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolygonLight {
    /// A corner, in metres.
    pub corner: DVec3,
    /// From it to the next corner, counter-clockwise.
    pub edge_u: DVec3,
    /// From it to the corner before.
    pub edge_v: DVec3,
    /// Whether that is all; else `corner + edge_u + edge_v` is the fourth corner.
    pub triangle: bool,
    /// Linear RGB, W/(m² sr).
    pub radiance: DVec3,
}

impl PolygonLight {
    /// Area times the unit normal of the front, in m².
    pub fn area_vector(&self) -> DVec3 {
        self.edge_u.cross(self.edge_v) * if self.triangle { 0.5 } else { 1.0 }
    }

    /// The same polygon shining to the other side.
    pub fn turned(&self) -> Self {
        Self { edge_u: self.edge_v, edge_v: self.edge_u, ..*self }
    }
}

/// What the polygon adds to a surface at `point`: nothing behind its front. `normal` is unit or zero, `viewer` unit; metres and world
/// space. Holds for distances up to 10⁹ m in f32.
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

/// The form factor from `point` with unit `normal` to a polygon's front, clipped to the point's horizon, unoccluded; in [0, 1]. 0 from
/// behind, in the polygon's plane, and for a polygon without area or a zero normal.
///
/// # Error of the f32 twin
///
/// Beyond its size 10⁻⁶ and 3·10⁻⁷ times its aspect, of what the polygon would be face on. Nearer 2·10⁻⁵ (1 +
/// aspect/10), and 8 u of its size over the distance to its nearest edge, the line of the horizon among them:
/// a corner relative to the point is rounded by u of the size, which turns an edge that is so near by as
/// much. In the polygon's own plane within rounding, on the polygon, anything in [0, 1]: a point there has it
/// before itself or behind. Measured against the closed form in f64, not derived operation by operation.
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
    // The corners are 0, u, third, v; a triangle's third corner is v again, with an edge of length 0 between them.
    let third = if triangle { edge_v } else { edge_u + edge_v };
    let mut sum = DVec3::ZERO;
    let mut horizon = None;
    let (mut sets, mut rises) = (DVec3::ZERO, DVec3::ZERO);
    let mut start = -middle;
    let first = height + normal.dot(start);
    let mut before = first;
    for (index, edge) in [edge_u, third - edge_u, edge_v - third, -edge_v].into_iter().enumerate() {
        let end = start + edge;
        // The contour ends where it began: as often above the horizon as below, however a corner on it is rounded.
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
    // Along the horizon, from where the contour sets to where it rises.
    if let Some((start, edge)) = horizon {
        sum += contour_term(center, spread, start, edge);
    }
    (-normal.dot(sum) / TAU).clamp(0.0, 1.0)
}

/// One edge's part of the contour integral, θ Γ, less what the terms of a closed contour cancel: `start` is relative to `center`,
/// `center` to the point.
fn contour_term(center: DVec3, spread: f64, start: DVec3, edge: DVec3) -> DVec3 {
    let end = start + edge;
    let (a, b) = (center + start, center + end);
    let (a_squared, b_squared) = (a.length_squared(), b.length_squared());
    let a_inverse = 1.0 / a_squared.max(TINY_LENGTH_SQUARED).sqrt();
    let b_inverse = 1.0 / b_squared.max(TINY_LENGTH_SQUARED).sqrt();
    // a × b / (|a||b|), from the shorter of the two, whose direction is the more precise: a × edge = b × edge.
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

/// θ/sin θ - 1 for θ up to a right angle, from tan²(θ/2) in [0, 1].
fn arc_excess(tangent_squared: f64) -> f64 {
    if tangent_squared < 1e-8 {
        // The next term is a fifth of the square: below 10⁻¹⁷.
        return tangent_squared * 2.0 / 3.0;
    }
    let tangent = tangent_squared.sqrt();
    (1.0 + tangent_squared) * tangent.atan() / tangent - 1.0
}

/// k_s L times the sum over `samples` x `samples` points of the polygon, each a point light of its solid angle over π: the specular
/// part of [`polygon_light_contribution`] with another number of points. 1 to 1000 of them along an edge.
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
    // Where the mirrored line of sight meets the plane, and the lobe's standard deviations there.
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
            // The part of the hemisphere that the point stands for: never more than all of it.
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

/// Standard deviations of the model's highlight about the mirror direction, in radians: in the plane of incidence (x) and across it
/// (y). A half vector turns half as far as the light in the plane, and less across it where the light grazes.
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

/// Points of a polygon along one edge: the middle of the lobe and its reach, in lengths of that edge.
#[derive(Clone, Copy, Debug)]
struct LobeAxis {
    middle: f64,
    reach: f64,
}

/// The lobe's middle and reach along the edge with this dual vector. `hit` is relative to the polygon's corner, `width` in metres.
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
    // How far along the edge the hit moves with the line of sight.
    let gradient = dual + front * (reflected.dot(dual) / fall);
    let across = gradient.dot(sideways);
    let along_squared = (gradient.length_squared() - across * across).max(0.0);
    let reach = LOBE_REACH * (width.x * width.x * along_squared + width.y * width.y * across * across).sqrt();
    // A lobe beside the polygon leaves its tail there, which is no narrower than a part of the way.
    let beside = (-middle).max(middle - 1.0).max(0.0);
    let reach = reach.max(beside / 3.0);
    // Far outside, the middle comes nearer and the reach with it: positions on the edge would be small differences of large numbers.
    let nearer = (FARTHEST_MIDDLE / beside.max(SMALLEST_REACH)).min(1.0);
    LobeAxis {
        middle: middle.clamp(-FARTHEST_MIDDLE, 1.0 + FARTHEST_MIDDLE),
        reach: (reach * nearer).max(SMALLEST_REACH),
    }
}

/// A point of a polygon along one edge, and how much of the edge it stands for.
#[derive(Clone, Copy, Debug)]
struct AxisSample {
    place: f64,
    length: f64,
}

/// The middle of stratum `index` of `count` over [0, end]: strata of equal parts of the density (1 + x²)^(-3/2), x in reaches from the
/// lobe's middle. Wide lobes make even strata.
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
