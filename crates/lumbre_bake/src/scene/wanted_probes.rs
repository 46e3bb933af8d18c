//! What the World asks of the probes: whether something moves, and where. Not the probes.

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_scene::{ChildOf, DynamicObject, EmissiveLight, GlobalTransform, Mesh, hidden_entities};

use super::{Object, under_a_dynamic_object, world_points};
use crate::BakeOptions;
use crate::options::Probes;

/// What the World asks of the probes.
pub(crate) struct WantedProbes {
    /// Corners of what moves, world space.
    pub moving: Vec<DVec3>,
    any: bool,
    /// By the index of its material in the scene, whether a surface is a polygon light in a frame.
    pub real_time: Vec<bool>,
}

impl WantedProbes {
    /// Reads the World.
    pub fn of(world: &mut World, objects: &[Object]) -> Self {
        let hidden = hidden_entities(world);
        let mut query =
            world
                .query::<(Entity, &Mesh, Option<&GlobalTransform>, Option<&DynamicObject>, Option<&ChildOf>)>(
                );
        let (mut moving, mut any) = (Vec::new(), false);
        let shown = query.iter(world).filter(|object| !hidden.contains(&object.0));
        for (_, mesh, transform, dynamic, parent) in shown {
            if dynamic.is_some() || under_a_dynamic_object(world, parent) {
                any = true;
                let transform = transform.copied().unwrap_or_default();
                moving.extend(world_points(&transform.0, &mesh.0));
            }
        }
        let parts = objects.iter().flat_map(|object| &object.primitives);
        let real_time = parts.map(|part| world.get::<EmissiveLight>(part.entity).is_some()).collect();
        Self { moving, any, real_time }
    }

    /// Whether probes are called for, or why not.
    pub fn are(&self, options: &BakeOptions) -> Result<(), &'static str> {
        match options.probes {
            Probes::Never => Err("they are switched off"),
            Probes::Automatic if !self.any => Err("nothing moves"),
            Probes::Automatic | Probes::Always => Ok(()),
        }
    }

    /// Corners of the box around what moves, world space; infinite and turned inside out if there is nothing.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let finite = self.moving.iter().filter(|point| point.is_finite());
        finite.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &point| {
            (low.min(point), high.max(point))
        })
    }
}
