//! glTF files that contain data from the reference encoders, with the output of the reference decoders for
//! comparison. `encoded/make.mjs` makes the data.
#![allow(dead_code, reason = "every test binary uses a part of it")]

use serde_json::{Value, json};

use super::support::File;

/// Width and height of the images.
pub const SIZE: (u32, u32) = (22, 17);

macro_rules! encoded {
    ($name:literal, $decoded:literal) => {
        (
            $name,
            include_bytes!(concat!("../encoded/", $name)) as &[u8],
            include_bytes!(concat!("../encoded/", $name, $decoded)) as &[u8],
        )
    };
}

/// Name, encoded data, and the output of the reference decoder for it.
pub type Encoded = (&'static str, &'static [u8], &'static [u8]);

pub const MESHES: [Encoded; 3] = [
    encoded!("edgebreaker.drc", ".json"),
    encoded!("edgebreaker_valence.drc", ".json"),
    encoded!("sequential.drc", ".json"),
];

pub const PICTURES: [Encoded; 7] = [
    encoded!("uastc.ktx2", ".rgba"),
    encoded!("uastc_zstandard.ktx2", ".rgba"),
    encoded!("etc1s.ktx2", ".rgba"),
    encoded!("etc1s_alpha.ktx2", ".rgba"),
    encoded!("lossy.webp", ".rgba"),
    encoded!("lossy_alpha.webp", ".rgba"),
    encoded!("lossless.webp", ".rgba"),
];

/// A file with one compressed mesh, and accessors as required by the reference decoder's output.
pub fn compressed_mesh(bytes: &[u8], expected: &Value) -> File {
    let mut file = File::new();
    let view = file.view(bytes);
    let (points, corners) =
        (expected["points"].as_u64().unwrap(), expected["indices"].as_array().unwrap().len());
    let accessor = |file: &mut File, component: u32, shape: &str, normalized: bool| {
        file.push(
            "accessors",
            json!({"componentType": component, "type": shape, "count": points, "normalized": normalized}),
        )
    };
    let attributes = json!({
        "POSITION": accessor(&mut file, 5126, "VEC3", false),
        "NORMAL": accessor(&mut file, 5126, "VEC3", false),
        "TEXCOORD_0": accessor(&mut file, 5126, "VEC2", false),
        "COLOR_0": accessor(&mut file, 5121, "VEC4", true),
        "JOINTS_0": accessor(&mut file, 5123, "VEC4", false),
        "_HEAT": accessor(&mut file, 5126, "SCALAR", false),
    });
    let indices = file.push("accessors", json!({"componentType": 5123, "type": "SCALAR", "count": corners}));
    let compressed = json!({"bufferView": view, "attributes": expected["ids"]});
    file.push(
        "meshes",
        json!({"primitives": [{"attributes": attributes, "indices": indices,
            "extensions": {"KHR_draco_mesh_compression": compressed}}]}),
    );
    file.node(json!({"name": "tube", "mesh": 0}));
    file.root["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    file.root["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    file
}

/// A square with an image as its texture.
pub fn pictured(bytes: &[u8], kind: &str, extension: Option<&str>) -> File {
    let mut file = File::new();
    let view = file.view(bytes);
    let image = file.push("images", json!({"bufferView": view, "mimeType": kind}));
    let texture = match extension {
        Some(extension) => json!({"extensions": {extension: {"source": image}}}),
        None => json!({"source": image}),
    };
    let texture = file.push("textures", texture);
    let material = file.push(
        "materials",
        json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}, "metallicFactor": 0}}),
    );
    file.square(|file, primitive| {
        primitive["material"] = material.into();
        primitive["attributes"]["TEXCOORD_0"] =
            file.floats("VEC2", 2, &[0., 1., 1., 1., 1., 0., 0., 0.]).into();
    });
    if let Some(extension) = extension {
        file.root["extensionsUsed"] = json!([extension]);
        file.root["extensionsRequired"] = json!([extension]);
    }
    file
}

pub fn encoded_picture(name: &str, bytes: &[u8]) -> File {
    if name.ends_with(".webp") {
        pictured(bytes, "image/webp", Some("EXT_texture_webp"))
    } else {
        pictured(bytes, "image/ktx2", Some("KHR_texture_basisu"))
    }
}

/// Instances of a square, below a node at (0, 1, 0).
pub fn instanced(translations: &[f32], rotations: &[f32]) -> File {
    let mut file = File::new();
    let node = file.square(|_, _| {});
    let translations = file.floats("VEC3", 3, translations);
    let rotations = file.floats("VEC4", 4, rotations);
    file.root["nodes"][node]["name"] = "instanced".into();
    file.root["nodes"][node]["translation"] = json!([0, 1, 0]);
    file.root["nodes"][node]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {
        "TRANSLATION": translations, "ROTATION": rotations, "_ID": translations}}});
    file.root["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    file.root["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    file
}
