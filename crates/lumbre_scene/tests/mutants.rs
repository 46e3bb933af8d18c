//! Loads more than ten thousand damaged files: each load must end without a panic and within a bound on
//! memory.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

#[path = "support/allocation.rs"]
mod allocation;
mod support;

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_scene::{
    LightmapEncoding, LightmapImage, PackedFormat, Supercompression, lightmap_to_ktx2, load_slice,
};
use serde_json::json;
use support::{File, png};

/// Most bytes that one load may hold at once. The default limit on decoded data for these files is 64 MiB
/// plus 64 times their 3 kB. Images of at most 300 bytes may expand to 33,000 bytes per byte with 4 bytes per
/// texel, and exist twice during conversion: 20 MB. The rest is for the JSON.
const BOUND: usize = 96 << 20;
/// Longest time for one load. Decoding a scene at the limit takes a fraction of a second; anything longer is
/// a hang.
const SLOWEST: Duration = Duration::from_secs(5);

/// Textures, a sparse accessor, a strip and vertex colours.
fn textured() -> Vec<u8> {
    let mut file = File::new();
    let view = file.view(&png(5, 4));
    let image = file.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    let sampler = file.push("samplers", json!({"magFilter": 9728, "minFilter": 9985, "wrapS": 33071}));
    let texture = file.push("textures", json!({"source": image, "sampler": sampler}));
    let transform =
        json!({"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.1, "scale": [2, 3]}});
    let material = file.push(
        "materials",
        json!({"name": "checker", "alphaMode": "MASK", "alphaCutoff": 0.4, "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture, "extensions": transform}, "metallicRoughnessTexture": {"index": texture}}}),
    );
    file.square(|file, primitive| {
        let uv = file.floats("VEC2", 2, &[0., 0., 1., 0., 1., 1., 0., 1.]);
        primitive["attributes"]["TEXCOORD_0"] = uv.into();
        primitive["material"] = material.into();
        let (at, new) = (file.view(&[2, 0, 3, 0]), file.view(&[0; 24]));
        let position = primitive["attributes"]["POSITION"].as_u64().unwrap() as usize;
        file.root["accessors"][position]["sparse"] = json!({"count": 2,
            "indices": {"bufferView": at, "componentType": 5123}, "values": {"bufferView": new}});
    });
    file.square(|file, primitive| {
        let order = file.indices(&[0, 1, 3, 2]);
        let view = file.view(&[255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 9, 9, 9, 9]);
        let accessor = json!({"bufferView": view, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"});
        primitive["attributes"]["COLOR_0"] = file.push("accessors", accessor).into();
        primitive["indices"] = order.into();
        primitive["mode"] = 5.into();
    });
    file.glb()
}

/// Lights of every kind, a camera, a hierarchy with a matrix, and every scene extension.
fn lit() -> Vec<u8> {
    let mut file = File::new();
    file.light(json!({"type": "spot", "intensity": 30, "range": 4, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}}));
    file.light(
        json!({"type": "directional", "color": [1, 0.5, 0.25], "extensions": {"LUMBRE_lights_phong": {
        "ambient": [0.1, 0, 0], "attenuation": [1, 0, 0], "bake": "mixed", "shadow": true}}}),
    );
    file.light(json!({"type": "point", "extensions": {"LUMBRE_lights_phong": {"attenuation": [0.5, 0.25, 1], "spot": {"cutoff": 0.4, "exponent": 8}}}}));
    let camera = file.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 100}}),
    );
    let material = file.push("materials", json!({"doubleSided": true, "emissiveFactor": [1, 1, 1], "extensions": {
        "KHR_materials_emissive_strength": {"emissiveStrength": 9}, "LUMBRE_materials_phong": {"diffuse": [0.5, 0.5, 0.5],
        "shininess": 30, "back": {"diffuse": [1, 0, 0]}}}}));
    let square = file.square(|_, primitive| primitive["material"] = material.into());
    let child = file.push(
        "nodes",
        json!({"camera": camera, "translation": [0, 1, 2], "rotation": [0, 0, 0, 1], "scale": [1, -1, 2],
        "extensions": {"LUMBRE_shading": {"technique": "flat"}, "LUMBRE_object": {"dynamic": true}}}),
    );
    file.root["nodes"][square]["children"] = json!([child]);
    file.root["nodes"][square]["matrix"] = json!([0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 3, 2, 1, 1]);
    file.root["scenes"][0]["extensions"] = json!({"LUMBRE_scene": {"ambient": [0.1, 0.2, 0.3], "reflection": "blinn",
        "shading": "gouraud", "frame": {"multisample": true, "lightThreshold": 0.1, "shadowResolution": 0.5, "shadowFilter": "soft"}, "fog": {"mode": "linear", "color": [1, 1, 1], "start": 1, "end": 9}}});
    file.glb()
}

/// A .gltf with inline data, no normals, a fan and animations.
fn text() -> Vec<u8> {
    let mut file = File::new();
    let node = file.square(|file, primitive| {
        primitive["mode"] = 6.into();
        primitive["indices"] = file.indices(&[0, 1, 2, 3]).into();
    });
    file.push("animations", json!({"channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}], "samplers": []}));
    file.gltf()
}

/// SplitMix64 pseudo-random numbers, identical on all platforms.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

const EXTREMES: [&str; 16] = [
    "0",
    "-1",
    "1",
    "2",
    "255",
    "65535",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "1e308",
    "-1e308",
    "1e-320",
    "0.5",
];

/// The range of digits of a number near a random position.
fn some_number(bytes: &[u8], random: &mut Random) -> Option<(usize, usize)> {
    let start = random.below(bytes.len());
    let begin = start + bytes[start..].iter().position(u8::is_ascii_digit)?;
    let end =
        begin + bytes[begin..].iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(bytes.len() - begin);
    Some((begin, end))
}

fn mutant(original: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for _ in 0..=random.below(3) {
        if bytes.is_empty() {
            break;
        }
        match random.below(8) {
            0 => {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            1 => {
                let at = random.below(bytes.len());
                bytes[at] = [0, 0xFF, 0x7F, 0x80, b'"', b'{', b'-', b'9'][random.below(8)];
            }
            2 => bytes.truncate(random.below(bytes.len())),
            3 if bytes.len() > 20 => {
                // The length fields of the file and the JSON chunk.
                let at = [8, 12][random.below(2)];
                let value = [0, 1, 4, u32::MAX, 1 << 31, random.next() as u32 % 8192][random.below(6)];
                bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
            4 => {
                // Insert a copy of a part of the file.
                let (at, end) = (random.below(bytes.len()), random.below(bytes.len()));
                let part = bytes[at.min(end)..at.max(end)].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, part.into_iter().take(64));
            }
            _ => {
                if let Some((begin, end)) = some_number(&bytes, random) {
                    let removed = end - begin;
                    let extreme = EXTREMES[random.below(EXTREMES.len())];
                    bytes.splice(begin..end, extreme.bytes());
                    // Update the lengths in a .glb, so that the parser reaches the number.
                    if bytes.starts_with(b"glTF") && begin >= 20 {
                        for at in [8, 12] {
                            let length =
                                u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
                            let length =
                                length.wrapping_add(extreme.len() as u32).wrapping_sub(removed as u32);
                            bytes[at..at + 4].copy_from_slice(&length.to_le_bytes());
                        }
                    }
                }
            }
        }
    }
    bytes
}

#[test]
fn no_mutant_panics_hangs_or_fills_the_memory() {
    let per_file = 10_000;
    let (mut loaded, mut refused) = (0, 0);
    let begin = Instant::now();
    let mut slowest = Duration::ZERO;
    let mut largest = 0;
    for (number, original) in [textured(), lit(), text()].into_iter().enumerate() {
        load_slice(&mut World::new(), &original, "original", None).unwrap_or_else(|error| panic!("{error}"));
        for seed in 0..per_file {
            let mutant = mutant(&original, &mut Random(seed << 8 | number as u64));
            let before = allocation::begin();
            let start = Instant::now();
            match load_slice(&mut World::new(), &mutant, "mutant", None) {
                Ok(_) => loaded += 1,
                Err(error) => {
                    assert!(error.to_string().len() > 10);
                    refused += 1;
                }
            }
            slowest = slowest.max(start.elapsed());
            let peak = allocation::most_since(before);
            largest = largest.max(peak);
            assert!(peak < BOUND, "file {number}, seed {seed}: {peak} bytes at once");
            assert!(start.elapsed() < SLOWEST, "file {number}, seed {seed}: {:?}", start.elapsed());
        }
    }
    eprintln!(
        "{loaded} loaded, {refused} refused in {:?}; slowest {slowest:?}, largest {largest} bytes",
        begin.elapsed()
    );
    // If the mutations were always refused, or never, the test would not test anything.
    assert!(
        loaded + refused >= 10_000 && loaded > 1_000 && refused > 1_000,
        "{loaded} loaded, {refused} refused"
    );
}

#[test]
fn no_damaged_lightmap_panics() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = File::new();
    file.square(|_, _| {});
    // The format is recognized by the first bytes, not by the name.
    file.root["nodes"][0]["extensions"] = json!({"LUMBRE_lightmap": {"image": "l.exr"}});
    let file = file.glb();
    let path = folder.path().join("l.exr");
    image::Rgb32FImage::from_fn(9, 5, |x, y| image::Rgb([x as f32, y as f32, 0.5])).save(&path).unwrap();
    let open_exr = std::fs::read(&path).unwrap();
    let texels = (0..45).map(|at| Vec3::new(at as f32, 1.0, 0.5)).collect();
    let (name, encoding) = (String::new(), LightmapEncoding::default());
    let image = LightmapImage { name, width: 9, height: 5, texels, encoding };
    let ktx2 = [Supercompression::None, Supercompression::Zstandard]
        .map(|scheme| lightmap_to_ktx2(&image, PackedFormat::Rgb9E5, scheme).unwrap().0);
    for original in std::iter::once(open_exr).chain(ktx2) {
        let (mut loaded, mut refused) = (0, 0);
        for seed in 0..1_000 {
            std::fs::write(&path, mutant(&original, &mut Random(seed))).unwrap();
            match load_slice(&mut World::new(), &file, "level", Some(folder.path())) {
                Ok(_) => loaded += 1,
                Err(error) => {
                    assert!(error.to_string().contains("l.exr"), "{error}");
                    refused += 1;
                }
            }
        }
        assert!(loaded > 50 && refused > 50, "{loaded} loaded, {refused} refused");
    }
}
