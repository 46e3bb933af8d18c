//! The background bake: its light arrives in passes, is assigned to the right surfaces, and can be cancelled
//! and saved.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_bake::{BakeOptions, Density};
use lumbre_demo::{BackgroundBake, BakeError, BakeNews, BakedLight, OpenOptions, Opened};
use lumbre_mesh::shapes::cuboid;
use lumbre_optics::{Material, Surface};
use lumbre_scene::{
    ChildOf, DynamicObject, IrradianceVolume, Lightmap, LoadOptions, Mesh, Name, StaticObject, Transform,
    load, save,
};

/// A red and a blue block far apart, each under a panel, a block that moves, and in front of them a node
/// without a mesh.
fn scene(folder: &Path) -> PathBuf {
    let mut world = World::new();
    world.spawn((Name::new("empty"), Transform::IDENTITY));
    let block = || Mesh(cuboid(Vec3::ONE, 1).into());
    for (name, x, glow) in [("red", -20.0, Vec3::X), ("blue", 20.0, Vec3::Z)] {
        let matt = Material::matt(Vec3::splat(0.5));
        world.spawn((Name::new(name), block(), matt, StaticObject, Transform::from_xyz(x, 0.0, 0.0)));
        let shines = Surface { emission: 5.0 * glow, ..Surface::default() };
        let panel = (block(), Material { front: shines, ..Material::default() }, StaticObject);
        let name = Name::new(format!("{name} panel"));
        world.spawn((name, panel, Transform::from_xyz(x, 2.0, 0.0)));
    }
    world.spawn((Name::new("moves"), block(), DynamicObject, Transform::from_xyz(0.0, 0.0, 5.0)));
    let path = folder.join("blocks.glb");
    save(&mut world, &path).unwrap();
    path
}

/// Small maps: the passes are tested, and not the quality of the light.
fn wanted() -> BakeOptions {
    BakeOptions { density: Density::MapSize(32), error: 0.02, ..BakeOptions::default() }
}

/// Collects all events until nothing is running any more.
fn all_news(bake: &mut BackgroundBake) -> Vec<BakeNews> {
    let begun = Instant::now();
    let mut news = Vec::new();
    loop {
        let running = bake.is_running();
        news.extend(bake.news());
        if !running {
            return news;
        }
        assert!(begun.elapsed() < Duration::from_secs(300), "the bake does not end");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Returns the mean of the lightmap of a node's first primitive, if it has one.
fn mean_light(world: &mut World, name: &str) -> Option<Vec3> {
    let mut meshes = world.query_filtered::<(&ChildOf, Option<&Lightmap>), With<Mesh>>();
    let found: Vec<_> =
        meshes.iter(world).map(|(parent, lightmap)| (parent.parent(), lightmap.cloned())).collect();
    let (_, lightmap) = found
        .into_iter()
        .find(|(node, _)| world.get::<Name>(*node).is_some_and(|own| own.as_str() == name))
        .unwrap();
    lightmap.map(|map| map.image.texels.iter().sum::<Vec3>() / map.image.texels.len() as f32)
}

#[test]
fn light_comes_in_steps_and_lands_where_it_belongs() {
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path());
    let mut opened = Opened::open(&path, &OpenOptions::default()).unwrap();
    let place = opened.place_of_bake();
    let mut bake = BackgroundBake::start(&path, &LoadOptions::default(), &wanted()).unwrap();
    assert!(bake.is_running() && !bake.can_be_saved());
    let news = all_news(&mut bake);
    let lights: Vec<&BakedLight> = news
        .iter()
        .map(|one| match one {
            BakeNews::Light(light) => light,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(lights.len(), 3);
    assert!(lights[2].error < lights[0].error, "{} and {}", lights[0].error, lights[2].error);
    assert!(lights[2].is_final && !lights[0].is_final);
    let world = &mut opened.game.world;
    let mut sides = Vec::new();
    for light in lights {
        assert!(!light.under_a_sky && light.len() == 4);
        light.apply(world, &opened.nodes);
        let (red, blue) = (mean_light(world, "red").unwrap(), mean_light(world, "blue").unwrap());
        assert!(red.x > 0.01 && red.x > 50.0 * red.z, "{}: {red}", light.pass);
        assert!(blue.z > 0.01 && blue.z > 50.0 * blue.x, "{}: {blue}", light.pass);
        // A moving object has no lightmap but an irradiance volume, which replaces that of the previous pass.
        assert_eq!(mean_light(world, "moves"), None);
        let mut volumes = world.query::<(&IrradianceVolume, &Name)>();
        let (volume, name) = volumes.single(world).unwrap();
        assert!(name.as_str() == "irradiance volume" && volume.validate().is_ok());
        let brightest = volume.cubes.iter().flat_map(|cube| cube.0).map(|side| side.x).fold(0.0, f32::max);
        assert!(brightest > 0.1, "{brightest}");
        let mut names = world.query::<&Name>();
        let left = names.iter(world).filter(|name| name.as_str() == "irradiance volume").count();
        assert_eq!(left, 1);
        let mut maps = world.query::<&Lightmap>();
        sides.push(maps.iter(world).map(|map| map.image.width).max());
    }
    assert!(sides[0] < sides[1] && sides[1] < sides[2], "each step has finer maps: {sides:?}");

    // The saved file has the light of the last pass.
    assert!(bake.can_be_saved());
    bake.save(&place);
    let news = all_news(&mut bake);
    assert!(matches!(&news[..], [BakeNews::Saved(path)] if *path == place), "{news:?}");
    let mut saved = World::new();
    load(&mut saved, &place).unwrap();
    let (shown, kept) = (mean_light(world, "red").unwrap(), mean_light(&mut saved, "red").unwrap());
    assert!((shown - kept).length() < 1e-6 * shown.length(), "{shown} was shown, {kept} is in the file");
    assert!(bake.can_be_saved(), "it can be saved again");

    // An error for a missing folder names the file, and the bake can still be saved.
    bake.save(&folder.path().join("no/such/folder/out.glb"));
    let news = all_news(&mut bake);
    let said = match &news[..] {
        [BakeNews::Failed(error @ BakeError::Save(_))] => error.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(said.contains("out"), "{said}");
    assert!(bake.can_be_saved());
}

#[test]
fn a_bake_can_be_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let mut bake = BackgroundBake::start(&scene(folder.path()), &LoadOptions::default(), &wanted()).unwrap();
    bake.cancel();
    let news = all_news(&mut bake);
    assert!(matches!(news.last(), Some(BakeNews::Cancelled)), "{news:?}");
    assert!(!bake.can_be_saved() && bake.status().is_none());
    bake.save(&folder.path().join("nothing.glb"));
    assert!(!folder.path().join("nothing.glb").exists());
}

#[test]
fn a_file_that_is_gone_is_named() {
    let missing = Path::new("no/such/level.glb");
    let mut bake = BackgroundBake::start(missing, &LoadOptions::default(), &wanted()).unwrap();
    match &all_news(&mut bake)[..] {
        [BakeNews::Failed(error @ BakeError::Load(_))] => {
            assert!(error.to_string().contains("level.glb"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_does_not_shine_is_baked_under_a_sky() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.glb");
    let mut world = World::new();
    let block = (Mesh(cuboid(Vec3::ONE, 1).into()), Material::matt(Vec3::splat(0.5)), StaticObject);
    world.spawn((Name::new("block"), block));
    save(&mut world, &path).unwrap();
    let mut opened = Opened::open(&path, &OpenOptions::default()).unwrap();
    let mut bake = BackgroundBake::start(&path, &LoadOptions::default(), &wanted()).unwrap();
    let news = all_news(&mut bake);
    let Some(BakeNews::Light(light)) = news.last() else { panic!("{news:?}") };
    assert!(light.under_a_sky);
    light.apply(&mut opened.game.world, &opened.nodes);
    // A convex body under a uniform sky of radiance 1 receives E/π = 1 everywhere; texels outside its charts
    // are 0.
    let mut maps = opened.game.world.query::<&Lightmap>();
    let brightest = maps.iter(&opened.game.world).flat_map(|map| map.image.texels.iter().copied());
    let brightest = brightest.fold(Vec3::ZERO, Vec3::max);
    assert!((brightest - Vec3::ONE).abs().max_element() < 0.02, "{brightest}");
}
