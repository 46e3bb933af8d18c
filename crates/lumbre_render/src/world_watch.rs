//! Detects whether anything in a World has changed that a frame is drawn from, by bevy_ecs's change
//! detection. No component is read; what changed is found in `extract`.

use bevy_ecs::archetype::ArchetypeId;
use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemState;
use bevy_ecs::world::WorldId;
use lumbre_optics::{Light, Material, ReflectionModel, Shading};
use lumbre_scene::{
    ActiveCamera, Camera, ChildOf, Children, DynamicObject, EmissiveLight, GlobalTransform, Hidden,
    IrradianceVolume, Lightmap, MaterialTextures, Medium, Mesh, Name, SceneSettings, StaticObject, Transform,
};

/// Filter for changes that a frame may show.
type Changes = Or<(
    Or<(Changed<Mesh>, Changed<Material>, Changed<MaterialTextures>, Changed<Lightmap>)>,
    Or<(Changed<Shading>, Changed<ReflectionModel>, Changed<EmissiveLight>, Changed<Hidden>)>,
    Or<(Changed<StaticObject>, Changed<DynamicObject>, Changed<Name>, Changed<Medium>)>,
    Or<(Changed<Transform>, Changed<GlobalTransform>, Changed<ChildOf>, Changed<Children>)>,
    Or<(Changed<Light>, Changed<IrradianceVolume>, Changed<Camera>, Changed<ActiveCamera>)>,
)>;
type Watch = SystemState<Query<'static, 'static, (), Changes>>;

/// Watches one World at a time.
#[derive(Default)]
pub(crate) struct WorldWatch {
    state: Option<(WorldId, Watch)>,
    settings: Option<SceneSettings>,
    /// How many entities have which components. Removed components and despawned entities leave no other
    /// trace.
    populations: Vec<(ArchetypeId, u32)>,
}

impl WorldWatch {
    /// Returns true if nothing has changed since the last call; false if the last call was for another World.
    pub fn is_unchanged(&mut self, world: &mut World) -> bool {
        let known = self.state.as_ref().is_some_and(|(id, _)| *id == world.id());
        if !known {
            self.state = Some((world.id(), SystemState::new(world)));
        }
        let settings = world.get_resource::<SceneSettings>().copied();
        let archetypes = world.archetypes().iter().filter(|archetype| !archetype.is_empty());
        let populations: Vec<_> = archetypes.map(|archetype| (archetype.id(), archetype.len())).collect();
        let same = settings == self.settings && populations == self.populations;
        (self.settings, self.populations) = (settings, populations);
        // Run the query in any case, because it resets what the next call compares with.
        let unmarked = match &mut self.state {
            Some((_, state)) => state.get(world).is_ok_and(|changes| changes.is_empty()),
            None => false,
        };
        known && same && unmarked
    }
}
