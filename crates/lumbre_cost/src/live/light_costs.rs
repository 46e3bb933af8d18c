//! Measures what the lights of a view cost and contribute, by drawing frames with each light, or each group
//! of lights, switched off in turn. The cost is measured and not derived from a model.
//!
//! Where there are many lights, a picture without each of them finds those that contribute most, which are then
//! timed one by one; the others are timed in groups, so that every light is in one of them.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_optics::{Light, LightKind};
use lumbre_render::{FrameOptions, RenderError};
use lumbre_scene::{EmissiveLight, GlobalTransform, Name, shines};
use lumbre_trace::relative_error;

use super::side_view::SideView;
use crate::Spread;

/// Largest number of lights that are timed one by one: those that contribute most.
const MAX_SINGLE_LIGHTS: usize = 12;
/// Time for the pictures that find the lights that contribute most. Lights that it does not suffice for are timed
/// in groups.
const LOOKING: Duration = Duration::from_secs(10);
/// Number of rounds; in each of them every frame is drawn once.
const ROUNDS: usize = 5;

/// Cost and contribution of a light or a group of lights.
#[derive(Clone, Debug, PartialEq)]
pub struct LightCost {
    /// Name of the light or the group.
    pub name: String,
    /// Number of lights.
    pub lights: usize,
    /// Milliseconds that a frame takes longer with it, over pairs from the same round; negative if frames are
    /// slower without it.
    pub milliseconds: Spread,
    /// Relative RMSE of the picture without it against the picture with it.
    pub difference: f64,
}

/// Measures what lights cost, one frame per step.
pub struct LightCosts {
    /// What is switched off: while lights are looked for, each of them, and then what is timed.
    groups: Vec<Group>,
    /// The difference of the picture without each group from the whole picture, as far as they are drawn.
    differences: Vec<f64>,
    /// If lights are still being looked for, since when.
    looking: Option<Instant>,
    whole: Vec<DVec3>,
    /// The times without each group, and last those with all lights.
    times: Vec<Vec<f64>>,
    drawn: usize,
}

/// Lights that are switched off together.
#[derive(Clone, Debug, PartialEq)]
struct Group {
    name: String,
    lights: Vec<Entity>,
    /// Emissive surfaces that are polygon lights.
    glowing: Vec<Entity>,
}

impl LightCosts {
    /// Begins a measurement by drawing the view with all its lights.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn begin(
        side: &mut SideView,
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Self, RenderError> {
        let groups = single_lights(world);
        let looking = (groups.len() > MAX_SINGLE_LIGHTS).then(Instant::now);
        let whole = radiance(side, world, options)?;
        let mut costs = Self { groups, differences: Vec::new(), looking, whole, times: Vec::new(), drawn: 0 };
        if looking.is_none() {
            costs.set_out(world, MAX_SINGLE_LIGHTS);
        }
        Ok(costs)
    }

    /// Begins to time the lights that contribute most, as far as they were looked at, one by one, up to `most`,
    /// and the others in groups.
    fn set_out(&mut self, world: &mut World, most: usize) {
        let mut lights: Vec<(Group, Option<f64>)> = Vec::new();
        let known = std::mem::take(&mut self.differences).into_iter().map(Some);
        for (light, difference) in self.groups.drain(..).zip(known.chain(std::iter::repeat(None))) {
            lights.push((light, difference));
        }
        lights.sort_by(|(_, a), (_, b)| b.unwrap_or(0.0).total_cmp(&a.unwrap_or(0.0)));
        let others = lights.split_off(lights.len().min(most));
        // The pictures of the lights that remain alone are drawn already, or all of them are still to be drawn.
        self.differences = lights.iter().map_while(|(_, difference)| *difference).collect();
        self.groups = lights.into_iter().map(|(light, _)| light).collect();
        self.groups.extend(by_kind(world, others.into_iter().flat_map(|(light, _)| light.lights)));
        self.groups.extend(glowing_surfaces(world));
        (self.looking, self.drawn) = (None, self.differences.len());
        self.times = vec![Vec::new(); self.groups.len() + 1];
    }

    /// Returns the fraction that is done; looking for the lights that contribute most counts as a third.
    pub fn fraction(&self) -> f64 {
        match self.looking {
            Some(_) => self.differences.len() as f64 / self.groups.len().max(1) as f64 / 3.0,
            None => (self.drawn as f64 / self.frames().max(1) as f64).max(1.0 / 3.0),
        }
    }

    fn frames(&self) -> usize {
        self.groups.len() + ROUNDS * self.times.len()
    }

    /// Draws the next frame. After the last one it returns the costs, the highest first. World and options
    /// must be the same in all steps.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn step(
        &mut self,
        side: &mut SideView,
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Option<Vec<LightCost>>, RenderError> {
        if let Some(since) = self.looking {
            let looked_at = self.differences.len();
            match self.groups.get(looked_at).filter(|_| since.elapsed() < LOOKING) {
                Some(light) => {
                    let without = light.left_out(world, |world| radiance(side, world, options))?;
                    self.differences.push(relative_error(&self.whole, &without));
                }
                None => self.set_out(world, MAX_SINGLE_LIGHTS.min(looked_at)),
            }
            return Ok(None);
        }
        let count = self.groups.len();
        if self.drawn < count {
            let group = &self.groups[self.drawn];
            let without = group.left_out(world, |world| radiance(side, world, options))?;
            self.differences.push(relative_error(&self.whole, &without));
        } else {
            let (round, place) = ((self.drawn - count) / (count + 1), (self.drawn - count) % (count + 1));
            let place = if round % 2 == 0 { place } else { count - place };
            let time = match self.groups.get(place) {
                Some(group) => group.left_out(world, |world| side.milliseconds(world, options)),
                None => side.milliseconds(world, options),
            };
            self.times[place].push(time?);
        }
        self.drawn += 1;
        Ok((self.drawn >= self.frames()).then(|| self.costs()))
    }

    fn costs(&self) -> Vec<LightCost> {
        let Some((all, without)) = self.times.split_last() else { return Vec::new() };
        let cost = |((group, times), difference): ((&Group, &Vec<f64>), &f64)| {
            let longer: Vec<f64> = all.iter().zip(times).map(|(all, without)| all - without).collect();
            Some(LightCost {
                name: group.name.clone(),
                lights: group.lights.len() + group.glowing.len(),
                milliseconds: Spread::of(&longer)?,
                difference: *difference,
            })
        };
        let mut costs: Vec<LightCost> =
            self.groups.iter().zip(without).zip(&self.differences).filter_map(cost).collect();
        costs.sort_by(|a, b| b.milliseconds.median.total_cmp(&a.milliseconds.median));
        costs
    }
}

impl Group {
    /// Draws with the group switched off, and switches it on again.
    fn left_out<T>(&self, world: &mut World, draw: impl FnOnce(&mut World) -> T) -> T {
        self.switch(world, false);
        let drawn = draw(world);
        self.switch(world, true);
        drawn
    }

    fn switch(&self, world: &mut World, on: bool) {
        for &light in &self.lights {
            if let Some(mut light) = world.get_mut::<Light>(light) {
                light.enabled = on;
            }
        }
        for &surface in &self.glowing {
            match on {
                true => world.entity_mut(surface).insert(EmissiveLight),
                false => world.entity_mut(surface).remove::<EmissiveLight>(),
            };
        }
    }
}

/// Returns each light that shines as a group of its own.
fn single_lights(world: &mut World) -> Vec<Group> {
    let mut lights = world.query::<(Entity, &Light, Option<&GlobalTransform>, Option<&Name>)>();
    let shining = lights.iter(world).filter(|(_, light, place, _)| shines(light, *place));
    let group = |(entity, light, _, name): (Entity, &Light, _, Option<&Name>)| Group {
        name: name
            .filter(|name| !name.is_empty())
            .map_or_else(|| kind(light).to_owned(), |name| name.to_string()),
        lights: vec![entity],
        glowing: Vec::new(),
    };
    shining.map(group).collect()
}

/// Groups lights by their kind, and by whether they cast shadows.
fn by_kind(world: &World, lights: impl Iterator<Item = Entity>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for entity in lights {
        let Some(light) = world.get::<Light>(entity) else { continue };
        let shadows = if light.shadow { " with shadows" } else { "" };
        let name = format!("other {}s{shadows}", kind(light));
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.lights.push(entity),
            None => groups.push(Group { name, lights: vec![entity], glowing: Vec::new() }),
        }
    }
    groups
}

/// Returns the emissive surfaces that are lights as a group, if there are any.
fn glowing_surfaces(world: &mut World) -> Option<Group> {
    let glowing: Vec<Entity> = world.query_filtered::<Entity, With<EmissiveLight>>().iter(world).collect();
    let name = "glowing surfaces".to_owned();
    (!glowing.is_empty()).then(|| Group { name, lights: Vec::new(), glowing })
}

/// Returns the kind of a light in words.
fn kind(light: &Light) -> &'static str {
    let has_cone = light.spot.is_some_and(|cone| !cone.is_everywhere());
    match light.kind {
        LightKind::Ambient => "ambient light",
        LightKind::Directional => "directional light",
        LightKind::Point if has_cone => "spot light",
        LightKind::Point => "point light",
    }
}

fn radiance(
    side: &mut SideView,
    world: &mut World,
    options: &FrameOptions,
) -> Result<Vec<DVec3>, RenderError> {
    let picture = side.radiance(world, options)?;
    Ok(picture.iter().map(|pixel| pixel.truncate().as_dvec3()).collect())
}
