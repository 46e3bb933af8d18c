//! A camera flight through a level, for machines without a display. Its frames are drawn in `tour_frames`.

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3};
use lumbre_scene::{Camera, GlobalTransform, Name, Transform};

use crate::motion::catmull_rom;

/// The prefix of the names of the cameras along the tour.
pub const TOUR_CAMERA: &str = "tour";

/// The path of a camera flight.
#[derive(Clone, Debug, PartialEq)]
pub enum Tour {
    /// Past the level's cameras named `tour...`, in the order of their names.
    Past(Vec<Transform>),
    /// Around a point that the camera looks at.
    Around {
        /// The point, metres.
        middle: DVec3,
        /// Distance from it, metres.
        distance: f64,
    },
}

impl Tour {
    /// Chooses the tour of a level: past its tour cameras; or from its first other camera, if it has one; or
    /// around `bounds`.
    pub fn of(world: &mut World, bounds: Option<(DVec3, DVec3)>) -> Self {
        let mut cameras = world.query_filtered::<(&GlobalTransform, Option<&Name>), With<Camera>>();
        let (mut stops, mut first) = (Vec::new(), None);
        for (place, name) in cameras.iter(world) {
            let place = Transform::from_affine(place.0).0;
            match name.filter(|name| name.as_str().starts_with(TOUR_CAMERA)) {
                Some(name) => stops.push((name.as_str().to_owned(), place)),
                None if name.is_none_or(|name| name.as_str() != "eyes") => {
                    first.get_or_insert(place);
                }
                None => {}
            }
        }
        stops.sort_by(|a, b| a.0.cmp(&b.0));
        if !stops.is_empty() {
            return Self::Past(stops.into_iter().map(|(_, place)| place).collect());
        }
        if let Some(view) = first {
            return Self::Past(vec![view]);
        }
        let (min, max) = bounds.unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
        Self::Around { middle: 0.5 * (min + max), distance: 1.2 * (max - min).length() }
    }

    /// Returns the view at a fraction of the tour, in [0, 1].
    pub fn view(&self, part: f64) -> Transform {
        let part = part.clamp(0.0, 1.0);
        match self {
            Self::Around { middle, distance } => {
                let direction =
                    DQuat::from_rotation_y(part * std::f64::consts::TAU) * DVec3::new(0.0, 0.4, 1.0);
                let eye = *middle + direction.normalize() * *distance;
                Transform::from_translation(eye).looking_at(*middle, DVec3::Y)
            }
            Self::Past(stops) => {
                let last = stops.len().saturating_sub(1);
                let position = part * last as f64;
                let from = (position.floor() as usize).min(last.saturating_sub(1));
                let at = |index: usize| stops.get(index.min(last)).copied().unwrap_or_default();
                let (a, b) = (at(from), at(from + 1));
                let t = position - from as f64;
                let curve = [at(from.saturating_sub(1)), a, b, at(from + 2)].map(|stop| stop.translation);
                Transform::from_translation(catmull_rom(curve, t))
                    .with_rotation(a.rotation.slerp(b.rotation, t))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_past_the_named_cameras_in_order() {
        let mut world = World::new();
        for (name, x) in [("tour 2", 2.0), ("start", 9.0), ("tour 1", 1.0), ("tour 3", 4.0)] {
            world.spawn((Camera::default(), Transform::from_xyz(x, 0.0, 0.0), Name::new(name)));
        }
        lumbre_scene::update_transforms(&mut world);
        let tour = Tour::of(&mut world, None);
        let x = |part: f64| tour.view(part).translation.x;
        assert_eq!((x(0.0), x(0.5), x(1.0)), (1.0, 2.0, 4.0));
        assert!(x(0.25) > 1.0 && x(0.25) < 2.0);
    }

    #[test]
    fn without_cameras_it_goes_around() {
        let tour = Tour::of(&mut World::new(), Some((DVec3::ZERO, DVec3::splat(2.0))));
        for step in 0..5 {
            let view = tour.view(f64::from(step) / 4.0);
            let forward = view.rotation * DVec3::NEG_Z;
            assert!(forward.distance((DVec3::ONE - view.translation).normalize()) < 1e-9);
        }
        let mut world = World::new();
        world.spawn((Camera::default(), Transform::from_xyz(5.0, 0.0, 0.0)));
        lumbre_scene::update_transforms(&mut world);
        assert_eq!(Tour::of(&mut world, None).view(0.7).translation.x, 5.0);
    }
}
