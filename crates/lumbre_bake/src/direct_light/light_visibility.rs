//! What may stand between a tile of texels and point, spot and directional lights. Not between it and emissive surfaces: that is `shafts`.

use glam::DVec3;
use lumbre_optics::{LightKind, SpotCone};

use crate::scene::{BakeScene, PlacedLight};
use crate::sources::light_sources::Sources;
use crate::visibility::cut_out::{Pieces, Shadow};
use crate::visibility::shadow_clipping::{LightVisibility, Origin};
use crate::visibility::shaft::{Area, Shaft, WIDEST};

/// What is known of the ways of some lights, by ascending number, to an area of a flat surface. `texel_side` is that of its texels.
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

/// Whether a texel's light by a few of its points, and by the middles of its pieces, is that of all of it: the light is not as near as texels
/// are large, no sharp edge of its cone goes through the area, and it is not so far away that numbers do not tell the shadows' edges.
fn is_even(scene: &BakeScene, placed: &PlacedLight, area: &Area, texel_side: f32) -> bool {
    if placed.light.kind == LightKind::Directional {
        return true;
    }
    let place = scene.space.place(placed.position);
    let [a, b, c, d] = area.corners;
    let along = |side: DVec3| {
        let squared = side.length_squared();
        if squared > 0.0 { side * ((place - a).dot(side) / squared).clamp(0.0, 1.0) } else { DVec3::ZERO }
    };
    let away = place.distance(a + along(b - a) + along(d - a));
    if !(away >= NEAR * f64::from(texel_side) && place.abs().max_element() < AFAR) {
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
    let beside = angle + spread < inner || angle - spread > outer;
    beside || outer - inner > spread
}

/// Whether a light ends before it reaches an area.
fn is_out_of_range(scene: &BakeScene, placed: &PlacedLight, area: &Area) -> bool {
    let range = f64::from(placed.light.attenuation.range) * scene.space.scale;
    // What is no range is none.
    if placed.light.kind == LightKind::Directional || range <= 0.0 || range.is_nan() {
        return false;
    }
    let (middle, reach) =
        ((area.corners[0] + area.corners[2]) * 0.5, 0.5 * area.corners[0].distance(area.corners[2]));
    scene.space.place(placed.position).distance(middle) > (range + reach) * (1.0 + f64::from(f32::EPSILON))
}

/// Of texels' sides, how near a light may be.
const NEAR: f64 = 2.0;
/// Coordinates of lights so far away that the edges of their shadows are rounded by a thousandth of a texel in maps of 8192.
const AFAR: f64 = (1 << 14) as f64;

/// `None` where rays have to tell.
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
    let mut room = Pieces::new();
    if shadows.is_empty() {
        Some(LightVisibility::Clear)
    } else if origin.hides_all(area.corners, &shadows, &mut room) {
        Some(LightVisibility::Hidden)
    } else {
        Some(LightVisibility::Shadows(origin, shadows))
    }
}

/// Most triangles whose shadows are looked at for one light: beyond, rays are quicker.
const MAX_BLOCKERS: usize = 128;
