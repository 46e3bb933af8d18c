//! Lights of a frame: those that are on and the faces of emissive objects, dynamic ones first. Which of them reach what is not decided here.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{BakeMode, Light, LightKind};
use lumbre_scene::{GlobalTransform, Name};

use super::emitters::{EmissivePolygon, Emitters};
use crate::RenderError;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::LightData;

/// What the shaders need to know of a frame's lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightSet {
    /// Lights that are shaded in full.
    pub dynamic: u32,
    /// These and the lights that are baked into the lightmaps.
    pub all: u32,
    /// Sum of the ambient lights.
    pub ambient: Vec3,
    /// Whether a baked light has an ambient colour.
    pub static_ambient: bool,
    pub directional: bool,
    pub point: bool,
    pub spot: bool,
    /// Whether faces of emissive objects shine.
    pub polygon: bool,
}

impl LightSet {
    /// The lights of a World, counted.
    ///
    /// # Errors
    /// [`RenderError::TooManyEmissiveFaces`].
    pub fn of(world: &mut World) -> Result<Self, RenderError> {
        let mut set = Self::default();
        Emitters::default().polygons(world)?.iter().for_each(|polygon| set.add_polygon(polygon));
        let mut query = world.query::<(&Light, &GlobalTransform)>();
        query
            .iter(world)
            .filter(|(light, transform)| shines(light, transform))
            .for_each(|(light, _)| set.add(light));
        Ok(set)
    }

    fn add_polygon(&mut self, polygon: &EmissivePolygon) {
        self.dynamic += u32::from(!polygon.baked);
        self.all += 1;
        self.polygon = true;
    }

    fn add(&mut self, light: &Light) {
        if light.kind == LightKind::Ambient {
            self.ambient += light.ambient;
            return;
        }
        self.dynamic += u32::from(light.bake != BakeMode::Static);
        self.all += 1;
        self.static_ambient |= light.bake == BakeMode::Static && light.ambient != Vec3::ZERO;
        self.directional |= light.kind == LightKind::Directional;
        self.point |= light.kind == LightKind::Point;
        self.spot |= light.spot.is_some_and(|cone| !cone.is_everywhere());
    }
}

/// How far a light of the buffer goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightReach {
    /// In the world.
    pub center: DVec3,
    /// Metres; infinite for a light without a range.
    pub radius: f64,
    /// Baked into the lightmaps in use.
    pub baked: bool,
    /// Of a polygon light: the plane that it shines from.
    pub polygon: Option<PolygonReach>,
}

/// Where a polygon light shines: before its plane, on everything but the object whose face it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolygonReach {
    /// Of any length, to the front.
    pub front: DVec3,
    pub emitter: Entity,
}

impl LightReach {
    fn new(light: &Light, transform: &GlobalTransform) -> Self {
        let radius = match light.kind {
            LightKind::Point => f64::from(light.attenuation.range),
            LightKind::Ambient | LightKind::Directional => f64::INFINITY,
        };
        let baked = light.bake == BakeMode::Static;
        Self { center: transform.translation(), radius, baked, polygon: None }
    }

    fn of_polygon(EmissivePolygon { light, emitter, baked }: &EmissivePolygon) -> Self {
        let reach = PolygonReach { front: light.area_vector(), emitter: *emitter };
        Self { center: light.corner, radius: f64::INFINITY, baked: *baked, polygon: Some(reach) }
    }
}

/// Writes the lights that are on and not black; entities in order, so that sums are the same every time. Those whose numbers are out of
/// range are `left_out`, each with a sentence.
///
/// # Errors
/// [`RenderError::TooManyEmissiveFaces`].
pub(crate) fn extract_lights(
    world: &mut World,
    emitters: &mut Emitters,
    buffer: &mut GrowableBuffer<LightData>,
    origin: DVec3,
    left_out: &mut Vec<String>,
) -> Result<(LightSet, Vec<LightReach>), RenderError> {
    let mut set = LightSet::default();
    let polygons = emitters.polygons(world)?;
    polygons.iter().for_each(|polygon| set.add_polygon(polygon));
    let mut query = world.query::<(Entity, &Light, &GlobalTransform)>();
    let mut found: Vec<_> = query
        .iter(world)
        .filter(|(entity, light, transform)| {
            left_out.extend(fault(world, *entity, light, transform));
            shines(light, transform)
        })
        .collect();
    found.sort_by_key(|(entity, _, _)| entity.index_u32());
    found.iter().for_each(|(_, light, _)| set.add(light));
    found.retain(|(_, light, _)| light.kind != LightKind::Ambient);
    let lights = found.iter().map(|(_, light, transform)| {
        (LightReach::new(light, transform), LightData::new(light, transform, origin))
    });
    let polygons = polygons
        .iter()
        .map(|polygon| (LightReach::of_polygon(polygon), LightData::polygon(&polygon.light, origin)));
    let mut all: Vec<(LightReach, LightData)> = lights.chain(polygons).collect();
    // Stable: within both halves the order stays.
    all.sort_by_key(|(reach, _)| reach.baked);
    buffer.replace(all.iter().map(|(_, data)| *data));
    Ok((set, all.into_iter().map(|(reach, _)| reach).collect()))
}

/// What is wrong with a light that is on, by name; nothing as a rule.
fn fault(world: &World, entity: Entity, light: &Light, transform: &GlobalTransform) -> Option<String> {
    if !light.enabled || transform.0.is_finite() && light.validate("").is_ok() {
        return None;
    }
    let name = world.get::<Name>(entity).map_or_else(|| entity.to_string(), ToString::to_string);
    Some(match light.validate(&name) {
        Err(error) => error.to_string(),
        Ok(()) => format!("light \"{name}\": its transform is not finite"),
    })
}

/// Whether a light adds anything; one whose numbers are out of range is left out rather than let into a frame.
fn shines(light: &Light, transform: &GlobalTransform) -> bool {
    let colors = [light.ambient, light.diffuse, light.specular];
    let placed = transform.0.is_finite();
    placed
        && light.enabled
        && colors.iter().any(|color| *color != Vec3::ZERO)
        && light.validate("light").is_ok()
}
