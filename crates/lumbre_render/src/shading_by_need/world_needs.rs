//! Shading by need for a whole World, without a device and regardless of what is in view, for `explain`.

use std::collections::HashMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use lumbre_mesh::SurfaceSpread;
use lumbre_optics::{ErrorBound, Shading};
use lumbre_scene::{GlobalTransform, Mesh, ObjectComponents, ObjectTraits, hidden_entities};

use super::evaluations::{Evaluations, MeshSize, Place};
use super::prediction::Prediction;
use super::{Conditions, LitSurface, SizedView, chosen};
use crate::extract::{CameraView, Lamp, Reflectance, find_camera, world_box};
use crate::mesh_buffers::mesh_box;
use crate::shading_need::{Chosen, ShadingNeed};
use crate::{FrameOptions, RenderError};

/// The choices for the objects of a World, each made when it is asked for.
#[derive(Default)]
pub(crate) struct WorldNeeds {
    /// In the order of `lumbre_scene::shown_objects`.
    objects: Vec<ShownObject>,
    lamps: Vec<Lamp>,
    seen: Option<(Conditions, SizedView)>,
    chosen: Vec<Chosen>,
}

struct ShownObject {
    entity: Entity,
    traits: ObjectTraits,
    reflectance: Reflectance,
    mesh: Mesh,
    spread: Arc<SurfaceSpread>,
    place: GlobalTransform,
}

impl WorldNeeds {
    /// Collects the objects of a World that are not hidden, for a frame of this size. Global transforms must
    /// be up to date. Without a camera, all objects take Phong shading.
    ///
    /// # Errors
    /// [`RenderError::TooManyEmissiveFaces`].
    pub fn of(
        world: &mut World,
        conditions: &Conditions,
        options: &FrameOptions,
        size: [u32; 2],
    ) -> Result<Self, RenderError> {
        let lamps = Lamp::of(world, options.lightmaps, options.shadows)?;
        let hidden = hidden_entities(world);
        let mut spreads: HashMap<usize, Arc<SurfaceSpread>> = HashMap::new();
        let mut query = world.query::<(Entity, ObjectComponents)>();
        let shown = query.iter(world).filter(|(entity, _)| !hidden.contains(entity));
        let objects = shown.map(|(entity, components)| {
            let (mesh, material, ..) = components.0;
            let spread = spreads
                .entry(Arc::as_ptr(&mesh.0) as usize)
                .or_insert_with(|| Arc::new(SurfaceSpread::of(&mesh.0)));
            ShownObject {
                entity,
                traits: ObjectTraits::new(components),
                reflectance: Reflectance::of(material),
                mesh: mesh.clone(),
                spread: Arc::clone(spread),
                place: world.get::<GlobalTransform>(entity).copied().unwrap_or_default(),
            }
        });
        let objects = objects.collect();
        let aspect = f64::from(size[0]) / f64::from(size[1].max(1));
        let view =
            find_camera(world, options.camera).and_then(|camera| CameraView::new(world, camera, aspect));
        let seen = view.ok().map(|view| {
            let exposure = options.exposure.unwrap_or(view.exposure);
            (*conditions, SizedView { view, size, exposure })
        });
        Ok(Self { objects, lamps, seen, chosen: Vec::new() })
    }

    /// Chooses the shading of the object with this index.
    pub fn choose(&mut self, number: usize, max_error: ErrorBound) -> Shading {
        let (Some(object), Some((conditions, view))) = (self.objects.get(number), &self.seen) else {
            return Shading::Phong;
        };
        let (center, half_size) = mesh_box(&object.mesh.0);
        let (center, half_size, radius) = world_box(center, half_size, &object.place);
        let predict = |enough| {
            let surface = LitSurface::new(&object.traits, object.reflectance, &object.spread, object.place.0);
            let reaching =
                self.lamps.iter().filter(|lamp| lamp.reach.touches(object.entity, center, half_size));
            Prediction::new(&surface, conditions, &view.view, enough, reaching)
        };
        let place = Place { center, half_size, radius };
        let mesh =
            MeshSize { vertices: object.mesh.0.positions.len(), triangles: object.mesh.0.triangle_count() };
        let evaluations = Evaluations::new(&object.traits, &conditions.settings, place, mesh, view);
        let lit = !self.lamps.is_empty() && !object.traits.unlit;
        let chosen = chosen(&evaluations, lit, view.exposure, max_error, predict);
        self.chosen.push(chosen);
        chosen.shading
    }

    /// Returns the choices so far, grouped.
    pub fn groups(&self) -> Vec<ShadingNeed> {
        ShadingNeed::group(&self.chosen)
    }
}
