//! Runs examples of the crate and checks what they print and write.

use std::process::Command;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_optics::{Light, Material};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

/// Returns the command that runs an example. Cargo builds examples into a folder beside that of the tests.
fn example(name: &str) -> Command {
    let mut folder = std::env::current_exe().expect("the path of the running test is known");
    folder.pop();
    folder.set_file_name("examples");
    Command::new(folder.join(name).with_extension(std::env::consts::EXE_EXTENSION))
}

#[test]
fn moved_object_reports_what_was_baked_again() {
    let scene = ["rooms_0", "small crate", "0.1", "0", "0.1"];
    let coarse = ["--error", "0.1", "--texels-per-meter", "3"];
    let output = example("moved_object").args(scene).args(coarse).output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
    assert!(stdout.contains("baked again what changed: small crate (changed)"), "{stdout}");
    assert!(stdout.contains("again and whole are"), "{stdout}");
    let unknown = example("moved_object").args(["rooms_0", "piano", "0", "0", "0"]).output().unwrap();
    assert!(!unknown.status.success());
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("has no object piano"));
}

#[test]
fn bake_file_bakes_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.glb"), folder.path().join("out.glb"));
    let mut world = World::new();
    let floor = Arc::new(lumbre_mesh::shapes::cuboid(Vec3::new(3.0, 0.2, 3.0), 1));
    world.spawn((Mesh(floor), Material::matt(Vec3::splat(0.5)), StaticObject));
    // The default, `BakeMode::Dynamic`, is not baked.
    let lamp = Light { bake: lumbre_optics::BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((lamp, Transform::from_xyz(0.0, 2.0, 0.0)));
    lumbre_scene::save(&mut world, &input).unwrap();

    let run =
        example("bake_file").args([&input, &output]).args(["--draft", "--map-size", "16"]).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));

    let mut baked = World::new();
    lumbre_scene::load(&mut baked, &output).unwrap();
    let mut maps = baked.query::<&Lightmap>();
    let map = maps.single(&baked).unwrap();
    assert_eq!((map.image.width, map.image.height), (16, 16));
    assert!(map.image.texels.iter().any(|texel| texel.x > 0.05));
}
