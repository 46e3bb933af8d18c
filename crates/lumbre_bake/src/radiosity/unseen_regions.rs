//! A guess at the light of bright regions that the rays of the form factors have missed, for the sampling guide. A small
//! and bright region, such as the inside of a lamp's shaft behind a grille, may be hit by none of the few thousand rays
//! of another region, though much of the light there comes from it. The guide would never choose it, and each cosine
//! ray that finds it would be a firefly. What is known better is how much is exchanged with everything around the
//! region, as that is hit by more rays. A region that saw no light at all stays without a guess.

use std::collections::BTreeMap;

use glam::{IVec3, Vec3};

use super::larger_patches::LargerPatches;
use super::patch_index::RegionIndex;
use crate::scene::BakeScene;

/// Side of the cubes within which exchange is shared out, in sides of a region.
const CUBE_SIDE: f32 = 2.0;
/// Most regions of a cube that are guessed at: those that the most light leaves.
const MAX_BRIGHT: usize = 64;
/// Most of the guess, as a share of the known light.
const MAX_GUESS: f64 = 0.8;
/// Guesses below this share of the known light are left out, so that rows stay short.
const MIN_GUESS: f64 = 3e-4;

/// Where each region is, and which regions of each cube give off the most light.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnseenRegions {
    /// The middle of each region, and its normal there.
    places: Vec<(Vec3, Vec3)>,
    /// The cube of each region.
    cube_of: Vec<u32>,
    cubes: Vec<Cube>,
}

/// The regions within a cube.
#[derive(Clone, Debug, Default)]
struct Cube {
    /// Square canonical units.
    area: f64,
    /// Its brightest regions, each with the power that leaves it.
    bright: Vec<(RegionIndex, f64)>,
}

impl UnseenRegions {
    /// From regions and the radiosity of each.
    pub fn new(scene: &BakeScene, regions: &LargerPatches, radiosity: &[f64]) -> Self {
        let side = regions.patches.subdivision.side;
        let mut numbers: BTreeMap<[i32; 3], u32> = BTreeMap::new();
        let mut unseen = Self { places: Vec::new(), cube_of: Vec::new(), cubes: Vec::new() };
        for (region, radiosity) in RegionIndex::all(radiosity.len()).zip(radiosity) {
            let patch = &regions.patches.list[region.place()];
            let (triangle, (u, v)) = regions.patches.middle(patch);
            let triangle = &scene.triangles[triangle as usize];
            let (middle, normal) = (triangle.position(u, v), triangle.side_normal(patch.side));
            let cell: IVec3 = (middle / (CUBE_SIDE * side)).floor().as_ivec3();
            let next = unseen.cubes.len() as u32;
            let number = *numbers.entry(cell.to_array()).or_insert(next);
            if number == next {
                unseen.cubes.push(Cube::default());
            }
            let cube = &mut unseen.cubes[number as usize];
            cube.area += f64::from(patch.area);
            cube.bright.push((region, radiosity * f64::from(patch.area)));
            unseen.places.push((middle, normal));
            unseen.cube_of.push(number);
        }
        for cube in &mut unseen.cubes {
            cube.bright.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            cube.bright.truncate(MAX_BRIGHT);
            cube.bright.shrink_to_fit();
        }
        unseen
    }

    /// Adds guesses, as if all of a cube were seen equally well, to the light that `receiver` gets from other regions.
    /// That is `flux`, by region, ascending; `exchange` has the exchange areas of the same regions.
    pub fn add(
        &self,
        receiver: RegionIndex,
        exchange: &[(RegionIndex, f64)],
        flux: &mut Vec<(RegionIndex, f64)>,
    ) {
        let known: f64 = flux.iter().map(|(_, flux)| flux).sum();
        let mut by_cube: BTreeMap<u32, f64> = BTreeMap::new();
        for (region, g) in exchange {
            *by_cube.entry(self.cube_of[region.place()]).or_default() += g;
        }
        let mut guesses: Vec<(RegionIndex, f64)> = Vec::new();
        for (number, g) in by_cube {
            let cube = &self.cubes[number as usize];
            for &(region, power) in &cube.bright {
                let guess = g * power / cube.area;
                if guess.is_nan() || guess < MIN_GUESS * known {
                    break;
                }
                if self.face_each_other(receiver, region) {
                    guesses.push((region, guess));
                }
            }
        }
        // A row has at most as many guesses as known entries, so that memory follows from the rays of the form factors.
        guesses.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        guesses.truncate(flux.len());
        let total: f64 = guesses.iter().map(|(_, guess)| guess).sum();
        let scale = (MAX_GUESS * known / total).min(1.0);
        flux.extend(guesses.into_iter().map(|(region, guess)| (region, guess * scale)));
        flux.sort_by_key(|(region, _)| *region);
        flux.dedup_by(|later, first| {
            let is_same = later.0 == first.0;
            if is_same {
                first.1 += later.1;
            }
            is_same
        });
    }

    /// The brightest regions near `region` that lie in front of `receiver`, each with the power that leaves it.
    pub fn around(&self, receiver: RegionIndex, region: RegionIndex) -> Vec<(RegionIndex, f64)> {
        let cube = self.cube_of.get(region.place()).map(|&cube| &self.cubes[cube as usize]);
        let bright = cube.map_or(&[][..], |cube| &cube.bright);
        bright.iter().copied().filter(|&(near, _)| self.face_each_other(receiver, near)).collect()
    }

    /// Whether the middles of two regions lie in front of each other.
    fn face_each_other(&self, receiver: RegionIndex, other: RegionIndex) -> bool {
        let ((from, normal), (to, other_normal)) =
            (self.places[receiver.place()], self.places[other.place()]);
        let along = to - from;
        along.dot(normal) > 0.0 && along.dot(other_normal) < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regions in two cubes: 0 is the receiver, on the floor of the first; 1 to 4 are in the second, above it. 1 is
    /// large and dark, 2 small and bright; 3 and 4 are brighter, but one is turned away and one beneath the receiver's
    /// plane.
    fn unseen() -> UnseenRegions {
        let up = Vec3::Y;
        let places = vec![
            (Vec3::ZERO, up),
            (Vec3::new(0.0, 3.0, 0.0), -up),
            (Vec3::new(1.0, 3.0, 0.0), -up),
            (Vec3::new(1.0, 3.0, 1.0), up),
            (Vec3::new(0.0, -3.0, 0.0), -up),
        ];
        let bright = vec![
            (RegionIndex(3), 60.0),
            (RegionIndex(4), 60.0),
            (RegionIndex(2), 50.0),
            (RegionIndex(1), 1.0),
        ];
        let cubes = vec![Cube { area: 1.0, bright: Vec::new() }, Cube { area: 10.0, bright }];
        UnseenRegions { places, cube_of: vec![0, 1, 1, 1, 1], cubes }
    }

    #[test]
    fn a_bright_region_beside_one_that_was_seen_is_guessed_at() {
        // Only the dark region was hit by rays.
        let mut flux = vec![(RegionIndex(1), 0.2)];
        unseen().add(RegionIndex(0), &[(RegionIndex(1), 1.0)], &mut flux);
        // All that is guessed brings at most a certain share of what is known, and there is no more than one guess
        // for one known region.
        assert_eq!(flux.iter().map(|(region, _)| region.0).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(flux[0].1, 0.2);
        assert!((flux[1].1 / (0.2 * MAX_GUESS) - 1.0).abs() < 1e-9, "{flux:?}");
    }

    #[test]
    fn a_guess_that_is_small_beside_the_known_light_is_left_out() {
        let known = 50.0 / 10.0 / MIN_GUESS * 1.01;
        let mut flux = vec![(RegionIndex(1), known)];
        unseen().add(RegionIndex(0), &[(RegionIndex(1), 1.0)], &mut flux);
        assert_eq!(flux, [(RegionIndex(1), known)]);
    }

    #[test]
    fn around_a_region_are_the_bright_ones_that_face_the_receiver() {
        let near = unseen().around(RegionIndex(0), RegionIndex(1));
        assert_eq!(near, [(RegionIndex(2), 50.0), (RegionIndex(1), 1.0)]);
        assert!(UnseenRegions::default().around(RegionIndex(0), RegionIndex(1)).is_empty());
    }

    #[test]
    fn without_known_light_there_is_nothing_to_guess() {
        let mut flux = Vec::new();
        unseen().add(RegionIndex(0), &[], &mut flux);
        assert!(flux.is_empty());
    }
}
