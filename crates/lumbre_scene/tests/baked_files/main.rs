//! A baked file must be the artist's file plus light. For one small file per feature, the JSON is compared
//! with that of the baked version, and every attribute of every corner bit for bit.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod comparison;
#[path = "../support/encoded.rs"]
mod encoded;
mod extensions;
mod feature_files;
#[path = "../support/mod.rs"]
mod support;

use comparison::*;
use feature_files::{cube, files, values};

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_mesh::{TriangleMesh, UnwrapOptions, unwrap};
use lumbre_optics::Shading;
use lumbre_scene::*;
use serde_json::{Value, json};
use support::{File, png};

/// Gives every static mesh lightmap coordinates and a lightmap, as the baker does.
fn bake(world: &mut World) {
    let mut query = world.query_filtered::<(Entity, &Mesh, Option<&MaterialTextures>), (With<StaticObject>, Without<DynamicObject>)>();
    let found: Vec<_> = query
        .iter(world)
        .map(|(entity, mesh, textures)| (entity, mesh.0.clone(), textures.cloned()))
        .collect();
    let mut made: BTreeMap<*const TriangleMesh, Arc<TriangleMesh>> = BTreeMap::new();
    for (entity, mesh, textures) in found {
        let reads_second =
            textures.iter().flat_map(|own| own.references()).any(|texture| texture.tex_coord == 1);
        let new = made.entry(Arc::as_ptr(&mesh)).or_insert_with(|| {
            let mut source = (*mesh).clone();
            if reads_second {
                source.uv0 = source.uv1.clone();
            }
            Arc::new(
                unwrap(&source, &source.positions, density(&source), UnwrapOptions::default()).unwrap().mesh,
            )
        });
        if reads_second {
            let mut textures = textures.unwrap();
            textures.references_mut().for_each(|texture| texture.tex_coord = 0);
            world.entity_mut(entity).insert(textures);
        }
        let image = LightmapImage {
            name: "light".into(),
            width: 2,
            height: 2,
            texels: [0.25, 0.5, 0.125, 1.0].map(Vec3::splat).to_vec(),
            encoding: LightmapEncoding::Rgb32Float,
        };
        world.entity_mut(entity).insert((Mesh(new.clone()), Lightmap { image: Arc::new(image) }));
    }
}

/// Texels per metre that give about sixteen texels across a mesh of any size.
fn density(mesh: &TriangleMesh) -> f64 {
    let size =
        mesh.positions.iter().map(|position| f64::from(position.abs().max_element())).fold(0.0, f64::max);
    if size > 0.0 { 8.0 / size } else { 1.0 }
}

#[test]
fn only_light_is_added() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut printed = Vec::new();
    for ((what, glb), (_, gltf)) in files().into_iter().zip(files()) {
        let mut counts = Vec::new();
        fs::write(at("file.glb"), glb.glb()).unwrap();
        fs::write(at("inline.gltf"), gltf.gltf()).unwrap();
        for (input, output) in [
            ("file.glb", "file.baked.glb"),
            ("inline.gltf", "inline.baked.gltf"),
            ("file.glb", "text.baked.gltf"),
            ("inline.gltf", "binary.baked.glb"),
        ] {
            baked(&at(input), &at(output));
            counts.push(compare(what, &at(input), &at(output)));
            // Bake again: the file neither grows nor loses anything.
            let first = fs::read(at(output)).unwrap();
            baked(&at(output), &at(output));
            assert!(fs::read(at(output)).unwrap() == first, "{what}: {output} baked again");
            // Reading the baked file gives the artist's file.
            let mut world = World::new();
            let report = load(&mut world, &at(output)).unwrap();
            assert!(
                report.notes.iter().all(|note| !note.to_string().contains("TEXCOORD_1")),
                "{:?}",
                report.notes
            );
        }
        assert!(counts.iter().all(|count| *count == counts[0]), "{what}: {counts:?}");
        printed.push(format!("{what}: {} primitives with light", counts[0]));
        let expected = match what {
            "animation" | "skin, joints and weights" => 1,
            "lights, cameras and more nodes" => 2,
            _ => 1,
        };
        assert_eq!(counts[0], expected, "{what}");
    }
    println!("{}", printed.join("\n"));
    assert!(printed.len() >= 20);
}

#[test]
fn what_moves_with_a_skeleton_is_not_baked_unless_the_file_says_so() {
    let (_, file) = files().into_iter().find(|(name, _)| name.starts_with("skin")).unwrap();
    let (mut world, report) = file.load().unwrap();
    assert_eq!(world.query::<(&Mesh, &StaticObject)>().iter(&world).count(), 1);
    assert_eq!(world.query::<(&Mesh, &DynamicObject)>().iter(&world).count(), 1);
    let note = report.notes.iter().find(|note| note.text.contains("skeleton")).unwrap();
    assert!(note.to_string().contains("not baked") && note.to_string().contains("cube"), "{note}");
}

/// A .gltf with an external buffer and an external image.
fn with_files(folder: &Path) -> PathBuf {
    let mut file = File::new();
    file.push("images", json!({"uri": "textures/a%20wall.png"}));
    file.push("textures", json!({"source": 0}));
    file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    cube(&mut file, |file, primitive| {
        primitive["attributes"]["TEXCOORD_0"] = file.floats("VEC2", 2, &values(2, 0.0)).into();
        primitive["material"] = 0.into();
    });
    file.root["buffers"] = json!([{"byteLength": file.binary.len(), "uri": "room.bin"}]);
    fs::create_dir_all(folder.join("textures")).unwrap();
    fs::write(folder.join("room.bin"), &file.binary).unwrap();
    fs::write(folder.join("textures/a wall.png"), png(3, 3)).unwrap();
    fs::write(folder.join("room.gltf"), serde_json::to_vec_pretty(&file.root).unwrap()).unwrap();
    folder.join("room.gltf")
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn files_beside_are_referred_to_or_copied() {
    let place = tempfile::tempdir().unwrap();
    let (level, out) = (place.path().join("level"), place.path().join("out"));
    for folder in [&level, &out] {
        fs::create_dir(folder).unwrap();
    }
    let input = with_files(&level);
    // Nothing is copied within the same folder.
    baked(&input, &level.join("room.baked.gltf"));
    compare("beside", &input, &level.join("room.baked.gltf"));
    let own = [
        "room.baked.bake.bin",
        "room.baked.gltf",
        "room.baked.lightmaps",
        "room.bin",
        "room.gltf",
        "textures",
    ];
    assert_eq!(names(&level), own);

    // Everything is copied to another folder, and existing files that are not from an earlier bake stay.
    fs::write(out.join("room.bin"), "of another file").unwrap();
    let output = out.join("room.gltf");
    let (_, saved) = baked(&input, &output);
    assert_eq!(fs::read(out.join("room.bin")).unwrap(), b"of another file");
    let found = read(&output);
    assert_eq!(found.root["buffers"][0]["uri"], "room.room.bin");
    assert_eq!(found.root["images"][0]["uri"], "textures/a%20wall.png");
    assert_eq!(found.buffers[0], fs::read(level.join("room.bin")).unwrap());
    assert_eq!(fs::read(out.join("textures/a wall.png")).unwrap(), png(3, 3));
    assert!(saved.files.contains(&out.join("textures/a wall.png")), "{:?}", saved.files);
    assert!(load(&mut World::new(), &output).is_ok());

    // The artist changes the image: the copy is updated.
    fs::write(level.join("textures/a wall.png"), png(5, 5)).unwrap();
    let before = names(&out);
    baked(&input, &output);
    assert_eq!(fs::read(out.join("textures/a wall.png")).unwrap(), png(5, 5));
    assert_eq!(names(&out), before);

    // A .glb takes in the first buffer, and images stay external.
    fs::remove_dir_all(&out).unwrap();
    fs::create_dir(&out).unwrap();
    baked(&input, &out.join("room.glb"));
    assert_eq!(names(&out), ["room.glb", "room.lightmaps", "textures"]);
    assert!(load(&mut World::new(), &out.join("room.glb")).is_ok());
}

#[test]
fn volumes_lights_and_the_sky_are_written_and_taken_back() {
    let place = tempfile::tempdir().unwrap();
    let (input, output) = (place.path().join("a.glb"), place.path().join("b.glb"));
    let mut file = File::new();
    file.light(
        json!({"type": "spot", "intensity": 30, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.7}}),
    );
    cube(&mut file, |_, _| {});
    fs::write(&input, file.glb()).unwrap();

    let mut world = World::new();
    let mut source = SourceFile::read(&input, &LoadOptions::default()).unwrap();
    source.load_into(&mut world).unwrap();
    let lamp = world.query::<&Light>().single(&world).unwrap().clone();
    bake(&mut world);
    world.resource_mut::<SceneSettings>().sky = Vec3::new(0.5, 0.75, 1.0);
    let volume = IrradianceVolume {
        resolution: glam::UVec3::ONE,
        cubes: vec![AmbientCube::default()],
        inside: Vec::new(),
    };
    world.spawn((Name::new("volume"), Transform::from_xyz(1.0, 2.0, 3.0), volume));
    save_baked(&mut world, &source, &output, &SaveOptions::default()).unwrap();

    let mut again = World::new();
    let report = load(&mut again, &output).unwrap();
    assert_eq!(*again.query::<&Light>().single(&again).unwrap(), lamp);
    assert_eq!(again.resource::<SceneSettings>().sky, Vec3::new(0.5, 0.75, 1.0));
    let (_, transform) = again.query::<(&IrradianceVolume, &Transform)>().single(&again).unwrap();
    assert_eq!(*transform, Transform::from_xyz(1.0, 2.0, 3.0));
    assert_eq!(report.nodes.len(), 3);

    // Undo the bake: the artist's own sky is black.
    let mut pristine = World::new();
    let mut source = SourceFile::read(&output, &LoadOptions::default()).unwrap();
    let report = source.load_into(&mut pristine).unwrap();
    assert_eq!(pristine.resource::<SceneSettings>().sky, Vec3::ZERO);
    assert_eq!((report.nodes.len(), pristine.query::<&IrradianceVolume>().iter(&pristine).count()), (2, 0));
    assert!(report.notes.iter().any(|note| note.place == "LUMBRE_bake"), "{:?}", report.notes);
    save_baked(&mut pristine, &source, &place.path().join("c.glb"), &SaveOptions::default()).unwrap();
    assert_eq!(read(&place.path().join("c.glb")).root, read(&input).root);
}

#[test]
fn settings_change_and_baked_light_stays_in_any_folder() {
    let (folder, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (input, output) = (folder.path().join("room.glb"), folder.path().join("room.baked.glb"));
    let mut file = File::new();
    cube(&mut file, |_, _| {});
    fs::write(&input, file.glb()).unwrap();
    let mut world = World::new();
    let mut source = SourceFile::read(&input, &LoadOptions::default()).unwrap();
    source.load_into(&mut world).unwrap();
    bake(&mut world);
    let options = SaveOptions { ktx2: Some(PackedFormat::Rgb9E5), ..SaveOptions::default() };
    save_baked(&mut world, &source, &output, &options).unwrap();

    let light = |path: &Path| {
        let mut world = World::new();
        load(&mut world, path).unwrap();
        let SceneSettings { shading, frame, .. } = *world.resource::<SceneSettings>();
        let maps: Vec<Vec<Vec3>> =
            world.query::<&Lightmap>().iter(&world).map(|map| map.image.texels.clone()).collect();
        (shading, frame, maps)
    };
    let (_, usual, maps) = light(&output);
    assert_eq!(usual, FrameSettings::default());
    assert!(!maps.is_empty());
    let frame = FrameSettings {
        multisample: Some(false),
        light_threshold: 0.25,
        shadows: false,
        shadow_resolution: 0.5,
        shadow_filter: ShadowFilter::PercentageCloser,
        lightmap_format: LightmapEncoding::Rgb9E5,
    };
    let settings = FileSettings { shading: Shading::Gouraud, frame, lightmap_reduction: 1 };
    for folder in [folder.path(), other.path()] {
        let tuned = folder.join("tuned.glb");
        save_settings(&output, &tuned, settings).unwrap();
        assert_eq!(light(&tuned), (Shading::Gouraud, frame, maps.clone()));
        // With the default settings again, nothing of the former ones is left in the file.
        let again = folder.join("again.glb");
        save_settings(&tuned, &again, FileSettings { frame: usual, ..settings }).unwrap();
        assert_eq!(light(&again), (Shading::Gouraud, usual, maps.clone()));
        assert!(!String::from_utf8_lossy(&fs::read(&again).unwrap()).contains("shadowFilter"));
    }
    let packed = |folder: &Path| fs::read_dir(folder.join("room.baked.lightmaps")).unwrap().count();
    assert_eq!(
        packed(other.path()),
        packed(folder.path()),
        "what lies beside the maps for others goes along"
    );

    // Smaller lightmaps are files of their own, for others too; nobody copies the former ones along.
    let elsewhere = tempfile::tempdir().unwrap();
    for folder in [folder.path(), elsewhere.path()] {
        let small = folder.join("small.glb");
        let reduced = FileSettings { lightmap_reduction: 2, ..settings };
        let report = save_settings(&output, &small, reduced).unwrap();
        assert_eq!(names(&folder.join("small.lightmaps")), ["cube.exr", "cube.ktx2"]);
        assert_eq!(report.lightmaps.len(), 2);
        let mut world = World::new();
        load(&mut world, &output).unwrap();
        reduce_lightmaps(&mut world, 2);
        let expected: Vec<Vec<Vec3>> =
            world.query::<&Lightmap>().iter(&world).map(|map| map.image.texels.clone()).collect();
        assert_eq!(light(&small), (Shading::Gouraud, frame, expected.clone()));
        assert!(expected[0].len() * 3 < maps[0].len(), "{} texels of {}", expected[0].len(), maps[0].len());
        // The next bake starts from the artist's file, as it would from the baked one.
        let pristine = |path: &Path| {
            let mut source = SourceFile::read(path, &LoadOptions::default()).unwrap();
            let mut world = World::new();
            source.load_into(&mut world).unwrap();
            world.query::<&Lightmap>().iter(&world).count()
        };
        assert_eq!((pristine(&small), pristine(&output)), (0, 0));
    }
    assert!(!elsewhere.path().join("room.baked.lightmaps").exists());

    let refused = save_settings(&output, &other.path().join("tuned.gltf"), settings);
    assert!(matches!(refused, Err(SaveError::Container { .. })), "{refused:?}");
    fs::write(&input, r#"{"asset": {"version": "2.0"}}"#).unwrap();
    let refused = save_settings(&input, &other.path().join("none.gltf"), settings);
    assert!(matches!(refused, Err(SaveError::NoScene { .. })), "{refused:?}");
    let refused = save_settings(&folder.path().join("missing.glb"), &other.path().join("none.glb"), settings);
    assert!(matches!(refused, Err(SaveError::Unreadable(_))), "{refused:?}");
    assert!(!other.path().join("none.gltf").exists() && !other.path().join("none.glb").exists());
}

#[test]
fn another_mesh_is_not_written_into_the_file() {
    let place = tempfile::tempdir().unwrap();
    let (input, output) = (place.path().join("a.glb"), place.path().join("b.glb"));
    let mut file = File::new();
    cube(&mut file, |_, _| {});
    fs::write(&input, file.glb()).unwrap();
    let mut world = World::new();
    let mut source = SourceFile::read(&input, &LoadOptions::default()).unwrap();
    source.load_into(&mut world).unwrap();
    bake(&mut world);
    for mut mesh in world.query::<&mut Mesh>().iter_mut(&mut world) {
        Arc::make_mut(&mut mesh.0).positions[0].x += 1.0;
    }
    let error = save_baked(&mut world, &source, &output, &SaveOptions::default()).unwrap_err();
    assert!(matches!(error, SaveError::MeshChanged { .. }), "{error}");
    assert!(error.to_string().contains("cube"), "{error}");
    assert_eq!(names(place.path()), ["a.glb"]);
}

/// Checks all files below the folder in the variable LUMBRE_CORPUS. Without the variable the test prints that
/// it is skipped.
#[test]
fn only_light_is_added_to_any_folder_of_files() {
    let Some(corpus) = std::env::var_os("LUMBRE_CORPUS") else {
        println!("skipped: set LUMBRE_CORPUS to a folder of glTF files");
        return;
    };
    let mut files = Vec::new();
    let mut folders = vec![PathBuf::from(corpus)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension().and_then(|extension| extension.to_str()) {
                _ if path.is_dir() => folders.push(path),
                Some("glb" | "gltf") => files.push(path),
                _ => {}
            }
        }
    }
    files.sort();
    let (mut kept, mut refused) = (0, 0);
    for input in files {
        let start = std::time::Instant::now();
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join(input.file_name().unwrap()).with_extension("baked.gltf");
        let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
        let mut world = World::new();
        let read = SourceFile::read(&input, &lenient)
            .and_then(|mut source| Ok((source.load_into(&mut world)?, source)));
        let outcome = match read {
            Err(error) => {
                refused += 1;
                error.to_string()
            }
            Ok((_, source)) => {
                bake(&mut world);
                save_baked(&mut world, &source, &output, &SaveOptions::default()).unwrap();
                let text: Value = serde_json::from_slice(&fs::read(&output).unwrap()).unwrap();
                let mut found = Vec::new();
                let before = json_of(&input);
                differences(&before, &text, "", &mut found);
                for place in &found {
                    let allowed = is_of_the_bake(place, &before, &text) || place.ends_with("/uri");
                    assert!(allowed, "{}: {place}", input.display());
                }
                // Undoing the bake gives a file that can be loaded.
                let again = SourceFile::read(&output, &lenient).unwrap().load_into(&mut World::new());
                assert!(again.is_ok(), "{}", input.display());
                kept += 1;
                let lit = found.iter().filter(|place| place.contains("TEXCOORD_1")).count();
                format!("kept, {} places differ, {lit} primitives lightmapped", found.len())
            }
        };
        println!("{:6.2} s  {}: {outcome}", start.elapsed().as_secs_f64(), input.display());
    }
    println!("{kept} kept, {refused} refused");
}

fn json_of(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        serde_json::from_slice(&bytes[20..20 + length]).unwrap()
    } else {
        serde_json::from_slice(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes)).unwrap()
    }
}
