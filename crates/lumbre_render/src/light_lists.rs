//! Light lists per object: which lights reach which object, found by the object's bounding box and the
//! light's range, or the plane that a polygon light shines from. The lists are exact, not an approximation: a
//! light is left out only if its range window is 0 on the whole object, or if no part of the object lies in
//! front of the polygon. An emitter's own faces do not light it, because rounding would decide which side of
//! them it lies on. Lists are per object rather than per screen tile, so that vertices outside the view,
//! which Gouraud shading evaluates, keep their light.

use std::collections::HashMap;

use bevy_ecs::entity::Entity;
use glam::DVec3;

use crate::RenderError;
use crate::extract::{LightClass, LightReach};
use crate::layout::InstanceData;
use crate::light_grid::LightGrid;

/// Bytes of one index on the device.
const INDEX_BYTES: u64 = size_of::<u32>() as u64;

/// Lists of light indices. Objects that are reached by the same lights share a list.
#[derive(Debug)]
pub(crate) struct ObjectLightLists<'a> {
    reaches: &'a [LightReach],
    everything: bool,
    /// Created when the first list is built.
    grid: Option<LightGrid>,
    near: Vec<u32>,
    /// Lights that are in no cluster's list.
    unbounded: Vec<u32>,
    /// All lists, one after the other.
    pub indices: Vec<u32>,
    known: HashMap<Vec<u32>, InstanceData>,
    lengths: (u64, u64),
    /// Number of indices that the device can hold, and number that is needed. Indices beyond the first number
    /// are not stored, and [`check`](Self::check) fails.
    most: u64,
    needed: u64,
}

impl<'a> ObjectLightLists<'a> {
    /// Creates empty lists. Baked lights come last in `reaches`; the device's buffer holds `bytes`. With
    /// `everything`, each list has every light.
    pub fn new(reaches: &'a [LightReach], everything: bool, bytes: u64) -> Self {
        let most = (bytes / INDEX_BYTES).min(u64::from(u32::MAX));
        let unbounded = (0..).zip(reaches).filter(|(_, light)| light.class == LightClass::Unbounded);
        let unbounded = unbounded.map(|(index, _)| index).collect();
        Self {
            reaches,
            everything,
            grid: None,
            near: Vec::new(),
            unbounded,
            indices: Vec::new(),
            known: HashMap::new(),
            lengths: (0, 0),
            most,
            needed: 0,
        }
    }

    /// Returns the empty list of an object whose fragments use clusters (`clustered`), if every light is in
    /// those. The object's bounds are not needed then.
    pub fn empty_if_clustered(&mut self, clustered: bool) -> Option<InstanceData> {
        (clustered && self.unbounded.is_empty()).then(|| {
            self.lengths.1 += 1;
            InstanceData::default()
        })
    }

    /// Returns the list of an object with this bounding box in the world (its `object` is 0). If the object's
    /// fragments use clusters (`clustered`), the list has only the lights that are in no cluster.
    pub fn reaching(
        &mut self,
        entity: Entity,
        center: DVec3,
        half_size: DVec3,
        clustered: bool,
    ) -> InstanceData {
        let list: Vec<u32> = if clustered {
            let touches = |index: &u32| self.reaches[*index as usize].touches(entity, center, half_size);
            self.unbounded.iter().copied().filter(touches).collect()
        } else {
            self.lights_of(entity, center, half_size).collect()
        };
        self.lengths = (self.lengths.0 + list.len() as u64, self.lengths.1 + 1);
        if let Some(known) = self.known.get(&list) {
            return *known;
        }
        self.needed += list.len() as u64;
        if self.needed > self.most {
            return InstanceData::default();
        }
        // `most` fits into a u32, so the counts do, too.
        let end = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let first_light = end(self.indices.len());
        let dynamic = list.iter().filter(|index| !self.reaches[**index as usize].baked).count();
        self.indices.extend_from_slice(&list);
        let instance = InstanceData::lit_by(first_light, first_light + end(dynamic), end(self.indices.len()));
        self.known.insert(list, instance);
        instance
    }

    /// Returns the lights that reach an object with this bounding box in the world, in ascending order. With
    /// `everything`, these are all lights except polygons that do not shine on the object.
    pub fn lights_of(
        &mut self,
        entity: Entity,
        center: DVec3,
        half_size: DVec3,
    ) -> impl Iterator<Item = u32> + use<'_, 'a> {
        let everything = self.everything;
        if everything {
            self.near.clear();
            self.near.extend(0..u32::try_from(self.reaches.len()).unwrap_or(u32::MAX));
        } else {
            let grid = self.grid.get_or_insert_with(|| LightGrid::new(self.reaches));
            grid.near(center, half_size, &mut self.near);
        }
        let reaches = self.reaches;
        let reached = move |light: &LightReach| match light.polygon {
            Some(polygon) => polygon.shines_on(light.center, entity, center, half_size),
            None => everything || light.touches(entity, center, half_size),
        };
        self.near.iter().copied().filter(move |index| reached(&reaches[*index as usize]))
    }

    /// Checks that all lists fit into the device's buffer. Silently dropping a light would give a wrong
    /// picture.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`].
    pub fn check(&self) -> Result<(), RenderError> {
        if self.needed <= self.most {
            return Ok(());
        }
        let what = "light lists (each object has one of the lights whose range reaches it; give lights a shorter range)";
        let (bytes, limit) = (self.needed * INDEX_BYTES, self.most * INDEX_BYTES);
        Err(RenderError::BufferTooLarge { what, bytes, limit })
    }

    /// Returns the average length of the objects' lists.
    pub fn mean_length(&self) -> f32 {
        self.lengths.0 as f32 / self.lengths.1.max(1) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::PolygonReach;

    #[test]
    fn an_object_gets_the_lights_whose_range_touches_it_baked_ones_last() {
        let light = |x: f64, radius, baked| LightReach {
            class: LightClass::Ranged,
            center: DVec3::new(x, 0.0, 0.0),
            radius,
            cone: None,
            baked,
            polygon: None,
        };
        let object = Entity::PLACEHOLDER;
        let reaches = [
            light(0.0, 2.0, false),
            light(100.0, f64::INFINITY, false),
            light(10.0, 2.0, false),
            light(1.0, 1.0, true),
            light(30.0, 1.0, true),
        ];
        let mut lists = ObjectLightLists::new(&reaches, false, u64::MAX);
        let near = lists.reaching(object, DVec3::ZERO, DVec3::splat(0.5), false);
        assert_eq!(lists.indices, [0, 1, 3]);
        assert_eq!((near.first_light, near.dynamic_end, near.static_end), (0, 2, 3));
        let far = lists.reaching(object, DVec3::new(11.0, 0.0, 0.0), DVec3::splat(0.5), false);
        assert_eq!(lists.indices, [0, 1, 3, 1, 2]);
        assert_eq!((far.first_light, far.dynamic_end, far.static_end), (3, 5, 5));
        // The same lights give the same list.
        assert_eq!(lists.reaching(object, DVec3::new(0.1, 0.0, 0.0), DVec3::splat(0.5), false), near);
        assert_eq!(lists.indices.len(), 5);
        // A box that only touches the sphere meets it where the window is already 0.
        assert_eq!(lists.reaching(object, DVec3::new(-3.0, 0.0, 0.0), DVec3::ONE, false).static_end, 6);
    }

    #[test]
    fn lists_beyond_the_devices_buffer_are_refused_and_not_stored() {
        let light = |x: f64| LightReach {
            class: LightClass::Ranged,
            center: DVec3::X * x,
            radius: 1.5,
            cone: None,
            baked: false,
            polygon: None,
        };
        let reaches: Vec<LightReach> = (0..10).map(|x| light(f64::from(x))).collect();
        // Two lights reach each point halfway between neighbours, so each object has a list of its own.
        let fill = |objects: u32, bytes: u64| {
            let mut lists = ObjectLightLists::new(&reaches, false, bytes);
            for object in 0..objects {
                let middle = DVec3::X * (f64::from(object) + 0.5);
                lists.reaching(Entity::PLACEHOLDER, middle, DVec3::ZERO, false);
            }
            (lists.indices.len(), lists.check())
        };
        assert_eq!(fill(1, u64::MAX).0, 2);
        let (stored, fits) = fill(8, 4 * 16);
        assert!(stored == 16 && fits.is_ok(), "{fits:?}");
        let (stored, refused) = fill(9, 4 * 16);
        assert_eq!(stored, 16, "nothing is stored past the limit");
        let Err(RenderError::BufferTooLarge { bytes, limit, .. }) = refused else { panic!("{refused:?}") };
        assert_eq!((bytes, limit), (72, 64));
    }

    #[test]
    fn a_polygon_reaches_what_lies_before_it_and_is_not_its_own() {
        let [lamp, other] = [1, 2].map(|index| Entity::from_raw_u32(index).unwrap());
        let polygon = Some(PolygonReach { front: DVec3::new(0.0, -1e-3, 0.0), emitter: lamp });
        let light = LightReach {
            class: LightClass::Unbounded,
            center: DVec3::Y * 2.0,
            radius: f64::INFINITY,
            cone: None,
            baked: false,
            polygon,
        };
        let reaches = [light];
        let mut lists = ObjectLightLists::new(&reaches, false, u64::MAX);
        let mut count = |entity, y: f64, half: f64| {
            let list = lists.reaching(entity, DVec3::Y * y, DVec3::splat(half), false);
            list.static_end - list.first_light
        };
        assert_eq!(count(other, 0.0, 0.5), 1);
        assert_eq!(count(lamp, 0.0, 0.5), 0);
        assert_eq!(count(other, 3.0, 0.5), 0);
        // It touches the plane with its lowest face, so nothing of it is lit. A little lower, something is.
        assert_eq!(count(other, 2.5, 0.5), 0);
        assert_eq!(count(other, 2.49, 0.5), 1);
    }
}
