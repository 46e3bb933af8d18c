//! What may stand between a tile of texels and point, spot and directional lights. Not between it and emissive surfaces: that is `shafts`.

use glam::DVec3;
use lumbre_optics::LightKind;

use crate::scene::{BakeScene, PlacedLight};
use crate::transport::box_tree::BoxTree;
use crate::transport::cut_out::{Pieces, Shadow};
use crate::transport::direct::{Receiver, Sources};
use crate::transport::lit_part::{Origin, Way};
use crate::transport::shaft::{Area, Shaft, WIDEST};

/// What is known of the lights' ways to an area of a flat surface, by the lights' numbers, in their order. Of many lights those that are the
/// brightest there.
pub(super) fn ways(sources: &Sources<'_>, area: &Area, tree: &BoxTree) -> Vec<(u32, Way)> {
    let point = |x: f32, y: f32| {
        let [a, b, _, d] = area.corners;
        let position = (a + (b - a) * f64::from(x) + (d - a) * f64::from(y)).as_vec3();
        let normal = area.normal.as_vec3();
        Some(Receiver { position, origin: position, geometric_normal: normal, normal })
    };
    let arriving = sources.brightest_lights(&point);
    let of_light = |(index, placed): (usize, &PlacedLight)| {
        let index = index as u32;
        let way = match arriving.binary_search(&index) {
            Ok(_) => way(sources.scene, placed, area, tree)?,
            // Of few lights all that arrive are among them.
            Err(_) if sources.has_few_lights() => Way::Hidden,
            Err(_) => return None,
        };
        Some((index, way))
    };
    sources.lights.iter().enumerate().filter_map(of_light).collect()
}

/// `None` where rays have to tell.
fn way(scene: &BakeScene, placed: &PlacedLight, area: &Area, tree: &BoxTree) -> Option<Way> {
    let light = &placed.light;
    let (shaft, origin) = match light.kind {
        LightKind::Directional => {
            let (towards, half_angle) = (-placed.axis, 0.5 * f64::from(light.angle));
            match half_angle > 0.0 {
                true if half_angle > WIDEST => return None,
                true => (Shaft::in_cone(area, towards, half_angle), None),
                false => (Shaft::towards(area, towards), Some(Origin::Direction(towards))),
            }
        }
        _ => {
            let place = scene.space.place(placed.position);
            match f64::from(light.radius) * scene.space.scale {
                radius if radius > 0.0 => (Shaft::to_ball(area, place, radius), None),
                _ => (Shaft::to_point(area, place), Some(Origin::Point(place))),
            }
        }
    };
    let Some(shaft) = shaft else { return Some(Way::Hidden) };
    let blockers = shaft.triangles(scene, tree, MOST_BLOCKERS)?;
    if blockers.is_empty() {
        return Some(Way::Clear);
    }
    let origin = origin?;
    let corners = |&index: &u32| scene.triangles[index as usize].corners.map(|corner| corner.as_dvec3());
    let shadows: Vec<Shadow> =
        blockers.iter().map(corners).filter_map(|corners: [DVec3; 3]| origin.shadow(corners)).collect();
    let mut room = Pieces::new();
    if shadows.is_empty() {
        Some(Way::Clear)
    } else if origin.hides_all(area.corners, &shadows, &mut room) {
        Some(Way::Hidden)
    } else {
        Some(Way::Shadows(origin, shadows))
    }
}

/// Most triangles whose shadows are looked at for one light: beyond, rays are quicker.
const MOST_BLOCKERS: usize = 128;
