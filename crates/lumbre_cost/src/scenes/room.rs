//! A furnished room with a glowing panel, lamps that are baked and lamps that are not, a shiny ball and a
//! textured floor. It can be baked in a second.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{BakeMode, Fog, FogMode, Light, Material, SpotCone, Surface};
use lumbre_scene::{
    Camera, DynamicObject, EmissiveLight, Image, MaterialTextures, Mesh, Name, Projection, SceneSettings,
    StaticObject, TextureReference, Transform,
};

/// Inner width, height and depth in metres.
const SIZE: DVec3 = DVec3::new(5.0, 2.8, 4.0);

/// What is in the room besides surfaces and lamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Air {
    /// Nothing, so that a frame shows the same light as rays.
    Clear,
    /// Thin fog, and ambient light instead of interreflection, as in a game without lightmaps.
    Hazy,
}

/// Creates the room. The static lamp and the panel are meant for a bake; in a frame without lightmaps they
/// shine as well.
pub fn room(air: Air) -> World {
    let mut world = World::new();
    let fog = Fog { mode: FogMode::Exponential { density: 0.02 }, color: Vec3::new(0.4, 0.45, 0.5) };
    let hazy = SceneSettings { ambient: Vec3::splat(0.06), fog: Some(fog), ..SceneSettings::default() };
    world.insert_resource(if air == Air::Hazy { hazy } else { SceneSettings::default() });
    walls(&mut world);
    furniture(&mut world);
    lights(&mut world);
    let eye = Transform::from_xyz(0.0, 1.55, 1.9).looking_at(DVec3::new(0.0, 1.0, -1.0), DVec3::Y);
    let projection = Projection::perspective(1.05);
    world.spawn((Name::new("camera"), Camera { projection, exposure: 1.0 }, eye));
    world
}

/// Distance in metres between the centres of two neighbouring rooms.
const APART: f64 = 2.0 * SIZE.x;

/// Creates the clear room and a copy of it with its own light beside it. Moving something in one room changes
/// nothing in the other.
pub fn two_rooms() -> World {
    let mut world = room(Air::Clear);
    let placed =
        world.query_filtered::<Entity, (With<Transform>, Without<Camera>)>().iter(&world).collect::<Vec<_>>();
    for entity in placed {
        let copy = world.entity_mut(entity).clone_and_spawn();
        let mut copy = world.entity_mut(copy);
        if let Some(mut place) = copy.get_mut::<Transform>() {
            place.translation.x += APART;
        }
        if let Some(mut name) = copy.get_mut::<Name>() {
            *name = Name::new(format!("{} next door", name.as_str()));
        }
    }
    world
}

fn fixed(
    world: &mut World,
    name: &str,
    mesh: lumbre_mesh::TriangleMesh,
    material: Material,
    place: Transform,
) -> Entity {
    world.spawn((Name::new(name.to_owned()), Mesh(Arc::new(mesh)), material, place, StaticObject)).id()
}

fn walls(world: &mut World) {
    let half = 0.5 * SIZE;
    let white = || Material::matt(Vec3::splat(0.75));
    let [width, height, depth] = SIZE.as_vec3().to_array();
    let side = |rotation: DQuat, x: f64, y: f64, z: f64| Transform::from_xyz(x, y, z).with_rotation(rotation);
    let quarter = std::f64::consts::FRAC_PI_2;
    let floor = fixed(
        world,
        "floor",
        shapes::plane(width, depth, 8, 8),
        plastic(Vec3::splat(0.7), 0.35),
        Transform::IDENTITY,
    );
    world
        .entity_mut(floor)
        .insert(MaterialTextures { base_color: Some(tiles()), ..MaterialTextures::default() });
    fixed(
        world,
        "ceiling",
        shapes::plane(width, depth, 4, 4),
        white(),
        side(DQuat::from_rotation_x(2.0 * quarter), 0.0, SIZE.y, 0.0),
    );
    fixed(
        world,
        "back wall",
        shapes::plane(width, height, 8, 4),
        white(),
        side(DQuat::from_rotation_x(quarter), 0.0, half.y, -half.z),
    );
    fixed(
        world,
        "front wall",
        shapes::plane(width, height, 4, 4),
        white(),
        side(DQuat::from_rotation_x(-quarter), 0.0, half.y, half.z),
    );
    let red = Material::matt(Vec3::new(0.65, 0.12, 0.08));
    fixed(
        world,
        "left wall",
        shapes::plane(height, depth, 4, 8),
        red,
        side(DQuat::from_rotation_z(-quarter), -half.x, half.y, 0.0),
    );
    let green = Material::matt(Vec3::new(0.15, 0.5, 0.18));
    fixed(
        world,
        "right wall",
        shapes::plane(height, depth, 4, 8),
        green,
        side(DQuat::from_rotation_z(quarter), half.x, half.y, 0.0),
    );
}

fn furniture(world: &mut World) {
    let wood = || Material::matt(Vec3::new(0.45, 0.28, 0.15));
    let block = shapes::cuboid(Vec3::new(0.9, 0.9, 0.9), 3);
    let turned = Transform::from_xyz(-1.2, 0.45, -0.8).with_rotation(DQuat::from_rotation_y(0.4));
    fixed(world, "block", block, wood(), turned);
    let pillar = shapes::cuboid(Vec3::new(0.35, 2.8, 0.35), 3);
    fixed(world, "pillar", pillar, Material::matt(Vec3::splat(0.6)), Transform::from_xyz(1.6, 1.4, -1.2));
    let ball = Mesh(Arc::new(shapes::uv_sphere(0.4, 32, 17)));
    let place = Transform::from_xyz(0.6, 0.4, -0.4);
    world.spawn((Name::new("ball"), ball, plastic(Vec3::new(0.2, 0.3, 0.75), 0.25), place, DynamicObject));
    let mut glass = plastic(Vec3::new(0.5, 0.75, 0.8), 0.2);
    (glass.alpha, glass.alpha_mode, glass.double_sided) = (0.35, lumbre_optics::AlphaMode::Blend, true);
    let pane = Mesh(Arc::new(shapes::plane(0.9, 1.2, 1, 1)));
    let upright = Transform::from_xyz(-0.2, 0.7, 0.1)
        .with_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    world.spawn((Name::new("pane"), pane, glass, upright, DynamicObject));
}

fn lights(world: &mut World) {
    let panel = Material {
        front: Surface { emission: Vec3::new(7.5, 7.2, 6.6), ..Surface::default() },
        ..Material::matt(Vec3::ZERO)
    };
    let down = Transform::from_xyz(-0.8, SIZE.y - 0.02, 0.2)
        .with_rotation(DQuat::from_rotation_x(std::f64::consts::PI));
    let panel = fixed(world, "panel", shapes::plane(1.2, 0.8, 1, 1), panel, down);
    world.entity_mut(panel).insert(EmissiveLight);
    let lamp = Light { bake: BakeMode::Static, radius: 0.05, ..Light::point(Vec3::new(1.3, 1.1, 0.8)) };
    world.spawn((Name::new("lamp"), lamp, Transform::from_xyz(1.4, 2.2, 0.6)));
    let moving = |color: Vec3| Light::point(color).with_range(3.0);
    world.spawn((
        Name::new("red lamp"),
        moving(Vec3::new(0.8, 0.1, 0.1)),
        Transform::from_xyz(-1.9, 0.8, 0.6),
    ));
    world.spawn((
        Name::new("blue lamp"),
        moving(Vec3::new(0.1, 0.2, 0.8)),
        Transform::from_xyz(1.2, 0.6, 0.4),
    ));
    let torch =
        Light { shadow: true, ..Light::spot(Vec3::splat(3.0), SpotCone::Smooth { inner: 0.3, outer: 0.5 }) };
    let aimed = Transform::from_xyz(0.3, 2.5, 1.7).looking_at(DVec3::new(0.4, 0.2, -0.8), DVec3::Y);
    world.spawn((Name::new("torch"), torch, aimed));
}

fn plastic(color: Vec3, roughness: f32) -> Material {
    Material::from_metallic_roughness(color, 0.0, roughness)
}

/// Returns the texture of a chequered floor.
fn tiles() -> TextureReference {
    let side = 64;
    let texel = |x: u32, y: u32| {
        if (x / 8 + y / 8).is_multiple_of(2) { [225, 220, 210, 255] } else { [150, 145, 140, 255] }
    };
    let rgba = (0..side).flat_map(|y| (0..side).flat_map(move |x| texel(x, y))).collect();
    TextureReference::new(Arc::new(Image { name: "tiles".into(), width: side, height: side, rgba }))
}
