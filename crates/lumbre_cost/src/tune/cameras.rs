//! The cameras of a level, and those that stand for all of them while most ways to draw it are still being
//! compared: the cameras where frames take longest, and those with the largest error of each kind.

use bevy_ecs::prelude::*;
use lumbre_scene::{ActiveCamera, Camera, Name};

use crate::Spread;
use crate::findings::listed;

/// The cameras of a level.
pub(crate) struct Cameras {
    /// The active camera first, and the others in the order of the file. Entities are the same whenever it is read.
    pub all: Vec<(Entity, String)>,
    /// For each, whether frames take longest there.
    pub slow: Vec<bool>,
    /// For each, whether some settings err most there.
    pub inaccurate: Vec<bool>,
}

impl Cameras {
    /// Returns the cameras of a World, each of which stands for itself.
    pub fn of(world: &mut World) -> Self {
        let mut cameras = world.query_filtered::<(Entity, Option<&Name>, Has<ActiveCamera>), With<Camera>>();
        let mut found: Vec<(Entity, String, bool)> = cameras
            .iter(world)
            .map(|(entity, name, active)| (entity, name.map_or("camera", Name::as_str).to_owned(), active))
            .collect();
        found.sort_by_key(|(entity, _, active)| (!active, entity.index_u32()));
        let all: Vec<_> = found.into_iter().map(|(entity, name, _)| (entity, name)).collect();
        Self { slow: vec![true; all.len()], inaccurate: vec![true; all.len()], all }
    }

    /// Returns all of them.
    pub fn every(&self) -> Vec<bool> {
        vec![true; self.all.len()]
    }

    /// Returns none of them.
    pub fn none(&self) -> Vec<bool> {
        vec![false; self.all.len()]
    }

    /// Lets those stand for all of them where one of these series of times is longest, and where one of these
    /// series of errors is largest. Each series is that of one way at all cameras.
    pub fn choose(&mut self, times: &[Vec<Option<Spread>>], errors: &[Vec<f64>]) {
        let medians = times.iter().map(|of_way| {
            of_way.iter().map(|time| time.map_or(0.0, |time| time.median)).collect::<Vec<f64>>()
        });
        let slow = at_largest(medians, self.all.len());
        let inaccurate = at_largest(errors.iter().cloned(), self.all.len());
        (self.slow, self.inaccurate) = (slow, inaccurate);
    }

    /// Adds the cameras where a way takes distinguishably longer than where frames took longest so far. Returns
    /// true if there are any. `times` are that way's at all cameras.
    pub fn add_slower(&mut self, times: &[Option<Spread>]) -> bool {
        let known = times.iter().zip(&self.slow).filter_map(|(time, slow)| time.filter(|_| *slow));
        let Some(longest) = known.max_by(|a, b| a.median.total_cmp(&b.median)) else { return false };
        let is_slower = |time: &Option<Spread>| time.is_some_and(|time| longest.is_below(&time));
        let slower: Vec<bool> = times.iter().map(is_slower).collect();
        self.slow.iter_mut().zip(&slower).for_each(|(slow, slower)| *slow |= slower);
        slower.contains(&true)
    }

    /// Returns the quoted names of some of them, as in a sentence.
    pub fn named(&self, which: &[bool]) -> String {
        let names = self.all.iter().zip(which).filter(|(_, is_one)| **is_one);
        let names: Vec<String> = names.map(|((_, name), _)| format!("\"{name}\"")).collect();
        listed(&names.iter().map(String::as_str).collect::<Vec<_>>(), "and")
    }
}

/// Returns for each place whether one of the series is largest there. Series without anything above 0 say
/// nothing, and without any that does, the first place stands for all.
fn at_largest(series: impl Iterator<Item = Vec<f64>>, places: usize) -> Vec<bool> {
    let mut found = vec![false; places];
    for values in series {
        let largest = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
        if let Some(place) = largest.filter(|&place| values[place] > 0.0) {
            found[place] = true;
        }
    }
    if !found.contains(&true)
        && let Some(first) = found.first_mut()
    {
        *first = true;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras(count: usize) -> Cameras {
        let mut world = World::new();
        for number in 0..count {
            world.spawn((Camera::default(), Name::new(format!("tour {number}"))));
        }
        Cameras::of(&mut world)
    }

    fn times(medians: &[f64]) -> Vec<Option<Spread>> {
        medians.iter().map(|&time| Spread::of(&[0.99 * time, time, 1.01 * time])).collect()
    }

    #[test]
    fn the_slowest_and_those_that_err_most_stand_for_all() {
        let mut found = cameras(4);
        assert_eq!((found.slow.clone(), found.inaccurate.clone()), (vec![true; 4], vec![true; 4]));
        found.choose(
            &[times(&[5.0, 9.0, 8.9, 1.0]), times(&[2.0, 1.0, 1.0, 1.0])],
            &[vec![0.0, 0.1, 0.0, 0.3], vec![0.0; 4], vec![0.0, 0.2, 0.1, 0.3]],
        );
        assert_eq!(found.slow, [true, true, false, false]);
        assert_eq!(found.inaccurate, [false, false, false, true]);
        assert_eq!(found.named(&found.slow), "\"tour 0\" and \"tour 1\"");
        found.choose(&[times(&[1.0; 4])], &[vec![0.0; 4]]);
        assert_eq!(found.inaccurate, [true, false, false, false], "where nothing is off, one is enough");
    }

    #[test]
    fn a_camera_that_turns_out_to_be_slower_is_added() {
        let mut found = cameras(3);
        found.choose(&[times(&[9.0, 5.0, 5.0])], &[]);
        assert!(!found.add_slower(&times(&[4.0, 4.01, 3.0])), "times that overlap are not told apart");
        assert_eq!(found.slow, [true, false, false]);
        assert!(found.add_slower(&times(&[4.0, 5.0, 3.0])));
        assert_eq!(found.slow, [true, true, false]);
    }
}
