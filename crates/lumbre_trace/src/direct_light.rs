//! Direct light at a surface point, and what the surface reflects of it towards the viewer: I_a k_a + Σ S_i
//! f_att (k_d L_d (n·l) + k_s L_s …) + k_t L_s (t·v)ⁿ. The equations are in `lumbre_optics`; this module sums
//! over lights and traces the shadow rays. Mirrored and transmitted rays are in `ray_tree`.

use glam::DVec3;
use lumbre_optics::{
    BakeMode, Contribution, LightKind, SurfaceSample, evaluate_light, light_contribution,
    polygon_light_contribution, transmitted_highlight,
};

use crate::coplanar::EndSurface;
use crate::geometry::RayOrigin;
use crate::medium::MediumStack;
use crate::scene::{PlacedLight, Scene};
use crate::shadow_ray::{Glass, Target, transmittance};
use crate::surface_point::SurfacePoint;

/// The terms of the sum at one point.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DirectLight {
    /// k_a (I_a + Σ L_a), or the irradiance volume's light in place of k_a I_a.
    pub ambient: DVec3,
    /// The part of `ambient` that belongs to no light.
    pub ambient_of_scene: DVec3,
    pub diffuse: DVec3,
    pub specular: DVec3,
    /// Highlights of lights behind a transmissive surface.
    pub transmitted: DVec3,
    /// Light of the lightmap.
    pub baked: DVec3,
    pub emission: DVec3,
    /// Number of shadow rays.
    pub rays: u32,
    /// The contribution of each light, by its index, where emissive polygons follow the lights; empty unless
    /// it is asked for.
    pub lights: Vec<LightTerm>,
}

/// The contribution of one light.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightTerm {
    pub light: usize,
    /// S_i per channel.
    pub visibility: DVec3,
    /// k_a L_a, which shadows do not affect.
    pub ambient: DVec3,
    pub diffuse: DVec3,
    pub specular: DVec3,
    pub transmitted: DVec3,
}

impl DirectLight {
    /// Returns the sum of all terms.
    pub fn total(&self) -> DVec3 {
        self.ambient + self.diffuse + self.specular + self.transmitted + self.baked + self.emission
    }
}

/// Options of the sum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lighting {
    pub shadows: bool,
    /// Whether the contribution of each light is wanted.
    pub by_light: bool,
}

/// Number of shadow rays along each edge of an emissive polygon.
const SHADOW_POINTS: u32 = 4;

/// Sums the light of all lamps and emissive polygons at a point, for a viewer in the direction `viewer`. The
/// tuple holds the media on the viewer's side of the surface, those behind it, and the index of refraction
/// behind over that in front.
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
    // Irradiance/π of the baked lights whose highlights a metal shows.
    let mut shown = DVec3::ZERO;
    // Both lightmaps and irradiance volumes hold the indirect light that the ambient term stands for.
    let indirect = mapped || point.from_volume.is_some();
    light.ambient_of_scene = match point.from_volume {
        Some(from_volume) => from_volume,
        None if mapped => DVec3::ZERO,
        None => point.surface.ambient * scene.settings.ambient_with_sky().as_dvec3(),
    };
    light.ambient = light.ambient_of_scene;
    let passing = object.transmission();
    let origin = point.ray_origin();
    for (number, placed) in scene.lights.iter().enumerate() {
        let sample = evaluate_light(&placed.light, placed.position, placed.axis, point.position);
        if sample.attenuation * sample.spot == 0.0 || (indirect && placed.light.kind == LightKind::Ambient) {
            continue;
        }
        let in_lightmap = mapped && placed.light.bake == BakeMode::Static;
        let surface = if in_lightmap { white(point) } else { point.surface };
        let mut added = light_contribution(object.model, surface, &sample, point.normal, viewer);
        let highlighted = taken_from_lightmap(point, in_lightmap, &mut added);
        light.ambient += added.ambient;
        let mut through = DVec3::ZERO;
        if passing != DVec3::ZERO && !object.medium.thin {
            // Light that shines through comes from behind: the index on the viewer's side over that on the
            // light's side.
            let highlight = transmitted_highlight(
                -point.optical_normal(viewer),
                sample.direction,
                viewer,
                point.surface.shininess,
                1.0 / eta,
            );
            through = passing * sample.specular * (sample.attenuation * sample.spot * highlight);
        }
        if added.diffuse + added.specular + through + highlighted == DVec3::ZERO {
            light.add_ambient(number, added.ambient, lighting);
            continue;
        }
        let visibility = if lighting.shadows {
            let from_behind = sample.direction.dot(point.geometric) < 0.0;
            let start = if from_behind { behind } else { media };
            let target = Target {
                distance: reach(placed, point),
                surface: None,
                glass: Glass::LetsThrough,
                bulbs: &placed.bulbs,
            };
            let ray = origin.towards(sample.direction);
            let (visible, rays) = transmittance(scene, &ray, &target, start);
            light.rays += rays;
            visible
        } else {
            DVec3::ONE
        };
        shown += visibility * highlighted;
        light.add(number, visibility, added, through, lighting);
    }
    for (number, polygon) in scene.polygons.iter().enumerate() {
        if polygon.emitter == point.object {
            continue;
        }
        let in_lightmap = mapped && polygon.baked;
        let surface = if in_lightmap { white(point) } else { point.surface };
        let mut added = polygon_light_contribution(
            object.model,
            surface,
            &polygon.light,
            point.position,
            point.normal,
            viewer,
        );
        let highlighted = taken_from_lightmap(point, in_lightmap, &mut added);
        light.ambient += added.ambient;
        if added.diffuse + added.specular + highlighted == DVec3::ZERO {
            light.add_ambient(scene.lights.len() + number, added.ambient, lighting);
            continue;
        }
        let mut visibility = DVec3::ONE;
        if lighting.shadows {
            let (sum, rays) = polygon_visibility(scene, point, &origin, number, media);
            light.rays += rays;
            visibility = sum;
        }
        shown += visibility * highlighted;
        light.add(scene.lights.len() + number, visibility, added, DVec3::ZERO, lighting);
    }
    if let Some(baked) = &point.baked {
        let beside_highlights = (baked.arriving - shown).max(DVec3::ZERO);
        light.baked = point.surface.diffuse * baked.arriving + baked.metal * beside_highlights;
    }
    light
}

/// Takes the diffuse part of a light in the lightmap away. Returns it where the highlight of a metal shows the light.
fn taken_from_lightmap(point: &SurfacePoint, in_lightmap: bool, added: &mut Contribution) -> DVec3 {
    if !in_lightmap {
        return DVec3::ZERO;
    }
    let taken = std::mem::take(&mut added.diffuse);
    let is_metal = point.baked.is_some_and(|baked| baked.metal != DVec3::ZERO);
    if is_metal { taken } else { DVec3::ZERO }
}

/// Returns the surface by which the irradiance of a light in the lightmap is found: its diffuse reflection is white.
fn white(point: &SurfacePoint) -> SurfaceSample {
    SurfaceSample { diffuse: DVec3::ONE, ..point.surface }
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

    /// Records the contribution of a light that adds ambient light alone, for which no shadow ray is needed.
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

/// Returns the distance to a light in metres, infinite for distant lights.
pub(crate) fn reach(placed: &PlacedLight, point: &SurfacePoint) -> f64 {
    match placed.light.kind {
        LightKind::Point => placed.position.distance(point.position),
        LightKind::Directional | LightKind::Ambient => f64::INFINITY,
    }
}

/// Returns the visibility of a polygon: the mean transmittance to a grid of points on it, weighted by their
/// light.
fn polygon_visibility(
    scene: &Scene,
    point: &SurfacePoint,
    origin: &RayOrigin,
    number: usize,
    media: &MediumStack,
) -> (DVec3, u32) {
    let light = &scene.polygons[number].light;
    let front = light.area_vector();
    let corners = [DVec3::ZERO, light.edge_u, light.edge_v].map(|edge| (light.corner + edge).abs());
    let extent = corners.into_iter().map(DVec3::max_element).fold(0.0, f64::max);
    let normal = front.normalize_or_zero();
    let surface = EndSurface { object: scene.polygons[number].emitter, normal, extent };
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
            // In proportion to the irradiance of the piece: its solid angle times the cosine at the surface.
            let part =
                (-to.dot(front) / distance.powi(3)).max(0.0) * to.dot(point.normal).max(0.0) / distance;
            if !(part > 0.0 && part.is_finite()) {
                continue;
            }
            let target = Target { distance, surface: Some(surface), glass: Glass::LetsThrough, bulbs: &[] };
            let ray = origin.towards(to / distance);
            let (mut visible, more) = transmittance(scene, &ray, &target, media);
            if visible != DVec3::ZERO {
                visible *= surface.uncovered_share(scene, &ray, distance);
            }
            (sum, weight, rays) = (sum + visible * part, weight + part, rays + more);
        }
    }
    // Where no point of the grid is above the horizon, the polygon's light is next to nothing and is not
    // shadowed.
    if weight > 0.0 { (sum / weight, rays) } else { (DVec3::ONE, rays) }
}
