//! The visibility of point, spot and directional lights from a tile of texels. That of emissive surfaces is in
//! `shafts`.

use glam::DVec3;
use lumbre_optics::{LightKind, SpotCone};

use crate::scene::{BakeScene, PlacedLight};
use crate::sources::Sources;
use crate::visibility::shaft::WIDEST;
use crate::visibility::{Area, LightVisibility, Origin, PolygonClipper, Shadow, Shaft};

/// What is known about the visibility of some lights, in ascending order of their indices, from a flat area.
/// `texel_side` is the side length of its texels. Lights that are left out need shadow rays.
pub(crate) fn visibilities(
    sources: &Sources<'_>,
    lights: &[u32],
    area: &Area,
    texel_side: f32,
) -> Vec<(u32, LightVisibility)> {
    let of_light = |&index: &u32| {
        if sources.scene.stop.is_cancelled() {
            return None;
        }
        let placed = &sources.lights[index as usize];
        let visibility = match is_out_of_range(sources.scene, placed, area) {
            true => LightVisibility::Dark,
            false if is_even(sources.scene, placed, area, texel_side) => {
                visibility(sources.scene, placed, area)?
            }
            false => return None,
        };
        Some((index, visibility))
    };
    lights.iter().filter_map(of_light).collect()
}

/// Whether a few points of a texel, and the centroids of the pieces that shadows cut it into, give the light of the
/// whole texel: the light is several texels away, no sharp edge of its cone crosses the area, and it is not so far away
/// that rounding would blur the edges of shadows.
fn is_even(scene: &BakeScene, placed: &PlacedLight, area: &Area, texel_side: f32) -> bool {
    if placed.light.kind == LightKind::Directional {
        return true;
    }
    let place = scene.space.place(placed.position);
    let [a, b, c, d] = area.corners;
    let projected = |side: DVec3| {
        let squared = side.length_squared();
        if squared > 0.0 { side * ((place - a).dot(side) / squared).clamp(0.0, 1.0) } else { DVec3::ZERO }
    };
    let distance = place.distance(a + projected(b - a) + projected(d - a));
    if !(distance >= NEAR * f64::from(texel_side) && place.abs().max_element() < FAR) {
        return false;
    }
    let Some(cone) = placed.light.spot.filter(|cone| !cone.is_everywhere()) else { return true };
    let (inner, outer) = match cone {
        SpotCone::Exponent { cutoff, .. } => (cutoff, cutoff),
        SpotCone::Smooth { inner, outer } => (inner, outer),
    };
    let (inner, outer) = (f64::from(inner), f64::from(outer));
    let (middle, reach) = ((a + c) * 0.5, 0.5 * a.distance(c));
    let from_light = middle - place;
    let spread = (reach / from_light.length()).min(1.0).asin();
    let angle = placed.axis.angle_between(from_light);
    let is_off_edge = angle + spread < inner || angle - spread > outer;
    is_off_edge || outer - inner > spread
}

/// Whether a light ends before it reaches an area.
fn is_out_of_range(scene: &BakeScene, placed: &PlacedLight, area: &Area) -> bool {
    let range = f64::from(placed.light.attenuation.range) * scene.space.scale;
    // A range that is not positive, or NaN, means no limit.
    if placed.light.kind == LightKind::Directional || range <= 0.0 || range.is_nan() {
        return false;
    }
    let (middle, reach) =
        ((area.corners[0] + area.corners[2]) * 0.5, 0.5 * area.corners[0].distance(area.corners[2]));
    scene.space.place(placed.position).distance(middle) > (range + reach) * (1.0 + f64::from(f32::EPSILON))
}

/// The distance, in texel sides, from which on a light is not too near.
const NEAR: f64 = 2.0;
/// Coordinates from which on a light is too far away: the edges of its shadows are rounded by a thousandth of a texel
/// in maps of 8192.
const FAR: f64 = (1 << 14) as f64;

/// The visibility of a light from an area; `None` if it needs shadow rays.
fn visibility(scene: &BakeScene, placed: &PlacedLight, area: &Area) -> Option<LightVisibility> {
    let light = &placed.light;
    let (shaft, origin) = match light.kind {
        LightKind::Directional => {
            let (towards, half_angle) = (-placed.axis, 0.5 * f64::from(light.angle));
            match placed.is_sized() {
                true if half_angle > WIDEST => return None,
                true => (Shaft::in_cone(area, towards, half_angle), None),
                false => (Shaft::towards(area, towards), Some(Origin::Direction(towards))),
            }
        }
        _ => {
            let place = scene.space.place(placed.position);
            match placed.is_sized() {
                true => (Shaft::to_ball(area, place, f64::from(light.radius) * scene.space.scale), None),
                false => (Shaft::to_point(area, place), Some(Origin::Point(place))),
            }
        }
    };
    let Some(shaft) = shaft else { return Some(LightVisibility::Dark) };
    let blockers = shaft.triangles(scene, MAX_BLOCKERS)?;
    if blockers.is_empty() {
        return Some(LightVisibility::Clear);
    }
    let origin = origin?;
    let corners = |&index: &u32| scene.triangles[index as usize].corners.map(|corner| corner.as_dvec3());
    let shadows: Vec<Shadow> =
        blockers.iter().map(corners).filter_map(|corners: [DVec3; 3]| origin.shadow(corners)).collect();
    let mut scratch = PolygonClipper::new();
    if shadows.is_empty() {
        Some(LightVisibility::Clear)
    } else if origin.hides_all(area.corners, &shadows, &mut scratch) {
        Some(LightVisibility::Hidden)
    } else {
        Some(LightVisibility::Shadows(origin, shadows))
    }
}

/// The most triangles whose shadows are cut out for one light; with more, shadow rays are faster.
const MAX_BLOCKERS: usize = 128;
