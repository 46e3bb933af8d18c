//! A camera for files without one: outside of the scene, looking into the open side of a room. Not a camera
//! path.
//!
//! Of the six views along the axes, the one that sees deepest into the scene is chosen. Parallel rays on a
//! regular grid enter the bounding box of the scene at its near face. The depth at which they hit the first
//! triangle, as a fraction of the depth of the box, is averaged over the grid without the rays that miss. A
//! closed side stops the rays at once (0), the open side of a room lets them reach its back wall (nearly 1),
//! and a single object stops them halfway from every side. A side from which some of the rays pass through
//! backs that are not drawn counts for less, such as that of a sign which can be read from the other, and so does the
//! narrower side of a scene. Horizontal views are preferred to those from above
//! or below unless the latter see much deeper, and among equals the first of +Z, +X, -X, -Z, +Y, -Y wins: +Z
//! is what glTF calls the front. A landscape, of which a horizontal view would show little but an edge, is seen
//! from a raised point unless something covers it.

use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec2, DVec3};
use lumbre_optics::Material;

use crate::{Bounds, Camera, GlobalTransform, Mesh, Projection, Transform, hidden_entities, scene_bounds};

/// Rays along each side of the grid: enough to find a door, few enough to stay fast for large meshes.
const GRID: usize = 24;
/// Vertical field of view in radians.
const VERTICAL_FOV: f64 = 0.7;
/// Factor on the distance that leaves a margin around the scene.
const MARGIN: f64 = 1.05;
/// How much deeper than the best view before it a horizontal view must see to replace it, so that a small
/// gain does not move the camera away from the front.
const ADVANTAGE: f64 = 0.1;
/// The same for views from above and below.
const VERTICAL_ADVANTAGE: f64 = 0.4;

/// A horizontal view is raised if the scene would fill less than this fraction of the frame's height, and to this
/// angle in radians.
const LOW: f64 = 0.25;
const RAISED: f64 = std::f64::consts::FRAC_PI_6;
/// It is not raised unless rays from above reach at least this depth.
const OPEN_ABOVE: f64 = 0.5;

/// Thickness, as a fraction of the scene's radius, below which a scene counts as flat.
const FLAT: f64 = 1e-4;

/// The viewing directions in order of preference; the camera is on the opposite side of the scene.
const DIRECTIONS: [DVec3; 6] = [DVec3::NEG_Z, DVec3::NEG_X, DVec3::X, DVec3::Z, DVec3::NEG_Y, DVec3::Y];

/// A camera that frames the scene for the aspect ratio `aspect` (width / height). Global transforms must be
/// up to date.
///
/// An empty scene gives a camera at (0, 0, 5) that looks at the origin.
pub fn default_camera(world: &mut World, aspect: f64) -> (Transform, Camera) {
    let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
    let bounds = scene_bounds(world);
    if bounds.is_empty() {
        return (Transform::from_xyz(0.0, 0.0, 5.0), Camera::default());
    }
    let mut best = (DIRECTIONS[0], f64::NEG_INFINITY);
    let size = bounds.max - bounds.min;
    // The width of the side that a horizontal view shows.
    let width = |direction: DVec3| size.dot(direction.cross(DVec3::Y).abs());
    let widest = size.x.max(size.z).max(f64::MIN_POSITIVE);
    let depths = depths(world, &bounds);
    for (&direction, depth) in DIRECTIONS.iter().zip(depths) {
        let (share, advantage) = match direction.y == 0.0 {
            true => ((width(direction) / widest).sqrt(), ADVANTAGE),
            false => (1.0, VERTICAL_ADVANTAGE),
        };
        if share * depth > best.1 + advantage {
            best = (direction, share * depth);
        }
    }
    let mut direction = best.0;
    // A roof would hide what it covers.
    let [.., from_above, _] = depths;
    if direction.y == 0.0 && from_above > OPEN_ABOVE && size.y * aspect < LOW * width(direction) {
        direction = RAISED.cos() * direction - RAISED.sin() * DVec3::Y;
    }
    frame(&bounds, direction, aspect)
}

fn frame(bounds: &Bounds, direction: DVec3, aspect: f64) -> (Transform, Camera) {
    let is_vertical = direction.x == 0.0 && direction.z == 0.0;
    let up = if is_vertical { DVec3::NEG_Z } else { DVec3::Y.reject_from_normalized(direction).normalize() };
    let half = 0.5 * (bounds.max - bounds.min);
    let right = direction.cross(up);
    let extent = |axis: DVec3| half.dot(axis.abs());
    let tangent = (0.5 * VERTICAL_FOV).tan();
    // The near face of the box decides, as it appears largest. A scene without extent still gets a positive
    // distance.
    let needed = (extent(up) / tangent).max(extent(right) / (tangent * aspect)) * MARGIN;
    let size = bounds.radius().max(1e-3);
    let distance = (needed + extent(direction)).max(1.1 * extent(direction) + 0.01 * size).max(size);
    let center = bounds.center();
    let transform = Transform::from_translation(center - direction * distance).looking_at(center, up);
    let near = (1e-3 * size).min(0.05).max(1e-6 * size);
    let projection = Projection::Perspective { vertical_fov: VERTICAL_FOV, aspect: None, near, far: None };
    (transform, Camera { projection, exposure: 1.0 })
}

/// The mean depth of the first hits for each viewing direction, from 0 to 1, over the rays that hit something in either
/// direction; those that pass backs which are not drawn count as 0.
fn depths(world: &mut World, bounds: &Bounds) -> [f64; 6] {
    // A flat scene has no depth, but its coordinates must not overflow. Rounded rotations leave a plane some thickness,
    // along which it would be seen from its edge.
    let least = (FLAT * bounds.radius()).max(1e-200);
    let size = (bounds.max - bounds.min).max(DVec3::splat(least));
    // Maps the bounding box to [0, 1]³, so that one grid serves all directions, and a flat one to its middle.
    let unit = DAffine3::from_translation(DVec3::splat(0.5))
        * DAffine3::from_scale(size.recip())
        * DAffine3::from_translation(-bounds.center());
    let mut first = vec![[f64::INFINITY; GRID * GRID]; 6];
    let hidden = hidden_entities(world);
    let mut query = world.query::<(Entity, &Mesh, &GlobalTransform, Option<&Material>)>();
    for (_, mesh, transform, material) in query.iter(world).filter(|object| !hidden.contains(&object.0)) {
        let to_unit = unit * transform.0;
        let mirrored = to_unit.matrix3.determinant() < 0.0;
        let double_sided = material.is_some_and(|material| material.double_sided);
        let position =
            |index: u32| mesh.0.positions.get(index as usize).map(|p| to_unit.transform_point3(p.as_dvec3()));
        for corners in mesh.0.triangles() {
            let [Some(a), Some(mut b), Some(mut c)] = corners.map(position) else { continue };
            if mirrored {
                (b, c) = (c, b);
            }
            let normal = (b - a).cross(c - a);
            for (direction, depths) in DIRECTIONS.iter().zip(&mut first) {
                // Back faces that are not drawn do not block the view: rooms are often modelled with
                // one-sided walls.
                if double_sided || normal.dot(*direction) < 0.0 {
                    splat([a, b, c], *direction, depths);
                }
            }
        }
    }
    std::array::from_fn(|view| {
        let depths = first[view].iter().copied().filter(|depth| depth.is_finite());
        // The ray of a cell is the same from both ends.
        let is_opposite = |direction: &DVec3| *direction == -DIRECTIONS[view];
        let opposite = DIRECTIONS.iter().position(is_opposite).map_or(&first[view], |other| &first[other]);
        let either = first[view].iter().zip(opposite).filter(|(a, b)| a.min(**b).is_finite()).count();
        // The mean over all rays that hit something, of which those that pass backs count as 0.
        depths.sum::<f64>() / either.max(1) as f64
    })
}

/// Rasterizes a triangle in the unit cube into the grid of rays and keeps the smaller depths.
fn splat(corners: [DVec3; 3], direction: DVec3, depths: &mut [f64; GRID * GRID]) {
    let axis = direction.abs().max_position();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = corners.map(|corner| DVec2::new(corner[u], corner[v]));
    let depth = corners.map(|corner| if direction[axis] > 0.0 { corner[axis] } else { 1.0 - corner[axis] });
    let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
    // The triangle is seen edge-on, or has a NaN coordinate.
    if area.is_nan() || area == 0.0 {
        return;
    }
    let low = flat[0].min(flat[1]).min(flat[2]);
    let high = flat[0].max(flat[1]).max(flat[2]);
    let cell = |value: f64| (value * GRID as f64 - 0.5).clamp(-1.0, GRID as f64);
    let range = |low: f64, high: f64| {
        (cell(low).ceil().max(0.0) as usize)..(cell(high).floor() + 1.0).clamp(0.0, GRID as f64) as usize
    };
    for row in range(low.y, high.y) {
        for column in range(low.x, high.x) {
            let point = (DVec2::new(column as f64, row as f64) + 0.5) / GRID as f64;
            let weight = |i: usize| (flat[(i + 1) % 3] - point).perp_dot(flat[(i + 2) % 3] - point) / area;
            let weights = [weight(0), weight(1), weight(2)];
            if weights.iter().all(|&weight| weight >= 0.0) {
                let here = weights[0] * depth[0] + weights[1] * depth[1] + weights[2] * depth[2];
                let nearest = &mut depths[row * GRID + column];
                *nearest = nearest.min(here);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;
    use lumbre_mesh::TriangleMesh;

    use super::*;
    use crate::update_transforms;

    /// The walls of a unit cube as a double-sided mesh, without the one in direction `open`.
    fn room(open: Option<DVec3>) -> World {
        let mut mesh = TriangleMesh::default();
        for direction in DIRECTIONS {
            if Some(direction) == open {
                continue;
            }
            let side = direction.any_orthonormal_vector();
            let other = direction.cross(side);
            let start = mesh.positions.len() as u32;
            for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                mesh.positions.push((0.5 * (direction + s * side + t * other)).as_vec3());
            }
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| corner + start));
        }
        let mut world = World::new();
        world.spawn((Mesh(Arc::new(mesh)), Material { double_sided: true, ..Material::default() }));
        update_transforms(&mut world);
        world
    }

    #[test]
    fn looks_into_the_open_side() {
        for open in DIRECTIONS {
            let mut world = room(Some(open));
            let (transform, _) = default_camera(&mut world, 1.5);
            let place = transform.translation.normalize();
            assert!(place.dot(open) > 0.999, "open towards {open}, camera at {place}");
            assert!((transform.rotation * DVec3::NEG_Z).dot(-open) > 0.999);
        }
    }

    #[test]
    fn a_closed_thing_is_seen_from_the_front() {
        let (transform, _) = default_camera(&mut room(None), 1.0);
        assert!(transform.translation.z > 1.0 && transform.translation.x.abs() < 1e-9);
    }

    /// Spawns a rectangle around a centre, of these two half sides, that is seen from where their cross product points to.
    fn spawn_rectangle(world: &mut World, center: DVec3, side: DVec3, other: DVec3) {
        let corners = [-side - other, side - other, side + other, other - side];
        let mesh = TriangleMesh {
            positions: corners.map(|corner| (center + corner).as_vec3()).to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..TriangleMesh::default()
        };
        world.spawn((Mesh(Arc::new(mesh)), Material::default()));
    }

    #[test]
    fn a_flat_thing_is_seen_from_its_front_wherever_it_is() {
        for facing in [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z] {
            for distance in [0.0, 5.0, -300.0] {
                let mut world = World::new();
                spawn_rectangle(&mut world, facing * distance, DVec3::Y.cross(facing), DVec3::Y);
                update_transforms(&mut world);
                let (transform, _) = default_camera(&mut world, 1.5);
                let along = (transform.translation - facing * distance).dot(facing);
                assert!(along > 1.0, "at {distance}, facing {facing}: {transform:?}");
            }
        }
    }

    /// A floor whose file rotates it upright from the xy plane by a rounded quaternion is seen from above, as one is that
    /// needs no rotation, not as a line.
    #[test]
    fn a_floor_that_is_turned_by_rounded_numbers_is_seen_from_above() {
        let rounded = DQuat::from_xyzw(-0.7071068286895752, 0.0, 0.0, 0.7071067094802856).normalize();
        for rotation in [DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2), rounded] {
            let mut world = World::new();
            spawn_rectangle(&mut world, DVec3::ZERO, 2.5 * DVec3::X, 2.5 * DVec3::Y);
            let mut floors = world.query_filtered::<Entity, With<Mesh>>();
            let floor = floors.single(&world).unwrap();
            world.entity_mut(floor).insert(Transform { rotation, ..Transform::IDENTITY });
            update_transforms(&mut world);
            let (transform, _) = default_camera(&mut world, 1.5);
            assert!(transform.translation.y > 1.0, "{rotation}: {transform:?}");
        }
    }

    /// A sign before two small things that face away from it, and which alone are seen from behind: deep in the box.
    #[test]
    fn a_sign_is_seen_from_where_it_can_be_read() {
        let mut world = World::new();
        spawn_rectangle(&mut world, DVec3::ZERO, DVec3::X, DVec3::Y);
        spawn_rectangle(&mut world, DVec3::new(1.5, 0.0, -0.1), DVec3::NEG_X * 0.3, DVec3::Y * 0.3);
        spawn_rectangle(&mut world, DVec3::new(1.5, 0.9, -1.0), DVec3::NEG_X * 0.1, DVec3::Y * 0.1);
        update_transforms(&mut world);
        let (transform, _) = default_camera(&mut world, 1.5);
        assert!(transform.translation.z > 1.0, "{transform:?}");
    }

    /// A thing behind a board, seen in the middle of the box along the board.
    #[test]
    fn a_board_is_not_seen_from_its_edge() {
        let mut world = World::new();
        spawn_rectangle(&mut world, DVec3::ZERO, DVec3::X, DVec3::Y);
        spawn_rectangle(&mut world, DVec3::new(0.5, 0.0, -0.1), DVec3::NEG_Z * 0.1, DVec3::Y * 0.9);
        update_transforms(&mut world);
        let (transform, _) = default_camera(&mut world, 1.5);
        assert!(transform.translation.z.abs() > 1.0, "{transform:?}");
    }

    #[test]
    fn a_landscape_is_seen_from_a_raised_point() {
        for (side, other) in [(50.0, 50.0), (50.0, 5.0)] {
            let mut world = World::new();
            spawn_rectangle(&mut world, DVec3::ZERO, DVec3::X * side, DVec3::NEG_Z * other);
            // A wall on it, which makes a horizontal view see deeper than one from above.
            spawn_rectangle(&mut world, DVec3::new(0.0, 1.0, -other), DVec3::X * side, DVec3::Y);
            update_transforms(&mut world);
            let (transform, camera) = default_camera(&mut world, 1.5);
            let down = (transform.rotation * DVec3::NEG_Z).y;
            assert!((-down - RAISED.sin()).abs() < 1e-6, "{transform:?}");
            assert!(transform.translation.z > other && transform.translation.x.abs() < 1e-6, "{transform:?}");
            let Projection::Perspective { vertical_fov, .. } = camera.projection else { panic!("parallel") };
            let (view, tangent) = (transform.affine().inverse(), (0.5 * vertical_fov).tan());
            for (x, y, z) in
                [(-side, 0.0, -other), (side, 2.0, -other), (side, 0.0, other), (-side, 2.0, other)]
            {
                let point = view.transform_point3(DVec3::new(x, y, z));
                assert!(point.y.abs() < -point.z * tangent && point.x.abs() < -point.z * tangent * 1.5);
            }
        }
    }

    #[test]
    fn a_wide_room_is_seen_through_its_open_side() {
        let mut world = World::new();
        let (across, deep) = (DVec3::X * 20.0, DVec3::NEG_Z * 5.0);
        spawn_rectangle(&mut world, DVec3::ZERO, across, deep);
        spawn_rectangle(&mut world, -5.0 * DVec3::Z + 1.5 * DVec3::Y, across, DVec3::Y * 1.5);
        // Its ceiling is seen from both sides.
        spawn_rectangle(&mut world, 3.0 * DVec3::Y, across, deep);
        world.query::<&mut Material>().iter_mut(&mut world).for_each(|mut side| side.double_sided = true);
        update_transforms(&mut world);
        let (transform, _) = default_camera(&mut world, 16.0 / 9.0);
        assert!((transform.rotation * DVec3::NEG_Z).dot(DVec3::NEG_Z) > 0.999, "{transform:?}");
    }

    #[test]
    fn the_whole_box_is_in_the_picture() {
        for aspect in [0.3, 1.0, 3.0] {
            let (transform, camera) = default_camera(&mut room(Some(DVec3::Z)), aspect);
            let Projection::Perspective { vertical_fov, near, .. } = camera.projection else {
                panic!("not a perspective")
            };
            let view = transform.affine().inverse();
            for corner in 0..8 {
                let sign = |bit: u32| if corner >> bit & 1 == 1 { 0.5 } else { -0.5 };
                let point = view.transform_point3(DVec3::new(sign(0), sign(1), sign(2)));
                let tangent = (0.5 * vertical_fov).tan();
                assert!(-point.z > near);
                assert!(point.y.abs() < -point.z * tangent && point.x.abs() < -point.z * tangent * aspect);
            }
        }
    }

    #[test]
    fn nothing_or_a_point_still_gives_a_camera() {
        let (transform, _) = default_camera(&mut World::new(), f64::NAN);
        assert!(transform.affine().is_finite());
        let mut world = World::new();
        let mesh = TriangleMesh {
            positions: vec![glam::Vec3::ONE],
            indices: vec![0, 0, 0],
            ..TriangleMesh::default()
        };
        world.spawn(Mesh(Arc::new(mesh)));
        update_transforms(&mut world);
        let (transform, _) = default_camera(&mut world, 1.0);
        assert!(transform.affine().is_finite());
    }
}
