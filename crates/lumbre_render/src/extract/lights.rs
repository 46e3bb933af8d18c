//! The lights of a frame: those that are switched on and the faces of emissive objects, dynamic ones first.
//! Which of them reach which object is decided in `light_lists` and `light_clusters`.

use std::borrow::Cow;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{BakeMode, Light, LightKind};
use lumbre_scene::{FrameSettings, GlobalTransform, LightCensus, Name, SceneSettings, shines};

use super::emitters::{EmissivePolygon, Emitters};
use super::light_reach::{LightClass, LightReach, cone};
use super::light_records::{LightRecord, LightRecords};
use super::shown_light::shown_light;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::{InverseSquareLightData, LightData};
use crate::shadow_light::{MAX_VIEWS, ShadowKind, ShadowLight, light_size};
use crate::{LightLists, RenderError};

/// Largest number of inverse-square lights, besides a black one, in a uniform buffer of 64 KiB, which every
/// device supports.
pub(crate) const UNIFORM_LIGHTS: u32 = 1364;
/// Largest number of inverse-square lights that 16-bit indices allow, besides a black one. Further ones are
/// listed like other lights with a range.
pub(crate) const NUMBERED_LIGHTS: usize = 65_535;
/// With at least this many lights with a range, clusters are used. With two, finding the cluster costs about
/// what it saves.
const CLUSTERED_LIGHTS: u32 = 3;

/// Counts of the lights of one class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightCounts {
    /// Number of lights that are shaded in full.
    pub dynamic: u32,
    /// Number of these lights and of those that are baked into the lightmaps.
    pub all: u32,
    /// Whether a baked light has an ambient colour.
    pub static_ambient: bool,
    pub directional: bool,
    pub point: bool,
    pub spot: bool,
    /// Whether there are faces of emissive objects.
    pub polygon: bool,
    /// What the shaders have to know about shadows.
    pub shadows: ShadowCounts,
}

/// Whether lights of a class cast shadows, and of which kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ShadowCounts {
    /// Number of lights with a shadow.
    pub lights: u32,
    pub cubes: bool,
    pub cascades: bool,
    pub soft: bool,
}

/// What the shaders have to know about a frame's lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightSet {
    /// The lights as the census counts them.
    pub census: LightCensus,
    /// Sum of the ambient lights, which belong to no class.
    pub ambient: Vec3,
    /// The lights of all classes.
    pub every: LightCounts,
    pub unbounded: LightCounts,
    pub inverse_square: LightCounts,
    pub shadowed: LightCounts,
    pub ranged: LightCounts,
    /// Number of shadow views of the lights so far.
    shadow_views: usize,
}

impl LightCounts {
    fn add(&mut self, light: &Light) {
        self.dynamic += u32::from(light.bake != BakeMode::Static);
        self.all += 1;
        self.static_ambient |= light.bake == BakeMode::Static && light.ambient != Vec3::ZERO;
        self.directional |= light.kind == LightKind::Directional;
        self.point |= light.kind == LightKind::Point;
        self.spot |= cone(light).is_some();
        if light.shadow
            && let Some(kind) = ShadowKind::of(light)
        {
            self.shadows.lights += 1;
            self.shadows.cubes |= kind == ShadowKind::Cube;
            self.shadows.cascades |= kind == ShadowKind::Cascades;
            self.shadows.soft |= light_size(kind, light) > 0.0;
        }
    }

    /// Returns true if shaders for lights with these counts support a single light with the counts `own`.
    fn knows(&self, own: &Self, baked: bool) -> bool {
        let there = match baked {
            true => self.all > self.dynamic && (self.static_ambient || !own.static_ambient),
            false => self.dynamic > 0,
        };
        let kinds = [
            (own.directional, self.directional),
            (own.point, self.point),
            (own.spot, self.spot),
            (own.polygon, self.polygon),
            (own.shadows.lights > 0, self.shadows.lights > 0),
            (own.shadows.cubes, self.shadows.cubes),
            (own.shadows.cascades, self.shadows.cascades),
            (own.shadows.soft, self.shadows.soft),
        ];
        there && kinds.iter().all(|(own, known)| !own || *known)
    }

    fn add_polygon(&mut self, polygon: &EmissivePolygon) {
        self.dynamic += u32::from(!polygon.baked);
        self.all += 1;
        self.polygon = true;
    }
}

impl LightSet {
    /// Counts the lights of a World, for frames with or without shadows.
    ///
    /// # Errors
    /// [`RenderError::TooManyEmissiveFaces`].
    pub fn of(world: &mut World, shadows: bool) -> Result<Self, RenderError> {
        let mut set = Self::default();
        Emitters::default().polygons(world)?.iter().for_each(|polygon| set.add_polygon(polygon));
        let settings = frame_settings(world);
        let mut query = world.query::<(&Light, Option<&GlobalTransform>)>();
        let mut found: Vec<Cow<'_, Light>> = query
            .iter(world)
            .filter(|(light, transform)| {
                let shines = shines(light, *transform);
                set.census.lights_off += usize::from(!shines);
                shines
            })
            .map(|(light, _)| shown_light(light, &settings))
            .collect();
        found.sort_by_key(|light| light.bake == BakeMode::Static);
        for light in &found {
            set.add(light, LightClass::of(light).in_frames(shadows));
        }
        Ok(if shadows { set } else { set.without_shadows() })
    }

    /// Returns the counts with lightmaps switched off, so that no light counts as baked.
    pub fn without_lightmaps(mut self) -> Self {
        self.every_class().for_each(|counts| counts.dynamic = counts.all);
        self
    }

    /// Returns the counts with shadows switched off.
    pub fn without_shadows(mut self) -> Self {
        self.every_class().for_each(|counts| counts.shadows = ShadowCounts::default());
        self
    }

    fn every_class(&mut self) -> impl Iterator<Item = &mut LightCounts> {
        let Self { every, unbounded, inverse_square, shadowed, ranged, .. } = self;
        [every, unbounded, inverse_square, shadowed, ranged].into_iter()
    }

    /// Returns the number of lights that clusters can list.
    pub fn with_range(&self) -> u32 {
        self.inverse_square.all + self.shadowed.all + self.ranged.all
    }

    /// Returns true if fragments find lights with a range by clusters. With few lights, the lists of objects
    /// are just as short.
    pub fn are_clustered(&self, lists: LightLists) -> bool {
        match lists {
            LightLists::Auto => self.with_range() >= CLUSTERED_LIGHTS,
            LightLists::Clusters => true,
            LightLists::Objects | LightLists::Everything => false,
        }
    }

    /// Describes which lists the lights of a frame are found by, and why, with one line for each kind of
    /// list. `clustered` of `objects` objects have fragments that use clusters.
    pub fn listing(&self, lists: LightLists, clustered: usize, objects: usize) -> Vec<String> {
        let (every, inverse_square, ranged) = (self.every.all, self.inverse_square.all, self.ranged.all);
        let (with_range, shadowed) = (self.with_range(), self.shadowed.all);
        if every == 0 {
            return vec!["none: the scene has no lights but ambient ones".to_owned()];
        }
        let mut lines = Vec::new();
        if clustered > 0 {
            lines.push(format!(
                "clusters: {with_range} lights with a range ({CLUSTERED_LIGHTS} are enough), for the fragments of {clustered} \
                 objects under Phong shading: {inverse_square} inverse-square ones of one colour in lean records, {shadowed} such \
                 lights with a shadow, {ranged} others"
            ));
        }
        let why = match (lists, self.are_clustered(lists), clustered) {
            (LightLists::Everything, ..) => "every light for every object, as was asked".to_owned(),
            (LightLists::Objects, ..) => format!("{every} lights, as was asked"),
            (_, false, _) => {
                format!("{every} lights, {with_range} with a range: fewer than {CLUSTERED_LIGHTS}")
            }
            (_, true, 0) => {
                format!("{every} lights: no object is under Phong shading")
            }
            (_, true, _) => {
                let apart = objects - clustered;
                let unbounded = self.unbounded.all;
                format!(
                    "{unbounded} lights without a range or with a shape; and all {every} for {apart} objects that no fragment lights"
                )
            }
        };
        lines.push(format!("objects: {why}"));
        lines
    }

    fn add_polygon(&mut self, polygon: &EmissivePolygon) {
        self.every.add_polygon(polygon);
        self.unbounded.add_polygon(polygon);
    }

    fn has_room_for(&self, views: usize) -> bool {
        self.shadow_views + views <= MAX_VIEWS
    }

    /// The class that a light of some class has after those that are counted: the numbers of compact records and of
    /// shadows are limited.
    fn class_of(&self, light: &Light, class: LightClass) -> LightClass {
        match class {
            LightClass::Shadowed if !self.has_room_for(shadow_views(light)) => LightClass::Ranged,
            LightClass::InverseSquare if self.inverse_square.all as usize == NUMBERED_LIGHTS => {
                LightClass::Ranged
            }
            class => class,
        }
    }

    /// Counts a light and returns the class that it has in this frame; `None` for an ambient light. Baked
    /// lights must come last, so that the same lights go without a 16-bit index wherever lights are counted.
    fn add(&mut self, light: &Light, class: LightClass) -> Option<LightClass> {
        self.census.add(light);
        if light.kind == LightKind::Ambient {
            self.ambient += light.ambient;
            return None;
        }
        self.every.add(light);
        let class = self.class_of(light, class);
        let views = shadow_views(light);
        self.shadow_views += if self.has_room_for(views) { views } else { 0 };
        let counts = match class {
            LightClass::Unbounded => &mut self.unbounded,
            LightClass::InverseSquare => &mut self.inverse_square,
            LightClass::Shadowed => &mut self.shadowed,
            LightClass::Ranged => &mut self.ranged,
        };
        counts.add(light);
        Some(class)
    }
}

/// The number of views that a light's shadow takes; 0 for a light without one.
fn shadow_views(light: &Light) -> usize {
    ShadowKind::of(light).filter(|_| light.shadow).map_or(0, ShadowKind::views)
}

/// What the shaders of an earlier frame support, while new ones are being created.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownLights<'a> {
    pub set: &'a LightSet,
    /// Whether fragments find lights with a range by clusters.
    pub clustered: bool,
    pub lightmaps: bool,
    pub shadows: bool,
}

impl KnownLights<'_> {
    /// Returns a light in the way these shaders can show it, without its shadow if necessary; `None` if they
    /// cannot. `so_far` counts the lights before it.
    fn shown<'l>(
        &self,
        record: &'l LightRecord,
        so_far: &LightSet,
        origin: DVec3,
    ) -> Option<Cow<'l, LightRecord>> {
        if record.light.kind == LightKind::Ambient {
            return Some(Cow::Borrowed(record));
        }
        let without_shadow = || {
            let light = Light { shadow: false, ..record.light.clone() };
            Cow::Owned(LightRecord::new(record.entity, light, record.place, origin))
        };
        let plain = std::iter::once_with(without_shadow).filter(|_| record.light.shadow);
        std::iter::once(Cow::Borrowed(record)).chain(plain).find(|record| {
            let light = &record.light;
            let mut own = LightCounts::default();
            own.add(light);
            if !self.shadows {
                own.shadows = ShadowCounts::default();
            }
            let baked = self.lightmaps && light.bake == BakeMode::Static;
            let class = so_far.class_of(light, record.reach.class.in_frames(self.shadows));
            let of_class = match class {
                LightClass::Unbounded => &self.set.unbounded,
                LightClass::InverseSquare => &self.set.inverse_square,
                LightClass::Shadowed => &self.set.shadowed,
                LightClass::Ranged => &self.set.ranged,
            };
            // The size of the uniform buffer is fixed.
            let full = class == LightClass::InverseSquare
                && self.set.inverse_square.all <= UNIFORM_LIGHTS
                && so_far.inverse_square.all >= UNIFORM_LIGHTS;
            self.set.every.knows(&own, baked) && (!self.clustered || of_class.knows(&own, baked) && !full)
        })
    }

    fn shows_polygon(&self, polygon: &EmissivePolygon) -> bool {
        let mut own = LightCounts::default();
        own.add_polygon(polygon);
        let baked = self.lightmaps && polygon.baked;
        self.set.every.knows(&own, baked) && (!self.clustered || self.set.unbounded.knows(&own, baked))
    }
}

/// A light with everything that CPU code needs of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lamp {
    pub reach: LightReach,
    /// For a polygon light, this only says that it shines.
    pub light: Light,
    pub position: DVec3,
    /// Direction that it shines in, of unit length.
    pub axis: DVec3,
}

impl Lamp {
    fn new(light: &Light, transform: &GlobalTransform, reach: LightReach) -> Self {
        Self { reach, light: light.clone(), position: transform.translation(), axis: transform.forward() }
    }

    fn of_polygon(polygon: &EmissivePolygon) -> Self {
        let (reach, position) = (LightReach::of_polygon(polygon), polygon.light.corner);
        Self { reach, light: Light::point(Vec3::ONE), position, axis: DVec3::NEG_Z }
    }

    /// Returns the lights of a World that a frame would evaluate, with or without lightmaps and shadows.
    ///
    /// # Errors
    /// [`RenderError::TooManyEmissiveFaces`].
    pub fn of(world: &mut World, lightmaps: bool, shadows: bool) -> Result<Vec<Self>, RenderError> {
        let polygons = Emitters::default().polygons(world)?;
        let settings = frame_settings(world);
        let mut query = world.query::<(&Light, Option<&GlobalTransform>)>();
        let shining = query
            .iter(world)
            .filter(|(light, transform)| light.kind != LightKind::Ambient && shines(light, *transform));
        let mut lamps: Vec<Self> = shining
            .filter_map(|(light, transform)| {
                let light = shown_light(light, &settings);
                let light = Light { shadow: light.shadow && shadows, ..light.into_owned() };
                let transform = transform?;
                let reach = LightReach::new(&light, transform, LightClass::of(&light));
                Some(Self::new(&light, transform, reach))
            })
            .chain(polygons.iter().map(Self::of_polygon))
            .collect();
        lamps.iter_mut().for_each(|lamp| lamp.reach.baked &= lightmaps);
        Ok(lamps)
    }
}

/// The lights of a frame: their counts, and one entry in each list for each light, dynamic ones first.
#[derive(Debug, Default)]
pub(crate) struct SceneLights {
    pub set: LightSet,
    pub reaches: Vec<LightReach>,
    /// The records of inverse-square lights, in the order of `reaches`.
    pub inverse_square: Vec<InverseSquareLightData>,
    /// The lights that cast shadows.
    pub shadows: Vec<ShadowLight>,
    /// One for each of `reaches`, if they were asked for.
    pub lamps: Vec<Lamp>,
}

impl SceneLights {
    /// Leaves out what a frame without lightmaps or without shadows does not distinguish.
    pub fn limit_to(&mut self, lightmaps: bool, shadows: bool) {
        if !lightmaps {
            self.set = self.set.without_lightmaps();
            self.reaches.iter_mut().for_each(|reach| reach.baked = false);
            self.lamps.iter_mut().for_each(|lamp| lamp.reach.baked = false);
        }
        if !shadows {
            self.set = self.set.without_shadows();
            self.shadows.clear();
            self.lamps.iter_mut().for_each(|lamp| lamp.light.shadow = false);
        }
    }
}

/// How the lights of a frame are extracted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightPlace<'a> {
    /// Origin of frame space in the world.
    pub origin: DVec3,
    /// If set, only lights that these shaders can show are extracted.
    pub known: Option<KnownLights<'a>>,
    /// Whether [`SceneLights::lamps`] are needed.
    pub lamps: bool,
    /// Whether the frame has shadows.
    pub shadows: bool,
    /// Settings for where lights end and whether their size matters.
    pub settings: FrameSettings,
}

/// Extracts the lights that are on and not black, in the order of their entities, so that sums are the same
/// every time. Lights with invalid data are left out, each with a message in `left_out`. With `known`, lights
/// that its shaders cannot show stay dark.
///
/// # Errors
/// [`RenderError::TooManyEmissiveFaces`].
pub(crate) fn extract_lights(
    world: &mut World,
    (emitters, records): (&mut Emitters, &mut LightRecords),
    buffer: &mut GrowableBuffer<LightData>,
    LightPlace { origin, known, lamps, shadows, settings }: LightPlace<'_>,
    left_out: &mut Vec<String>,
) -> Result<SceneLights, RenderError> {
    let mut scene = SceneLights::default();
    let mut polygons = emitters.polygons(world)?;
    polygons.retain(|polygon| known.is_none_or(|known| known.shows_polygon(polygon)));
    polygons.iter().for_each(|polygon| scene.set.add_polygon(polygon));
    records.update(world, origin, &settings, left_out);
    let (shining, off) = records.counts();
    scene.set.census.lights_off = off;
    scene.reaches.reserve(shining + polygons.len());
    let mut data = Vec::with_capacity(shining + polygons.len() + 1);
    let mut views = 0;
    for of_baked in [false, true] {
        for record in records.shining(of_baked) {
            let shown = match &known {
                Some(known) => known.shown(record, &scene.set, origin),
                None => Some(Cow::Borrowed(record)),
            };
            let Some(record) = shown.as_deref() else { continue };
            let LightRecord { entity, light, place, .. } = record;
            let class = record.reach.class.in_frames(shadows);
            let Some(class) = scene.set.add(light, class) else { continue };
            if class == LightClass::InverseSquare {
                scene.inverse_square.extend(record.inverse_square);
            }
            let reach = LightReach { class, ..record.reach };
            scene.reaches.push(reach);
            if lamps {
                scene.lamps.push(Lamp::new(light, place, reach));
            }
            let mut shadow = ShadowLight::new(*entity, light, place, views);
            if let Some(shadow) = shadow.as_mut().filter(|_| class == LightClass::Shadowed) {
                shadow.compact = record.inverse_square;
            }
            if shadow.is_none() && light.shadow {
                let name = world.get::<Name>(*entity).map_or_else(|| entity.to_string(), ToString::to_string);
                left_out.push(format!(
                    "the shadow of light \"{name}\": shadows have room for {MAX_VIEWS} views, and a point light needs six"
                ));
            }
            data.push(record.data.with_shadow(shadow.as_ref().map_or(0, ShadowLight::flags)));
            views += shadow.as_ref().map_or(0, ShadowLight::views);
            scene.shadows.extend(shadow);
        }
        for polygon in polygons.iter().filter(|polygon| polygon.baked == of_baked) {
            scene.reaches.push(LightReach::of_polygon(polygon));
            if lamps {
                scene.lamps.push(Lamp::of_polygon(polygon));
            }
            data.push(LightData::polygon(&polygon.light, origin));
        }
    }
    if known.is_some() {
        // If all lights of a class are gone, the shaders still read its lists and find a black light; see
        // `ClusterBuffers::build`.
        data.push(LightData::default());
    }
    buffer.replace(data);
    Ok(scene)
}

/// Returns the settings of a World's frames.
fn frame_settings(world: &World) -> FrameSettings {
    world.get_resource::<SceneSettings>().map_or_else(FrameSettings::default, |settings| settings.frame)
}

#[cfg(test)]
mod tests {
    use lumbre_optics::Attenuation;

    use super::*;

    #[test]
    fn lights_beyond_the_last_number_are_found_without_one() {
        let attenuation = Attenuation { range: 3.0, ..Attenuation::INVERSE_SQUARE };
        let lamp = Light { attenuation, ..Light::point(Vec3::ONE) };
        let mut set = LightSet::default();
        for _ in 0..NUMBERED_LIGHTS {
            assert_eq!(set.add(&lamp, LightClass::InverseSquare), Some(LightClass::InverseSquare));
        }
        let baked = Light { bake: BakeMode::Static, ..lamp };
        assert_eq!(set.add(&baked, LightClass::InverseSquare), Some(LightClass::Ranged));
        assert_eq!((set.inverse_square.dynamic, set.ranged.all, set.ranged.dynamic), (65_535, 1, 0));
        assert_eq!(set.add(&Light::ambient(Vec3::X), LightClass::Unbounded), None);
        assert_eq!((set.ambient, set.every.all), (Vec3::X, 65_536));
    }
}
