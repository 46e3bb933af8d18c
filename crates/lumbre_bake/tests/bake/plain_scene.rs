//! Bakes from and to plain data: a scene without a World bakes to the same bits as the World with the same content.

use std::sync::Arc;

use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use lumbre_bake::{
    Bake, BakeError, BakeOptions, Density, PlacedLight, PlacedPrimitive, Quality, SceneObject, StaticScene,
    TexelErrors,
};
use lumbre_mesh::shapes;
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{
    DynamicObject, IrradianceVolume, Lightmap, Mesh, Name, SceneSettings, StaticObject, Transform,
};

fn options() -> BakeOptions {
    BakeOptions { density: Density::TexelsPerMeter(6.0), quality: Quality::Draft, ..BakeOptions::default() }
}

fn reflecting(reflectance: Vec3) -> Material {
    crate::scene_parts::matt(reflectance, Vec3::ZERO)
}

/// A floor and two rotated boxes that share a mesh under a point light and a sky, and a dynamic ball between them.
struct Scene {
    floor: Arc<lumbre_mesh::TriangleMesh>,
    block: Arc<lumbre_mesh::TriangleMesh>,
    ball: Arc<lumbre_mesh::TriangleMesh>,
    lamp: Light,
}

const FLOOR: Vec3 = Vec3::new(0.7, 0.5, 0.3);
const BLOCK: Vec3 = Vec3::new(0.2, 0.4, 0.6);
const LAMP: DVec3 = DVec3::new(0.3, 2.5, 0.2);
const SKY: Vec3 = Vec3::new(0.1, 0.2, 0.3);

impl Scene {
    fn new() -> Self {
        Self {
            floor: Arc::new(shapes::plane(4.0, 4.0, 1, 1)),
            block: Arc::new(shapes::cuboid(Vec3::splat(0.8), 1)),
            ball: Arc::new(shapes::uv_sphere(0.3, 8, 6)),
            lamp: Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(5.0)) },
        }
    }

    fn places() -> [Transform; 2] {
        [(-0.9, 0.4), (0.8, 1.1)].map(|(x, angle)| Transform {
            rotation: DQuat::from_rotation_y(angle),
            ..Transform::from_xyz(x, 0.4, 0.1)
        })
    }

    fn world(&self) -> World {
        let mut world = World::new();
        world.insert_resource(SceneSettings { sky: SKY, ..SceneSettings::default() });
        world.spawn((Name::new("floor"), Mesh(Arc::clone(&self.floor)), reflecting(FLOOR), StaticObject));
        for (index, place) in Self::places().into_iter().enumerate() {
            let name = Name::new(format!("block {index}"));
            world.spawn((name, Mesh(Arc::clone(&self.block)), reflecting(BLOCK), StaticObject, place));
        }
        world.spawn((
            Mesh(Arc::clone(&self.ball)),
            reflecting(BLOCK),
            DynamicObject,
            Transform::from_xyz(0.0, 1.0, 0.0),
        ));
        world.spawn((self.lamp.clone(), Transform { translation: LAMP, ..Transform::IDENTITY }));
        world
    }

    fn plain(&self) -> StaticScene {
        let primitive = |mesh: &Arc<_>, material: Material, transform| PlacedPrimitive {
            mesh: Arc::clone(mesh),
            material,
            transform,
            ..PlacedPrimitive::default()
        };
        let floor = primitive(&self.floor, reflecting(FLOOR), DAffine3::IDENTITY);
        let mut objects = vec![SceneObject::new("floor", vec![floor])];
        for (index, place) in Self::places().into_iter().enumerate() {
            let block = primitive(&self.block, reflecting(BLOCK), place.affine());
            objects.push(SceneObject::new(format!("block {index}"), vec![block]));
        }
        let moving = self.ball.positions.iter().map(|point| point.as_dvec3() + DVec3::Y).collect();
        StaticScene {
            objects,
            lights: vec![PlacedLight { light: self.lamp.clone(), position: LAMP, axis: -DVec3::Z }],
            sky: SKY,
            moving: Some(moving),
        }
    }
}

#[test]
fn a_scene_without_a_world_bakes_to_the_same_bits() {
    let scene = Scene::new();
    let mut world = scene.world();
    let options = BakeOptions { atlas_size: Some(256), ..options() };
    let of_world = Bake::new(&options).run(&mut world).unwrap();
    let mut plain = scene.plain();
    // The objects of a World are baked in the order of their entities, so that the plain scene needs the same order.
    let mut named: Vec<(Entity, Name)> =
        world.query::<(Entity, &Name)>().iter(&world).map(|(entity, name)| (entity, name.clone())).collect();
    named.sort_by_key(|(entity, _)| *entity);
    let place = |object: &SceneObject| named.iter().position(|(_, name)| name.as_str() == object.name);
    plain.objects.sort_by_key(place);
    let names: Vec<String> = plain.objects.iter().map(|object| object.name.clone()).collect();
    let baked = Bake::new(&options).run_scene(plain).unwrap();
    assert_eq!(baked.report.content_hash, of_world.content_hash);
    assert_eq!((baked.report.rays, baked.report.estimated_error), (of_world.rays, of_world.estimated_error));
    let mut query = world.query::<(&Name, &Mesh, &Lightmap, &TexelErrors)>();
    let mut count = 0;
    for (name, mesh, map, errors) in query.iter(&world) {
        let index = names.iter().position(|other| other == name.as_str()).unwrap();
        let object = &baked.objects[index];
        let baked_map = &baked.maps[object.map];
        assert_eq!(*object.meshes[0], *mesh.0, "{name}");
        assert_eq!(baked_map.image, map.image, "{name}");
        assert!(baked_map.separate.is_none(), "nobody asked for it");
        let bits = |errors: &TexelErrors| errors.0.iter().map(|error| error.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&baked_map.errors), bits(errors), "{name}");
        count += 1;
    }
    assert_eq!(count, baked.objects.len());
    let (place, volume) = baked.volume.unwrap();
    let mut query = world.query::<(&Transform, &IrradianceVolume)>();
    let (of_world, expected) = query.single(&world).unwrap();
    assert_eq!((&place, &volume.cubes), (of_world, &expected.cubes));
}

#[test]
fn samples_can_be_reused_without_a_world() {
    let scene = Scene::new();
    let mut samples = None;
    let first = Bake::new(&options()).keep_samples(&mut samples).run_scene(scene.plain()).unwrap();
    let again = Bake::new(&options()).former(samples.as_ref()).run_scene(scene.plain()).unwrap();
    let rebake = again.report.rebake.unwrap();
    assert_eq!((rebake.relit, rebake.gathered), (0, 0), "{rebake}");
    for (first, again) in first.maps.iter().zip(&again.maps) {
        assert_eq!(first.image, again.image);
    }
}

#[test]
fn invalid_objects_are_refused_by_name() {
    let refused = |change: &dyn Fn(&mut StaticScene)| {
        let mut scene = Scene::new().plain();
        change(&mut scene);
        Bake::new(&options()).run_scene(scene).unwrap_err()
    };
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(&|scene| scene.objects[1].lightmap_scale = scale);
        assert!(matches!(&error, BakeError::LightmapScale { object, .. } if object == "block 0"), "{error}");
    }
    let error = refused(&|scene| {
        let broken = lumbre_mesh::TriangleMesh {
            indices: vec![0, 1, 99],
            ..(*scene.objects[2].primitives[0].mesh).clone()
        };
        scene.objects[2].primitives[0].mesh = Arc::new(broken);
    });
    assert!(matches!(&error, BakeError::Mesh { object, .. } if object == "block 1"), "{error}");
}

#[test]
fn a_scene_with_nothing_to_bake_is_reported_and_no_error() {
    let empty = Bake::new(&options()).run_scene(StaticScene::default()).unwrap();
    assert!(empty.objects.is_empty() && empty.maps.is_empty() && empty.volume.is_none());
    assert_eq!(empty.report.skipped, ["everything: the scene has no static mesh"]);
    // An invalid sky and a disabled light count as no light.
    let mut dark = Scene::new().plain();
    dark.sky = Vec3::new(f32::NAN, 1.0, 1.0);
    dark.lights[0].light.enabled = false;
    let dark = Bake::new(&options()).run_scene(dark).unwrap();
    assert!(dark.maps.is_empty() && dark.report.skipped[0].contains("no sky"), "{:?}", dark.report.skipped);
}
