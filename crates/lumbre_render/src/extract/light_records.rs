//! The records of lights that are kept between frames: the device's data of a light and how far it reaches. A
//! record is computed again only if its entity, the origin of frame space or the scene's settings changed.
//! Which lights a frame has, and how they are counted, is decided in `lights`.

use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemState;
use bevy_ecs::world::WorldId;
use glam::DVec3;
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{FrameSettings, GlobalTransform, Name, ShadowFilter, light_place, shines};

use super::entity_slots::EntitySlots;
use super::light_reach::{LightClass, LightReach};
use super::shown_light::shown_light;
use crate::layout::{InverseSquareLightData, LightData};

/// A light that shines.
#[derive(Clone, Debug)]
pub(super) struct LightRecord {
    pub entity: Entity,
    /// The light as frames show it.
    pub light: Light,
    pub place: GlobalTransform,
    /// Its class is the one without the limit on 16-bit indices.
    pub reach: LightReach,
    /// Without the flags of its shadow.
    pub data: LightData,
    /// Set for an inverse-square light, with a shadow or without.
    pub inverse_square: Option<InverseSquareLightData>,
}

impl LightRecord {
    pub fn new(entity: Entity, light: Light, place: GlobalTransform, origin: DVec3) -> Self {
        let class = LightClass::of(&light);
        let inverse_square = matches!(class, LightClass::InverseSquare | LightClass::Shadowed)
            .then(|| InverseSquareLightData::new(&light, &place, origin));
        let reach = LightReach::new(&light, &place, class);
        Self { entity, data: LightData::new(&light, &place, origin), reach, inverse_square, light, place }
    }

    fn is_baked(&self) -> bool {
        self.light.bake == BakeMode::Static
    }
}

/// A light, whether it shines or not.
#[derive(Debug, Default)]
struct Kept {
    /// Set if it shines.
    record: Option<LightRecord>,
    /// What is wrong with it.
    fault: Option<String>,
    has_place: bool,
    /// Number of the last update that found it.
    seen: u64,
}

type Lights<'w, 's> = Query<'w, 's, (Entity, Ref<'static, Light>, Option<Ref<'static, GlobalTransform>>)>;
type Names<'w, 's> = Query<'w, 's, &'static Name>;
type Extraction = SystemState<(Lights<'static, 'static>, Names<'static, 'static>)>;

/// Keeps the lights of one World at a time.
#[derive(Default)]
pub(crate) struct LightRecords {
    state: Option<(WorldId, Extraction)>,
    kept: EntitySlots<Kept>,
    /// Origin of frame space and light settings that the records were computed for.
    made_for: Option<(DVec3, f32, bool, ShadowFilter)>,
    updates: u64,
    /// Slots of the lights that shine: dynamic ones first, then in the order of their entities, so that sums
    /// are the same every time.
    order: Vec<(bool, u32, usize)>,
}

impl LightRecords {
    /// Brings the records up to date. Lights with invalid data are left out, each with a message in
    /// `left_out`.
    pub fn update(
        &mut self,
        world: &mut World,
        origin: DVec3,
        settings: &FrameSettings,
        left_out: &mut Vec<String>,
    ) {
        if self.state.as_ref().is_none_or(|(id, _)| *id != world.id()) {
            *self = Self { state: Some((world.id(), SystemState::new(world))), ..Self::default() };
        }
        self.updates += 1;
        let made_for = Some((origin, settings.light_threshold, settings.shadows, settings.shadow_filter));
        let remade = std::mem::replace(&mut self.made_for, made_for) != made_for;
        self.order.clear();
        let Some((id, mut state)) = self.state.take() else { return };
        if let Ok((lights, names)) = state.get(world) {
            for (entity, light, place) in &lights {
                let slot = self.kept.of(entity);
                let kept = self.kept.values[slot].get_or_insert_default();
                let moved = place.as_ref().is_some_and(Ref::is_changed) || place.is_some() != kept.has_place;
                // A faulty light is always checked again, because its message contains its name, which may
                // change.
                if remade || kept.seen == 0 || moved || light.is_changed() || kept.fault.is_some() {
                    let transform = place.as_deref();
                    kept.has_place = transform.is_some();
                    kept.fault = fault(&names, entity, &light, transform);
                    let place = light_place(&light, transform).filter(|_| shines(&light, transform));
                    let shown = || shown_light(&light, settings).into_owned();
                    kept.record = place.map(|place| LightRecord::new(entity, shown(), place, origin));
                }
                kept.seen = self.updates;
                left_out.extend(kept.fault.clone());
                if let Some(record) = &kept.record {
                    self.order.push((record.is_baked(), entity.index_u32(), slot));
                }
            }
        }
        self.state = Some((id, state));
        self.order.sort_unstable();
        let updates = self.updates;
        self.kept.release(|kept| kept.seen == updates, drop);
    }

    /// Returns the lights that shine, either the dynamic or the baked ones, in the order of their entities.
    pub(super) fn shining(&self, baked: bool) -> impl Iterator<Item = &LightRecord> {
        let begin = if baked { self.order.partition_point(|(baked, ..)| !baked) } else { 0 };
        let of_kind = self.order[begin..].iter().take_while(move |(of, ..)| *of == baked);
        of_kind.filter_map(|(_, _, slot)| self.kept.values[*slot].as_ref()?.record.as_ref())
    }

    /// Returns how many lights shine, and how many do not.
    pub fn counts(&self) -> (usize, usize) {
        (self.order.len(), self.kept.len() - self.order.len())
    }
}

/// Returns a message with the light's name if something is wrong with a light that is switched on.
fn fault(
    names: &Names<'_, '_>,
    entity: Entity,
    light: &Light,
    place: Option<&GlobalTransform>,
) -> Option<String> {
    let place = light_place(light, place);
    if !light.enabled || place.is_some_and(|place| place.0.is_finite()) && light.validate("").is_ok() {
        return None;
    }
    let name = names.get(entity).map_or_else(|_| entity.to_string(), ToString::to_string);
    Some(match (light.validate(&name), place) {
        (Err(error), _) => error.to_string(),
        (Ok(()), None) => {
            format!("light \"{name}\": it has no Transform, so that it stands nowhere; spawn it with one")
        }
        (Ok(()), Some(_)) => format!("light \"{name}\": its transform is not finite"),
    })
}
