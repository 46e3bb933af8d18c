//! Malformed files: each gives the expected kind of error, which names the place.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use lumbre_scene::LoadProblem;
use serde_json::{Value, json};
use support::{File, container, load_bytes};

fn square() -> File {
    let mut file = File::new();
    file.square(|_, _| {});
    file
}

/// The error for a square with one changed JSON value.
fn changed(path: &str, value: Value) -> LoadProblem {
    let mut file = square();
    let (parent, key) = path.rsplit_once('/').expect("a JSON pointer");
    file.root.pointer_mut(parent).expect("it is there")[key] = value;
    file.problem()
}

fn bytes(bytes: &[u8]) -> LoadProblem {
    *load_bytes(bytes).expect_err("it has to be refused").problem
}

macro_rules! assert_matches {
    ($problem:expr, $pattern:pat $(if $guard:expr)?) => {{
        let problem = $problem;
        assert!(matches!(&problem, $pattern $(if $guard)?), "{problem:?}: {problem}");
        assert!(problem.to_string().len() > 20);
    }};
}

#[test]
fn containers() {
    let good = square().glb();
    for length in [0, 3, 4, 8, 11, 12, 15, 19, 20, 100, good.len() - 1] {
        assert_matches!(bytes(&good[..length]), LoadProblem::Truncated { .. } | LoadProblem::Magic { .. });
    }
    assert_matches!(bytes(b"GLTF\x02\0\0\0"), LoadProblem::Magic { magic } if magic == "GLTF");
    let mut old = good.clone();
    old[4] = 1;
    assert_matches!(bytes(&old), LoadProblem::Version { version } if version == "1");
    let mut chunk = good.clone();
    chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_matches!(bytes(&chunk), LoadProblem::Truncated { what, .. } if what.contains("JSON"));
    let mut kind = good;
    kind[16] = b'X';
    assert_matches!(bytes(&kind), LoadProblem::Container { .. });
    assert_matches!(bytes(&container(b"{\"asset\":", &[])), LoadProblem::Json { .. });
    let deep = "[".repeat(1_000_000);
    assert_matches!(bytes(format!("{{\"asset\": {deep}").as_bytes()), LoadProblem::Json { .. });
    assert_matches!(bytes(b"{}"), LoadProblem::Version { .. });
    assert_matches!(bytes(b"{\"asset\": {\"version\": \"1.0\"}}"), LoadProblem::Version { .. });
}

#[test]
fn buffers() {
    let mut file = square();
    file.binary.truncate(0);
    let glb = container(file.root.to_string().as_bytes(), &[]);
    assert_matches!(bytes(&glb), LoadProblem::Reference { list: "buffers", .. });
    let mut file = square();
    file.root["buffers"] = json!([{"byteLength": 1u64 << 31}]);
    let glb = container(file.root.to_string().as_bytes(), &file.binary);
    assert_matches!(bytes(&glb), LoadProblem::Truncated { what, needed: 0x8000_0000, .. } if what == "buffers[0]");
    let missing = json!([{"byteLength": 4, "uri": "not there.bin"}]);
    let mut file = square();
    file.root["buffers"] = missing;
    assert_matches!(bytes(file.root.to_string().as_bytes()), LoadProblem::Uri { place, .. } if place == "buffers[0]");
    for uri in ["../x.bin", "/etc/passwd", "http://example.com/x.bin", "file:///x", "data:;base64,@"] {
        file.root["buffers"][0]["uri"] = uri.into();
        assert_matches!(bytes(file.root.to_string().as_bytes()), LoadProblem::Uri { .. });
    }
    assert_matches!(
        changed("/bufferViews/0/byteOffset", json!(u64::MAX)),
        LoadProblem::BufferView { view: 0, .. }
    );
    assert_matches!(
        changed("/bufferViews/0/byteLength", json!(1u64 << 40)),
        LoadProblem::BufferView { view: 0, .. }
    );
}

#[test]
fn accessors() {
    for count in [5, 1u64 << 31, u64::MAX] {
        let problem = changed("/accessors/0/count", json!(count));
        assert_matches!(problem, LoadProblem::Accessor { accessor: 0, used_by, .. } if used_by.contains("square"));
    }
    assert_matches!(
        changed("/accessors/0/byteOffset", json!(u64::MAX)),
        LoadProblem::Accessor { accessor: 0, .. }
    );
    assert_matches!(
        changed("/accessors/0/componentType", json!(5124)),
        LoadProblem::Accessor { accessor: 0, .. }
    );
    assert_matches!(changed("/accessors/0/type", json!("MAT4")), LoadProblem::Accessor { accessor: 0, .. });
    assert_matches!(
        changed("/bufferViews/0/byteStride", json!(4)),
        LoadProblem::Accessor { accessor: 0, .. }
    );
    assert_matches!(changed("/accessors/0/count", json!(-1)), LoadProblem::Json { place, .. } if place == "accessors[0]");
    assert_matches!(
        changed("/meshes/0/primitives/0/attributes/POSITION", json!(99)),
        LoadProblem::Reference { index: 99, .. }
    );
    // An accessor without a buffer view is all zeros, but 2^31 of them exceed the limit.
    let mut file = square();
    file.root["accessors"][0] = json!({"componentType": 5126, "count": 1u64 << 31, "type": "VEC3"});
    assert_matches!(file.problem(), LoadProblem::TooLarge { .. });
    // An index of a vertex that does not exist.
    let mut file = square();
    file.root["meshes"][0]["primitives"][0]["indices"] = json!(file.indices(&[0, 1, 4]));
    assert_matches!(file.problem(), LoadProblem::Accessor { problem, .. } if problem.contains("index 2 is 4"));
    for (attribute, shape, components) in [("POSITION", "VEC3", 3), ("TEXCOORD_0", "VEC2", 2)] {
        for value in [f32::NAN, f32::INFINITY] {
            let mut file = square();
            let values = file.floats(shape, components, &vec![value; 4 * components]);
            file.root["meshes"][0]["primitives"][0]["attributes"][attribute] = json!(values);
            assert_matches!(file.problem(), LoadProblem::Accessor { problem, .. } if problem.contains("NaN"));
        }
    }
    // Fewer texture coordinates than vertices.
    let mut file = square();
    file.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] =
        json!(file.floats("VEC2", 2, &[0.0; 6]));
    assert_matches!(file.problem(), LoadProblem::Accessor { .. });
    // A sparse index out of range, and more replacements than elements.
    for (count, index) in [(1, 4u8), (5, 0)] {
        let mut file = square();
        let (at, new) = (file.view(&[index; 5]), file.view(&[0; 60]));
        file.root["accessors"][0]["sparse"] = json!({"count": count,
            "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": new}});
        assert_matches!(file.problem(), LoadProblem::Accessor { accessor: 0, .. });
    }
}

#[test]
fn hierarchies() {
    let mut file = square();
    file.node(json!({"children": [0]}));
    assert_matches!(file.problem(), LoadProblem::TwoParents { node: 0, .. });
    let mut file = square();
    file.push("nodes", json!({"name": "ring", "children": [2]}));
    file.push("nodes", json!({"children": [1]}));
    assert_matches!(file.problem(), LoadProblem::Cycle { name, .. } if name == "ring");
    let mut file = square();
    file.root["nodes"][0]["children"] = json!([0]);
    assert_matches!(file.problem(), LoadProblem::Cycle { node: 0, .. });
    assert_matches!(
        changed("/nodes/0/children", json!([7])),
        LoadProblem::Reference { list: "nodes", index: 7, .. }
    );
    assert_matches!(changed("/nodes/0/mesh", json!(1)), LoadProblem::Reference { list: "meshes", .. });
    assert_matches!(changed("/scenes/0/nodes", json!([0, 0])), LoadProblem::TwoParents { .. });
    let mut file = square();
    file.root["scene"] = 3.into();
    assert_matches!(file.problem(), LoadProblem::Reference { list: "scenes", .. });
    assert_matches!(changed("/nodes/0/rotation", json!([0, 0, 0, 0])), LoadProblem::Value { field, .. } if field == "rotation");
    assert_matches!(changed("/nodes/0/scale", json!([1e300, 0, 0])), LoadProblem::Value { .. });
    // A very deep tree must not overflow the stack.
    let mut file = File::new();
    file.node(json!({"children": [1]}));
    for node in 1..50_000 {
        file.push("nodes", json!({"children": [node + 1]}));
    }
    file.push("nodes", json!({}));
    assert_eq!(file.load().unwrap().1.nodes.len(), 50_001);
}

#[test]
fn extensions() {
    let mut file = square();
    file.root["extensionsRequired"] = json!(["KHR_lights_punctual", "KHR_gaussian_splatting"]);
    let problem = file.problem();
    assert!(
        problem.to_string().contains("KHR_gaussian_splatting")
            && problem.to_string().contains("KHR_texture_transform")
    );
    assert_matches!(problem, LoadProblem::RequiredExtension { .. });
    let mut file = square();
    file.root["extensionsUsed"] = json!(["EXT_unheard_of"]);
    let (_, report) = file.load().unwrap();
    assert!(report.notes.iter().any(|note| note.place.contains("EXT_unheard_of")), "{:?}", report.notes);
}

#[test]
fn lights_and_materials() {
    let phong = |phong: Value| {
        let mut file = File::new();
        file.light(json!({"name": "sconce", "type": "point", "extensions": {"LUMBRE_lights_phong": phong}}));
        file.problem()
    };
    for wrong in [
        json!({"attenuation": [0, 0, 0]}),
        json!({"attenuation": [-1, 0, 0]}),
        json!({"attenuation": [1e300, 0, 0]}),
        json!({"diffuse": [-1, 0, 0]}),
        json!({"specular": [1e300, 0, 0]}),
        json!({"spot": {"cutoff": 2, "exponent": 1}}),
    ] {
        assert_matches!(phong(wrong), LoadProblem::Light { source, .. } if source.to_string().contains("sconce"));
    }
    assert_matches!(phong(json!({"bake": "sometimes"})), LoadProblem::Value { .. });
    assert_matches!(phong(json!({"ambient": [1, 2]})), LoadProblem::Json { place, .. } if place.contains("sconce"));
    let material = |material: Value| {
        let mut file = File::new();
        file.push("materials", material);
        file.problem()
    };
    let wrong =
        json!({"name": "brass", "extensions": {"LUMBRE_materials_phong": {"back": {"shininess": -1}}}});
    assert_matches!(material(wrong), LoadProblem::Material { source, .. } if source.to_string().contains("brass"));
    let brass = |phong: Value| {
        material(json!({"name": "brass", "extensions": {"LUMBRE_materials_phong": phong}})).to_string()
    };
    for (wrong, told) in [
        (json!({"distribution": "ggx"}), "use one of cosine-power, gaussian, trowbridge-reitz"),
        (json!({"fresnel": "metal"}), "use one of dielectric, conductor, normal-reflectance"),
        (json!({"fresnel": "conductor"}), "give its index of refraction beside it"),
        (json!({"eta": [1, -1, 1]}), "\"brass\": fresnel.eta is -1, which is negative"),
        (json!({"absorption": [1e300, 1, 1]}), "fresnel.absorption is inf"),
        (json!({"absorption": [1, 1, 20000]}), "fresnel.absorption is 20000; give a number from 0 to 10000"),
        (json!({"eta": [0, 1, 1]}), "fresnel.eta is 0; give a number above 0"),
        (json!({"eta": [1, 1]}), "brass"),
    ] {
        let message = brass(wrong.clone());
        assert!(message.contains(told), "{wrong}: {message}");
    }
    let mut file = square();
    file.root["nodes"][0]["extensions"] = json!({"LUMBRE_shading": {"reflection": "cook"}});
    assert!(file.problem().to_string().contains("use one of phong, blinn"));
    assert_matches!(material(json!({"alphaMode": "SOMETIMES"})), LoadProblem::Value { .. });
    assert_matches!(
        material(json!({"pbrMetallicRoughness": {"metallicFactor": 2}})),
        LoadProblem::Value { .. }
    );
    assert_matches!(
        material(json!({"emissiveTexture": {"index": 0}})),
        LoadProblem::Reference { list: "textures", .. }
    );
}

#[test]
fn images() {
    let image = |bytes: &[u8]| {
        let mut file = File::new();
        let view = file.view(bytes);
        file.push("images", json!({"name": "map", "bufferView": view}));
        file.push("textures", json!({"source": 0}));
        file.push("materials", json!({"emissiveTexture": {"index": 0}}));
        file.load()
    };
    let good = support::png(4, 4);
    assert!(image(&good).is_ok());
    let refused = |bytes: &[u8]| *image(bytes).expect_err("it has to be refused").problem;
    assert_matches!(refused(b"no image"), LoadProblem::Image { place, .. } if place.contains("map"));
    assert_matches!(refused(&good[..good.len() / 2]), LoadProblem::Image { .. });
    // A header that claims 16384 x 16384 texels in about a hundred bytes, with a valid checksum.
    let mut bomb = good;
    bomb[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = !bomb[12..29].iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(
            crc ^ u32::from(byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 },
        )
    });
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    assert_matches!(refused(&bomb), LoadProblem::Image { problem, .. } if problem.contains("16384 x 16384"));
}

#[test]
fn a_refused_file_leaves_the_world_alone() {
    let mut world = bevy_ecs::world::World::new();
    let before = world.query::<&lumbre_scene::Transform>().iter(&world).count();
    let mut file = square();
    file.root["nodes"][0]["camera"] = 0.into();
    lumbre_scene::load_slice(&mut world, &file.glb(), "x", None).unwrap_err();
    assert_eq!(world.query::<&lumbre_scene::Transform>().iter(&world).count(), before);
    assert!(!world.contains_resource::<lumbre_scene::SceneSettings>());
}
