//! Lightmaps that are packed into shared atlases show the same light as separate maps.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common;
use crate::scene_parts::grey;
use bevy_ecs::world::World;
use glam::{DVec2, DVec3, Vec2, Vec3};
use lumbre_bake::{Bake, BakeError, BakeOptions, BakeReport, Density, Quality, TexelErrors};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

/// A floor, sixteen boxes that share a mesh, and a tile whose given coordinates fill the whole unit square, under a
/// light.
fn scene() -> World {
    let mut world = World::new();
    let floor = Mesh(Arc::new(shapes::plane(8.0, 8.0, 1, 1)));
    world.spawn((Name::new("floor"), floor, grey(0.5, 0.0), StaticObject));
    let block = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.5), 1)));
    for (index, name) in (0..16).map(|index| (index, format!("box {index:02}"))) {
        let at =
            Transform::from_xyz(f64::from(index % 4) * 1.5 - 2.25, 0.5, f64::from(index / 4) * 1.5 - 2.25);
        world.spawn((Name::new(name), block.clone(), grey(0.5, 0.0), StaticObject, at));
    }
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let tile = TriangleMesh {
        positions: corners.map(|[x, z]| Vec3::new(x, 1.5, z)).to_vec(),
        uv1: corners.map(Vec2::from).to_vec(),
        indices: vec![0, 2, 1, 0, 3, 2],
        ..TriangleMesh::default()
    };
    world.spawn((Name::new("tile"), Mesh(Arc::new(tile)), grey(0.5, 0.0), StaticObject));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((light, Transform::from_xyz(0.3, 2.5, 0.2)));
    world
}

fn run(world: &mut World, atlas_size: Option<u32>) -> Result<BakeReport, BakeError> {
    let options = BakeOptions {
        density: Density::TexelsPerMeter(12.0),
        quality: Quality::Draft,
        atlas_size,
        ..BakeOptions::default()
    };
    Bake::new(&options).run(world)
}

/// For each object: the filtered values at points of each of its triangles, corners and edges included; the name of its
/// map; and the number of texels with a stated error.
type Samples = BTreeMap<String, (Vec<DVec3>, String, usize)>;

fn samples(world: &mut World) -> Samples {
    let mut query = world.query::<(&Name, &Mesh, &Lightmap, &TexelErrors)>();
    let samples = query.iter(world).map(|(name, mesh, map, errors)| {
        assert_eq!(errors.0.len(), map.image.texels.len());
        let mut values = Vec::new();
        for triangle in mesh.0.triangles() {
            let [a, b, c] = triangle.map(|v| mesh.0.uv1[v as usize].as_dvec2());
            for i in 0..=6 {
                for k in 0..=6 - i {
                    let uv: DVec2 = a + (b - a) * (f64::from(i) / 6.0) + (c - a) * (f64::from(k) / 6.0);
                    values.push(common::bilinear(&map.image, uv));
                }
            }
        }
        let known = errors.0.iter().filter(|error| error.is_finite()).count();
        (name.to_string(), (values, map.image.name.clone(), known))
    });
    samples.collect()
}

#[test]
fn an_atlas_shows_the_same_as_separate_maps() {
    let mut separate = scene();
    let report = run(&mut separate, None).expect("the scene bakes");
    assert_eq!((report.maps, report.atlases), (18, 0));
    let expected = samples(&mut separate);
    for (side, least_pages) in [(64, 1), (40, 2)] {
        let mut world = scene();
        let report = run(&mut world, Some(side)).expect("the scene bakes");
        println!("{side}: {} maps, {} atlases", report.maps, report.atlases);
        assert!(report.atlases >= least_pages);
        for (name, map) in common::maps(&mut world) {
            assert!(name.starts_with("floor") || (map.width <= side && map.height <= side), "{name}");
            assert_eq!(map.texels.len(), (map.width * map.height) as usize);
        }
        let samples = samples(&mut world);
        assert_eq!(samples.len(), 18);
        // The floor with its 97 texels a side keeps its own map, and so does a map that would be alone on a page.
        let outside: Vec<_> = samples.iter().filter(|(_, (_, map, _))| !map.starts_with("atlas-")).collect();
        assert!(outside.len() <= 2 && outside.iter().any(|(name, _)| *name == "floor"));
        assert_eq!(report.maps, report.atlases + outside.len());
        for (name, (values, _, known)) in &samples {
            assert!(*known > 0);
            for (value, expected) in values.iter().zip(&expected[name].0) {
                // Coordinates in another range are rounded differently, by 2^-24 of a page.
                assert!((*value - *expected).abs().max_element() < 1e-4, "{name}: {value} {expected}");
            }
        }
    }
}

#[test]
fn atlases_survive_saving_and_bakes_repeat_bit_for_bit() {
    let [mut world, mut again] = [scene(), scene()];
    let report = run(&mut world, Some(64)).expect("the scene bakes");
    run(&mut again, Some(64)).expect("the scene bakes");
    assert_eq!(common::bits(&mut world), common::bits(&mut again));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    lumbre_scene::save(&mut world, &path).unwrap();
    let files = std::fs::read_dir(folder.path().join("scene.lightmaps"))
        .unwrap()
        .filter_map(|file| file.ok()?.file_name().into_string().ok());
    let names: Vec<String> = files.filter(|name| name.ends_with(".exr")).collect();
    assert!(names.len() == report.maps && report.atlases > 0, "{names:?}");
    let mut loaded = World::new();
    lumbre_scene::load(&mut loaded, &path).unwrap();
    let mut query = loaded.query::<&Lightmap>();
    let mut images: Vec<_> = query.iter(&loaded).map(|map| Arc::as_ptr(&map.image)).collect();
    assert_eq!(images.len(), 18);
    images.sort_unstable();
    images.dedup();
    assert_eq!(images.len(), report.maps);
}

#[test]
fn an_atlas_out_of_range_is_named() {
    for side in [0, 15, 8193] {
        let error = run(&mut World::new(), Some(side)).unwrap_err();
        assert!(error.to_string().contains("atlas size"), "{error}");
    }
}
