//! Import of normal and occlusion textures, tangents, and the extensions for the reflectance of dielectrics.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use bevy_ecs::prelude::*;
use glam::{Vec3, Vec4};
use lumbre_optics::Lobe;
use lumbre_scene::*;
use serde_json::{Value, json};
use support::{File, png};

/// A square with one material, texture coordinates, normals and one image.
fn square(material: Value, change: impl FnOnce(&mut File, &mut Value)) -> File {
    let mut file = File::new();
    let image = png(2, 2);
    let view = file.view(&image);
    file.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    file.push("textures", json!({"source": 0}));
    file.push("materials", material);
    file.square(|file, primitive| {
        let normal = file.floats("VEC3", 3, &[0.0, 0.0, 1.0].repeat(4));
        let uv = file.floats("VEC2", 2, &[0., 1., 1., 1., 1., 0., 0., 0.]);
        primitive["attributes"]["NORMAL"] = normal.into();
        primitive["attributes"]["TEXCOORD_0"] = uv.into();
        primitive["attributes"]["TEXCOORD_1"] = uv.into();
        primitive["material"] = 0.into();
        change(file, primitive);
    });
    file
}

fn only<T: Component + Clone>(world: &mut World) -> T {
    let found: Vec<T> = world.query::<&T>().iter(world).cloned().collect();
    let [one] = found.as_slice() else { panic!("{} instead of one", found.len()) };
    one.clone()
}

fn noted(report: &LoadReport, what: &str) -> bool {
    report.notes.iter().any(|note| note.to_string().contains(what))
}

#[test]
fn normal_and_occlusion_textures_are_read_with_their_numbers() {
    let transform =
        json!({"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2.0, 3.0]}});
    let material = json!({
        "normalTexture": {"index": 0, "texCoord": 1, "scale": -0.75, "extensions": transform},
        "occlusionTexture": {"index": 0, "strength": 0.25},
    });
    let (mut world, report) = square(material, |_, _| {}).load().unwrap();
    let textures: MaterialTextures = only(&mut world);
    let (normal, occlusion) = (textures.normal.unwrap(), textures.occlusion.unwrap());
    assert_eq!((normal.scale, normal.texture.tex_coord, normal.texture.rotation), (-0.75, 1, 0.5));
    assert_eq!(normal.texture.offset, glam::Vec2::new(0.5, 0.25));
    assert_eq!((occlusion.strength, occlusion.texture.tex_coord), (0.25, 0));
    assert!(std::sync::Arc::ptr_eq(&normal.texture.image, &occlusion.texture.image), "decoded once");
    assert!(!noted(&report, "texture"), "{:?}", report.notes);
    // Both factors default to 1.
    let material = json!({"normalTexture": {"index": 0}, "occlusionTexture": {"index": 0}});
    let (mut world, _) = square(material, |_, _| {}).load().unwrap();
    let textures: MaterialTextures = only(&mut world);
    assert_eq!((textures.normal.unwrap().scale, textures.occlusion.unwrap().strength), (1.0, 1.0));
}

#[test]
fn numbers_that_they_cannot_have_are_refused_by_name() {
    for (slot, field) in [
        (json!({"normalTexture": {"index": 0, "scale": 1e300}}), "normalTexture.scale"),
        (json!({"occlusionTexture": {"index": 0, "strength": 1.5}}), "occlusionTexture.strength"),
        (json!({"occlusionTexture": {"index": 0, "strength": -0.1}}), "occlusionTexture.strength"),
        (json!({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}), "KHR_materials_ior.ior"),
        (json!({"extensions": {"KHR_materials_ior": {"ior": -1.0}}}), "KHR_materials_ior.ior"),
        (
            json!({"extensions": {"KHR_materials_specular": {"specularFactor": 2.0}}}),
            "KHR_materials_specular.specularFactor",
        ),
        (
            json!({"extensions": {"KHR_materials_specular": {"specularColorFactor": [1.0, -1.0, 1.0]}}}),
            "KHR_materials_specular.specularColorFactor",
        ),
        (
            json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 3.0}}}),
            "KHR_materials_transmission.transmissionFactor",
        ),
    ] {
        let message = square(slot, |_, _| {}).load().unwrap_err().to_string();
        assert!(message.contains(field) && message.contains("materials[0]"), "{message}");
    }
}

#[test]
fn tangents_are_unit_or_none() {
    let tangents = [2.0, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0, -3.0, 0.0, 0.0, 0.0, 1.0, f32::NAN, 0.0, 0.0, 1.0];
    let file = square(json!({"normalTexture": {"index": 0}}), |file, primitive| {
        primitive["attributes"]["TANGENT"] = file.floats("VEC4", 4, &tangents).into();
    });
    let (mut world, report) = file.load().unwrap();
    let mesh = only::<Mesh>(&mut world).0;
    let expected = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, -1.0), Vec4::ZERO, Vec4::ZERO];
    assert_eq!(mesh.tangents, expected);
    assert!(noted(&report, "2 tangents were zero or NaN"), "{:?}", report.notes);
    // The specification requires tangents without normals to be ignored.
    let file = square(json!({"normalTexture": {"index": 0}}), |file, primitive| {
        primitive["attributes"]["TANGENT"] = file.floats("VEC4", 4, &tangents).into();
        primitive["attributes"].as_object_mut().unwrap().remove("NORMAL");
    });
    let (mut world, _) = file.load().unwrap();
    assert!(only::<Mesh>(&mut world).0.tangents.is_empty());
}

#[test]
fn tangents_that_cannot_be_read_are_made_anew() {
    let file = || {
        square(json!({"normalTexture": {"index": 0}}), |file, primitive| {
            primitive["attributes"]["TANGENT"] = file.floats("VEC4", 4, &[1.0, 0.0, 0.0, 1.0]).into();
        })
    };
    let strict = file().load().unwrap_err().to_string();
    assert!(strict.contains("TANGENT") && strict.contains("1 elements"), "{strict}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("square.glb");
    std::fs::write(&path, file().glb()).unwrap();
    let mut world = World::new();
    let options = LoadOptions { lenient: true, ..LoadOptions::default() };
    let report = load_with(&mut world, &path, &options).unwrap();
    assert!(only::<Mesh>(&mut world).0.tangents.is_empty());
    assert!(noted(&report, "tangents are made anew"), "{:?}", report.notes);
}

#[test]
fn a_normal_map_that_cannot_be_decoded_is_left_out_and_not_white() {
    let mut file =
        square(json!({"normalTexture": {"index": 1}, "occlusionTexture": {"index": 1}}), |_, _| {});
    let view = file.view(b"no picture");
    file.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    file.push("textures", json!({"source": 1}));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("square.glb");
    std::fs::write(&path, file.glb()).unwrap();
    let mut world = World::new();
    let options = LoadOptions { lenient: true, ..LoadOptions::default() };
    load_with(&mut world, &path, &options).unwrap();
    let textures: MaterialTextures = only(&mut world);
    // White would tilt the normals of a normal map, but has no effect in an occlusion texture.
    assert_eq!(textures.normal, None);
    assert_eq!(textures.occlusion.unwrap().texture.image.rgba, [255; 4]);
}

#[test]
fn metallic_roughness_keeps_its_energy_and_coefficients_are_bare() {
    let lobe = |material: Value| {
        let (mut world, _) = square(material, |_, _| {}).load().unwrap();
        only::<Material>(&mut world).lobe
    };
    let phong = |value: Value| json!({"extensions": {"LUMBRE_materials_phong": value}});
    assert_eq!(lobe(json!({})), Lobe::EnergyConserving);
    assert_eq!(lobe(phong(json!({"specular": [0.5, 0.5, 0.5], "shininess": 10.0}))), Lobe::Bare);
    assert_eq!(lobe(phong(json!({"shininess": 10.0, "lobe": "energy-keeping"}))), Lobe::EnergyConserving);
    let mapped = json!({"pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}}});
    assert_eq!(lobe(mapped), Lobe::EnergyConserving);
    let message = square(phong(json!({"lobe": "bar"})), |_, _| {}).load().unwrap_err().to_string();
    assert!(message.contains("LUMBRE_materials_phong.lobe") && message.contains("bare"), "{message}");
}

#[test]
fn dielectrics_reflect_what_their_extensions_say() {
    let read = |extensions: Value, metallic: f32| {
        let pbr = json!({"baseColorFactor": [0.5, 0.25, 1.0, 1.0], "metallicFactor": metallic});
        let (mut world, report) =
            square(json!({"pbrMetallicRoughness": pbr, "extensions": extensions}), |_, _| {}).load().unwrap();
        (only::<Material>(&mut world), report)
    };
    let near = |a: Vec3, b: Vec3| assert!((a - b).abs().max_element() < 1e-6, "{a} {b}");
    let (plain, _) = read(json!({}), 0.0);
    assert_eq!((plain.front.specular, plain.ior), (Vec3::splat(0.04), 1.5));
    // Diamond: ((2.42 - 1)/(2.42 + 1))^2.
    let (diamond, _) = read(json!({"KHR_materials_ior": {"ior": 2.42}}), 0.0);
    near(diamond.front.specular, Vec3::splat(0.172_394_9));
    assert_eq!(diamond.ior, 2.42);
    let (all, _) = read(json!({"KHR_materials_ior": {"ior": 0.0}}), 0.0);
    near(all.front.specular, Vec3::ONE);
    let specular =
        json!({"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 0.5, 50.0]}});
    let (tinted, _) = read(specular.clone(), 0.0);
    // The tinted reflectance is clamped to 1 before the factor is applied.
    near(tinted.front.specular, Vec3::new(0.02, 0.01, 0.5));
    // With a metallic factor of 0.5, half of it is the base colour.
    near(read(specular, 0.5).0.front.specular, Vec3::new(0.26, 0.13, 0.75));
    let textured = json!({"KHR_materials_specular": {"specularTexture": {"index": 0}}});
    assert!(noted(&read(textured, 0.0).1, "specularTexture is not read"));
    let (glass, report) = read(json!({"KHR_materials_transmission": {"transmissionFactor": 0.5}}), 0.0);
    assert_eq!(glass.transmission, Vec3::new(0.25, 0.125, 0.5));
    assert!(noted(&report, "KHR_materials_transmission is kept"), "{:?}", report.notes);
    // glTF blends transmission with diffuse reflection.
    assert_eq!(glass.front.diffuse, Vec3::new(0.25, 0.125, 0.5));
}
