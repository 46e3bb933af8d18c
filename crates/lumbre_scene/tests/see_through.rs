//! Import and export of the media of transmissive surfaces and of exact surfaces.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_scene::{Material, Medium, Mesh, Name, Quadric, QuadricShape, load_slice, save};

/// A .gltf with one triangle; `material` and `node` are the extensions of its material and node.
fn file(material: &str, node: &str) -> Vec<u8> {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"mesh":0,"extensions":{{{node}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "materials":[{{"extensions":{{{material}}}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}]}}"#
    )
    .into_bytes()
}

fn read(bytes: &[u8]) -> World {
    let mut world = World::new();
    load_slice(&mut world, bytes, "see_through.gltf", None).expect("the file is sound");
    world
}

#[test]
fn media_are_what_the_extensions_say() {
    let medium = |material: &str| {
        let mut world = read(&file(material, ""));
        world.query::<&Medium>().iter(&world).next().copied()
    };
    let transmission = r#""KHR_materials_transmission":{"transmissionFactor":0.5}"#;
    assert_eq!(medium(""), None);
    assert_eq!(medium(transmission), Some(Medium { thin: true, fresnel: true, ..Medium::default() }));
    let volume = r#""KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[0.5,0.25,1]}"#;
    let tinted = Medium {
        thin: false,
        fresnel: true,
        attenuation_color: Vec3::new(0.5, 0.25, 1.0),
        attenuation_distance: 2.0,
    };
    assert_eq!(medium(&format!("{transmission},{volume}")), Some(tinted));
    let own = r#""LUMBRE_materials_phong":{"transmission":[1,1,1],"thin":true}"#;
    assert_eq!(medium(own), Some(Medium { thin: true, ..Medium::default() }));
    let all = r#""LUMBRE_materials_phong":{"fresnelSplit":true,"attenuationColor":[0.5,0.25,1],"attenuationDistance":2}"#;
    assert_eq!(medium(all), Some(tinted));
    for (bad, field) in [
        (r#""KHR_materials_volume":{"attenuationDistance":0}"#, "attenuationDistance"),
        (r#""LUMBRE_materials_phong":{"attenuationColor":[2,0,0]}"#, "attenuationColor"),
    ] {
        let error =
            load_slice(&mut World::new(), &file(bad, ""), "bad.gltf", None).expect_err("it is refused");
        let words = format!("{error:#}");
        assert!(words.contains(field) && words.contains("materials[0]"), "{words}");
    }
}

#[test]
fn exact_surfaces_need_a_mesh_of_one_primitive_and_a_size() {
    let sphere = r#""LUMBRE_quadric":{"kind":"sphere","radius":0.5}"#;
    let mut world = read(&file("", sphere));
    let found: Vec<_> = world.query::<&Quadric>().iter(&world).cloned().collect();
    assert_eq!(found, [Quadric::sphere(0.5)]);
    let bad = file("", r#""LUMBRE_quadric":{"kind":"sphere","radius":-1}"#);
    let error = load_slice(&mut World::new(), &bad, "bad.gltf", None).expect_err("it is refused");
    assert!(format!("{error:#}").contains("LUMBRE_quadric"), "{error:#}");
    let without = String::from_utf8(file("", sphere)).expect("it is text").replace("\"mesh\":0,", "");
    let mut world = World::new();
    let report = load_slice(&mut world, without.as_bytes(), "bare.gltf", None).expect("the file is sound");
    assert!(
        report.notes.iter().any(|note| note.to_string().contains("LUMBRE_quadric")),
        "{:?}",
        report.notes
    );
    assert_eq!(world.query::<&Quadric>().iter(&world).count(), 0);
}

#[test]
fn worlds_come_back_with_their_media_and_exact_surfaces() {
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path = folder.path().join("glass.glb");
    let mut world = World::new();
    let glass = Material {
        transmission: Vec3::ONE,
        mirror: Vec3::splat(0.1),
        ior: 1.7,
        ..Material::matt(Vec3::ZERO)
    };
    let medium = Medium {
        thin: false,
        fresnel: true,
        attenuation_color: Vec3::new(0.9, 0.5, 0.1),
        attenuation_distance: 0.3,
    };
    let shapes_of = [
        Quadric::sphere(1.0),
        Quadric::new(QuadricShape::Cone { radius: 0.5, height: 2.0, closed: false }),
        Quadric { trim: Some([DVec3::splat(-1.0), DVec3::ONE]), ..Quadric::new(QuadricShape::Plane) },
        // The upper half of a ball: the box is open on all other sides.
        Quadric { trim: Some([DVec3::NEG_INFINITY.with_y(0.0), DVec3::INFINITY]), ..Quadric::sphere(2.0) },
    ];
    let mesh = Arc::new(shapes::uv_sphere(1.0, 8, 4));
    for (number, quadric) in shapes_of.iter().enumerate() {
        let name = Name::new(format!("{number}"));
        world.spawn((name, Mesh(mesh.clone()), glass.clone(), medium, quadric.clone()));
    }
    save(&mut world, &path).expect("it can be saved");
    let mut again = World::new();
    lumbre_scene::load(&mut again, &path).expect("it can be loaded");
    let found: Vec<_> = again
        .query::<(&Quadric, &Medium, &Material)>()
        .iter(&again)
        .collect::<Vec<_>>()
        .into_iter()
        .map(|(quadric, medium, material)| (quadric.clone(), *medium, material.clone()))
        .collect();
    assert_eq!(found.len(), shapes_of.len());
    assert!(shapes_of.iter().all(|quadric| found.iter().any(|(found, ..)| found == quadric)), "{found:?}");
    for (_, found_medium, material) in &found {
        assert_eq!((*found_medium, material.mirror, material.ior), (medium, glass.mirror, glass.ior));
    }
}
