//! Spawns objects into a World in the structure of a glTF file: nodes with primitives below them and lights
//! on them.

use std::collections::HashMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Attenuation, BakeMode, Light, Material, SpotCone, Surface};
use lumbre_scene::{
    Camera, DynamicObject, Extras, MaterialTextures, Medium, Mesh, Mobility, Name, Primitive, StaticObject,
    Transform,
};
use serde_json::json;

use super::paint::Paint;
use super::textures::{Drawn, Texture};
use crate::motion::Motion;

/// A World that is being filled.
pub struct Builder<'w> {
    world: &'w mut World,
    textures: HashMap<Texture, Drawn>,
    glow: Arc<TriangleMesh>,
}

/// The appearance of a mesh: the contents of a glTF material.
struct Look {
    name: String,
    material: Material,
    medium: Option<Medium>,
    textures: MaterialTextures,
}

impl<'w> Builder<'w> {
    /// Creates a builder that fills a World.
    pub fn new(world: &'w mut World) -> Self {
        let glow = Arc::new(lumbre_mesh::shapes::tetrahedral_sphere(0.06, 2, false));
        Self { world, textures: HashMap::new(), glow }
    }

    /// Spawns an empty node.
    pub fn node(&mut self, name: &str, place: Transform) -> Entity {
        self.world.spawn((Name::new(name.to_owned()), place)).id()
    }

    /// Spawns an empty node below another one.
    pub fn child(&mut self, parent: Entity, name: &str, place: Transform) -> Entity {
        self.world.spawn((Name::new(name.to_owned()), place, ChildOf(parent))).id()
    }

    /// Spawns a static object.
    pub fn fixed(
        &mut self,
        name: &str,
        place: Transform,
        mesh: impl Into<Arc<TriangleMesh>>,
        paint: Paint,
    ) -> Entity {
        let node = self.node(name, place);
        let look = self.look(paint);
        self.primitive(node, name, mesh.into(), look, Mobility::Static);
        node
    }

    /// Spawns a static object that the baker leaves out, because it mirrors or transmits light.
    pub fn clear(
        &mut self,
        name: &str,
        place: Transform,
        mesh: impl Into<Arc<TriangleMesh>>,
        paint: Paint,
    ) -> Entity {
        let node = self.node(name, place);
        let look = self.look(paint);
        self.primitive(node, name, mesh.into(), look, Mobility::Unsaid);
        node
    }

    /// Spawns a moving object.
    pub fn moving(
        &mut self,
        name: &str,
        place: Transform,
        mesh: impl Into<Arc<TriangleMesh>>,
        paint: Paint,
        motion: &Motion,
    ) -> Entity {
        let node = self.node(name, place);
        self.world.entity_mut(node).insert((DynamicObject, motion_extras(motion)));
        let look = self.look(paint);
        self.primitive(node, name, mesh.into(), look, Mobility::Dynamic);
        node
    }

    /// Lets the player walk through a node's meshes.
    pub fn let_through(&mut self, node: Entity) {
        self.world.entity_mut(node).insert(Extras(json!({"lumbre_demo": {"solid": false}})));
    }

    /// Spawns a static light that the baker takes over.
    pub fn baked_light(&mut self, name: &str, place: Transform, light: Light) {
        let node = self.node(name, place);
        self.world.entity_mut(node).insert(Light { bake: BakeMode::Static, ..light });
    }

    /// Spawns a moving light within a small emissive ball of its colour.
    pub fn moving_light(&mut self, name: &str, place: Transform, light: Light, motion: &Motion) -> Entity {
        let node = self.node(name, place);
        let look = glowing(light.diffuse);
        self.world.entity_mut(node).insert((light, DynamicObject, motion_extras(motion)));
        let glow = self.glow.clone();
        self.primitive(node, "glow", glow, look, Mobility::Dynamic);
        node
    }

    /// Spawns a light within a small emissive ball of its colour, below a moving node.
    pub fn carried_light(&mut self, carrier: Entity, name: &str, place: Transform, light: Light) {
        let node = self.child(carrier, name, place);
        let look = glowing(light.diffuse);
        self.world.entity_mut(node).insert((light, DynamicObject));
        let glow = self.glow.clone();
        self.primitive(node, "glow", glow, look, Mobility::Dynamic);
    }

    /// Spawns a camera.
    pub fn camera(&mut self, name: &str, place: Transform) -> Entity {
        let node = self.node(name, place);
        self.world.entity_mut(node).insert(Camera::default());
        node
    }

    /// Adds geometry to a moving node, such as what a light hangs from.
    pub fn hang(&mut self, node: Entity, name: &str, mesh: TriangleMesh, paint: Paint) {
        let look = self.look(paint);
        self.primitive(node, name, Arc::new(mesh), look, Mobility::Dynamic);
    }

    fn look(&mut self, paint: Paint) -> Look {
        let mut material = paint.material();
        let mut textures = MaterialTextures::default();
        if let Some(texture) = paint.texture() {
            let Drawn { texture, tint } =
                self.textures.entry(texture).or_insert_with(|| texture.draw()).clone();
            material.front.ambient *= tint;
            material.front.diffuse *= tint;
            textures.base_color = Some(texture);
        }
        Look { name: paint.name(), material, medium: paint.medium(), textures }
    }

    fn primitive(
        &mut self,
        node: Entity,
        name: &str,
        mesh: Arc<TriangleMesh>,
        look: Look,
        mobility: Mobility,
    ) {
        let index = self.world.get::<Children>(node).map_or(0, |children| children.len());
        let primitive = Primitive { index, mesh: name.into(), material: look.name.into() };
        let mut entity = self.world.spawn((Mesh(mesh), look.material, primitive, ChildOf(node)));
        if look.textures != MaterialTextures::default() {
            entity.insert(look.textures);
        }
        if let Some(medium) = look.medium {
            entity.insert(medium);
        }
        match mobility {
            Mobility::Static => entity.insert(StaticObject),
            Mobility::Dynamic => entity.insert(DynamicObject),
            Mobility::Unsaid => &mut entity,
        };
    }
}

fn motion_extras(motion: &Motion) -> Extras {
    Extras(json!({"lumbre_demo": {"motion": motion}}))
}

/// Returns the look of the ball around a light: the light's hue at a fixed brightness.
fn glowing(color: Vec3) -> Look {
    let emission = color / color.max_element().max(1e-6) * 1.5;
    let front = Surface { emission, ..Material::matt(Vec3::splat(0.1)).front };
    let [red, green, blue] = (emission * 100.0).as_ivec3().to_array();
    Look {
        name: format!("glow {red} {green} {blue}"),
        material: Material { front, ..Material::default() },
        medium: None,
        textures: MaterialTextures::default(),
    }
}

/// Returns a small coloured light whose attenuation is finite at distance 0 and ends at `range` metres.
pub fn wisp(color: Vec3, range: f32) -> Light {
    let attenuation = Attenuation { constant: 1.0, linear: 0.0, quadratic: 1.2, clamp: false, range };
    Light { attenuation, ..Light::point(color) }
}

/// Returns a spotlight with a soft edge.
pub fn beam(color: Vec3, outer_degrees: f32, range: f32) -> Light {
    let outer = outer_degrees.to_radians();
    let attenuation = Attenuation { constant: 1.0, linear: 0.0, quadratic: 0.12, clamp: false, range };
    Light { attenuation, ..Light::spot(color, SpotCone::Smooth { inner: 0.5 * outer, outer }) }
}
