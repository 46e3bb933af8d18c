//! What a bake reads from the World, once, before it computes anything. Not the scene as light meets it: that is `triangles`.

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::Vec3;

use super::{Canonical, Object, PlacedLight, WantedProbes, collect, lights, sky, world_points};
use crate::BakeError;

/// What a bake reads from the World.
pub(crate) struct Input {
    /// Everything static, in an order that does not depend on the World's.
    pub objects: Arc<Vec<Object>>,
    /// The lights that are baked, world space.
    pub lights: Vec<PlacedLight>,
    /// Radiance of the sky, W/(m² sr).
    pub sky: Vec3,
    pub wanted_probes: WantedProbes,
}

impl Input {
    /// Reads the World, whose global transforms it brings up to date.
    ///
    /// # Errors
    /// [`BakeError`], which names the object or light.
    pub fn read(world: &mut World) -> Result<Self, BakeError> {
        let objects = Arc::new(collect(world)?);
        let (lights, sky) = (lights(world), sky(world));
        let wanted_probes = WantedProbes::of(world, &objects);
        Ok(Self { objects, lights, sky, wanted_probes })
    }

    /// The space in which a bake of it computes.
    pub fn space(&self) -> Canonical {
        let parts = self.objects.iter().flat_map(|object| &object.primitives);
        Canonical::of(parts.flat_map(|part| world_points(&part.transform, &part.mesh)))
    }
}
