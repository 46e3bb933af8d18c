//! Stores a value for each entity of a World, in a slot that stays the same as long as the entity is found.
//! What the values are and how they are updated is decided by the owner.

use bevy_ecs::entity::{Entity, EntityHashMap};

/// Values by entity and by slot.
#[derive(Debug)]
pub(crate) struct EntitySlots<T> {
    by_entity: EntityHashMap<usize>,
    /// By slot; `None` if the slot is free or new.
    pub values: Vec<Option<T>>,
    free: Vec<usize>,
}

impl<T> Default for EntitySlots<T> {
    fn default() -> Self {
        Self { by_entity: EntityHashMap::default(), values: Vec::new(), free: Vec::new() }
    }
}

impl<T> EntitySlots<T> {
    /// Returns the number of entities with a slot.
    pub fn len(&self) -> usize {
        self.by_entity.len()
    }

    /// Returns the slot of an entity, or assigns it a free one.
    pub fn of(&mut self, entity: Entity) -> usize {
        *self.by_entity.entry(entity).or_insert_with(|| {
            self.free.pop().unwrap_or_else(|| {
                self.values.push(None);
                self.values.len() - 1
            })
        })
    }

    /// Frees the slots of entities whose values are no longer found, and passes these values to `gone`.
    /// Returns true if there were any.
    pub fn release(&mut self, is_found: impl Fn(&T) -> bool, mut gone: impl FnMut(T)) -> bool {
        // Usually all are found.
        if self.values.iter().flatten().all(&is_found) {
            return false;
        }
        let (values, free) = (&mut self.values, &mut self.free);
        self.by_entity.retain(|_, slot| {
            let found = values[*slot].as_ref().is_some_and(&is_found);
            if !found {
                values[*slot].take().into_iter().for_each(&mut gone);
                free.push(*slot);
            }
            found
        });
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_free_once_its_entity_is_gone() {
        let [first, second, third] = [1, 2, 3].map(|number| Entity::from_raw_u32(number).unwrap());
        let mut slots = EntitySlots::default();
        for (entity, value) in [(first, 'a'), (second, 'b')] {
            let slot = slots.of(entity);
            slots.values[slot] = Some(value);
        }
        assert_eq!((slots.of(first), slots.of(second), slots.len()), (0, 1, 2));
        let mut gone = Vec::new();
        assert!(!slots.release(|_| true, |value| gone.push(value)));
        assert!(slots.release(|value| *value == 'b', |value| gone.push(value)));
        assert_eq!((gone, slots.len()), (vec!['a'], 1));
        assert_eq!((slots.of(third), slots.of(second)), (0, 1));
    }
}
