//! EXT_meshopt_compression in whole files: decoding, limits, and errors for damaged data. The codec has its
//! own unit tests.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use lumbre_scene::*;
use serde_json::json;
use support::{File, load_bytes};

/// Sixteen vertices of four bytes (0, n, 2n, 8n), as meshoptimizer's encoder writes them
/// (js/meshopt_decoder.test.js, MIT licence).
const VERTICES: [u8; 65] = {
    let mut bytes = [0; 65];
    let start = [
        0xa0, 0x00, 0x01, 0x2a, 0xaa, 0xaa, 0xaa, 0x02, 0x04, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44, 0x03,
        0x00, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10,
    ];
    let mut at = 0;
    while at < start.len() {
        bytes[at] = start[at];
        at += 1;
    }
    bytes
};
const TRIANGLES: [u8; 27] = [
    0xe1, 0xf0, 0x10, 0xfe, 0xff, 0xf0, 0x0c, 0xff, 0x02, 0x02, 0x02, 0x00, 0x76, 0x87, 0x56, 0x67, 0x78,
    0xa9, 0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
];

/// A mesh of four triangles with compressed positions and indices. The second buffer is the fallback.
fn file() -> File {
    let mut file = File::new();
    let mut view = |bytes: &[u8], count: usize, stride: usize, mode: &str, offset: usize| {
        let view = file.view(bytes);
        let compressed = file.root["bufferViews"][view].clone();
        file.root["bufferViews"][view] = json!({"buffer": 1, "byteOffset": offset, "byteLength": count * stride,
            "extensions": {"EXT_meshopt_compression": {"buffer": 0, "byteOffset": compressed["byteOffset"],
                "byteLength": compressed["byteLength"], "byteStride": stride, "count": count, "mode": mode}}});
        view
    };
    let vertices = view(&VERTICES, 16, 4, "ATTRIBUTES", 0);
    let triangles = view(&TRIANGLES, 12, 4, "TRIANGLES", 64);
    file.root["bufferViews"][vertices]["byteStride"] = 4.into();
    let position = file.push(
        "accessors",
        json!({"bufferView": vertices, "componentType": 5121, "count": 16, "type": "VEC3"}),
    );
    let indices = file.push(
        "accessors",
        json!({"bufferView": triangles, "componentType": 5125, "count": 12, "type": "SCALAR"}),
    );
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}, "indices": indices}]}));
    file.node(json!({"mesh": 0}));
    file.root["extensionsRequired"] = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
    file
}

fn bytes(mut file: File) -> Vec<u8> {
    let fallback = json!({"byteLength": 112, "extensions": {"EXT_meshopt_compression": {"fallback": true}}});
    file.root["buffers"] = json!([{"byteLength": file.binary.len()}, fallback]);
    let json = file.root.to_string();
    support::container(json.as_bytes(), &file.binary)
}

#[test]
fn a_compressed_mesh_is_decoded() {
    let (mut world, _) = load_bytes(&bytes(file())).unwrap();
    let mesh = world.query::<&Mesh>().single(&world).unwrap().0.clone();
    // The mesh has no normals, so every corner becomes a vertex of its own.
    let order = [0u8, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9];
    let expected: Vec<[f32; 3]> = order.iter().map(|&n| [0.0, f32::from(n), f32::from(2 * n)]).collect();
    assert_eq!(mesh.positions.iter().map(|position| position.to_array()).collect::<Vec<_>>(), expected);
}

#[test]
fn damaged_compression_is_refused_by_its_place() {
    let problem = |change: fn(&mut File)| {
        let mut file = file();
        change(&mut file);
        let error = load_bytes(&bytes(file)).unwrap_err();
        assert!(error.to_string().contains("bufferViews[0]"), "{error}");
        *error.problem
    };
    fn extension(file: &mut File) -> &mut serde_json::Value {
        &mut file.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]
    }
    assert!(matches!(problem(|file| file.binary[0] = 0xa1), LoadProblem::Compressed { .. }));
    assert!(matches!(
        problem(|file| extension(file)["byteLength"] = 40.into()),
        LoadProblem::Compressed { .. }
    ));
    assert!(matches!(
        problem(|file| extension(file)["byteLength"] = 4000.into()),
        LoadProblem::BufferView { .. }
    ));
    assert!(matches!(
        problem(|file| extension(file)["byteOffset"] = u64::MAX.into()),
        LoadProblem::BufferView { .. }
    ));
    assert!(matches!(problem(|file| extension(file)["mode"] = "FAST".into()), LoadProblem::Value { .. }));
    assert!(matches!(problem(|file| extension(file)["filter"] = "BLUR".into()), LoadProblem::Value { .. }));
    assert!(matches!(problem(|file| extension(file)["count"] = 17.into()), LoadProblem::Value { .. }));
    assert!(matches!(problem(|file| extension(file)["buffer"] = 9.into()), LoadProblem::Reference { .. }));
    // A small file must not be able to claim a large allocation.
    let claims = problem(|file| {
        let count = 1u64 << 40;
        extension(file)["count"] = count.into();
        file.root["bufferViews"][0]["byteLength"] = (4 * count).into();
    });
    assert!(matches!(claims, LoadProblem::TooLarge { .. }), "{claims}");
}

#[test]
fn no_mutant_of_a_compressed_file_panics() {
    let original = bytes(file());
    let start = original.len() - VERTICES.len() - TRIANGLES.len() - 8;
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut loaded = 0;
    for _ in 0..10_000 {
        let mut mutant = original.clone();
        for _ in 0..3 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Most changes are in the compressed data.
            let at =
                if random >> 62 == 0 { 20 } else { start } + (random >> 33) as usize % (mutant.len() - start);
            if let Some(byte) = mutant.get_mut(at) {
                *byte = (random >> 20) as u8;
            }
        }
        loaded += usize::from(load_bytes(&mutant).is_ok());
    }
    assert!(loaded > 0 && loaded < 10_000);
    println!("10,000 mutants, {loaded} of them loaded");
}
