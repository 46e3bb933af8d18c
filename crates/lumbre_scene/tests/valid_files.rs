//! Two faults that the Khronos validator reports, checked in saved files: TEXCOORD_1 without TEXCOORD_0, and
//! zero normals. The validator itself is run by `scripts/validate`.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use std::path::Path;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{Vec2, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_scene::*;
use serde_json::{Value, json};
use support::File;

/// The JSON of a .glb and its binary chunk.
fn parts(path: &Path) -> (Value, Vec<u8>) {
    let bytes = std::fs::read(path).unwrap();
    let end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&bytes[20..end]).unwrap(), bytes[end + 8..].to_vec())
}

/// The normals of the only primitive of a file.
fn normals(path: &Path) -> Vec<Vec3> {
    let (root, chunk) = parts(path);
    let accessor = root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"].as_u64().unwrap() as usize;
    let accessor = &root["accessors"][accessor];
    let view = &root["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let start =
        (view["byteOffset"].as_u64().unwrap_or(0) + accessor["byteOffset"].as_u64().unwrap_or(0)) as usize;
    let stride = view["byteStride"].as_u64();
    let count = accessor["count"].as_u64().unwrap() as usize;
    let read = |at: usize| match accessor["componentType"].as_u64().unwrap() {
        5126 => {
            let start = start + at * stride.unwrap_or(12) as usize;
            let component =
                |axis: usize| f32::from_le_bytes(chunk[start + 4 * axis..][..4].try_into().unwrap());
            Vec3::new(component(0), component(1), component(2))
        }
        _ => {
            let start = start + at * stride.unwrap_or(3) as usize;
            Vec3::from_array([0, 1, 2].map(|axis| f32::from(chunk[start + axis] as i8) / 127.0))
        }
    };
    (0..count).map(read).collect()
}

fn set(path: &Path, set: &str) -> Value {
    parts(path).0["meshes"][0]["primitives"][0]["attributes"][set].clone()
}

/// Loads a file, gives its mesh the lightmap coordinates of a plane, and saves it as a bake does.
fn baked(file: File, path: &Path) -> Vec<Note> {
    let input = path.with_extension("input.glb");
    std::fs::write(&input, file.glb()).unwrap();
    let mut world = World::new();
    let mut source = SourceFile::read(&input, &LoadOptions::default()).unwrap();
    source.load_into(&mut world).unwrap();
    let image = Arc::new(LightmapImage {
        name: "light".into(),
        width: 1,
        height: 1,
        texels: vec![Vec3::ONE],
        encoding: LightmapEncoding::Rgb32Float,
    });
    let entities: Vec<_> = world
        .query::<(Entity, &Mesh)>()
        .iter(&world)
        .map(|(entity, mesh)| (entity, mesh.0.clone()))
        .collect();
    for (entity, mesh) in entities {
        let mut mesh = (*mesh).clone();
        mesh.uv1 = mesh.positions.iter().map(|position| position.truncate() * 0.5 + 0.25).collect();
        world.entity_mut(entity).insert((Mesh(Arc::new(mesh)), Lightmap { image: image.clone() }));
    }
    save_baked(&mut world, &source, path, &SaveOptions::default()).unwrap().notes
}

#[test]
fn a_lightmap_s_coordinates_are_never_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("baked.glb");
    let mut file = File::new();
    file.square(|_, _| {});
    baked(file, &path);
    assert!(set(&path, "TEXCOORD_1").is_number());
    assert_eq!(set(&path, "TEXCOORD_0"), set(&path, "TEXCOORD_1"));
    // On import, the mesh still has no texture coordinates of its own.
    let mut world = World::new();
    load(&mut world, &path).unwrap();
    let mesh = world.query::<&Mesh>().single(&world).unwrap().0.clone();
    assert!(mesh.uv0.is_empty() && !mesh.uv1.is_empty());

    // Existing texture coordinates are kept.
    let mut file = File::new();
    file.square(|file, primitive| {
        primitive["attributes"]["TEXCOORD_0"] =
            file.floats("VEC2", 2, &[0., 0., 4., 0., 4., 4., 0., 4.]).into();
    });
    baked(file, &path);
    assert_ne!(set(&path, "TEXCOORD_0"), set(&path, "TEXCOORD_1"));

    // A World that was not loaded from a file.
    let mut world = World::new();
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        uv1: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        indices: vec![0, 1, 2],
        ..TriangleMesh::default()
    };
    world.spawn((Mesh(Arc::new(mesh.clone())), Transform::IDENTITY));
    save(&mut world, &path).unwrap();
    assert_eq!(set(&path, "TEXCOORD_0"), set(&path, "TEXCOORD_1"));
    let mut again = World::new();
    load(&mut again, &path).unwrap();
    assert_eq!(*again.query::<&Mesh>().single(&again).unwrap().0, mesh);
}

#[test]
fn normals_that_are_written_anew_have_a_direction() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("baked.glb");
    // Of four normals one is zero and one is NaN; the faces point along z. Stored as floats and as normalized
    // bytes.
    let float = |file: &mut File| {
        let values = [0., 0., 1., 0., 0., 0., f32::NAN, 0., 1., 0., 0., 1.];
        file.floats("VEC3", 3, &values)
    };
    let bytes = |file: &mut File| {
        let view = file.view(&[0, 0, 127, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 0]);
        file.root["bufferViews"][view]["byteStride"] = 4.into();
        let accessor = json!({"bufferView": view, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3"});
        file.push("accessors", accessor)
    };
    for (what, make) in [("floats", &float as &dyn Fn(&mut File) -> usize), ("bytes", &bytes)] {
        let mut file = File::new();
        file.square(|file, primitive| primitive["attributes"]["NORMAL"] = make(file).into());
        let notes = baked(file, &path);
        assert_eq!(normals(&path), [Vec3::Z; 4], "{what}");
        assert!(
            notes.iter().any(|note| note.to_string().contains("2 normals were zero")),
            "{what}: {notes:?}"
        );
    }
    // Valid normals are left alone.
    let mut file = File::new();
    let normal = file.floats("VEC3", 3, &[0., 0., 1.].repeat(4));
    file.square(|_, primitive| primitive["attributes"]["NORMAL"] = normal.into());
    assert!(baked(file, &path).is_empty());
    assert_eq!(set(&path, "NORMAL"), normal);

    // A World with a degenerate triangle, which has no normal.
    let mut world = World::new();
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::X],
        normals: vec![Vec3::ZERO; 3],
        indices: vec![0, 1, 2],
        ..TriangleMesh::default()
    };
    world.spawn((Mesh(Arc::new(mesh)), Transform::IDENTITY));
    let report = save(&mut world, &path).unwrap();
    assert_eq!(normals(&path), [Vec3::Y; 3]);
    assert!(
        report.notes.iter().any(|note| note.to_string().contains("3 normals are zero")),
        "{:?}",
        report.notes
    );
}
