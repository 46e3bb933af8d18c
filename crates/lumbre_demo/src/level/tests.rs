//! The level is sound and walkable, and `assets/demo.glb` is up to date.

use std::collections::BTreeMap;

use glam::DVec3;
use lumbre_optics::{AlphaMode, BakeMode, Light, Material};
use lumbre_scene::{Camera, DynamicObject, GlobalTransform, Mesh, Name};

use super::*;
use crate::moving::{GameTime, move_things, read_motions};
use crate::{Game, Input};

fn built() -> World {
    let mut world = World::new();
    build(&mut world);
    world
}

fn room_of(point: DVec3) -> Option<&'static str> {
    let holds = |room: &Room| room.bounds.min.cmple(point).all() && point.cmple(room.bounds.max).all();
    rooms().iter().find(|room| holds(room)).map(|room| room.name)
}

#[test]
fn every_room_has_moving_lights_and_there_are_enough_of_them() {
    let mut world = built();
    let mut lights = world.query::<(&Light, &GlobalTransform, Has<DynamicObject>, &Name)>();
    let (mut moving, mut fixed) = (BTreeMap::new(), 0);
    for (light, place, dynamic, name) in lights.iter(&world) {
        light.validate(name.as_str()).unwrap();
        assert_eq!(light.bake == BakeMode::Dynamic, dynamic, "{name}");
        if dynamic {
            *moving.entry(room_of(place.translation()).unwrap_or("between")).or_insert(0) += 1;
        } else {
            fixed += 1;
        }
    }
    assert!(moving.values().sum::<i32>() >= 24, "{moving:?}");
    for room in rooms() {
        assert!(moving.get(room.name).is_some_and(|count| *count >= 3), "{moving:?}");
    }
    assert!(fixed >= 5);
}

#[test]
fn nothing_that_moves_goes_into_a_wall() {
    let (mut world, plan) = (built(), plan());
    let count = read_motions(&mut world).unwrap();
    assert!(count >= 25);
    let mut schedule = Schedule::default();
    schedule.add_systems((move_things, lumbre_scene::propagate_transforms).chain());
    let mut moving = world.query_filtered::<(&GlobalTransform, &Name), With<DynamicObject>>();
    for step in 0..1400 {
        world.insert_resource(GameTime { seconds: f64::from(step) * 0.05 });
        schedule.run(&mut world);
        for (place, name) in moving.iter(&world) {
            // The emissive ball around a light has a radius of 6 cm.
            for axis in DVec3::AXES {
                for side in [-0.06, 0.06] {
                    let point = place.translation() + axis * side;
                    assert!(plan.is_air(point), "{name} at {point} after {} s", f64::from(step) * 0.05);
                }
            }
        }
    }
}

#[test]
fn the_level_shows_every_kind_of_material() {
    let mut world = built();
    let mut materials = world.query::<(&Material, Option<&lumbre_scene::MaterialTextures>)>();
    let has = |wanted: &dyn Fn(&Material) -> bool, world: &World, query: &mut QueryState<_>| {
        query
            .iter(world)
            .any(|(material, _): (&Material, Option<&lumbre_scene::MaterialTextures>)| wanted(material))
    };
    for exponent in [10.0, 100.0, 500.0] {
        assert!(has(
            &|m| m.front.shininess == exponent && m.front.specular != Vec3::ZERO,
            &world,
            &mut materials
        ));
    }
    assert!(has(&|m| matches!(m.alpha_mode, AlphaMode::Mask { .. }), &world, &mut materials));
    assert!(has(&|m| m.alpha_mode == AlphaMode::Blend && m.alpha < 1.0, &world, &mut materials));
    assert!(has(&|m| m.double_sided && m.back.is_some(), &world, &mut materials));
    let textured = materials.iter(&world).filter(|(_, textures)| textures.is_some()).count();
    let plain = materials.iter(&world).filter(|(_, textures)| textures.is_none()).count();
    assert!(textured >= 8 && plain >= 8);
    // No surface reflects much more light than it receives.
    for (material, _) in materials.iter(&world) {
        material.validate("a material of the level").unwrap();
        assert!((material.front.diffuse + material.front.specular).max_element() <= 1.3);
    }
}

#[test]
fn meshes_are_sound_and_few_enough() {
    let mut world = built();
    let mut triangles = 0;
    for mesh in world.query::<&Mesh>().iter(&world) {
        mesh.0.validate().unwrap();
        assert_eq!(mesh.0.normals.len(), mesh.0.positions.len());
        assert!(mesh.0.positions.iter().all(|p| p.is_finite()));
        triangles += mesh.0.triangle_count();
    }
    assert!((10_000..60_000).contains(&triangles), "{triangles}");
}

#[test]
fn cameras_are_in_the_air_and_the_player_stands() {
    let (mut world, plan) = (built(), plan());
    let mut cameras = 0;
    for (place, _) in world.query::<(&GlobalTransform, &Camera)>().iter(&world) {
        assert!(plan.is_air(place.translation()), "{place:?}");
        cameras += 1;
    }
    assert!(cameras >= 10);
    let mut game = Game::new(world).unwrap();
    assert!(!game.player().flying && game.player().body.on_ground);
    let feet = game.player().body.feet;
    game.step(std::time::Duration::from_secs(1), &Input::default());
    assert_eq!(game.player().body.feet, feet);
    assert_eq!(room_of(feet + DVec3::Y), Some("hall"));
}

#[test]
fn built_twice_it_is_the_same() {
    let meshes = |mut world: World| -> Vec<Mesh> { world.query::<&Mesh>().iter(&world).cloned().collect() };
    let (first, second) = (meshes(built()), meshes(built()));
    assert_eq!(first.len(), second.len());
    assert!(first.iter().zip(&second).all(|(a, b)| a.0 == b.0));
}

#[test]
fn the_file_in_assets_is_this_level() {
    // The file may have been written on another machine, whose sine rounds differently: names and counts must
    // match, and places to 10 micrometres.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/demo.glb");
    assert!(std::fs::metadata(path).unwrap().len() < 1 << 20, "the level outgrew its 1 MiB");
    let mut world = World::new();
    lumbre_scene::load(&mut world, std::path::Path::new(path)).unwrap();
    let mut ours = built();
    let names = |world: &mut World| -> BTreeMap<String, DVec3> {
        let mut nodes = world.query::<(&Name, &GlobalTransform)>();
        nodes.iter(world).map(|(name, place)| (name.as_str().to_owned(), place.translation())).collect()
    };
    let (file, built) = (names(&mut world), names(&mut ours));
    assert_eq!(
        file.keys().collect::<Vec<_>>(),
        built.keys().collect::<Vec<_>>(),
        "run the example generate_level"
    );
    for (name, place) in &file {
        assert!(place.distance(built[name]) < 1e-5, "{name}: run the example generate_level");
    }
    let triangles = |world: &mut World| -> usize {
        world.query::<&Mesh>().iter(world).map(|mesh| mesh.0.triangle_count()).sum()
    };
    assert_eq!(triangles(&mut world), triangles(&mut ours));
    assert_eq!(read_motions(&mut world).unwrap(), read_motions(&mut ours).unwrap());
    let colors = |world: &mut World| -> f32 {
        let mut sum = 0.0;
        world.query::<&Light>().iter(world).for_each(|light| sum += light.diffuse.element_sum());
        world
            .query::<&Material>()
            .iter(world)
            .for_each(|m| sum += (m.front.diffuse + m.front.emission).element_sum());
        sum
    };
    let (file, built) = (colors(&mut world), colors(&mut ours));
    assert!((file / built - 1.0).abs() < 1e-4, "{file} for {built}: run the example generate_level");
}
