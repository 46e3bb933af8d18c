//! Lights of a frame: those that are on and the faces of emissive objects, dynamic ones first. Which of them reach what is not decided here.

use std::borrow::Cow;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{Attenuation, BakeMode, Light, LightKind, SpotCone};
use lumbre_scene::{FrameSettings, GlobalTransform, LightCensus, Name, SceneSettings, light_place, shines};

use super::emitters::{EmissivePolygon, Emitters};
use super::shown_light::shown_light;
use crate::growable_buffer::GrowableBuffer;
use crate::layout::{InverseSquareLightData, LightData};
use crate::shadow_light::{MOST_VIEWS, ShadowKind, ShadowLight, light_size};
use crate::{LightLists, RenderError};

/// Most inverse-square lights that a uniform buffer of 64 KiB holds, which every device has, beside a black one.
pub(crate) const UNIFORM_LIGHTS: u32 = 1364;
/// Most inverse-square lights that 16 bits number, beside a black one; more of them are listed as other lights with a range are.
pub(crate) const NUMBERED_LIGHTS: usize = 65_535;
/// From so many lights with a range on they are listed by clusters: with two, finding the cluster costs about what it saves.
const CLUSTERED_LIGHTS: u32 = 3;

/// Lights of one class, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightCounts {
    /// Lights that are shaded in full.
    pub dynamic: u32,
    /// These and the lights that are baked into the lightmaps.
    pub all: u32,
    /// Whether a baked light has an ambient colour.
    pub static_ambient: bool,
    pub directional: bool,
    pub point: bool,
    pub spot: bool,
    /// Whether faces of emissive objects shine.
    pub polygon: bool,
    /// What has to be known of shadows.
    pub shadows: ShadowCounts,
}

/// Whether lights of a class cast shadows, and of which kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ShadowCounts {
    /// Lights that do.
    pub lights: u32,
    pub cubes: bool,
    pub cascades: bool,
    pub soft: bool,
}

/// What the shaders need to know of a frame's lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightSet {
    /// What they count as in the census.
    pub census: LightCensus,
    /// Sum of the ambient lights, which are in no class.
    pub ambient: Vec3,
    /// Lights of all classes.
    pub every: LightCounts,
    pub unbounded: LightCounts,
    pub inverse_square: LightCounts,
    pub ranged: LightCounts,
}

/// By what a light can be found, and what has to be asked of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightClass {
    /// It has no range, or is directional, or a polygon: it is in the lists of objects.
    Unbounded,
    /// A point light without a shadow, with a smooth cone or without one, of one colour, with the inverse square within a range, with or without a constant term
    /// beside it: what most lights of a game are.
    InverseSquare,
    /// Any other point light with a range: with a shadow, OpenGL's cone, a linear attenuation, or colours that differ.
    Ranged,
}

impl LightClass {
    /// Of a light that is not ambient.
    fn of(light: &Light) -> Self {
        let Attenuation { range, constant, linear, quadratic, clamp } = light.attenuation;
        if light.kind != LightKind::Point || !range.is_finite() {
            return Self::Unbounded;
        }
        // Numbers whose quotients are as good as they are.
        let inverse_square =
            linear == 0.0 && !clamp && (1e-3..=1e3).contains(&quadratic) && (0.0..=1e3).contains(&constant);
        let one_color = light.ambient == Vec3::ZERO && light.specular == light.diffuse;
        let narrowed = cone(light).is_some_and(|cone| !matches!(cone, SpotCone::Smooth { .. }));
        // What `attenuate_quadratic` takes.
        let usual_range = (1e-9..=1e15).contains(&range);
        match inverse_square && one_color && !narrowed && usual_range && !light.shadow {
            true => Self::InverseSquare,
            false => Self::Ranged,
        }
    }
}

/// The cone of a light, if it narrows it.
fn cone(light: &Light) -> Option<SpotCone> {
    light.spot.filter(|cone| !cone.is_everywhere())
}

impl LightCounts {
    fn add(&mut self, light: &Light) {
        self.dynamic += u32::from(light.bake != BakeMode::Static);
        self.all += 1;
        self.static_ambient |= light.bake == BakeMode::Static && light.ambient != Vec3::ZERO;
        self.directional |= light.kind == LightKind::Directional;
        self.point |= light.kind == LightKind::Point;
        self.spot |= cone(light).is_some();
        if let Some(kind) = ShadowKind::of(light).filter(|_| light.shadow) {
            self.shadows.lights += 1;
            self.shadows.cubes |= kind == ShadowKind::Cube;
            self.shadows.cascades |= kind == ShadowKind::Cascades;
            self.shadows.soft |= light_size(kind, light) > 0.0;
        }
    }

    /// Whether shaders for lights that count so know all of one that counts so by itself.
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
    /// The lights of a World, counted.
    ///
    /// # Errors
    /// [`RenderError::TooManyEmissiveFaces`].
    pub fn of(world: &mut World) -> Result<Self, RenderError> {
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
            set.add(light);
        }
        Ok(set)
    }

    /// With lightmaps switched off nothing counts as baked.
    pub fn without_lightmaps(mut self) -> Self {
        for counts in [&mut self.every, &mut self.unbounded, &mut self.inverse_square, &mut self.ranged] {
            counts.dynamic = counts.all;
        }
        self
    }

    /// With shadows switched off no light casts any.
    pub fn without_shadows(mut self) -> Self {
        for counts in [&mut self.every, &mut self.unbounded, &mut self.inverse_square, &mut self.ranged] {
            counts.shadows = ShadowCounts::default();
        }
        self
    }

    /// Whether fragments find lights with a range by clusters: with fewer, the lists of objects are as short.
    pub fn are_clustered(&self, lists: LightLists) -> bool {
        match lists {
            LightLists::Auto => self.inverse_square.all + self.ranged.all >= CLUSTERED_LIGHTS,
            LightLists::Clusters => true,
            LightLists::Objects | LightLists::Everything => false,
        }
    }

    /// By which lists the lights of a frame are found, and why, a line for each kind of list. `clustered` of `objects` shown ones have
    /// fragments that read clusters' lists.
    pub fn listing(&self, lists: LightLists, clustered: usize, objects: usize) -> Vec<String> {
        let (every, inverse_square, ranged) = (self.every.all, self.inverse_square.all, self.ranged.all);
        if every == 0 {
            return vec!["none: the scene has no lights but ambient ones".to_owned()];
        }
        let mut lines = Vec::new();
        let with_range = inverse_square + ranged;
        if clustered > 0 {
            lines.push(format!(
                "clusters: {with_range} lights with a range ({CLUSTERED_LIGHTS} are enough), for the fragments of {clustered} \
                 objects under Phong shading: {inverse_square} inverse-square ones of one colour in lean records, {ranged} others"
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

    /// Counts a light, and says of which class it is; an ambient one is of none. Baked lights are to come last: where numbers run out, the same
    /// lights have to go without one wherever they are counted.
    fn add(&mut self, light: &Light) -> Option<LightClass> {
        self.census.add(light);
        if light.kind == LightKind::Ambient {
            self.ambient += light.ambient;
            return None;
        }
        self.every.add(light);
        let class = match LightClass::of(light) {
            LightClass::InverseSquare if self.inverse_square.all as usize == NUMBERED_LIGHTS => {
                LightClass::Ranged
            }
            class => class,
        };
        let counts = match class {
            LightClass::Unbounded => &mut self.unbounded,
            LightClass::InverseSquare => &mut self.inverse_square,
            LightClass::Ranged => &mut self.ranged,
        };
        counts.add(light);
        Some(class)
    }
}

/// What the shaders of a frame know of lights: those of an earlier one, while others are being made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownLights<'a> {
    pub set: &'a LightSet,
    /// Fragments find lights with a range by clusters.
    pub clustered: bool,
    pub lightmaps: bool,
    pub shadows: bool,
}

impl KnownLights<'_> {
    /// A light as these shaders can show it, without its shadow if need be; nothing if they cannot. `so_far` counts those before it.
    fn shown<'l>(&self, light: &'l Light, so_far: &LightSet) -> Option<Cow<'l, Light>> {
        if light.kind == LightKind::Ambient {
            return Some(Cow::Borrowed(light));
        }
        let plain = Light { shadow: false, ..light.clone() };
        [Cow::Borrowed(light), Cow::Owned(plain)].into_iter().find(|light| {
            let mut own = LightCounts::default();
            own.add(light);
            if !self.shadows {
                own.shadows = ShadowCounts::default();
            }
            let baked = self.lightmaps && light.bake == BakeMode::Static;
            let class = LightClass::of(light);
            let of_class = match class {
                LightClass::Unbounded => &self.set.unbounded,
                LightClass::InverseSquare => &self.set.inverse_square,
                LightClass::Ranged => &self.set.ranged,
            };
            // The uniform buffer is as long as it is.
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

/// How far a light of the buffer goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightReach {
    pub class: LightClass,
    /// Of the ball that holds all it reaches, in the world; of a polygon light, its corner.
    pub center: DVec3,
    /// Of that ball, in metres; infinite for a light without a range.
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
    fn new(light: &Light, transform: &GlobalTransform, class: LightClass) -> Self {
        let (center, radius) = match light.kind {
            LightKind::Point => bounding_sphere(light, transform),
            LightKind::Ambient | LightKind::Directional => (transform.translation(), f64::INFINITY),
        };
        Self { class, center, radius, baked: light.bake == BakeMode::Static, polygon: None }
    }

    fn of_polygon(EmissivePolygon { light, emitter, baked }: &EmissivePolygon) -> Self {
        let reach = PolygonReach { front: light.area_vector(), emitter: *emitter };
        let (class, center) = (LightClass::Unbounded, light.corner);
        Self { class, center, radius: f64::INFINITY, baked: *baked, polygon: Some(reach) }
    }
}

impl LightReach {
    /// Whether it may light anything of an object with this bounding box in the world.
    pub fn touches(&self, entity: Entity, center: DVec3, half_size: DVec3) -> bool {
        if let Some(polygon) = self.polygon {
            return polygon.shines_on(self.center, entity, center, half_size);
        }
        let outside = ((self.center - center).abs() - half_size).max(DVec3::ZERO);
        self.radius.is_infinite() || outside.length() < self.radius
    }
}

impl PolygonReach {
    /// Whether anything of an object with this bounding box lies before the polygon with this corner, and the object is not its own.
    pub fn shines_on(&self, corner: DVec3, entity: Entity, center: DVec3, half_size: DVec3) -> bool {
        let farthest = (center - corner).dot(self.front) + half_size.dot(self.front.abs());
        self.emitter != entity && farthest > 0.0
    }
}

/// A light with all that the CPU may ask of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lamp {
    pub reach: LightReach,
    /// Nothing of a polygon light but that it shines.
    pub light: Light,
    pub position: DVec3,
    /// Unit: where it shines.
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

    /// The lights of a World that a frame would evaluate, with lightmaps and shadows or without.
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

/// Middle and radius of the smallest ball around all that a point light reaches: the ball of its range, or around a spotlight's part of it.
fn bounding_sphere(light: &Light, transform: &GlobalTransform) -> (DVec3, f64) {
    let (place, range) = (transform.translation(), f64::from(light.attenuation.range));
    let Some(cone) = cone(light).filter(|_| range.is_finite()) else { return (place, range) };
    // Rounded to f32 on the device, and strictly inside is lit: a little wider is enough.
    let cosine = (cone.cosines().outer - 1e-6).max(0.0);
    let sine = (1.0 - cosine * cosine).sqrt();
    let axis = transform.forward();
    match cosine > sine {
        // Through the apex and the rim of the cap.
        true => (place + axis * (0.5 * range / cosine), 0.5 * range / cosine),
        // Around the rim.
        false => (place + axis * (range * cosine), range * sine),
    }
}

/// The lights of a frame: what is counted of them, and one entry of each list for each light, dynamic ones first.
#[derive(Debug, Default)]
pub(crate) struct SceneLights {
    pub set: LightSet,
    pub reaches: Vec<LightReach>,
    /// Those of the class, in the order of `reaches`.
    pub inverse_square: Vec<InverseSquareLightData>,
    /// Those that cast shadows.
    pub shadows: Vec<ShadowLight>,
    /// One for each of `reaches`, where they are asked for.
    pub lamps: Vec<Lamp>,
}

/// Where the lights of a frame go, and what is wanted of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightPlace<'a> {
    /// Of frame space, in the world.
    pub origin: DVec3,
    /// Only what these can show is lit.
    pub known: Option<KnownLights<'a>>,
    /// [`SceneLights::lamps`] are wanted.
    pub lamps: bool,
    /// Where lights end, and whether their size shows.
    pub settings: FrameSettings,
}

/// Writes the lights that are on and not black; entities in order, so that sums are the same every time. Those whose numbers are out of
/// range are `left_out`, each with a sentence; with `known`, those that its shaders cannot show stay dark.
///
/// # Errors
/// [`RenderError::TooManyEmissiveFaces`].
pub(crate) fn extract_lights(
    world: &mut World,
    emitters: &mut Emitters,
    buffer: &mut GrowableBuffer<LightData>,
    LightPlace { origin, known, lamps, settings }: LightPlace<'_>,
    left_out: &mut Vec<String>,
) -> Result<SceneLights, RenderError> {
    let mut scene = SceneLights::default();
    let mut polygons = emitters.polygons(world)?;
    polygons.retain(|polygon| known.is_none_or(|known| known.shows_polygon(polygon)));
    polygons.iter().for_each(|polygon| scene.set.add_polygon(polygon));
    let mut query = world.query::<(Entity, &Light, Option<&GlobalTransform>)>();
    let mut found: Vec<_> = query
        .iter(world)
        .filter_map(|(entity, light, transform)| {
            let place = light_place(light, transform);
            left_out.extend(fault(world, entity, light, place.as_ref()));
            let shines = shines(light, transform);
            scene.set.census.lights_off += usize::from(!shines);
            place.filter(|_| shines).map(|place| (entity, shown_light(light, &settings), place))
        })
        .collect();
    found.sort_by_key(|(entity, _, _)| entity.index_u32());
    // Stable: within both halves the order stays.
    found.sort_by_key(|(_, light, _)| light.bake == BakeMode::Static);
    let baked = found.iter().position(|(_, light, _)| light.bake == BakeMode::Static).unwrap_or(found.len());
    let (dynamic, baked) = found.split_at(baked);
    let mut data = Vec::with_capacity(found.len() + polygons.len());
    let mut views = 0;
    for (lights, of_baked) in [(dynamic, false), (baked, true)] {
        for (entity, light, place) in lights {
            let shown = match &known {
                Some(known) => known.shown(light, &scene.set),
                None => Some(Cow::Borrowed(&**light)),
            };
            let Some(light) = &shown else { continue };
            let Some(class) = scene.set.add(light) else { continue };
            if class == LightClass::InverseSquare {
                scene.inverse_square.push(InverseSquareLightData::new(light, place, origin));
            }
            let reach = LightReach::new(light, place, class);
            scene.reaches.push(reach);
            if lamps {
                scene.lamps.push(Lamp::new(light, place, reach));
            }
            let shadow = ShadowLight::new(*entity, light, place, views);
            if shadow.is_none() && light.shadow {
                let name = world.get::<Name>(*entity).map_or_else(|| entity.to_string(), ToString::to_string);
                left_out.push(format!(
                    "the shadow of light \"{name}\": shadows have room for {MOST_VIEWS} views, and a point light needs six"
                ));
            }
            data.push(LightData::new(light, place, origin, shadow.as_ref().map_or(0, ShadowLight::flags)));
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
        // Where all of a class are gone its lists are read still, and find a black one: `ClusterBuffers::build`.
        data.push(LightData::default());
    }
    buffer.replace(data);
    Ok(scene)
}

/// What a World asks of its frames.
fn frame_settings(world: &World) -> FrameSettings {
    world.get_resource::<SceneSettings>().map_or_else(FrameSettings::default, |settings| settings.frame)
}

/// What is wrong with a light that is on, by name; nothing as a rule.
fn fault(world: &World, entity: Entity, light: &Light, place: Option<&GlobalTransform>) -> Option<String> {
    if !light.enabled || place.is_some_and(|place| place.0.is_finite()) && light.validate("").is_ok() {
        return None;
    }
    let name = world.get::<Name>(entity).map_or_else(|| entity.to_string(), ToString::to_string);
    Some(match (light.validate(&name), place) {
        (Err(error), _) => error.to_string(),
        (Ok(()), None) => {
            format!("light \"{name}\": it has no Transform, so that it stands nowhere; spawn it with one")
        }
        (Ok(()), Some(_)) => format!("light \"{name}\": its transform is not finite"),
    })
}

#[cfg(test)]
mod tests {
    use lumbre_scene::Transform;

    use super::*;

    #[test]
    fn the_ball_around_a_cone_holds_what_it_lights_and_no_more() {
        let transform = Transform::from_xyz(1.0, 2.0, 3.0).looking_at(DVec3::new(-1.0, 0.5, 2.0), DVec3::Y);
        let place = GlobalTransform(transform.affine());
        let axis = place.forward();
        let side = axis.any_orthonormal_vector();
        for outer in [0.01_f32, 0.5, 0.785, 0.786, 1.2, 1.57] {
            let attenuation = Attenuation { range: 4.0, ..Attenuation::INVERSE_SQUARE };
            let cone = SpotCone::Smooth { inner: 0.0, outer };
            let (center, radius) =
                bounding_sphere(&Light { attenuation, ..Light::spot(Vec3::ONE, cone) }, &place);
            // Its farthest points: the apex, the middle and the rim of the cap.
            let rim = |angle: f64| axis * angle.cos() + side * angle.sin();
            let outer = f64::from(outer);
            let mut farthest: f64 = if outer < 0.786 { center.distance(place.translation()) } else { 0.0 };
            for step in 0..=100 {
                let at = place.translation() + rim(outer * (f64::from(step) / 50.0 - 1.0)) * 4.0;
                farthest = farthest.max(center.distance(at));
            }
            assert!(center.distance(place.translation()) <= radius * (1.0 + 1e-12), "{outer}");
            assert!(farthest <= radius + 1e-9, "{outer}: {farthest} is outside of {radius}");
            assert!(radius < farthest * (1.0 + 1e-4), "{outer}: {radius} is wider than {farthest}");
        }
    }

    #[test]
    fn lights_beyond_the_last_number_are_found_without_one() {
        let attenuation = Attenuation { range: 3.0, ..Attenuation::INVERSE_SQUARE };
        let lamp = Light { attenuation, ..Light::point(Vec3::ONE) };
        let mut set = LightSet::default();
        for _ in 0..NUMBERED_LIGHTS {
            assert_eq!(set.add(&lamp), Some(LightClass::InverseSquare));
        }
        assert_eq!(set.add(&Light { bake: BakeMode::Static, ..lamp }), Some(LightClass::Ranged));
        assert_eq!((set.inverse_square.dynamic, set.ranged.all, set.ranged.dynamic), (65_535, 1, 0));
        assert_eq!(set.add(&Light::ambient(Vec3::X)), None);
        assert_eq!((set.ambient, set.every.all), (Vec3::X, 65_536));
    }

    #[test]
    fn lights_are_classed_by_what_has_to_be_asked_of_them() {
        let ranged = Attenuation { range: 3.0, ..Attenuation::INVERSE_SQUARE };
        let lamp = Light { attenuation: ranged, ..Light::point(Vec3::ONE) };
        assert_eq!(LightClass::of(&lamp), LightClass::InverseSquare);
        let smooth = Some(SpotCone::Smooth { inner: 0.1, outer: 0.2 });
        let softened = Attenuation { constant: 0.1, quadratic: 1.2, ..ranged };
        for other in [Light { spot: smooth, ..lamp.clone() }, Light { attenuation: softened, ..lamp.clone() }]
        {
            assert_eq!(LightClass::of(&other), LightClass::InverseSquare, "{other:?}");
        }
        let cone = Some(SpotCone::Exponent { cutoff: 0.2, exponent: 3.0 });
        let linear = Attenuation { linear: 0.1, ..ranged };
        let faint = Attenuation { quadratic: 1e-6, ..ranged };
        let clamped = Attenuation { clamp: true, ..ranged };
        let tiny = Attenuation { range: 1e-12, ..ranged };
        for other in [
            Light { spot: cone, ..lamp.clone() },
            Light { ambient: Vec3::X, ..lamp.clone() },
            Light { specular: Vec3::ZERO, ..lamp.clone() },
            Light { shadow: true, ..lamp.clone() },
            Light { attenuation: linear, ..lamp.clone() },
            Light { attenuation: faint, ..lamp.clone() },
            Light { attenuation: clamped, ..lamp.clone() },
            Light { attenuation: tiny, ..lamp.clone() },
        ] {
            assert_eq!(LightClass::of(&other), LightClass::Ranged, "{other:?}");
        }
        for other in [Light::point(Vec3::ONE), Light { kind: LightKind::Directional, ..lamp }] {
            assert_eq!(LightClass::of(&other), LightClass::Unbounded, "{other:?}");
        }
    }
}
