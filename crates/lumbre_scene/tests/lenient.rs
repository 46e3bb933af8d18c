//! Faults that other viewers repair: they are repaired with a note that names the place, and refused without
//! `lenient`.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_scene::*;
use serde_json::json;
use support::{File, png};

/// Checks that a file loads only with repairs, and returns its World and report. `said` must occur in the
/// notes.
fn repaired(bytes: &[u8], said: &str) -> (World, LoadReport) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.glb");
    std::fs::write(&path, bytes).unwrap();
    let mut strict = World::new();
    let before = strict.entities().len();
    let error = load_with(&mut strict, &path, &LoadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("level.glb: "), "{error}");
    assert_eq!(strict.entities().len(), before);
    let mut world = World::new();
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let report = load_with(&mut world, &path, &lenient).unwrap();
    let notes: Vec<String> = report.notes.iter().map(ToString::to_string).collect();
    assert!(notes.iter().any(|note| note.contains(said)), "{said:?} is not in {notes:#?}");
    // `SourceFile`, as used for baking, repairs it as well.
    assert!(SourceFile::read(&path, &lenient).unwrap().load_into(&mut World::new()).is_ok());
    (world, report)
}

fn parent(world: &World, report: &LoadReport, node: usize) -> Option<Entity> {
    world.get::<ChildOf>(report.nodes[node]).map(|child| child.parent())
}

#[test]
fn nodes_that_are_listed_twice() {
    // A child of two nodes belongs to the first.
    let mut file = File::new();
    let child = file.push("nodes", json!({"name": "cup"}));
    let first = file.node(json!({"children": [child]}));
    file.node(json!({"children": [child]}));
    let (world, report) =
        repaired(&file.glb(), "nodes[0] (cup): is listed by nodes[1].children and by nodes[2].children");
    assert_eq!(parent(&world, &report, child), Some(report.nodes[first]));

    // A scene root that is also a child stays below its parent and keeps its parent's transform.
    let mut file = File::new();
    let child = file.node(json!({"name": "cup", "translation": [1, 0, 0]}));
    let table = file.node(json!({"children": [child], "translation": [0, 2, 0]}));
    let (world, report) = repaired(&file.glb(), "cup");
    assert_eq!(parent(&world, &report, child), Some(report.nodes[table]));
    let place = world.get::<GlobalTransform>(report.nodes[child]).unwrap().translation();
    assert_eq!(place, DVec3::new(1.0, 2.0, 0.0));

    // A scene root whose parent is not in the scene becomes a root.
    let mut file = File::new();
    let child = file.node(json!({"name": "cup"}));
    file.push("nodes", json!({"children": [child]}));
    let (world, report) = repaired(&file.glb(), "cup");
    assert_eq!(parent(&world, &report, child), None);
    assert!(report.nodes[child] != Entity::PLACEHOLDER && report.nodes[1] == Entity::PLACEHOLDER);

    // A node listed twice by the scene, and one listed twice by its parent.
    let mut file = File::new();
    let twice = file.push("nodes", json!({"name": "spoon"}));
    let node = file.node(json!({"name": "cup", "children": [twice, twice]}));
    file.root["scenes"][0]["nodes"] = json!([node, node]);
    let (mut world, report) = repaired(&file.glb(), "spoon");
    assert!(report.notes.iter().any(|note| note.to_string().contains("cup")));
    assert_eq!(world.query::<&Name>().iter(&world).count(), 2);
}

#[test]
fn cycles_are_refused_all_the_same() {
    let mut file = File::new();
    file.push("nodes", json!({"children": [1]}));
    file.push("nodes", json!({"children": [0]}));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.glb");
    std::fs::write(&path, file.glb()).unwrap();
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let error = load_with(&mut World::new(), &path, &lenient).unwrap_err();
    assert!(matches!(*error.problem, LoadProblem::Cycle { .. }), "{error}");
}

/// A square with a base colour texture; `change` damages the file.
fn textured(change: impl FnOnce(&mut File)) -> Vec<u8> {
    let mut file = File::new();
    let view = file.view(&png(4, 4));
    file.push("images", json!({"name": "wall", "bufferView": view}));
    file.push("textures", json!({"source": 0}));
    let paint = json!({"baseColorTexture": {"index": 0}, "metallicFactor": 0});
    file.push("materials", json!({"name": "brick", "pbrMetallicRoughness": paint}));
    file.square(|file, primitive| {
        primitive["material"] = 0.into();
        primitive["attributes"]["TEXCOORD_0"] =
            file.floats("VEC2", 2, &[0., 0., 1., 0., 1., 1., 0., 1.]).into();
    });
    change(&mut file);
    file.glb()
}

#[test]
fn textures_that_cannot_be_decoded_are_white() {
    for change in [
        // A damaged image, another format, a missing file, no data at all, and a dangling index.
        (|file: &mut File| file.binary[8..16].fill(0)) as fn(&mut File),
        |file| file.binary[..8].copy_from_slice(b"GIF89a  "),
        |file| file.root["images"][0] = json!({"name": "wall", "uri": "missing.png"}),
        |file| file.root["images"][0] = json!({"name": "wall"}),
        |file| file.root["images"][0]["bufferView"] = 99.into(),
    ] {
        let (mut world, _) = repaired(&textured(change), "images[0] (wall): ");
        let textures = world.query::<&MaterialTextures>().single(&world).unwrap();
        let image = &textures.base_color.as_ref().unwrap().image;
        assert_eq!((image.width, image.height, image.rgba.as_slice()), (1, 1, &[255; 4][..]));
    }
    let (mut world, _) =
        repaired(&textured(|file| file.root["textures"] = json!([])), "materials[0] (brick)");
    assert_eq!(world.query::<&MaterialTextures>().iter(&world).count(), 0);
    repaired(&textured(|file| file.root["textures"][0]["sampler"] = 3.into()), "textures[0].sampler");
}

#[test]
fn a_compressed_picture_that_cannot_be_decoded_makes_way_for_the_plain_one() {
    let basis =
        |source: usize| json!({"source": 0, "extensions": {"KHR_texture_basisu": {"source": source}}});
    let ktx2 = |bytes: &'static [u8], texture: fn(&mut File)| {
        textured(move |file| {
            let view = file.view(bytes);
            file.push("images", json!({"name": "packed", "bufferView": view, "mimeType": "image/ktx2"}));
            file.root["extensionsUsed"] = json!(["KHR_texture_basisu"]);
            file.root["textures"][0] = basis(1);
            texture(file);
        })
    };
    let sizes = |world: &mut World| -> Vec<(u32, u32)> {
        let mut textures = world.query::<&MaterialTextures>();
        let image = |textures: &MaterialTextures| textures.base_color.as_ref().unwrap().image.clone();
        textures.iter(world).map(|own| (image(own).width, image(own).height)).collect()
    };
    // The identifier of KTX2 without a valid header.
    let damaged: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n0000";
    let said = "images[1] (packed): cannot be decoded as KTX2";
    let (mut world, report) = repaired(&ktx2(damaged, |_| {}), said);
    assert_eq!(sizes(&mut world), [(4, 4)]);
    let notes: Vec<String> = report.notes.iter().map(ToString::to_string).collect();
    assert!(
        notes.iter().any(|note| note.contains("images[0], the texture's own source, stands in")),
        "{notes:?}"
    );

    // A second texture has no alternative source, so it becomes white.
    let (mut world, _) = repaired(
        &ktx2(damaged, |file| {
            file.push("textures", json!({"extensions": {"KHR_texture_basisu": {"source": 1}}}));
            file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}));
            let mut second = file.root["meshes"][0]["primitives"][0].clone();
            second["material"] = 1.into();
            file.root["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
        }),
        said,
    );
    assert_eq!(sizes(&mut world), [(4, 4), (1, 1)]);

    // An image index that is out of range.
    let none = textured(|file| file.root["textures"][0] = basis(7));
    assert_eq!(sizes(&mut repaired(&none, "images[7]").0), [(4, 4)]);

    // Both images are damaged.
    let both = ktx2(damaged, |file| file.binary[8..16].fill(0));
    assert_eq!(sizes(&mut repaired(&both, "images[0] (wall): ").0), [(1, 1)]);

    // The preferred image is intact, so the other one is not read.
    let whole: &[u8] = include_bytes!("encoded/uastc.ktx2");
    let bytes = ktx2(whole, |file| file.binary[8..16].fill(0));
    let (mut world, report) = support::load_bytes(&bytes).unwrap();
    assert_eq!(sizes(&mut world), [(22, 17)]);
    assert!(report.notes.is_empty(), "{:?}", report.notes);
}

#[test]
fn versions_and_padding_that_are_missing() {
    let mut file = File::new();
    file.square(|_, _| {});
    for asset in [json!(null), json!({}), json!({"generator": "x"})] {
        let mut root = file.root.clone();
        root["asset"] = asset;
        repaired(&File { root, binary: file.binary.clone() }.glb(), "asset.version");
    }
    // Version 1 has objects instead of lists, and a stated version is believed.
    for change in
        [json!({"asset": {}, "nodes": {"a": {}}}), json!({"asset": {"version": "1.0"}, "nodes": []})]
    {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("level.gltf");
        std::fs::write(&path, change.to_string()).unwrap();
        let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
        let error = load_with(&mut World::new(), &path, &lenient).unwrap_err();
        assert!(matches!(*error.problem, LoadProblem::Version { .. }), "{error}");
    }

    // The binary data ends two bytes after a multiple of four. The file is cut there, though its headers
    // include the padding.
    let mut file = File::new();
    file.square(|file, primitive| {
        primitive["indices"] = file.indices(&[0, 1, 2]).into();
    });
    assert_eq!(file.binary.len() % 4, 2);
    let whole = file.glb();
    repaired(&whole[..whole.len() - 2], "padding");
    // More than padding is missing.
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.glb");
    std::fs::write(&path, &whole[..whole.len() - 6]).unwrap();
    assert!(load_with(&mut World::new(), &path, &lenient).is_err());
}

#[test]
fn indices_of_what_is_not_drawn() {
    let file = |change: fn(&mut File)| {
        let mut file = File::new();
        file.square(|_, _| {});
        change(&mut file);
        file.glb()
    };
    let (mut world, _) =
        repaired(&file(|file| file.root["nodes"][0]["camera"] = 7.into()), "nodes[0] (square)");
    assert_eq!(world.query::<&Camera>().iter(&world).count(), 0);
    let (mut world, _) = repaired(
        &file(|file| file.root["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}})),
        "nodes[0] (square)",
    );
    assert_eq!(world.query::<&Light>().iter(&world).count(), 0);
    repaired(
        &file(|file| {
            file.push(
                "animations",
                json!({"channels": [{"target": {"node": 8, "path": "scale"}}], "samplers": []}),
            );
        }),
        "animations[0].channels",
    );
    let (mut world, _) = repaired(&file(|file| file.root["scene"] = 4.into()), "scene");
    assert_eq!(world.query::<&Mesh>().iter(&world).count(), 1);
    // An index of something that is drawn must be valid.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.glb");
    std::fs::write(&path, file(|file| file.root["nodes"][0]["mesh"] = 7.into())).unwrap();
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    assert!(load_with(&mut World::new(), &path, &lenient).is_err());
}

#[test]
fn the_file_that_is_missing_is_named_once() {
    let error = load(&mut World::new(), std::path::Path::new("nofile.glb")).unwrap_err().to_string();
    assert_eq!(error.matches("nofile.glb").count(), 1, "{error}");
    assert!(error.starts_with("nofile.glb: cannot be read: "), "{error}");
}
