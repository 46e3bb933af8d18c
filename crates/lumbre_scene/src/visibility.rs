//! Which entities are hidden by a [`Hidden`] component of their own or of an ancestor, and which lightmaps are
//! shown by the others. This is not view culling.

use std::collections::HashSet;
use std::sync::Arc;

use bevy_ecs::entity::EntityHashSet;
use bevy_ecs::prelude::*;

use crate::{Hidden, Lightmap, LightmapImage};

/// The entities with [`Hidden`], and all their descendants.
pub fn hidden_entities(world: &mut World) -> EntityHashSet {
    let mut state =
        bevy_ecs::system::SystemState::<(Query<Entity, With<Hidden>>, Query<&Children>)>::new(world);
    // Fetching queries cannot fail; only a missing resource would be an error.
    state.get(world).map(|(hidden, children)| with_descendants(hidden.iter(), &children)).unwrap_or_default()
}

/// The lightmaps of objects that are not hidden, each image once.
pub fn shown_lightmaps(world: &mut World) -> Vec<Arc<LightmapImage>> {
    let hidden = hidden_entities(world);
    let mut known = HashSet::new();
    let mut lit = world.query::<(Entity, &Lightmap)>();
    let shown = lit.iter(world).filter(|(entity, _)| !hidden.contains(entity)).map(|(_, map)| &map.image);
    shown.filter(|image| known.insert(Arc::as_ptr(image))).cloned().collect()
}

/// These entities and all their descendants.
pub fn with_descendants(
    entities: impl Iterator<Item = Entity>,
    children: &Query<&Children>,
) -> EntityHashSet {
    let mut found = EntityHashSet::default();
    let mut stack: Vec<Entity> = entities.collect();
    while let Some(entity) = stack.pop() {
        if found.insert(entity) {
            stack.extend(children.get(entity).into_iter().flatten());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_hangs_from_a_hidden_entity_is_hidden() {
        let mut world = World::new();
        assert!(hidden_entities(&mut world).is_empty());
        let top = world.spawn_empty().id();
        let hidden = world.spawn((Hidden, ChildOf(top))).id();
        let child = world.spawn(ChildOf(hidden)).id();
        let below = world.spawn((Hidden, ChildOf(child))).id();
        world.spawn(ChildOf(top));
        let mut found: Vec<Entity> = hidden_entities(&mut world).into_iter().collect();
        found.sort();
        let mut expected = vec![hidden, child, below];
        expected.sort();
        assert_eq!(found, expected);
        world.entity_mut(hidden).remove::<Hidden>();
        assert_eq!(hidden_entities(&mut world).into_iter().collect::<Vec<_>>(), [below]);
    }
}
