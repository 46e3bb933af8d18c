//! Encoded files as artists have them: Draco meshes, KTX2 and WebP images. Files made by the reference
//! encoders are compared with the results of the reference decoders; damaged files must give errors that name
//! the place, or load without harm. `encoded/make.mjs` makes the files.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]
#![allow(clippy::print_stdout, reason = "what became of the mutants is what one wants to see of them")]

#[path = "support/allocation.rs"]
mod allocation;
#[path = "support/encoded.rs"]
mod encoded;
mod support;

use std::sync::Mutex;
use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use encoded::*;
use lumbre_scene::*;
use serde_json::{Value, json};
use support::File;

/// Locked while memory is measured, so that allocations of other tests are not counted.
static MEASURING: Mutex<()> = Mutex::new(());

fn numbers(value: &Value) -> Vec<f32> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap() as f32).collect()
}

fn the_mesh(world: &mut World) -> std::sync::Arc<lumbre_mesh::TriangleMesh> {
    world.query::<&Mesh>().single(world).unwrap().0.clone()
}

#[test]
fn draco_meshes_are_what_the_reference_decoder_finds() {
    let _alone = MEASURING.lock();
    for (name, bytes, expected) in MESHES {
        let expected: Value = serde_json::from_slice(expected).unwrap();
        let (mut world, report) = compressed_mesh(bytes, &expected).load().unwrap();
        assert_eq!(report.triangles, 36, "{name}");
        let mesh = the_mesh(&mut world);
        let indices: Vec<f32> = mesh.indices.iter().map(|&index| index as f32).collect();
        assert_eq!(indices, numbers(&expected["indices"]), "{name}");
        let flat = |values: Vec<Vec<f32>>| values.concat();
        let of = |name: &str| numbers(&expected["attributes"][name]);
        let positions: Vec<f32> = flat(mesh.positions.iter().map(|v| v.to_array().to_vec()).collect());
        assert_eq!(positions, of("POSITION"), "{name}");
        let coordinates: Vec<f32> = flat(mesh.uv0.iter().map(|v| v.to_array().to_vec()).collect());
        assert_eq!(coordinates, of("TEXCOORD_0"), "{name}");
        // Normals with eight bits per octahedral coordinate are not exactly of unit length.
        for (ours, theirs) in mesh.normals.iter().zip(of("NORMAL").chunks(3)) {
            assert!((*ours - glam::Vec3::from_slice(theirs)).length() < 1e-6, "{name}: {ours} {theirs:?}");
        }
        let colors: Vec<f32> = flat(mesh.colors.iter().map(|v| (*v * 255.0).to_array().to_vec()).collect());
        for (ours, theirs) in colors.iter().zip(of("COLOR_0")) {
            assert!((ours - theirs).abs() < 1e-3, "{name}");
        }
    }
}

/// A file of which two attributes share an accessor, as programs that remove duplicates leave them: both are three floats
/// for each of as many vertices.
fn sharing_an_accessor() -> (File, std::sync::Arc<lumbre_mesh::TriangleMesh>) {
    let (_, bytes, expected) = MESHES[0];
    let expected: Value = serde_json::from_slice(expected).unwrap();
    let (mut alone, _) = compressed_mesh(bytes, &expected).load().unwrap();
    let mut file = compressed_mesh(bytes, &expected);
    let attributes = &mut file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = attributes["POSITION"].clone();
    (file, the_mesh(&mut alone))
}

#[test]
fn attributes_that_share_an_accessor_have_their_own_draco_data() {
    let _alone = MEASURING.lock();
    let (mut file, alone) = sharing_an_accessor();
    assert!(alone.normals != alone.positions);
    // A second primitive with the same data is not decoded again.
    let primitives = file.root["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives.push(primitives[0].clone());
    let (mut shared, _) = file.load().unwrap();
    let meshes: Vec<_> = shared.query::<&Mesh>().iter(&shared).map(|mesh| mesh.0.clone()).collect();
    let [mesh, second] = &meshes[..] else { panic!("{} meshes", meshes.len()) };
    assert!(std::sync::Arc::ptr_eq(mesh, second));
    assert_eq!((&mesh.positions, &mesh.normals), (&alone.positions, &alone.normals));
    assert_eq!((&mesh.uv0, &mesh.indices), (&alone.uv0, &alone.indices));
}

#[test]
fn a_reference_that_leads_nowhere_does_not_lead_to_an_added_accessor() {
    let _alone = MEASURING.lock();
    let (mut file, _) = sharing_an_accessor();
    let accessors = file.root["accessors"].as_array().unwrap().len();
    let nowhere = json!({"attributes": {"POSITION": accessors}});
    file.root["meshes"][0]["primitives"].as_array_mut().unwrap().push(nowhere);
    let text = file.problem().to_string();
    assert!(text.contains(&format!("accessors[{accessors}]")), "{text}");
}

#[test]
fn what_accessors_say_is_not_copied_without_end() {
    let _alone = MEASURING.lock();
    let (mut file, _) = sharing_an_accessor();
    file.root["accessors"][0]["extras"] = "x".repeat(1 << 20).into();
    let primitive = file.root["meshes"][0]["primitives"][0].clone();
    for number in 100..200 {
        let mut primitive = primitive.clone();
        primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = number.into();
        file.root["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }
    let limits = LoadLimits { decoded_bytes: Some(32 << 20), ..LoadLimits::default() };
    let loaded = load_slice_within(&mut World::new(), &file.glb(), "test.glb", None, limits);
    let problem = loaded.err().map(|error| *error.problem);
    assert!(matches!(problem, Some(LoadProblem::TooLarge { .. })), "{problem:?}");
}

fn the_picture(world: &mut World) -> std::sync::Arc<Image> {
    world.query::<&MaterialTextures>().single(world).unwrap().base_color.clone().unwrap().image
}

#[test]
fn pictures_are_what_the_reference_decoders_find() {
    let _alone = MEASURING.lock();
    for (name, bytes, expected) in PICTURES {
        let (mut world, _) = encoded_picture(name, bytes).load().unwrap_or_else(|error| panic!("{error}"));
        let image = the_picture(&mut world);
        assert_eq!((image.width, image.height), SIZE, "{name}");
        let difference = image.rgba.iter().zip(expected).map(|(ours, theirs)| ours.abs_diff(*theirs)).max();
        println!("{name}: {} bytes, largest difference {difference:?}", bytes.len());
        assert_eq!(image.rgba.len(), expected.len(), "{name}");
        assert_eq!(difference, Some(0), "{name}");
    }
}

/// An uncompressed or Zstandard KTX2 file written by hand, and its texels.
fn plain_ktx2(format: u32, channels: usize, zstandard: bool) -> (Vec<u8>, Vec<u8>) {
    let (width, height) = (5u32, 3u32);
    let texels: Vec<u8> = (0..width as usize * height as usize * channels).map(|at| (7 * at) as u8).collect();
    let level = if zstandard { zstd::bulk::compress(&texels, 3).unwrap() } else { texels.clone() };
    let mut file = vec![0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
    let scheme = if zstandard { 2 } else { 0 };
    let fields = [format, 1, width, height, 0, 0, 1, 1, scheme, 104, 28, 0, 0];
    file.extend(fields.into_iter().flat_map(u32::to_le_bytes));
    let index = [0u64, 0, 132, level.len() as u64, texels.len() as u64];
    file.extend(index.into_iter().flat_map(u64::to_le_bytes));
    file.extend([28, 0, 0, 0]);
    file.extend([0; 24]);
    file.extend(&level);
    (file, texels)
}

#[test]
fn uncompressed_ktx2_pictures() {
    let _alone = MEASURING.lock();
    for (format, channels) in [(23, 3), (29, 3), (37, 4), (43, 4)] {
        for zstandard in [false, true] {
            let (bytes, texels) = plain_ktx2(format, channels, zstandard);
            let (mut world, _) = encoded_picture("plain.ktx2", &bytes).load().unwrap();
            let image = the_picture(&mut world);
            assert_eq!((image.width, image.height), (5, 3));
            let opaque = |texel: &[u8]| [texel[0], texel[1], texel[2], *texel.get(3).unwrap_or(&255)];
            let expected: Vec<u8> = texels.chunks(channels).flat_map(opaque).collect();
            assert_eq!(image.rgba, expected, "format {format}");
        }
    }
}

#[test]
fn damaged_files_are_refused_by_their_place() {
    let _alone = MEASURING.lock();
    let (_, bytes, expected) = MESHES[0];
    let expected: Value = serde_json::from_slice(expected).unwrap();
    let problem = |change: &dyn Fn(&mut File)| {
        let mut file = compressed_mesh(bytes, &expected);
        change(&mut file);
        file.problem()
    };
    let at = |file: &mut File, key: &str, value: Value| {
        file.root["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"][key] = value;
    };
    for (change, said) in [
        (
            &(|file: &mut File| file.binary[0] = b'X') as &dyn Fn(&mut File),
            "meshes[0].primitives[0]: its Draco data",
        ),
        (&|file: &mut File| file.binary.truncate(300), "bufferViews[0]"),
        (&|file: &mut File| at(file, "bufferView", 9.into()), "bufferViews[9]"),
        (
            &|file: &mut File| at(file, "attributes", json!({"POSITION": 77})),
            "attribute 77 is not in its Draco data",
        ),
        (
            &|file: &mut File| at(file, "attributes", json!({"POSITION": 2})),
            "its type has 3 numbers, but its Draco data have 2",
        ),
        (&|file: &mut File| at(file, "attributes", json!("x")), "KHR_draco_mesh_compression"),
        (
            &|file: &mut File| file.root["accessors"][0]["count"] = 29.into(),
            "another attribute in the same Draco data 28",
        ),
        (&|file: &mut File| file.root["accessors"][6]["count"] = 30.into(), "faces"),
        (&|file: &mut File| file.root["accessors"][6]["componentType"] = 5126.into(), "cannot be an index"),
        (
            &|file: &mut File| file.root["accessors"][4]["componentType"] = 5121.into(),
            "componentType cannot hold",
        ),
        (&|file: &mut File| file.root["accessors"][0]["componentType"] = 5123.into(), "real numbers"),
        (&|file: &mut File| file.root["meshes"][0]["primitives"][0]["mode"] = 5.into(), "mode"),
    ] {
        let text = problem(change).to_string();
        assert!(text.contains(said), "{said}: {text}");
    }
    // A small file must not be able to claim a large allocation.
    let claims = problem(&|file| {
        for accessor in 0..7 {
            file.root["accessors"][accessor]["count"] = (3u64 << 40).into();
        }
    });
    assert!(matches!(claims, LoadProblem::TooLarge { .. }), "{claims}");

    let (_, bytes, _) = PICTURES[0];
    let changed = |at: usize, value: u32| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        encoded_picture("changed.ktx2", &bytes).problem().to_string()
    };
    for (at, value, said) in [
        (12, 9, "vkFormat is 9"),
        (20, 0, "pixelWidth is 0"),
        (20, 30_000, "uncompressedByteLength"),
        (28, 4, "pixelDepth"),
        (36, 6, "faceCount"),
        (44, 3, "supercompressionScheme"),
        (48, u32::MAX, "data format descriptor"),
        (68, u32::MAX, "global data"),
        (84, u32::MAX, "level 0"),
    ] {
        let text = changed(at, value);
        assert!(
            text.starts_with("images[0]: cannot be decoded as KTX2") && text.contains(said),
            "{said}: {text}"
        );
    }
    let problem = pictured(b"GIF89a0000000000000", "image/gif", None).problem().to_string();
    assert!(problem.contains("neither PNG nor JPEG, WebP or KTX2"), "{problem}");
}

#[test]
fn instances_are_nodes() {
    let _alone = MEASURING.lock();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let rotations = [0., 0., 0., 1., 0., half, 0., half, 0., 0., 0., 1.];
    let (mut world, report) = instanced(&[0., 0., 0., 5., 0., 0., 0., 7., 0.], &rotations).load().unwrap();
    let mut seen: Vec<_> = world
        .query_filtered::<&GlobalTransform, With<Mesh>>()
        .iter(&world)
        .map(|transform| transform.0.transform_point3(glam::DVec3::X))
        .collect();
    seen.sort_by(|a, b| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x)));
    // The instanced node is at (0, 1, 0); a quarter turn about y takes x to -z.
    let expected = [(1., 1., 0.), (5., 1., -1.), (1., 8., 0.)].map(glam::DVec3::from);
    assert_eq!(seen.len(), 3);
    for (seen, expected) in seen.iter().zip(expected) {
        assert!((*seen - expected).length() < 1e-6, "{seen} {expected}");
    }
    assert_eq!(report.nodes.len(), 4);
    assert!(report.notes.iter().any(|note| note.text.contains("3 instances")), "{:?}", report.notes);

    // The node's exact surface is that of each instance, and not of the node, which has no mesh any more.
    let mut balls = instanced(&[0.0; 9], &[0.0, 0.0, 0.0, 1.0].repeat(3));
    balls.root["nodes"][0]["extensions"]["LUMBRE_quadric"] = json!({"kind": "sphere"});
    let (mut world, report) = balls.load().unwrap();
    let found: Vec<_> = world.query::<&Quadric>().iter(&world).cloned().collect();
    assert_eq!(found, vec![Quadric::sphere(1.0); 3]);
    assert!(report.notes.iter().all(|note| !note.text.contains("LUMBRE_quadric")), "{:?}", report.notes);

    // All instances cannot have the light of one map.
    let mut baked = instanced(&[0.0; 9], &[0.0, 0.0, 0.0, 1.0].repeat(3));
    baked.root["nodes"][0]["extensions"]["LUMBRE_lightmap"] = json!({"image": "light.exr"});
    let (_, report) = baked.load().unwrap();
    assert!(report.notes.iter().any(|note| note.text.contains("bake the file again")), "{:?}", report.notes);
    let problem = instanced(&[0.0; 9], &[0., 0., 0., 1.]).problem().to_string();
    assert!(
        problem.contains("nodes[0] (instanced): EXT_mesh_gpu_instancing.ROTATION")
            && problem.contains("has 1 elements")
    );
    let problem = instanced(&[f32::NAN; 3], &[0., 0., 0., 1.]).problem().to_string();
    assert!(problem.contains("NaN"), "{problem}");
    let mut many = instanced(&[0.0; 9], &[0.0, 0.0, 0.0, 1.0].repeat(3));
    for accessor in many.root["accessors"].as_array_mut().unwrap() {
        if accessor["count"] == 3 {
            accessor.as_object_mut().unwrap().remove("bufferView");
            accessor["count"] = 5_000_000.into();
        }
    }
    let problem = many.problem();
    assert!(matches!(problem, LoadProblem::TooLarge { .. }), "{problem}");
}

/// Instances and meshes are charged to one limit: what the instances take is not available for the meshes.
#[test]
fn one_limit_covers_instances_and_meshes() {
    let _alone = MEASURING.lock();
    let file = instanced(&[0.0; 9], &[0.0, 0.0, 0.0, 1.0].repeat(3)).glb();
    // The least limit with which the file is loaded.
    let loads = |bytes| {
        let limits = LoadLimits { decoded_bytes: Some(bytes), ..LoadLimits::default() };
        load_slice_within(&mut World::new(), &file, "test.glb", None, limits).is_ok()
    };
    let least = (0..1 << 14).collect::<Vec<u64>>().partition_point(|&bytes| !loads(bytes));
    // An instance is counted as 1 KiB and 28 bytes of its attributes; a square has 4 vertices and 2 triangles.
    let instances = 3 * (1024 + 3 * 4 + 4 * 4);
    let square = 4 * 12 + 6 * 4;
    assert!(least >= instances + square, "{least}");
}

/// SplitMix64 pseudo-random numbers.
fn next(state: &mut u64) -> usize {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 1) as usize
}

/// A copy that is truncated or has bytes changed.
fn mutant(original: &[u8], seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut bytes = original.to_vec();
    for _ in 0..=next(&mut state) % 4 {
        let at = next(&mut state) % bytes.len();
        match next(&mut state) % 8 {
            0 => bytes.truncate(at.max(1)),
            1 => bytes[at] = [0, 0x7f, 0x80, 0xff][next(&mut state) % 4],
            _ => bytes[at] ^= 1 << (next(&mut state) % 8),
        }
    }
    bytes
}

/// Most bytes that one load may hold at once: vertices and indices of 64 MiB plus 64 times the file
/// (`LoadLimits`), and images, which are limited here to 256 texels per side, with 4 bytes per texel several
/// times over. A VP8 frame keeps its rows in addition.
const BOUND: usize = 96 << 20;
const SLOWEST: Duration = Duration::from_secs(5);

#[test]
fn no_mutant_panics_hangs_or_fills_the_memory() {
    load_mutants(0..3_500);
}

/// Runs as many mutants of every file as is required for a decoder, since most files take a path of their own
/// through it.
#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn none_of_ten_thousand_mutants_of_each_file_does() {
    load_mutants(0..10_000);
}

/// Loads mutants of every file, made with these seeds.
fn load_mutants(seeds: std::ops::Range<u64>) {
    let [plain, plain_zstandard] = [false, true].map(|zstandard| plain_ktx2(37, 4, zstandard).0);
    let instances = instanced(&[0.0; 9], &[0.0, 0.0, 0.0, 1.0].repeat(3)).glb();
    let meshes = MESHES.map(|(name, bytes, expected)| (name, bytes, Some(expected)));
    let pictures = PICTURES.map(|(name, bytes, _)| (name, bytes, None));
    let _alone = MEASURING.lock();
    let limits = LoadLimits { image_side: 256, ..LoadLimits::default() };
    let whole = [("instances", &instances[..], None)];
    let plain = [("plain.ktx2", &plain[..], None), ("plain_zstandard.ktx2", &plain_zstandard[..], None)];
    for (name, original, expected) in meshes.into_iter().chain(pictures).chain(plain).chain(whole) {
        let expected: Option<Value> = expected.map(|expected| serde_json::from_slice(expected).unwrap());
        let (mut loaded, mut refused, mut largest, mut slowest) = (0, 0, 0, Duration::ZERO);
        for seed in seeds.clone() {
            let bytes = mutant(original, seed);
            let file = match &expected {
                Some(expected) => compressed_mesh(&bytes, expected).glb(),
                None if name == "instances" => bytes,
                None => encoded_picture(name, &bytes).glb(),
            };
            let before = allocation::begin();
            let start = Instant::now();
            match load_slice_within(&mut World::new(), &file, "mutant", None, limits) {
                Ok(_) => loaded += 1,
                Err(error) => {
                    let text = error.to_string();
                    assert!(!text.contains("decoder fail"), "{name}, seed {seed}: {text}");
                    refused += 1;
                }
            }
            slowest = slowest.max(start.elapsed());
            let peak = allocation::most_since(before);
            largest = largest.max(peak);
            assert!(peak < BOUND, "{name}, seed {seed}: {peak} bytes at once");
            assert!(slowest < SLOWEST, "{name}, seed {seed}: {slowest:?}");
        }
        println!("{name}: {loaded} loaded, {refused} refused; slowest {slowest:?}, largest {largest} bytes");
        assert!(loaded > 100 && refused > 1_000, "{name}: {loaded} loaded, {refused} refused");
    }
}
