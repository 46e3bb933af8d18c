//! Adds blocks, furniture, lights and a camera to a world at any scale. The scenes are in the other modules.

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Surface};
use lumbre_scene::{ActiveCamera, Camera, Mesh, Name, Projection, SceneSettings, StaticObject, Transform};

use super::region::Region;

/// Builds a world. Coordinates are in metres at scale 1 and are multiplied by the scale.
pub struct Builder {
    pub world: World,
    pub scale: f64,
}

pub fn matt(reflectance: [f32; 3], emission: [f32; 3]) -> Material {
    let front = Surface { diffuse: reflectance.into(), emission: emission.into(), ..Surface::default() };
    Material { front, ..Material::default() }
}

/// Turns a mesh inside out. (`common::shapes` has the same function; examples include the scenes without that module.)
pub fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

pub const WHITE: [f32; 3] = [0.72, 0.7, 0.66];
pub const CLAY: [f32; 3] = [0.55, 0.24, 0.16];
pub const WOOD: [f32; 3] = [0.45, 0.33, 0.2];
pub const GREEN: [f32; 3] = [0.2, 0.45, 0.22];
pub const NONE: [f32; 3] = [0.0; 3];

impl Builder {
    pub fn new(scale: f64) -> Self {
        Self { world: World::new(), scale }
    }

    pub fn mesh(&mut self, name: &str, mesh: TriangleMesh, material: Material, at: DVec3, turn: f64) {
        let place = Transform::from_translation(at * self.scale).with_rotation(DQuat::from_rotation_y(turn));
        self.world.spawn((Name::new(name.to_owned()), Mesh(Arc::new(mesh)), material, StaticObject, place));
    }

    /// A box from its lowest to its highest corner, turned about its own vertical axis.
    pub fn block(&mut self, name: &str, low: [f64; 3], high: [f64; 3], color: [f32; 3], turn: f64) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let mesh = shapes::cuboid(((high - low) * self.scale).as_vec3(), 1);
        self.mesh(name, mesh, matt(color, NONE), (low + high) / 2.0, turn);
    }

    /// An emissive box.
    pub fn lamp(&mut self, name: &str, low: [f64; 3], high: [f64; 3], radiance: [f32; 3]) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let mesh = shapes::cuboid(((high - low) * self.scale).as_vec3(), 1);
        self.mesh(name, mesh, matt([0.5; 3], radiance), (low + high) / 2.0, 0.0);
    }

    /// A box without its bottom face, for objects that stand on the ground. The bottom would be lit by the baker's sky,
    /// which also lies below the horizon.
    pub fn standing(&mut self, name: &str, low: [f64; 3], high: [f64; 3], color: [f32; 3]) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let mut mesh = shapes::cuboid(((high - low) * self.scale).as_vec3(), 1);
        let without_bottom = mesh.indices.chunks_exact(3).filter(|t| mesh.normals[t[0] as usize].y > -0.5);
        mesh.indices = without_bottom.flatten().copied().collect();
        self.mesh(name, mesh, matt(color, NONE), (low + high) / 2.0, 0.0);
    }

    /// A box seen from inside.
    pub fn shell(&mut self, name: &str, low: [f64; 3], high: [f64; 3], color: [f32; 3]) {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let mesh = inside_out(shapes::cuboid(((high - low) * self.scale).as_vec3(), 1));
        self.mesh(name, mesh, matt(color, NONE), (low + high) / 2.0, 0.0);
    }

    /// A point light; its intensity grows with the square of the scale, so that the irradiance stays the same.
    pub fn point_light(&mut self, at: [f64; 3], color: [f32; 3]) {
        let strength = (self.scale * self.scale) as f32;
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::from(color) * strength) };
        self.world.spawn((light, Transform::from_translation(DVec3::from(at) * self.scale)));
    }

    /// A table with four legs.
    pub fn table(&mut self, x: f64, z: f64, turn: f64) {
        self.mesh_at_turn("table board", [1.2, 0.04, 0.7], [x, 0.73, z], turn, [0.0; 3]);
        for (dx, dz) in [(-0.55, -0.3), (0.55, -0.3), (-0.55, 0.3), (0.55, 0.3)] {
            self.mesh_at_turn("table leg", [0.06, 0.71, 0.06], [x, 0.355, z], turn, [dx, 0.0, dz]);
        }
    }

    /// A wooden box at the position `off` relative to `at`, rotated together with that offset about the vertical axis.
    pub fn mesh_at_turn(&mut self, name: &str, size: [f64; 3], at: [f64; 3], turn: f64, off: [f64; 3]) {
        let mesh = shapes::cuboid((DVec3::from(size) * self.scale).as_vec3(), 1);
        let at = DVec3::from(at) + DQuat::from_rotation_y(turn) * DVec3::from(off);
        self.mesh(name, mesh, matt(WOOD, NONE), at, turn);
    }

    /// A closed cupboard of six boards; no light reaches its inside.
    pub fn closed_cupboard(&mut self, low: [f64; 3], high: [f64; 3]) {
        const BOARD: f64 = 0.02;
        let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
        self.block("cupboard floor", low, [x1, y0 + BOARD, z1], WOOD, 0.0);
        self.block("cupboard top", [x0, y1 - BOARD, z0], high, WOOD, 0.0);
        let (y0, y1) = (y0 + BOARD, y1 - BOARD);
        self.block("cupboard left", [x0, y0, z0], [x0 + BOARD, y1, z1], WOOD, 0.0);
        self.block("cupboard right", [x1 - BOARD, y0, z0], [x1, y1, z1], WOOD, 0.0);
        let (x0, x1) = (x0 + BOARD, x1 - BOARD);
        self.block("cupboard back", [x0, y0, z0], [x1, y1, z0 + BOARD], WOOD, 0.0);
        self.block("cupboard door", [x0, y0, z1 - BOARD], [x1, y1, z1], WOOD, 0.0);
    }

    /// A directional light that travels along a direction and gives this irradiance to a surface perpendicular to it.
    pub fn sun(&mut self, along: DVec3, irradiance: [f32; 3]) {
        let color = Vec3::from(irradiance) / std::f32::consts::PI;
        let light = Light { bake: BakeMode::Static, ..Light::directional(color) };
        let place = Transform::IDENTITY.looking_at(along, DVec3::Y);
        self.world.spawn((Name::new("sun"), light, place));
    }

    pub fn sky(&mut self, radiance: [f32; 3]) {
        let sky = Vec3::from(radiance);
        self.world.insert_resource(SceneSettings { sky, background: sky, ..SceneSettings::default() });
    }

    /// The active camera, with the view of a player.
    pub fn camera(&mut self, at: [f64; 3], target: [f64; 3]) {
        let place = Transform::from_translation(DVec3::from(at) * self.scale)
            .looking_at(DVec3::from(target) * self.scale, DVec3::Y);
        let near = 0.02 * self.scale;
        let projection = Projection::Perspective { vertical_fov: 1.1, aspect: None, near, far: None };
        self.world.spawn((
            Name::new("view"),
            Camera { projection, ..Camera::default() },
            ActiveCamera,
            place,
        ));
    }

    /// The region that a player sees, and the rectangles (a corner and two edges) through which most of its light
    /// enters.
    pub fn region(&mut self, low: [f64; 3], high: [f64; 3], openings: &[[[f64; 3]; 3]]) {
        let scaled = |point: [f64; 3]| DVec3::from(point) * self.scale;
        let openings = openings.iter().map(|opening| opening.map(scaled)).collect();
        let region = Region { low: scaled(low), high: scaled(high), openings };
        self.world.insert_resource(region);
    }
}
