//! Bakes files with compressed data, instances or material variants, and checks what is written.

use super::encoded::{MESHES, PICTURES, compressed_mesh, encoded_picture, instanced};
use super::*;

/// Bakes a file twice and undoes the bake: the second bake gives the same bytes, and undoing gives the
/// artist's JSON.
fn baked_twice(what: &str, input: &Path, output: &Path) -> Read {
    baked(input, output);
    let first = fs::read(output).unwrap();
    baked(output, output);
    assert!(fs::read(output).unwrap() == first, "{what}: baked again");
    let pristine = output.with_extension("pristine.glb");
    let (mut world, mut source) = (World::new(), SourceFile::read(output, &LoadOptions::default()).unwrap());
    let instanced =
        source.load_into(&mut world).unwrap().notes.iter().any(|note| note.text.contains("instances"));
    save_baked(&mut world, &source, &pristine, &SaveOptions::default()).unwrap();
    let written = read(&pristine).root;
    if !instanced {
        assert_eq!(written, read(input).root, "{what}");
    }
    read(output)
}

#[test]
fn a_draco_mesh_is_written_uncompressed_with_every_attribute() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("tube.glb"), folder.path().join("tube.baked.glb"));
    for (name, bytes, expected) in MESHES {
        let expected: Value = serde_json::from_slice(expected).unwrap();
        let mut file = compressed_mesh(bytes, &expected);
        file.root["accessors"][0]["min"] = json!([0, 0, 0]);
        file.root["accessors"][0]["max"] = json!([0, 0, 0]);
        fs::write(&input, file.glb()).unwrap();
        let after = baked_twice(name, &input, &output);
        assert_eq!(after.root["extensionsUsed"], json!(["LUMBRE_bake", "LUMBRE_lightmap"]));
        assert!(after.root["extensionsRequired"].is_null());
        let primitive = &after.root["meshes"][0]["primitives"][0];
        assert!(primitive["extensions"].is_null(), "{primitive}");
        assert!(primitive["attributes"]["TEXCOORD_1"].is_number());
        let corners = after.corners(primitive);
        let order: Vec<usize> =
            expected["indices"].as_array().unwrap().iter().map(|at| at.as_u64().unwrap() as usize).collect();
        assert_eq!(corners.len(), order.len());
        for (attribute, values) in expected["attributes"].as_object().unwrap() {
            let values: Vec<f64> =
                values.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
            let width = values.len() / 28;
            let accessor = &primitive["attributes"][attribute];
            let component = after.root["accessors"][accessor.as_u64().unwrap() as usize]["componentType"]
                .as_u64()
                .unwrap();
            let elements = after.elements(accessor);
            for (&from, &to) in order.iter().zip(&corners) {
                let ours = elements[to].chunks(elements[to].len() / width).map(|bytes| match component {
                    5126 => f64::from(f32::from_le_bytes(bytes.try_into().unwrap())),
                    _ => whole(bytes) as f64,
                });
                for (ours, theirs) in ours.zip(&values[from * width..]) {
                    assert!(
                        (ours - theirs).abs() < 1e-6,
                        "{name}: {attribute} of vertex {from}: {ours} {theirs}"
                    );
                }
            }
            if attribute == "POSITION" {
                let stated = &after.root["accessors"][accessor.as_u64().unwrap() as usize];
                for (axis, most) in stated["max"].as_array().unwrap().iter().enumerate() {
                    let largest = values.iter().skip(axis).step_by(3).copied().fold(f64::MIN, f64::max);
                    assert_eq!(most.as_f64().unwrap(), f64::from(largest as f32));
                }
            }
        }
    }
}

#[test]
fn compressed_pictures_stay_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("wall.glb"), folder.path().join("wall.baked.glb"));
    for (name, bytes, _) in PICTURES {
        fs::write(&input, encoded_picture(name, bytes).glb()).unwrap();
        baked_twice(name, &input, &output);
        assert_eq!(compare(name, &input, &output), 1);
    }
}

#[test]
fn instances_are_baked_as_nodes_and_taken_back() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("trees.glb"), folder.path().join("trees.baked.glb"));
    let file = instanced(&[0., 0., 0., 5., 0., 0., 0., 7., 0.], &[0.0, 0.0, 0.0, 1.0].repeat(3));
    fs::write(&input, file.glb()).unwrap();
    let after = baked_twice("instances", &input, &output);
    let nodes = after.root["nodes"].as_array().unwrap();
    assert_eq!((nodes.len(), nodes[0]["children"].as_array().unwrap().len()), (4, 3));
    assert!(nodes[0]["mesh"].is_null() && nodes[0]["extensions"].is_null(), "{}", nodes[0]);
    assert_eq!(nodes[2]["translation"], json!([5.0, 0.0, 0.0]));
    assert!(nodes[1..].iter().all(|node| node["extensions"]["LUMBRE_lightmap"].is_object()), "{nodes:?}");
    assert_eq!(after.root["extensionsUsed"], json!(["LUMBRE_bake", "LUMBRE_lightmap"]));
    assert!(after.root["extensionsRequired"].is_null());
    let record = after.root["extensions"]["LUMBRE_bake"].to_string();
    assert!(record.contains("EXT_mesh_gpu_instancing") && record.contains("_ID"), "{record}");
    assert!(
        load(&mut World::new(), &output).unwrap().notes.iter().all(|note| !note.text.contains("instances"))
    );
}

#[test]
fn variants_and_animation_pointers_are_carried() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("shoe.glb"), folder.path().join("shoe.baked.glb"));
    let mut file = File::new();
    for name in ["red", "blue"] {
        file.push("materials", json!({"name": name, "pbrMetallicRoughness": {"metallicFactor": 0}}));
    }
    cube(&mut file, |_, primitive| {
        primitive["material"] = 0.into();
        primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": [
            {"material": 0, "variants": [0]}, {"material": 1, "variants": [1]}]}});
    });
    let door = cube(&mut file, |_, _| {});
    file.light(json!({"type": "point", "intensity": 30}));
    file.light(json!({"type": "point", "intensity": 20}));
    file.root["extensions"]["KHR_materials_variants"] =
        json!({"variants": [{"name": "red"}, {"name": "blue"}]});
    let input_of = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let (places, strengths) =
        (file.floats("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]), file.floats("SCALAR", 1, &[1.0, 2.0]));
    let channel = |sampler: usize, pointer: String| json!({"sampler": sampler, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}});
    file.push(
        "animations",
        json!({"channels": [channel(0, format!("/nodes/{door}/translation")),
                channel(1, "/extensions/KHR_lights_punctual/lights/1/intensity".to_owned()),
                channel(1, "/materials/0/pbrMetallicRoughness/metallicFactor".to_owned())],
            "samplers": [{"input": input_of, "output": places}, {"input": input_of, "output": strengths}]}),
    );
    let used = ["KHR_lights_punctual", "KHR_materials_variants", "KHR_animation_pointer"];
    file.root["extensionsUsed"] = json!(used);
    file.root["extensionsRequired"] = json!(["KHR_materials_variants", "KHR_animation_pointer"]);
    fs::write(&input, file.glb()).unwrap();
    baked_twice("variants", &input, &output);
    // The door moves, and the second lamp flickers.
    assert_eq!(compare("variants", &input, &output), 1);
    let mut world = World::new();
    load(&mut world, &input).unwrap();
    let modes: Vec<_> = world.query::<&Light>().iter(&world).map(|light| light.bake).collect();
    assert_eq!(modes, [lumbre_optics::BakeMode::Static, lumbre_optics::BakeMode::Dynamic]);
    assert_eq!(world.query::<(&Mesh, &DynamicObject)>().iter(&world).count(), 1);
    assert!(world.query::<&Primitive>().iter(&world).any(|primitive| &*primitive.material == "red"));
}
