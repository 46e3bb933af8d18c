//! The light that reaches a point of a surface straight from the scene's lights, and what the surface sends of it to the viewer:
//! I_a k_a + Σ S_i f_att (k_d L_d (n·l) + k_s L_s …) + k_t L_s (t·v)ⁿ. The equations are `lumbre_optics`'; here is the sum over lights and what
//! stands between. Not mirrored and transmitted rays.

use glam::DVec3;
use lumbre_optics::{
    BakeMode, Contribution, LightKind, evaluate_light, light_contribution, polygon_light_contribution,
    transmitted_highlight,
};

use crate::geometry::SpaceRay;
use crate::medium::MediumStack;
use crate::scene::{PlacedLight, Scene};
use crate::shadow_ray::{Glass, transmittance};
use crate::surface_point::SurfacePoint;

/// The terms of the sum at one point.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DirectLight {
    /// k_a (I_a + Σ L_a), or what an irradiance volume has in place of I_a.
    pub ambient: DVec3,
    /// The part of it that is no light's.
    pub ambient_of_scene: DVec3,
    pub diffuse: DVec3,
    pub specular: DVec3,
    /// Highlights of light that shines through.
    pub transmitted: DVec3,
    /// k_d E/π of the lightmap.
    pub baked: DVec3,
    pub emission: DVec3,
    /// Shadow rays.
    pub rays: u32,
    /// Of each light, by its number (emissive polygons after the lights), what it adds to the picture; only if it is asked for.
    pub lights: Vec<LightTerm>,
}

/// What one light adds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightTerm {
    pub light: usize,
    /// S_i per channel.
    pub visibility: DVec3,
    /// k_a L_a, which no shadow takes away.
    pub ambient: DVec3,
    pub diffuse: DVec3,
    pub specular: DVec3,
    pub transmitted: DVec3,
}

impl DirectLight {
    /// Everything together.
    pub fn total(&self) -> DVec3 {
        self.ambient + self.diffuse + self.specular + self.transmitted + self.baked + self.emission
    }
}

/// How light is summed up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lighting {
    pub shadows: bool,
    /// Terms of each light are wanted.
    pub by_light: bool,
}

/// Points along each edge of an emissive polygon that shadow rays go to.
const SHADOW_POINTS: u32 = 4;

/// The light of all lamps at a point, for a viewer in a direction. `media` is on the viewer's side of the surface, `behind` with the index
/// `eta` beyond it.
pub(crate) fn direct_light(
    scene: &Scene,
    point: &SurfacePoint,
    viewer: DVec3,
    (media, behind, eta): (&MediumStack, &MediumStack, f64),
    lighting: Lighting,
) -> DirectLight {
    let object = &scene.objects[point.object];
    let mut light = DirectLight { emission: point.emission, ..DirectLight::default() };
    let mapped = point.baked.is_some();
    light.baked = point.baked.unwrap_or(DVec3::ZERO);
    // Either holds what the ambient term stands for.
    let indirect = mapped || point.from_volume.is_some();
    light.ambient_of_scene = match point.from_volume {
        Some(from_volume) => from_volume,
        None if mapped => DVec3::ZERO,
        None => point.surface.ambient * scene.settings.ambient_with_sky().as_dvec3(),
    };
    light.ambient = light.ambient_of_scene;
    let passing = object.transmission();
    for (number, placed) in scene.lights.iter().enumerate() {
        let sample = evaluate_light(&placed.light, placed.position, placed.axis, point.position);
        if sample.attenuation * sample.spot == 0.0 || (indirect && placed.light.kind == LightKind::Ambient) {
            continue;
        }
        let mut added = light_contribution(object.model, point.surface, &sample, point.normal, viewer);
        if mapped && placed.light.bake == BakeMode::Static {
            added.diffuse = DVec3::ZERO;
        }
        light.ambient += added.ambient;
        let mut through = DVec3::ZERO;
        if passing != DVec3::ZERO && !object.medium.thin {
            // From behind: the index on the viewer's side over that on the light's.
            let highlight = transmitted_highlight(
                -point.optical_normal(viewer),
                sample.direction,
                viewer,
                point.surface.shininess,
                1.0 / eta,
            );
            through = passing * sample.specular * (sample.attenuation * sample.spot * highlight);
        }
        if added.diffuse + added.specular + through == DVec3::ZERO {
            light.add_ambient(number, added.ambient, lighting);
            continue;
        }
        let visibility = if lighting.shadows {
            let from_behind = sample.direction.dot(point.geometric) < 0.0;
            let start = if from_behind { behind } else { media };
            let (visible, rays) = transmittance(
                scene,
                &shadow_ray(point, sample.direction),
                reach(placed, point),
                start,
                (Glass::LetsThrough, &placed.bulbs),
            );
            light.rays += rays;
            visible
        } else {
            DVec3::ONE
        };
        light.add(number, visibility, added, through, lighting);
    }
    for (number, polygon) in scene.polygons.iter().enumerate() {
        if polygon.emitter == point.object {
            continue;
        }
        let mut added = polygon_light_contribution(
            object.model,
            point.surface,
            &polygon.light,
            point.position,
            point.normal,
            viewer,
        );
        if mapped && polygon.baked {
            added.diffuse = DVec3::ZERO;
        }
        light.ambient += added.ambient;
        if added.diffuse + added.specular == DVec3::ZERO {
            light.add_ambient(scene.lights.len() + number, added.ambient, lighting);
            continue;
        }
        let mut visibility = DVec3::ONE;
        if lighting.shadows {
            let (sum, rays) = polygon_visibility(scene, point, number, media);
            light.rays += rays;
            visibility = sum;
        }
        light.add(scene.lights.len() + number, visibility, added, DVec3::ZERO, lighting);
    }
    light
}

impl DirectLight {
    fn add(
        &mut self,
        number: usize,
        visibility: DVec3,
        added: Contribution,
        through: DVec3,
        lighting: Lighting,
    ) {
        let (diffuse, specular) = (visibility * added.diffuse, visibility * added.specular);
        self.diffuse += diffuse;
        self.specular += specular;
        self.transmitted += visibility * through;
        if lighting.by_light {
            let transmitted = visibility * through;
            let ambient = added.ambient;
            self.lights.push(LightTerm {
                light: number,
                visibility,
                ambient,
                diffuse,
                specular,
                transmitted,
            });
        }
    }

    /// The term of a light that adds nothing else, so that nothing is asked of its shadow.
    fn add_ambient(&mut self, number: usize, ambient: DVec3, lighting: Lighting) {
        if lighting.by_light && ambient != DVec3::ZERO {
            let zero = DVec3::ZERO;
            let [visibility, diffuse, specular, transmitted] = [DVec3::ONE, zero, zero, zero];
            self.lights.push(LightTerm {
                light: number,
                visibility,
                ambient,
                diffuse,
                specular,
                transmitted,
            });
        }
    }
}

/// Metres to a light; infinite to distant ones.
pub(crate) fn reach(placed: &PlacedLight, point: &SurfacePoint) -> f64 {
    match placed.light.kind {
        LightKind::Point => placed.position.distance(point.position),
        LightKind::Directional | LightKind::Ambient => f64::INFINITY,
    }
}

/// A ray from a point towards a light, off the surface on the light's side.
pub(crate) fn shadow_ray(point: &SurfacePoint, direction: DVec3) -> SpaceRay {
    SpaceRay::leaving(point.position, direction, point.geometric, point.extent)
}

/// How much of a polygon is seen, by a grid of points over it: the mean of what each lets through.
fn polygon_visibility(
    scene: &Scene,
    point: &SurfacePoint,
    number: usize,
    media: &MediumStack,
) -> (DVec3, u32) {
    let light = &scene.polygons[number].light;
    let front = light.area_vector();
    let (mut sum, mut weight, mut rays) = (DVec3::ZERO, 0.0, 0);
    for row in 0..SHADOW_POINTS {
        for column in 0..SHADOW_POINTS {
            let [mut u, mut v] =
                [row, column].map(|index| (f64::from(index) + 0.5) / f64::from(SHADOW_POINTS));
            if light.triangle && u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let to = light.corner + light.edge_u * u + light.edge_v * v - point.position;
            let distance = to.length();
            // As much as the piece sends: by the solid angle, and above the horizon.
            let part =
                (-to.dot(front) / distance.powi(3)).max(0.0) * to.dot(point.normal).max(0.0) / distance;
            if !(part > 0.0 && part.is_finite()) {
                continue;
            }
            let (visible, more) = transmittance(
                scene,
                &shadow_ray(point, to / distance),
                distance,
                media,
                (Glass::LetsThrough, &[]),
            );
            (sum, weight, rays) = (sum + visible * part, weight + part, rays + more);
        }
    }
    // Where no point of the grid is above the horizon the polygon's light is next to nothing, and is left as it is.
    if weight > 0.0 { (sum / weight, rays) } else { (DVec3::ONE, rays) }
}
