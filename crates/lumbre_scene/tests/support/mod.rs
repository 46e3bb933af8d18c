//! Shared by the tests: glTF files assembled by hand, and a text form of a World for comparisons.
#![allow(dead_code, reason = "every test binary uses a part of it")]

use std::fmt::Write;

use bevy_ecs::prelude::*;
use lumbre_optics::{Light, Material, Shading};
use lumbre_scene::*;
use serde_json::{Value, json};

/// A glTF file under construction.
pub struct File {
    pub root: Value,
    pub binary: Vec<u8>,
}

impl File {
    /// A file with one empty scene.
    pub fn new() -> Self {
        let root = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{}]});
        Self { root, binary: Vec::new() }
    }

    /// Appends to a list of the file and returns the index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let entry = &mut self.root[list];
        if entry.is_null() {
            *entry = json!([]);
        }
        let entries = entry.as_array_mut().expect("lists are arrays");
        entries.push(value);
        entries.len() - 1
    }

    /// Adds a buffer view of these bytes, aligned to four.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// Adds a float accessor.
    pub fn floats(&mut self, shape: &str, components: usize, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = values.len() / components;
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5126, "count": count, "type": shape}),
        )
    }

    /// Adds an accessor of u16 indices.
    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5123, "count": values.len(), "type": "SCALAR"}),
        )
    }

    /// Adds a node to the scene.
    pub fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        let nodes = &mut self.root["scenes"][0]["nodes"];
        if nodes.is_null() {
            *nodes = json!([]);
        }
        nodes.as_array_mut().expect("a list").push(index.into());
        index
    }

    /// Adds a node with a mesh of one primitive, a unit square of four vertices in the plane z = 0, changed
    /// by `change`.
    pub fn square(&mut self, change: impl FnOnce(&mut Self, &mut Value)) -> usize {
        let position = self.floats("VEC3", 3, &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        let indices = self.indices(&[0, 1, 2, 0, 2, 3]);
        let mut primitive = json!({"attributes": {"POSITION": position}, "indices": indices});
        change(self, &mut primitive);
        let mesh = self.push("meshes", json!({"name": "square", "primitives": [primitive]}));
        self.node(json!({"name": "square", "mesh": mesh}))
    }

    /// Adds a node with a light.
    pub fn light(&mut self, light: Value) -> usize {
        let lights = &mut self.root["extensions"]["KHR_lights_punctual"]["lights"];
        if lights.is_null() {
            *lights = json!([]);
        }
        let lights = lights.as_array_mut().expect("a list");
        lights.push(light);
        let index = lights.len() - 1;
        self.node(json!({"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": index}}}))
    }

    /// The file as a .glb.
    pub fn glb(mut self) -> Vec<u8> {
        if !self.binary.is_empty() {
            self.root["buffers"] = json!([{"byteLength": self.binary.len()}]);
        }
        container(self.root.to_string().as_bytes(), &self.binary)
    }

    /// The file as a .gltf with its data inline.
    pub fn gltf(mut self) -> Vec<u8> {
        let data: String = self.binary.iter().fold(String::new(), |mut data, byte| {
            let _ = write!(data, "%{byte:02X}");
            data
        });
        let uri = format!("data:application/octet-stream,{data}");
        self.root["buffers"] = json!([{"byteLength": self.binary.len(), "uri": uri}]);
        serde_json::to_vec_pretty(&self.root).expect("it is JSON")
    }

    /// Loads the file into a new World.
    pub fn load(self) -> Result<(World, LoadReport), LoadError> {
        load_bytes(&self.glb())
    }

    /// The error of loading the file, which must fail.
    pub fn problem(self) -> LoadProblem {
        match self.load() {
            Ok(_) => panic!("it was loaded, but has to be refused"),
            Err(error) => {
                assert!(error.to_string().starts_with("test.glb: "), "{error}");
                *error.problem
            }
        }
    }
}

pub fn load_bytes(bytes: &[u8]) -> Result<(World, LoadReport), LoadError> {
    let mut world = World::new();
    let report = load_slice(&mut world, bytes, "test.glb", None)?;
    Ok((world, report))
}

/// Assembles a .glb without the crate under test.
pub fn container(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    file.extend((json.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(&json);
    if !binary.is_empty() {
        let mut binary = binary.to_vec();
        binary.resize(binary.len().next_multiple_of(4), 0);
        file.extend((binary.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(&binary);
    }
    let length = file.len() as u32;
    file[8..12].copy_from_slice(&length.to_le_bytes());
    file
}

/// A small PNG whose texels are all different.
pub fn png(width: u32, height: u32) -> Vec<u8> {
    let image = image::RgbaImage::from_fn(width, height, |x, y| {
        image::Rgba([x as u8 * 7, y as u8 * 5, (x * y) as u8, 255 - x as u8])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("memory takes it");
    bytes.into_inner()
}

/// A text with everything that a file stores, one line per entity. Equal Worlds give equal text.
pub fn described(world: &mut World) -> String {
    let mut roots: Vec<Entity> =
        world.query_filtered::<Entity, (With<Transform>, Without<ChildOf>)>().iter(world).collect();
    roots.sort_by_key(|entity| entity.index_u32());
    let mut text = format!("{:?}\n", world.get_resource::<SceneSettings>().copied().unwrap_or_default());
    for root in roots {
        describe(world, root, 0, &mut text);
    }
    text
}

fn describe(world: &World, entity: Entity, depth: usize, text: &mut String) {
    let _ = write!(text, "{:depth$}{:?} ", "", world.get::<Name>(entity).map(Name::as_str));
    let _ = write!(text, "{:?} ", world.get::<Transform>(entity));
    let _ = write!(text, "{:?} ", world.get::<GlobalTransform>(entity));
    let _ = write!(text, "{:?} ", world.get::<Mesh>(entity));
    let _ = write!(text, "{:?} ", world.get::<Material>(entity));
    let _ = write!(text, "{:?} ", world.get::<MaterialTextures>(entity));
    let _ = write!(text, "{:?} ", world.get::<Primitive>(entity));
    let _ = write!(text, "{:?} ", world.get::<Light>(entity));
    let _ = write!(text, "{:?} ", world.get::<Camera>(entity));
    let _ = write!(text, "{:?} ", world.get::<Shading>(entity));
    let _ = write!(text, "{:?} ", world.get::<Extras>(entity));
    let _ = write!(text, "{:?} ", world.get::<ActiveCamera>(entity));
    let _ = write!(text, "{:?} ", world.get::<StaticObject>(entity));
    let _ = write!(text, "{:?} ", world.get::<DynamicObject>(entity));
    let _ = write!(text, "{:?} ", world.get::<Hidden>(entity));
    let _ = write!(text, "{:?} ", world.get::<EmissiveLight>(entity));
    let _ = write!(text, "{:?} ", world.get::<LightmapScale>(entity));
    let lightmap = world.get::<Lightmap>(entity).map(|lightmap| {
        let image = &lightmap.image;
        (image.width, image.height, image.encoding, image.texels.clone())
    });
    let _ = writeln!(text, "{lightmap:?}");
    let mut children: Vec<Entity> =
        world.get::<Children>(entity).into_iter().flat_map(|list| list.iter()).collect();
    // Primitives may come before or after child nodes; within each group the order is stable.
    children.sort_by_key(|&child| world.get::<Primitive>(child).map(|primitive| primitive.index));
    for child in children {
        describe(world, child, depth + 1, text);
    }
}
