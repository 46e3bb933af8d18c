//! The tessellated twin of an exact surface, which frames draw, with normals by the surface's equation. An entity
//! that gets a [`Quadric`] and has no mesh gets this one.

use std::sync::Arc;

use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use glam::{DVec3, Vec2, Vec3};
use lumbre_mesh::surfaces::{Cone, Cylinder, GeneralQuadric, MAX_CELLS, implicit_mesh, parametric_mesh};
use lumbre_mesh::{TriangleMesh, shapes};

use crate::{Mesh, Quadric, QuadricShape};

/// Marks an entity whose [`Mesh`] was made from its [`Quadric`]. Another `Quadric` that is inserted replaces the
/// mesh.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct QuadricMesh;

impl Quadric {
    /// Number of segments around the axis in the mesh of an entity without a mesh of its own.
    pub const SEGMENTS: u32 = 64;
    /// Distance from the origin, along each axis, up to which the mesh of a surface without an end reaches.
    pub const MESH_REACH: f64 = 100.0;

    /// A mesh of the surface with `segments` (3 to [`shapes::MAX_SEGMENTS`]) around its axis. General quadrics
    /// have half as many cells along the longest side of their bounds, at most
    /// [`MAX_CELLS`](lumbre_mesh::surfaces::MAX_CELLS). The distance from the surface falls with the square of
    /// `segments`. Empty if nothing of the surface is inside its trim, or if f32 cannot hold its
    /// size.
    pub fn mesh(&self, segments: u32) -> TriangleMesh {
        let mesh = self.mesh_of_any_size(segments);
        let finite = mesh.positions.iter().all(|position| position.is_finite());
        if finite { mesh } else { TriangleMesh::default() }
    }

    fn mesh_of_any_size(&self, segments: u32) -> TriangleMesh {
        let segments = segments.clamp(3, shapes::MAX_SEGMENTS);
        let rings = (segments / 2).max(2);
        let whole = match self.shape {
            QuadricShape::Plane => return self.plane(),
            QuadricShape::General { coefficients } => return self.general(coefficients, rings),
            QuadricShape::Sphere { radius } => shapes::uv_sphere(radius as f32, segments, rings),
            QuadricShape::Cylinder { radius, height, closed: true } => {
                shapes::cylinder(radius as f32, height as f32, segments)
            }
            QuadricShape::Cylinder { radius, height, closed: false } => {
                parametric_mesh(&Cylinder { radius, height }, segments, 1).unwrap_or_default()
            }
            QuadricShape::Cone { radius, height, closed } => cone(Cone { radius, height }, closed, segments),
        };
        match self.trim {
            Some(trim) => whole.clipped_to_box(trim),
            None => whole,
        }
    }

    /// Returns true if the surface has no end in some direction, so that its mesh shows only a part of it.
    pub fn is_endless(&self) -> bool {
        self.tight_bounds().iter().any(|corner| !corner.is_finite())
    }

    /// [`bounds`](Self::bounds), and those of ellipsoids that are given by their coefficients.
    fn tight_bounds(&self) -> [DVec3; 2] {
        let [low, high] = self.bounds();
        let QuadricShape::General { coefficients } = self.shape else { return [low, high] };
        match (GeneralQuadric { coefficients }).ellipsoid_bounds() {
            Some([own_low, own_high]) => {
                // With room for rounding, since the surface touches its bounds.
                let room = 1e-6 * (own_high - own_low);
                [low.max(own_low - room), high.min(own_high + room)]
            }
            None => [low, high],
        }
    }

    /// The bounds with ends: open sides end at [`MESH_REACH`](Self::MESH_REACH).
    fn finite_bounds(&self) -> [DVec3; 2] {
        let [low, high] = self.tight_bounds();
        let reach = DVec3::splat(Self::MESH_REACH);
        let finite = |own: DVec3, otherwise: DVec3| DVec3::select(own.is_finite_mask(), own, otherwise);
        [finite(low, -reach.max(reach - high)), finite(high, reach.max(reach + low))]
    }

    fn plane(&self) -> TriangleMesh {
        let [low, high] = self.finite_bounds().map(|corner| corner.as_vec3());
        if !low.cmple(high).all() {
            return TriangleMesh::default();
        }
        let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
        TriangleMesh {
            positions: vec![
                corner(low.x, high.z),
                corner(high.x, high.z),
                corner(high.x, low.z),
                corner(low.x, low.z),
            ],
            normals: vec![Vec3::Y; 4],
            uv0: vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..TriangleMesh::default()
        }
    }

    fn general(&self, coefficients: [f64; 10], cells: u32) -> TriangleMesh {
        let cells = cells.min(MAX_CELLS);
        implicit_mesh(&GeneralQuadric { coefficients }, self.finite_bounds(), cells).unwrap_or_default()
    }
}

/// A cone in rings, so that normals near the apex belong to their own segments.
fn cone(side: Cone, closed: bool, segments: u32) -> TriangleMesh {
    let mut mesh = parametric_mesh(&side, segments, segments / 2).unwrap_or_default();
    if closed {
        mesh.append(shapes::disc(side.radius as f32, -0.5 * side.height as f32, segments));
    }
    mesh
}

/// Gives an entity without a mesh of its own the mesh of the exact surface that was inserted.
pub(crate) fn insert_mesh(mut world: DeferredWorld<'_>, context: HookContext) {
    let entity = world.entity(context.entity);
    let own = entity.contains::<Mesh>() && !entity.contains::<QuadricMesh>();
    let Some(quadric) = entity.get::<Quadric>().filter(|quadric| !own && quadric.validate().is_ok()) else {
        return;
    };
    let mesh = Mesh(Arc::new(quadric.mesh(Quadric::SEGMENTS)));
    world.commands().entity(context.entity).insert((mesh, QuadricMesh));
}
