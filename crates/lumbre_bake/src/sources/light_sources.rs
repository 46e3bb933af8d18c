//! All light sources of a scene: emissive triangles and punctual lights, each in a tree, and the sky. The light that
//! they bring to a receiver is computed in `irradiance`.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use lumbre_optics::LightKind;

use super::emitter_tree::EmitterTree;
use super::emitters::{Emitter, lamps};
use super::light_tree::{LightTree, has_position};
use crate::scene::{BakeScene, PlacedLight};

/// The sources of a scene.
#[derive(Clone)]
pub(crate) struct Sources<'a> {
    pub scene: &'a BakeScene,
    pub emitters: Arc<Vec<Emitter>>,
    /// For each emitter the number of its lamp.
    pub lamps: Arc<Vec<u32>>,
    pub(crate) emitter_tree: Arc<EmitterTree>,
    pub lights: Vec<PlacedLight>,
    pub(crate) light_tree: LightTree,
    /// Indices of the lights that are sampled individually everywhere: directional lights, and all lights if they are
    /// few.
    pub(crate) individually_sampled_lights: Vec<u32>,
    /// Irradiance of a surface under an unoccluded sky: π times the sky's radiance, W/m². The sky is not part of direct
    /// light: rays of the form factors and of the final gather receive it where they hit nothing.
    pub sky: Vec3,
}

/// Up to this many lights, all are sampled individually: the exact sum over them times the visible fraction is less
/// noisy than shared samples.
pub(crate) const FEW_LIGHTS: usize = 16;

impl<'a> Sources<'a> {
    /// Builds the trees over a scene's emissive triangles and punctual lights. `sky` is a radiance.
    pub fn new(scene: &'a BakeScene, emitters: Vec<Emitter>, lights: Vec<PlacedLight>, sky: Vec3) -> Self {
        let lamps = lamps(scene, &emitters);
        let emitter_tree = Arc::new(EmitterTree::new(&emitters, &lamps));
        let are_few = lights.len() <= FEW_LIGHTS;
        let shares_samples = |index: &u32| !are_few && has_position(&lights[*index as usize]);
        let (in_tree, individually_sampled_lights) = (0..lights.len() as u32).partition(shares_samples);
        let light_tree = LightTree::new(&lights, in_tree, scene.space);
        Self {
            scene,
            emitters: Arc::new(emitters),
            lamps: Arc::new(lamps),
            emitter_tree,
            lights,
            light_tree,
            individually_sampled_lights,
            sky: sky * PI,
        }
    }

    /// Only the emissive triangles that `keep` accepts, without punctual lights and sky.
    pub fn only_emitters(&self, keep: impl Fn(&Emitter) -> bool) -> Self {
        let kept: Vec<Emitter> = self.emitters.iter().filter(|emitter| keep(emitter)).cloned().collect();
        if kept.len() < self.emitters.len() {
            return Self::new(self.scene, kept, Vec::new(), Vec3::ZERO);
        }
        let (lights, individually_sampled_lights) = (Vec::new(), Vec::new());
        let light_tree = LightTree::default();
        Self { lights, light_tree, individually_sampled_lights, sky: Vec3::ZERO, ..self.clone() }
    }

    /// Bytes that the emitters and their tree take.
    pub fn emitter_bytes(&self) -> u64 {
        let lists = size_of_val(self.emitters.as_slice()) + size_of_val(self.lamps.as_slice());
        lists as u64 + self.emitter_tree.bytes()
    }

    /// Whether there is no light source.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty() && self.lights.is_empty() && !self.has_sky()
    }

    /// Whether the sky emits light.
    pub fn has_sky(&self) -> bool {
        self.sky != Vec3::ZERO
    }

    /// The indices of the emitters of a node of the emitter tree.
    pub fn emitters_of(&self, node: u32) -> &[u32] {
        self.emitter_tree.emitters_of(node)
    }
}

/// Whether all light sources are inside rooms, so that it is dark outside of them. `sky` is a radiance.
pub(crate) fn shines_inside_only(
    scene: &BakeScene,
    emitters: &[Emitter],
    lights: &[PlacedLight],
    sky: Vec3,
) -> bool {
    let inside =
        |points: &[Vec3]| scene.rooms.iter().any(|room| points.iter().all(|&point| room.contains(point)));
    let is_light_inside = |placed: &PlacedLight| {
        placed.light.kind != LightKind::Directional && inside(&[scene.space.position(placed.position)])
    };
    !scene.has_masks()
        && sky == Vec3::ZERO
        && lights.iter().all(is_light_inside)
        && emitters.iter().all(|emitter| inside(&emitter.corners))
}
