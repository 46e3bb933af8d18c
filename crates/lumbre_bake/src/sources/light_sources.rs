//! Everything that shines in a scene: emissive triangles and punctual lights, each in a tree, and the sky. Not the light that a receiver takes
//! from them: that is `irradiance`.

use std::f32::consts::PI;

use glam::Vec3;
use lumbre_optics::LightKind;

use super::emitter_tree::EmitterTree;
use super::emitters::{Emitter, lamps};
use super::light_tree::{LightTree, has_place};
use crate::scene::{BakeScene, PlacedLight};

/// The sources of a scene.
pub(crate) struct Sources<'a> {
    pub scene: &'a BakeScene,
    pub emitters: Vec<Emitter>,
    pub(crate) emitter_tree: EmitterTree,
    pub lights: Vec<PlacedLight>,
    pub(crate) light_tree: LightTree,
    /// Lights that have samples of their own everywhere, by number: those in the sky, and all where they are few.
    pub(crate) individually_sampled_lights: Vec<u32>,
    /// Irradiance that a surface gets of an unhidden sky: π times its radiance, W/m². Not direct light here: the rays of the
    /// form factors and of the final gather find it where they meet nothing.
    pub sky: Vec3,
}

/// Up to so many lights all have samples of their own: the exact sum over them times the share that is seen is less noisy than samples.
pub(crate) const FEW_LIGHTS: usize = 16;

impl<'a> Sources<'a> {
    /// Of a scene, its emissive triangles, its punctual lights and its sky's radiance.
    pub fn new(scene: &'a BakeScene, emitters: Vec<Emitter>, lights: Vec<PlacedLight>, sky: Vec3) -> Self {
        let emitter_tree = EmitterTree::new(&emitters, &lamps(scene, &emitters));
        let few = lights.len() <= FEW_LIGHTS;
        let shares_samples = |index: &u32| !few && has_place(&lights[*index as usize]);
        let (together, individually_sampled_lights) = (0..lights.len() as u32).partition(shares_samples);
        let light_tree = LightTree::new(&lights, together, scene.space);
        Self { scene, emitters, emitter_tree, lights, light_tree, individually_sampled_lights, sky: sky * PI }
    }

    /// The emissive triangles among them that are to be kept, and no lights.
    pub fn only_emitters(&self, keep: impl Fn(&Emitter) -> bool) -> Self {
        let emitters: Vec<Emitter> = self.emitters.iter().filter(|emitter| keep(emitter)).cloned().collect();
        let emitter_tree = EmitterTree::new(&emitters, &lamps(self.scene, &emitters));
        Self {
            scene: self.scene,
            emitters,
            emitter_tree,
            lights: Vec::new(),
            light_tree: LightTree::default(),
            individually_sampled_lights: Vec::new(),
            sky: Vec3::ZERO,
        }
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty() && self.lights.is_empty() && !self.has_sky()
    }

    /// Whether the sky shines.
    pub fn has_sky(&self) -> bool {
        self.sky != Vec3::ZERO
    }

    /// The emitters of a part of the emissive surfaces, by number.
    pub fn emitters_of(&self, node: u32) -> &[u32] {
        self.emitter_tree.emitters_of(node)
    }
}

/// Whether all that shines is inside of rooms: outside of them it is dark. `sky` is its radiance.
pub(crate) fn shines_inside_only(
    scene: &BakeScene,
    emitters: &[Emitter],
    lights: &[PlacedLight],
    sky: Vec3,
) -> bool {
    let inside =
        |points: &[Vec3]| scene.rooms.iter().any(|room| points.iter().all(|&point| room.contains(point)));
    let light = |placed: &PlacedLight| {
        placed.light.kind != LightKind::Directional && inside(&[scene.space.position(placed.position)])
    };
    !scene.masked
        && sky == Vec3::ZERO
        && lights.iter().all(light)
        && emitters.iter().all(|emitter| inside(&emitter.corners))
}
