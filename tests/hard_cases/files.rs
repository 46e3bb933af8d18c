//! Cases that come from files: what is rejected, with a name, and what is repaired, with a note.

use bevy_ecs::world::World;
use lumbre_optics::Light;
use lumbre_scene::Mesh;
use serde_json::{Value, json};

use crate::case::Outcome;

crate::cases! {
    "normal of length 0" { zero_normals_in_a_file_become_the_faces, the_mesh_is_named_once }
    "attenuation (0,0,0), negative, not a number; intensity 0, 1e-30, 1e30; colour infinite" {
        attenuation_all_zero, attenuation_negative, attenuation_too_large, intensity_zero, intensity_1e_30,
        intensity_1e30, intensity_beyond, colour_infinite, cutoff_beyond,
    }
}

/// Loads a file with one light with these keys and one triangle whose normals are zero.
fn load(light: Value, phong: Value) -> Result<(World, Vec<String>), String> {
    let mut light = light;
    light["name"] = "the lamp".into();
    light["type"] = "point".into();
    if !phong.is_null() {
        light["extensions"] = json!({"LUMBRE_lights_phong": phong});
    }
    let numbers: [f32; 18] =
        [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let data: String = numbers.iter().flat_map(|x| x.to_le_bytes()).map(|b| format!("%{b:02X}")).collect();
    let accessor = |offset: usize| json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [2, 2, 0]});
    let file = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [light]}},
        "nodes": [
            {"name": "flat mesh", "mesh": 0},
            {"name": "lamp node", "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "meshes": [{"name": "flat mesh", "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}}]}],
        "accessors": [accessor(0), accessor(36)],
        "bufferViews": [{"buffer": 0, "byteLength": 72}],
        "buffers": [{"byteLength": 72, "uri": format!("data:application/octet-stream,{data}")}],
    });
    let mut world = World::new();
    match lumbre_scene::load_slice(&mut world, file.to_string().as_bytes(), "level.gltf", None) {
        Ok(report) => Ok((world, report.notes.iter().map(ToString::to_string).collect())),
        Err(error) => Err(error.to_string()),
    }
}

fn plain() -> (World, Vec<String>) {
    load(json!({}), Value::Null).unwrap()
}

fn zero_normals_in_a_file_become_the_faces() -> Outcome {
    let (mut world, _) = plain();
    let mesh = world.query::<&Mesh>().single(&world).unwrap();
    let normals = mesh.0.normals.iter().map(|normal| (1.0, f64::from(normal.z)));
    Outcome::worst(normals.collect::<Vec<_>>(), 0.0, "the triangle faces +z")
}

fn the_mesh_is_named_once() -> Outcome {
    let notes = plain().1;
    let naming: Vec<&String> = notes.iter().filter(|note| note.contains("normal")).collect();
    assert_eq!(naming.len(), 1, "{notes:?}");
    Outcome::text("meshes[0]", naming[0].clone())
}

fn refusal(light: Value, phong: Value) -> String {
    match load(light, phong) {
        Err(error) => error,
        Ok(_) => "accepted".to_owned(),
    }
}

fn attenuation_all_zero() -> Outcome {
    Outcome::text(
        "light \"the lamp\": attenuation is (0, 0, 0)",
        refusal(json!({}), json!({"attenuation": [0, 0, 0]})),
    )
}

fn attenuation_negative() -> Outcome {
    Outcome::text(
        "light \"the lamp\": attenuation.linear is -1",
        refusal(json!({}), json!({"attenuation": [1, -1, 0]})),
    )
}

fn attenuation_too_large() -> Outcome {
    // JSON has no NaN; this number becomes infinite in f32.
    Outcome::text(
        "light \"the lamp\": attenuation.constant is inf",
        refusal(json!({}), json!({"attenuation": [1e300, 0, 0]})),
    )
}

fn light_of(intensity: f64) -> f64 {
    let (mut world, _) = load(json!({}), json!({"diffuse": [intensity, 0, 0]})).unwrap();
    f64::from(world.query::<&Light>().single(&world).unwrap().diffuse.x)
}

fn intensity_zero() -> Outcome {
    Outcome::number(0.0, light_of(0.0), 0.0, "a light that is black is a light")
}

fn intensity_1e_30() -> Outcome {
    Outcome::number(1e-30, light_of(1e-30), 1e-37, "f32's rounding")
}

fn intensity_1e30() -> Outcome {
    Outcome::number(1e30, light_of(1e30), 6e22, "f32's rounding: the largest that is taken")
}

fn intensity_beyond() -> Outcome {
    Outcome::text(
        "light \"the lamp\": diffuse is up to",
        refusal(json!({}), json!({"diffuse": [1e31, 0, 0]})),
    )
}

fn colour_infinite() -> Outcome {
    Outcome::text("light \"the lamp\": diffuse is inf", refusal(json!({"color": [1e39, 1, 1]}), Value::Null))
}

fn cutoff_beyond() -> Outcome {
    let phong = json!({"spot": {"cutoff": 2.0, "exponent": 1}});
    Outcome::text("light \"the lamp\": spot.cutoff is 2 rad", refusal(json!({}), phong))
}
