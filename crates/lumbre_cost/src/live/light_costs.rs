//! Measures what the lights of a view cost and contribute, by drawing frames with each light, or each group
//! of lights, switched off in turn. The cost is measured and not derived from a model.

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_optics::{Light, LightKind};
use lumbre_render::{FrameOptions, RenderError};
use lumbre_scene::{EmissiveLight, GlobalTransform, Name, shines};
use lumbre_trace::relative_error;

use super::side_view::SideView;
use crate::Spread;

/// Largest number of lights that are measured one by one; more lights are measured in groups.
const MAX_SINGLE_LIGHTS: usize = 8;
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
    groups: Vec<Group>,
    /// The difference of the picture without each group from the whole picture.
    differences: Vec<f64>,
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
        let groups = groups(world);
        let whole = radiance(side, world, options)?;
        let times = vec![Vec::new(); groups.len() + 1];
        Ok(Self { groups, differences: Vec::new(), whole, times, drawn: 0 })
    }

    /// Returns the fraction that is done.
    pub fn fraction(&self) -> f64 {
        self.drawn as f64 / self.frames().max(1) as f64
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

/// Returns the groups of lights that shine: single lights if there are few, and otherwise lights of the same
/// kind that cast or do not cast shadows; and all emissive surfaces that are lights.
fn groups(world: &mut World) -> Vec<Group> {
    let mut lights = world.query::<(Entity, &Light, Option<&GlobalTransform>, Option<&Name>)>();
    let shining: Vec<(Entity, &Light, Option<&Name>)> = lights
        .iter(world)
        .filter(|(_, light, place, _)| shines(light, *place))
        .map(|(entity, light, _, name)| (entity, light, name))
        .collect();
    let alone = shining.len() <= MAX_SINGLE_LIGHTS;
    let mut groups: Vec<Group> = Vec::new();
    for (entity, light, name) in shining {
        let kind = kind(light);
        let name = match (alone, name.filter(|name| !name.is_empty())) {
            (true, Some(name)) => name.to_string(),
            (true, None) => kind.to_owned(),
            (false, _) if light.shadow => format!("{kind}s with shadows"),
            (false, _) => format!("{kind}s"),
        };
        match groups.iter_mut().find(|group| !alone && group.name == name) {
            Some(group) => group.lights.push(entity),
            None => groups.push(Group { name, lights: vec![entity], glowing: Vec::new() }),
        }
    }
    let glowing: Vec<Entity> = world.query_filtered::<Entity, With<EmissiveLight>>().iter(world).collect();
    if !glowing.is_empty() {
        groups.push(Group { name: "glowing surfaces".to_owned(), lights: Vec::new(), glowing });
    }
    groups
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
