//! The example runs and does what it says.

use std::process::Command;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_optics::{Light, Material};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

#[test]
fn bake_file_bakes_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.glb"), folder.path().join("out.glb"));
    let mut world = World::new();
    let floor = Arc::new(lumbre_mesh::shapes::cuboid(Vec3::new(3.0, 0.2, 3.0), 1));
    world.spawn((Mesh(floor), Material::matt(Vec3::splat(0.5)), StaticObject));
    // Saved with `bake: dynamic` it would light nothing.
    let lamp = Light { bake: lumbre_optics::BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((lamp, Transform::from_xyz(0.0, 2.0, 0.0)));
    lumbre_scene::save(&mut world, &input).unwrap();

    // Cargo builds examples beside the tests.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.set_file_name("examples");
    let example = example.join("bake_file").with_extension(std::env::consts::EXE_EXTENSION);
    let arguments = ["--draft", "--map-size", "16"];
    let ran = Command::new(example).args([&input, &output]).args(arguments).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));

    let mut baked = World::new();
    lumbre_scene::load(&mut baked, &output).unwrap();
    let mut maps = baked.query::<&Lightmap>();
    let map = maps.single(&baked).unwrap();
    assert_eq!((map.image.width, map.image.height), (16, 16));
    assert!(map.image.texels.iter().any(|texel| texel.x > 0.05));
}
