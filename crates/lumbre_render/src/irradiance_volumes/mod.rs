//! The irradiance volumes of a World: which ones are usable, which of them lights an object, and their copies
//! on the GPU, created when a frame first needs them. How a surface reads a volume is in
//! shaders/irradiance_volume.wesl; whether it does is decided in `features`.

mod probe_texture;

use std::collections::HashMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemState;
use bevy_ecs::world::WorldId;
use glam::DVec3;
use lumbre_scene::{
    GlobalTransform, IrradianceVolume, IrradianceVolumeError, Name, VolumePlace, nearest_volume,
};

pub(crate) use probe_texture::{empty, layout};

use self::probe_texture::ProbeTexture;
use crate::Gpu;

type Found<'a> = (Entity, Ref<'a, IrradianceVolume>, Option<&'a GlobalTransform>, Option<&'a Name>);
type FoundQuery<'w, 's> = Query<'w, 's, Found<'static>>;

/// The volumes of the World that was drawn last.
#[derive(Default)]
pub(crate) struct IrradianceVolumes {
    state: Option<(WorldId, SystemState<FoundQuery<'static, 'static>>)>,
    known: HashMap<Entity, Volume>,
    /// The usable volumes in the order of their entities.
    usable: Vec<Usable>,
    uploaded: u64,
}

struct Volume {
    /// What is wrong with its data, regardless of its transform.
    fault: Option<IrradianceVolumeError>,
    /// Created when a frame first needs it.
    texture: Option<ProbeTexture>,
    seen: bool,
}

struct Usable {
    entity: Entity,
    place: VolumePlace,
    group: Option<Arc<wgpu::BindGroup>>,
}

impl IrradianceVolumes {
    /// Finds the volumes of a World, and adds messages about unusable ones to `left_out`.
    pub fn extract(&mut self, world: &mut World, left_out: &mut Vec<String>) {
        let id = world.id();
        let mut state = match self.state.take() {
            Some((known, state)) if known == id => state,
            _ => {
                self.known.clear();
                SystemState::new(world)
            }
        };
        self.usable.clear();
        self.known.values_mut().for_each(|volume| volume.seen = false);
        // A query cannot fail in any World.
        if let Ok(query) = state.get(world) {
            for (entity, volume, transform, name) in &query {
                if let Err(fault) = self.take(entity, &volume, transform) {
                    let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
                    left_out.push(format!("irradiance volume `{name}`: {fault}"));
                }
            }
        }
        self.known.retain(|_, volume| volume.seen);
        self.usable.sort_by_key(|usable| usable.entity.index_u32());
        self.state = Some((id, state));
    }

    /// Registers a volume, and adds it to the usable ones if it is valid.
    fn take(
        &mut self,
        entity: Entity,
        volume: &Ref<'_, IrradianceVolume>,
        transform: Option<&GlobalTransform>,
    ) -> Result<(), IrradianceVolumeError> {
        if volume.is_changed() {
            self.known.remove(&entity);
        }
        let new = || Volume { fault: volume.validate().err(), texture: None, seen: true };
        let known = self.known.entry(entity).or_insert_with(new);
        known.seen = true;
        if let Some(fault) = &known.fault {
            return Err(fault.clone());
        }
        let place = IrradianceVolume::place(volume.resolution, transform)?;
        self.usable.push(Usable { entity, place, group: None });
        Ok(())
    }

    /// Returns the number of usable volumes.
    pub fn len(&self) -> usize {
        self.usable.len()
    }

    /// Uploads the usable volumes, placed in the frame space with this origin.
    pub fn upload(&mut self, world: &World, gpu: &Gpu, layout: &wgpu::BindGroupLayout, origin: DVec3) {
        for usable in &mut self.usable {
            let volume = world.get::<IrradianceVolume>(usable.entity);
            let (Some(known), Some(volume)) = (self.known.get_mut(&usable.entity), volume) else { continue };
            let uploaded = &mut self.uploaded;
            let texture =
                known.texture.get_or_insert_with(|| ProbeTexture::new(gpu, layout, volume, uploaded));
            texture.stand(gpu, &usable.place, origin, &mut self.uploaded);
            usable.group = Some(Arc::clone(&texture.group));
        }
    }

    /// Returns the bytes uploaded since the last call.
    pub fn take_uploaded(&mut self) -> u64 {
        std::mem::take(&mut self.uploaded)
    }

    /// Returns the group of the volume that lights an object with this centre.
    pub fn around(&self, center: DVec3) -> Option<&Arc<wgpu::BindGroup>> {
        nearest_volume(&self.usable, |usable| &usable.place, center)?.group.as_ref()
    }
}
