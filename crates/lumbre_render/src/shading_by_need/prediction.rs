//! The errors that flat and Gouraud shading would have on an object, from the lights that reach it. Not which of them is taken.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};
use lumbre_optics::{
    ConeOverObject, Highlight, InterpolationError, LightKind, LightOverObject, MINIMUM_COSINE_DIFFERENCE,
    ReflectionModel, SpotCone, Surface, interpolation_error,
};

use super::Conditions;
use super::need::Reason;
use super::surface::LitSurface;
use crate::extract::{CameraView, Lamp};
use crate::shader::Feature;
use crate::texture_sets;

/// A prediction is made for all eyes within this part of the distance to the object: a camera that moves seldom asks for another.
const ROOM: f64 = 0.2;
/// Radians by which cones are taken wider than they are, for roundings of the device.
const MARGIN: f64 = 1e-3;

/// What there is to say of one object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prediction {
    pub reason: Reason,
    /// Of flat and of Gouraud shading against Phong shading, in radiance: no pixel and channel is farther.
    pub errors: [f64; 2],
    /// How far the eye may go from where it was, in metres.
    room: f64,
}

impl Prediction {
    pub fn new<'l>(
        surface: &LitSurface<'_>,
        conditions: &Conditions,
        view: &CameraView,
        lamps: impl Iterator<Item = &'l Lamp>,
    ) -> Self {
        let nothing = |reason| Self { reason, errors: [0.0; 2], room: f64::INFINITY };
        let unknown = |reason| Self { errors: [f64::INFINITY; 2], ..nothing(reason) };
        let traits = surface.traits;
        let has =
            |feature| texture_sets::features(traits.texture_mask).any(|(of, bound)| bound && of == feature);
        if traits.unlit {
            return nothing(Reason::Unlit);
        }
        if has(Feature::MetallicRoughnessTexture) {
            return unknown(Reason::MetallicRoughnessTexture);
        }
        if conditions.irradiance_volumes && traits.is_lit_by_irradiance_volume() {
            return unknown(Reason::IrradianceVolume);
        }
        let scenes = conditions.settings.reflection;
        let model = conditions.reflection.or(traits.reflection).unwrap_or(scenes);
        let viewer = Viewer::new(surface, conditions, view);
        let sides = Sides::new(surface, conditions);
        let (mut over, mut polygon) = (Vec::new(), false);
        for lamp in lamps {
            polygon |= lamp.reach.polygon.is_some();
            over.extend(
                over_object(lamp, surface, &sides, &viewer, model)
                    .filter(|light| light.ambient > 0.0 || light.diffuse > 0.0 || light.specular > 0.0),
            );
        }
        if polygon {
            return unknown(Reason::PolygonLight);
        }
        if over.is_empty() {
            return nothing(Reason::NoLight);
        }
        if has(Feature::NormalTexture) {
            return unknown(Reason::NormalTexture);
        }
        if traits.vertex_color {
            return unknown(Reason::VertexColors);
        }
        if conditions.specular_antialiasing && traits.specular {
            return unknown(Reason::SpecularAntialiasing);
        }
        let of_vertices = conditions.clamp.then(|| {
            let modulated = has(Feature::BaseColorTexture) || has(Feature::OcclusionTexture);
            ClampedVertices { constant: sides.constant(conditions), modulated }
        });
        let mut errors = [0.0_f64; 2];
        for triangle in surface.triangles() {
            let rule = conditions.settings.flat_rule;
            let one = over.iter().map(|light| interpolation_error(light, &triangle, rule));
            let all = one.fold(InterpolationError::default(), |sum, one| sum + one);
            let [flat, gouraud] = of_vertices.as_ref().map_or([all.flat, all.gouraud], |of| of.errors(&all));
            // Infinity times 0: nothing is known.
            let known = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
            errors = [errors[0].max(known(flat)), errors[1].max(known(gouraud))];
        }
        let room = if over.iter().any(|light| light.specular > 0.0) { viewer.room } else { f64::INFINITY };
        Self { reason: Reason::Predicted, errors, room }
    }

    /// Whether what was predicted from an eye holds in a view.
    pub fn holds_from(&self, eye: DVec3, backward: DVec3, view: &CameraView, local_viewer: bool) -> bool {
        if self.room.is_infinite() {
            return true;
        }
        match local_viewer {
            true => (view.eye - eye).length() <= self.room,
            false => view.basis.z_axis == backward,
        }
    }
}

/// The eye, with room to move.
struct Viewer {
    room: f64,
    /// From the nearest eye to the nearest point.
    distance: f64,
    /// From the object's middle, and how far from it that of any point and eye may be.
    direction: DVec3,
    half_angle: f64,
}

impl Viewer {
    fn new(surface: &LitSurface<'_>, conditions: &Conditions, view: &CameraView) -> Self {
        if !conditions.settings.local_viewer {
            let direction = view.basis.z_axis;
            return Self { room: 0.0, distance: f64::INFINITY, direction, half_angle: 0.0 };
        }
        let way = view.eye - surface.center;
        let distance = way.length();
        let room = ROOM * (distance - surface.radius).max(0.0);
        Self {
            room,
            distance: (surface.distances(view.eye)[0] - room).max(0.0),
            direction: way.try_normalize().unwrap_or(DVec3::Y),
            half_angle: surface.half_angle(distance, room),
        }
    }
}

/// The larger coefficients of the sides that are seen.
struct Sides {
    seen: [Surface; 2],
    /// Both sides are lit.
    both: bool,
    lightmapped: bool,
}

impl Sides {
    fn new(surface: &LitSurface<'_>, conditions: &Conditions) -> Self {
        let front = surface.reflectance.front;
        let both = surface.traits.double_sided && conditions.settings.two_sided;
        let back = surface.reflectance.back.filter(|_| both).unwrap_or(front);
        let lightmapped = conditions.lightmaps && surface.traits.is_lit_by_lightmap();
        Self { seen: [front, back], both, lightmapped }
    }

    /// The largest channel of a coefficient times a colour.
    fn reflected(&self, color: Vec3, coefficient: fn(&Surface) -> Vec3) -> f64 {
        let of = |side: &Surface| f64::from((coefficient(side) * color).abs().max_element());
        of(&self.seen[0]).max(of(&self.seen[1]))
    }

    /// The largest of what is there without lights.
    fn constant(&self, conditions: &Conditions) -> f64 {
        let ambient = conditions.settings.ambient_with_sky();
        self.reflected(ambient, |side| side.ambient) + self.reflected(Vec3::ONE, |side| side.emission)
    }
}

/// Vertices of OpenGL's display: their colours are clamped before they are interpolated and before a texture weakens them.
struct ClampedVertices {
    constant: f64,
    modulated: bool,
}

impl ClampedVertices {
    fn errors(&self, all: &InterpolationError) -> [f64; 2] {
        let beyond = (self.constant + all.brightest - 1.0).max(0.0);
        let lost = if self.modulated { beyond } else { 0.0 };
        // An upper limit has a corner, as the terminator has.
        let corner = if beyond > 0.0 { 0.25 * all.change } else { 0.0 };
        [all.flat + lost, all.gouraud + lost + corner]
    }
}

/// What a lamp can do on an object; nothing if it does not light it.
fn over_object(
    lamp: &Lamp,
    surface: &LitSurface<'_>,
    sides: &Sides,
    viewer: &Viewer,
    model: ReflectionModel,
) -> Option<LightOverObject> {
    let light = &lamp.light;
    let directional = light.kind == LightKind::Directional;
    let way = lamp.position - surface.center;
    let (distances, direction, half_angle) = match directional {
        true => ([f64::INFINITY; 2], -lamp.axis, 0.0),
        false => {
            let direction = way.try_normalize().unwrap_or(DVec3::Y);
            (surface.distances(lamp.position), direction, surface.half_angle(way.length(), 0.0))
        }
    };
    if !directional && distances[0] >= f64::from(light.attenuation.range) {
        return None;
    }
    let cone = match light.spot.filter(|cone| !cone.is_everywhere()) {
        _ if light.shadow => ConeOverObject::Step,
        None => ConeOverObject::Everywhere,
        Some(cone) => cone_over(cone, lamp.axis.angle_between(-direction), half_angle)?,
    };
    let facing = surface.normals().map_or(Facing::Anywhere, |normals| {
        let (angle, room) = (normals.axis.angle_between(direction), normals.half_angle + half_angle + MARGIN);
        match () {
            () if angle + room < FRAC_PI_2 => Facing::Front,
            () if angle - room > FRAC_PI_2 => Facing::Back,
            () => Facing::Anywhere,
        }
    });
    let dark = facing == Facing::Back && !sides.both;
    let of = |lit: bool, color: Vec3, coefficient: fn(&Surface) -> Vec3| {
        if lit && !dark { sides.reflected(color, coefficient) } else { 0.0 }
    };
    // The brighter highlight, and the sharper one: of two sides none is sharper than this or brighter.
    let shininess = |side: &Surface| f64::from(side.shininess_in_range());
    let [front, back] = sides.seen.each_ref().map(shininess);
    let between = viewer.direction.angle_between(direction) + viewer.half_angle + half_angle;
    Some(LightOverObject {
        ambient: sides.reflected(light.ambient, |side| side.ambient),
        diffuse: of(!(lamp.reach.baked && sides.lightmapped), light.diffuse, |side| side.diffuse),
        specular: of(true, light.specular, |side| side.specular),
        highlight: Highlight { model, lobe: surface.reflectance.lobe, shininess: front.max(back) },
        attenuation: light.attenuation,
        distances,
        cone: if front == back { cone } else { ConeOverObject::Step },
        viewer_distance: viewer.distance,
        light_to_viewer: between.min(PI),
        terminator: facing == Facing::Anywhere,
    })
}

/// Where normals look, as a light has it.
#[derive(Clone, Copy, PartialEq)]
enum Facing {
    Front,
    Back,
    Anywhere,
}

/// A cone over an object whose middle is so far from its axis, in radians, and which fills such a half angle; none if it is dark there.
fn cone_over(cone: SpotCone, angle: f64, half_angle: f64) -> Option<ConeOverObject> {
    let (least, most) = (angle - half_angle - MARGIN, angle + half_angle + MARGIN);
    if least > f64::from(cone.outer_angle()) {
        return None;
    }
    Some(match cone {
        SpotCone::Smooth { inner, .. } if most < f64::from(inner) => ConeOverObject::Everywhere,
        SpotCone::Smooth { .. } => {
            let cosines = cone.cosines();
            let width = (cosines.inner_or_exponent - cosines.outer).max(MINIMUM_COSINE_DIFFERENCE);
            ConeOverObject::Slope(2.0 / width)
        }
        SpotCone::Exponent { cutoff, .. } if most >= f64::from(cutoff) => ConeOverObject::Step,
        SpotCone::Exponent { exponent, .. } => match f64::from(exponent) {
            0.0 => ConeOverObject::Everywhere,
            ..1.0 => ConeOverObject::Step,
            exponent => ConeOverObject::Slope(exponent),
        },
    })
}
