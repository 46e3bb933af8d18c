//! The cost of each rate of evaluation for an object: how often its lights are evaluated, by vertices or by
//! pixels. The lights themselves do not matter, because they are about the same for all three.

use glam::DVec3;
use lumbre_scene::{ObjectTraits, SceneSettings};

use super::SizedView;
use crate::extract::{Object, ViewVolume};
use crate::mesh_buffers::GpuMesh;

/// Cost of evaluating the lights at a vertex, relative to a fragment.
const VERTEX: f64 = 1.0;

/// Evaluations of all lights, relative to those of one fragment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evaluations {
    pub flat: f64,
    pub gouraud: f64,
    pub phong: f64,
}

/// Placement of an object: its box along the world's axes, and the sphere around the same centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub center: DVec3,
    pub half_size: DVec3,
    pub radius: f64,
}

/// The size of a mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshSize {
    pub vertices: usize,
    pub triangles: usize,
}

impl From<&Object> for Place {
    fn from(object: &Object) -> Self {
        Self { center: object.center, half_size: object.half_size, radius: object.radius }
    }
}

impl From<&GpuMesh> for MeshSize {
    fn from(mesh: &GpuMesh) -> Self {
        Self { vertices: mesh.vertices(), triangles: mesh.triangles() }
    }
}

impl Evaluations {
    pub fn new(
        traits: &ObjectTraits,
        settings: &SceneSettings,
        place: Place,
        mesh: MeshSize,
        view: &SizedView,
    ) -> Self {
        let sides = if traits.double_sided && settings.two_sided { 2.0 } else { 1.0 };
        Self {
            // All three vertices of a triangle evaluate the same values.
            flat: VERTEX * sides * 3.0 * mesh.triangles as f64,
            gouraud: VERTEX * sides * mesh.vertices as f64,
            phong: pixels(place, view),
        }
    }
}

/// Estimates the pixels that an object's box covers, at most those of the frame.
fn pixels(Place { center, half_size: half, radius }: Place, view: &SizedView) -> f64 {
    let [width, height] = view.size.map(f64::from);
    // Projected area of the box in square metres: one face of each pair is visible.
    let projected = |direction: DVec3| {
        4.0 * DVec3::new(half.y * half.z, half.x * half.z, half.x * half.y).dot(direction.abs())
    };
    let (area, wide, high) = match view.view.volume {
        ViewVolume::Perspective { half_width, half_height, .. } => {
            let to_center = center - view.view.eye;
            let distance = to_center.length();
            if distance <= radius {
                return width * height;
            }
            (projected(to_center / distance) / (distance * distance), half_width, half_height)
        }
        ViewVolume::Orthographic { half_width, half_height, .. } => {
            (projected(view.view.basis.z_axis), half_width, half_height)
        }
    };
    (area * (0.25 * width * height / (wide * high)).abs()).min(width * height)
}

#[cfg(test)]
mod tests {
    use bevy_ecs::prelude::*;
    use lumbre_scene::{Camera, GlobalTransform, Transform};

    use super::*;
    use crate::extract::CameraView;

    #[test]
    fn a_box_covers_the_pixels_that_it_projects_to() {
        let mut world = World::new();
        let place = Transform::from_xyz(0.0, 0.0, 100.0);
        let camera = world.spawn((Camera::default(), GlobalTransform(place.affine()))).id();
        let view = CameraView::new(&world, camera, 2.0).unwrap();
        let ViewVolume::Perspective { half_width, half_height, .. } = view.volume else { panic!() };
        let view = SizedView { view, size: [400, 200], exposure: 1.0 };
        let object = Place { center: DVec3::ZERO, half_size: DVec3::new(2.0, 1.0, 1e-3), radius: 3.0 };
        // Its front face of 4 x 2 m at a distance of 100 m.
        let expected = (4.0 * 400.0 / (200.0 * half_width)) * (2.0 * 200.0 / (200.0 * half_height));
        assert!((pixels(object, &view) / expected - 1.0).abs() < 1e-9);
        let around = Place { center: DVec3::new(0.0, 0.0, 99.0), ..object };
        assert_eq!(pixels(around, &view), 80_000.0, "the eye is in it");
        let near = Place { center: DVec3::new(0.0, 0.0, 96.9), ..object };
        assert!(pixels(near, &view) <= 80_000.0);
    }
}
