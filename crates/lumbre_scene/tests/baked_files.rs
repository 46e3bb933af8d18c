//! A baked file is the artist's file and light: one small file per feature, its JSON compared with that of its baked twin, and every
//! attribute of every corner bit for bit.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_mesh::{TriangleMesh, UnwrapOptions, unwrap};
use lumbre_scene::*;
use serde_json::{Value, json};
use support::{File, png};

/// Gives every static mesh lightmap coordinates and a map, as the baker does.
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
            textures.base_color.as_mut().unwrap().tex_coord = 0;
            world.entity_mut(entity).insert(textures);
        }
        let image = LightmapImage {
            name: "light".into(),
            width: 2,
            height: 2,
            texels: vec![Vec3::splat(0.25); 4],
            encoding: LightmapEncoding::Rgb32Float,
        };
        world.entity_mut(entity).insert((Mesh(new.clone()), Lightmap { image: Arc::new(image) }));
    }
}

/// Texels per metre for some sixteen across a mesh of any size.
fn density(mesh: &TriangleMesh) -> f64 {
    let size =
        mesh.positions.iter().map(|position| f64::from(position.abs().max_element())).fold(0.0, f64::max);
    if size > 0.0 { 8.0 / size } else { 1.0 }
}

/// A cube of eight vertices, which six charts split, with attributes by `change`.
fn cube(file: &mut File, change: impl FnOnce(&mut File, &mut Value)) -> usize {
    let positions: Vec<f32> = (0..8)
        .flat_map(|corner: u32| (0..3).map(move |axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 }))
        .collect();
    let normals: Vec<f32> = positions.iter().map(|value| value / 3f32.sqrt()).collect();
    let position = file.floats("VEC3", 3, &positions);
    file.root["accessors"][position]["min"] = json!([-1.0, -1.0, -1.0]);
    file.root["accessors"][position]["max"] = json!([1.0, 1.0, 1.0]);
    let normal = file.floats("VEC3", 3, &normals);
    let indices = file.indices(&[
        0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3,
        7, 5,
    ]);
    let mut primitive = json!({"attributes": {"POSITION": position, "NORMAL": normal}, "indices": indices});
    change(file, &mut primitive);
    let mesh = file.push("meshes", json!({"name": "cube", "primitives": [primitive]}));
    file.node(json!({"name": "cube", "mesh": mesh}))
}

/// Eight values of so many components that all differ.
fn values(components: usize, offset: f32) -> Vec<f32> {
    (0..8 * components).map(|at| offset + at as f32 * 0.125).collect()
}

fn accessor(
    file: &mut File,
    bytes: &[u8],
    component: u32,
    shape: &str,
    count: usize,
    stride: Option<usize>,
) -> usize {
    let view = file.view(bytes);
    if let Some(stride) = stride {
        file.root["bufferViews"][view]["byteStride"] = stride.into();
    }
    file.push(
        "accessors",
        json!({"bufferView": view, "componentType": component, "count": count, "type": shape}),
    )
}

fn texture(file: &mut File) -> usize {
    let view = file.view(&png(2, 3));
    let image = file.push("images", json!({"name": "wall", "bufferView": view, "mimeType": "image/png"}));
    let sampler = file.push("samplers", json!({"name": "nearest", "magFilter": 9728}));
    file.push("textures", json!({"name": "wall", "source": image, "sampler": sampler}))
}

/// The files, by what each of them has.
fn files() -> Vec<(&'static str, File)> {
    let mut all = Vec::new();
    let mut add = |name, make: &dyn Fn(&mut File)| {
        let mut file = File::new();
        make(&mut file);
        all.push((name, file));
    };
    add("nothing more", &|file| {
        cube(file, |_, _| {});
    });
    add("no normals", &|file| {
        cube(file, |_, primitive| {
            primitive["attributes"].as_object_mut().unwrap().remove("NORMAL");
        });
    });
    for (name, key) in [("normal texture", "normalTexture"), ("occlusion texture", "occlusionTexture")] {
        add(name, &|file| {
            let index = texture(file);
            let material =
                file.push("materials", json!({"name": "brick", key: {"index": index, "extras": {"a": 1}}}));
            cube(file, |file, primitive| {
                primitive["attributes"]["TEXCOORD_0"] = file.floats("VEC2", 2, &values(2, 0.0)).into();
                primitive["material"] = material.into();
            });
        });
    }
    add("animation", &|file| {
        let node = cube(file, |_, _| {});
        file.square(|_, _| {});
        let input = file.floats("SCALAR", 1, &[0.0, 1.0]);
        let output = file.floats("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        file.push(
            "animations",
            json!({"name": "up", "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}],
                "samplers": [{"input": input, "output": output, "interpolation": "LINEAR"}]}),
        );
    });
    add("skin, joints and weights", &|file| {
        let joint = file.node(json!({"name": "bone"}));
        let matrix = file.floats("MAT4", 16, &glam::Mat4::IDENTITY.to_cols_array());
        let skin =
            file.push("skins", json!({"joints": [joint], "inverseBindMatrices": matrix, "name": "armature"}));
        let node = cube(file, joints);
        file.root["nodes"][node]["skin"] = skin.into();
        // The same with the word of the artist that it stands still.
        let still = cube(file, joints);
        file.root["nodes"][still]["skin"] = skin.into();
        file.root["nodes"][still]["extensions"] = json!({"LUMBRE_object": {"dynamic": false}});
    });
    add("tangents", &|file| {
        cube(file, |file, primitive| {
            primitive["attributes"]["TANGENT"] = file.floats("VEC4", 4, &values(4, 0.5)).into();
        });
    });
    add("morph targets, one of them sparse", &|file| {
        cube(file, |file, primitive| {
            let dense = file.floats("VEC3", 3, &values(3, 7.0));
            let at = file.view(&[2, 7]);
            let bytes: Vec<u8> =
                [1f32, 2., 3., 4., 5., 6.].iter().flat_map(|value| value.to_le_bytes()).collect();
            let of = file.view(&bytes);
            let sparse = file.push(
                "accessors",
                json!({"componentType": 5126, "count": 8, "type": "VEC3", "name": "smile", "sparse": {"count": 2,
                    "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": of}}}),
            );
            primitive["targets"] = json!([{"POSITION": dense}, {"POSITION": sparse, "NORMAL": dense}]);
        });
        file.root["meshes"][0]["weights"] = json!([0.0, 0.5]);
    });
    add("custom attributes, interleaved and of odd sizes", &|file| {
        cube(file, |file, primitive| {
            let bytes: Vec<u8> = (0..8 * 16u8).collect();
            primitive["attributes"]["_ID"] = accessor(file, &bytes, 5125, "SCALAR", 8, Some(16)).into();
            primitive["attributes"]["_BYTES"] = accessor(file, &bytes, 5121, "VEC3", 8, Some(4)).into();
            primitive["attributes"]["_MATRIX"] = accessor(file, &bytes, 5120, "MAT3", 8, None).into();
            primitive["attributes"]["COLOR_1"] = file.floats("VEC4", 4, &values(4, 0.0)).into();
        });
    });
    add("normalized and quantized attributes", &|file| {
        cube(file, |file, primitive| {
            let bytes: Vec<u8> = (0..64).map(|at| at * 3).collect();
            for (name, shape, component) in
                [("TEXCOORD_0", "VEC2", 5121), ("COLOR_0", "VEC4", 5121), ("TANGENT", "VEC4", 5120)]
            {
                let made = accessor(file, &bytes, component, shape, 8, Some(8));
                file.root["accessors"][made]["normalized"] = true.into();
                primitive["attributes"][name] = made.into();
            }
            let positions: Vec<u8> = (0..8u8)
                .flat_map(|corner| (0..4).flat_map(move |axis| i16::from(corner >> axis & 1).to_le_bytes()))
                .collect();
            let quantized = accessor(file, &positions, 5122, "VEC3", 8, Some(8));
            file.root["accessors"][quantized]["min"] = json!([0, 0, 0]);
            file.root["accessors"][quantized]["max"] = json!([1, 1, 1]);
            primitive["attributes"]["POSITION"] = quantized.into();
        });
        file.root["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        file.root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    });
    add("sparse positions", &|file| {
        cube(file, |file, primitive| {
            let old = primitive["attributes"]["POSITION"].as_u64().unwrap() as usize;
            let at = file.view(&[3, 0]);
            let of = file.view(&[2f32; 3].map(f32::to_le_bytes).concat());
            file.root["accessors"][old]["sparse"] = json!({"count": 1, "indices": {"bufferView": at,
                "componentType": 5123}, "values": {"bufferView": of}});
            file.root["accessors"][old]["max"] = json!([2.0, 2.0, 2.0]);
        });
    });
    add("a few vertices of a long list", &|file| {
        let position = file.floats("VEC3", 3, &(0..300).map(|at| (at * at % 101) as f32).collect::<Vec<_>>());
        file.root["accessors"][position]["min"] = json!([0.0, 0.0, 0.0]);
        file.root["accessors"][position]["max"] = json!([100.0, 100.0, 100.0]);
        let indices = file.indices(&[70, 80, 90, 7, 8, 90]);
        let primitive = json!({"attributes": {"POSITION": position, "_LONG": position}, "indices": indices});
        file.push("meshes", json!({"primitives": [primitive]}));
        file.node(json!({"mesh": 0}));
    });
    for (name, mode) in [("a strip", 5), ("a fan", 6)] {
        add(name, &|file| {
            cube(file, |file, primitive| {
                primitive["mode"] = mode.into();
                primitive["indices"] = file.indices(&[0, 1, 2, 3, 6, 7, 7, 5]).into();
                primitive["attributes"]["_CUSTOM"] = file.floats("SCALAR", 1, &values(1, 0.0)).into();
            });
        });
    }
    add("no indices", &|file| {
        file.square(|_, primitive| {
            primitive.as_object_mut().unwrap().remove("indices");
        });
    });
    add("points beside triangles", &|file| {
        cube(file, |_, _| {});
        let mut points = file.root["meshes"][0]["primitives"][0].clone();
        points["mode"] = 0.into();
        file.root["meshes"][0]["primitives"].as_array_mut().unwrap().insert(0, points);
    });
    add("a second scene, and meshes that only it shows", &|file| {
        cube(file, |_, _| {});
        let other = file.push("nodes", json!({"name": "elsewhere", "mesh": 0}));
        file.root["scenes"]
            .as_array_mut()
            .unwrap()
            .push(json!({"name": "other", "nodes": [other], "extras": 1}));
    });
    add("no scene", &|file| {
        cube(file, |_, _| {});
        for key in ["scene", "scenes"] {
            file.root.as_object_mut().unwrap().remove(key);
        }
    });
    add("extras, copyright and names everywhere", &|file| {
        let index = texture(file);
        let material = json!({"name": "red", "extras": {"engine": "x"}, "pbrMetallicRoughness": {"baseColorTexture": {"index": index}}});
        file.push("materials", material);
        let camera = json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "extras": 2}, "extras": {"dof": 3}, "name": "eye"});
        file.push("cameras", camera);
        file.node(json!({"camera": 0}));
        cube(file, |_, primitive| primitive["material"] = 0.into());
        file.root["asset"]["copyright"] = "somebody".into();
        file.root["asset"]["generator"] = "by hand".into();
        file.root["extras"] = json!([1, {"two": 3.5}]);
        for list in ["nodes", "meshes", "accessors", "bufferViews", "scenes"] {
            file.root[list][0]["extras"] = json!({"of": list});
        }
    });
    add("foreign extensions at every level", &|file| {
        let index = texture(file);
        file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}}));
        cube(file, |_, primitive| primitive["material"] = 0.into());
        file.root["extensionsUsed"] = json!(["FOREIGN_thing"]);
        file.root["extensions"] = json!({"FOREIGN_thing": {"list": [{"a": 1}]}});
        for list in
            ["nodes", "meshes", "materials", "textures", "images", "accessors", "bufferViews", "scenes"]
        {
            file.root[list][0]["extensions"] = json!({"FOREIGN_thing": {"of": list}});
        }
        file.root["meshes"][0]["primitives"][0]["extensions"] = json!({"FOREIGN_thing": {"of": "primitive"}});
    });
    add("textures and variants that read TEXCOORD_1", &|file| {
        let index = texture(file);
        let material = json!({"name": "first", "pbrMetallicRoughness": {"baseColorTexture": {"index": index, "texCoord": 1}},
            "normalTexture": {"index": index}});
        file.push("materials", material);
        file.push("materials", json!({"name": "second", "emissiveTexture": {"index": index, "texCoord": 1}}));
        cube(file, |file, primitive| {
            primitive["attributes"]["TEXCOORD_0"] = file.floats("VEC2", 2, &values(2, 0.0)).into();
            primitive["attributes"]["TEXCOORD_1"] = file.floats("VEC2", 2, &values(2, 9.0)).into();
            primitive["material"] = 0.into();
            primitive["extensions"] =
                json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}});
        });
        file.root["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "v"}]}});
        file.root["extensionsUsed"] = json!(["KHR_materials_variants"]);
    });
    add("a normal texture that reads TEXCOORD_1", &|file| {
        let index = texture(file);
        file.push("materials", json!({"normalTexture": {"index": index, "texCoord": 1}}));
        cube(file, |file, primitive| {
            primitive["attributes"]["TEXCOORD_1"] = file.floats("VEC2", 2, &values(2, 9.0)).into();
            primitive["material"] = 0.into();
        });
    });
    add("lights, cameras and more nodes", &|file| {
        file.light(json!({"type": "point", "intensity": 30, "name": "bulb", "extras": 4}));
        file.light(json!({"type": "spot", "extensions": {"LUMBRE_lights_phong": {"diffuse": [1, 2, 3]}}}));
        cube(file, |_, _| {});
        file.root["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        let below = file.push("nodes", json!({"mesh": 0, "scale": [1, 2, 1], "rotation": [0, 0, 0, 1]}));
        file.node(json!({"children": [below], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]}));
    });
    add("a mesh shared by what moves and what does not", &|file| {
        cube(file, |_, _| {});
        file.node(json!({"mesh": 0, "extensions": {"LUMBRE_object": {"dynamic": true}}}));
    });
    all
}

fn joints(file: &mut File, primitive: &mut Value) {
    let joints: Vec<u8> = vec![0; 32];
    primitive["attributes"]["JOINTS_0"] = accessor(file, &joints, 5121, "VEC4", 8, None).into();
    let weights = [255, 0, 0, 0].repeat(8);
    let weights = accessor(file, &weights, 5121, "VEC4", 8, None);
    file.root["accessors"][weights]["normalized"] = true.into();
    primitive["attributes"]["WEIGHTS_0"] = weights.into();
}

/// A file of JSON and buffers, read independently of the crate.
struct Read {
    root: Value,
    buffers: Vec<Vec<u8>>,
}

fn read(path: &Path) -> Read {
    let bytes = fs::read(path).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (root, chunk): (Value, Vec<u8>) = if bytes.starts_with(b"glTF") {
        let end = 20 + word(12);
        let chunk = if end < bytes.len() { bytes[end + 8..end + 8 + word(end)].to_vec() } else { Vec::new() };
        (serde_json::from_slice(&bytes[20..end]).unwrap(), chunk)
    } else {
        (serde_json::from_slice(&bytes).unwrap(), Vec::new())
    };
    let buffers = root["buffers"].as_array().into_iter().flatten().map(|buffer| {
        let mut content = match buffer["uri"].as_str() {
            None => chunk.clone(),
            Some(uri) => match uri.strip_prefix("data:application/octet-stream,") {
                Some(data) => {
                    data.split('%').skip(1).map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
                }
                None => fs::read(path.with_file_name(uri)).unwrap(),
            },
        };
        content.truncate(buffer["byteLength"].as_u64().unwrap() as usize);
        content
    });
    let buffers = buffers.collect();
    Read { root, buffers }
}

impl Read {
    /// The bytes of each element.
    fn elements(&self, accessor: &Value) -> Vec<Vec<u8>> {
        let accessor = &self.root["accessors"][accessor.as_u64().unwrap() as usize];
        let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let of = |component: &Value| match number(component) {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            _ => 4,
        };
        let component: usize = of(&accessor["componentType"]);
        let size = match accessor["type"].as_str().unwrap() {
            "SCALAR" => component,
            "VEC2" => 2 * component,
            "VEC3" => 3 * component,
            "VEC4" => 4 * component,
            "MAT3" => 3 * (3 * component).next_multiple_of(4),
            _ => 16 * component,
        };
        let slices =
            |view: &Value, offset: &Value, count: usize, size: usize, strided: bool| -> Vec<Vec<u8>> {
                let view = &self.root["bufferViews"][number(view)];
                let start = number(&view["byteOffset"]) + number(offset);
                let stride = if strided {
                    view["byteStride"].as_u64().map_or(size, |stride| stride as usize)
                } else {
                    size
                };
                let end = number(&view["byteOffset"]) + number(&view["byteLength"]);
                assert!(count == 0 || start + stride * (count - 1) + size <= end, "{view}");
                assert_eq!(start % 4, 0);
                let buffer = &self.buffers[number(&view["buffer"])];
                (0..count).map(|at| buffer[start + at * stride..][..size].to_vec()).collect()
            };
        let count = number(&accessor["count"]);
        let mut elements = match &accessor["bufferView"] {
            Value::Null => vec![vec![0; size]; count],
            view => slices(view, &accessor["byteOffset"], count, size, true),
        };
        let sparse = &accessor["sparse"];
        if sparse.is_object() {
            let (at, of_values) = (&sparse["indices"], &sparse["values"]);
            let indices = slices(
                &at["bufferView"],
                &at["byteOffset"],
                number(&sparse["count"]),
                of(&at["componentType"]),
                false,
            );
            let values = slices(
                &of_values["bufferView"],
                &of_values["byteOffset"],
                number(&sparse["count"]),
                size,
                false,
            );
            let mut last = None;
            for (index, value) in indices.iter().zip(values) {
                let index = whole(index);
                assert!(last < Some(index), "sparse indices ascend");
                last = Some(index);
                elements[index] = value;
            }
        }
        elements
    }

    /// The vertex at each corner of each triangle that has an area in the list.
    fn corners(&self, primitive: &Value) -> Vec<usize> {
        let order: Vec<usize> = match &primitive["indices"] {
            Value::Null => (0..self.elements(&primitive["attributes"]["POSITION"]).len()).collect(),
            indices => self.elements(indices).iter().map(|bytes| whole(bytes)).collect(),
        };
        match primitive["mode"].as_u64() {
            Some(5) => (2..order.len())
                .map(|at| {
                    if at % 2 == 0 {
                        [order[at - 2], order[at - 1], order[at]]
                    } else {
                        [order[at - 2], order[at], order[at - 1]]
                    }
                })
                .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
                .flatten()
                .collect(),
            Some(6) => (2..order.len()).flat_map(|at| [order[at - 1], order[at], order[0]]).collect(),
            _ => order,
        }
    }
}

fn whole(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | usize::from(byte))
}

/// The places at which two values differ.
fn differences(before: &Value, after: &Value, place: &str, found: &mut Vec<String>) {
    match (before, after) {
        (Value::Object(before), Value::Object(after)) => {
            let keys: std::collections::BTreeSet<_> = before.keys().chain(after.keys()).collect();
            for key in keys {
                let place = format!("{place}/{key}");
                match (before.get(key), after.get(key)) {
                    (Some(before), Some(after)) => differences(before, after, &place, found),
                    _ => found.push(place),
                }
            }
        }
        (Value::Array(before), Value::Array(after)) => {
            for index in 0..before.len().max(after.len()) {
                let place = format!("{place}/{index}");
                match (before.get(index), after.get(index)) {
                    (Some(before), Some(after)) => differences(before, after, &place, found),
                    _ => found.push(place),
                }
            }
        }
        _ if before == after => {}
        _ => found.push(place.to_owned()),
    }
}

/// Whether a bake may change what is at a place.
fn is_of_the_bake(place: &str, before: &Value, after: &Value) -> bool {
    let parts: Vec<&str> = place.split('/').skip(1).collect();
    let index = |at: usize| parts.get(at).and_then(|part| part.parse::<usize>().ok());
    let length = |list: &str| before[list].as_array().map_or(0, Vec::len);
    let new = |list: &str, value: &Value| value.as_u64().is_some_and(|index| index as usize >= length(list));
    let at = |value: &Value, place: &str| value.pointer(place).cloned().unwrap_or(Value::Null);
    match parts.as_slice() {
        [list @ ("accessors" | "bufferViews" | "buffers" | "materials" | "meshes" | "nodes"), ..]
            if !before[*list].is_array() =>
        {
            true
        }
        [list @ ("accessors" | "bufferViews" | "buffers" | "materials" | "meshes" | "nodes"), _] => {
            index(1).unwrap() >= length(list)
        }
        ["buffers", "0", "byteLength"] => at(after, place).as_u64() > at(before, place).as_u64(),
        ["buffers", "0", "uri"] => at(after, place).is_null() || at(before, place).is_null(),
        ["nodes", _, "extensions", "LUMBRE_lightmap"] => true,
        ["nodes", node, "extensions"] => {
            let added = &after["nodes"][node.parse::<usize>().unwrap()]["extensions"];
            added.as_object().unwrap().keys().eq(["LUMBRE_lightmap"])
        }
        ["nodes", _, "mesh"] => new("meshes", &at(after, place)),
        ["meshes", _, "primitives", _, "mode"] => at(after, place).is_null(),
        ["meshes", _, "primitives", _, "indices"] => new("accessors", &at(after, place)),
        ["meshes", _, "primitives", _, "attributes", name] => {
            new("accessors", &at(after, place)) || name.starts_with("TEXCOORD_")
        }
        ["meshes", _, "primitives", _, "targets", _, _] => new("accessors", &at(after, place)),
        ["meshes", _, "primitives", _, "material"] => new("materials", &at(after, place)),
        // What was compressed has no place for the lightmap's coordinates.
        ["meshes", _, "primitives", _, "extensions", "KHR_draco_mesh_compression"] => true,
        ["meshes", _, "primitives", _, "extensions", "KHR_materials_variants", "mappings", _, "material"] => {
            new("materials", &at(after, place))
        }
        ["extensions", "KHR_lights_punctual", "lights", _, "extensions"] => {
            at(after, place).as_object().unwrap().keys().eq(["LUMBRE_lights_phong"])
        }
        ["extensions", "KHR_lights_punctual", "lights", _, "extensions", "LUMBRE_lights_phong", "bake"] => {
            true
        }
        ["extensions", "LUMBRE_bake"] => true,
        ["extensions"] => after["extensions"].as_object().unwrap().keys().eq(["LUMBRE_bake"]),
        ["extensionsUsed"] => true,
        ["extensionsUsed", number] => number.parse::<usize>().unwrap() >= length("extensionsUsed"),
        _ => false,
    }
}

/// Loads a file, bakes it and writes it.
fn baked(input: &Path, output: &Path) -> (LoadReport, SaveReport) {
    let mut world = World::new();
    let mut source = SourceFile::read(input, &LoadOptions::default()).unwrap();
    let loaded = source.load_into(&mut world).unwrap();
    bake(&mut world);
    (loaded, save_baked(&mut world, &source, output, &SaveOptions::default()).unwrap())
}

/// Everything that has to hold between a file and its baked twin. How many primitives have light.
fn compare(what: &str, input: &Path, output: &Path) -> usize {
    let (before, after) = (read(input), read(output));
    let mut found = Vec::new();
    differences(&before.root, &after.root, "", &mut found);
    for place in found {
        let show = |value: &Value| value.pointer(&place).map_or("nothing".to_owned(), ToString::to_string);
        assert!(
            is_of_the_bake(&place, &before.root, &after.root),
            "{what}: {place} was {} and is {}",
            show(&before.root),
            show(&after.root)
        );
    }
    for (before, after) in before.buffers.iter().zip(&after.buffers) {
        assert!(before[..] == after[..before.len()], "{what}: old bytes are as they were");
    }
    let mut lit = 0;
    for (index, node) in before.root["nodes"].as_array().unwrap().iter().enumerate() {
        let (Some(old), Some(new)) = (node["mesh"].as_u64(), after.root["nodes"][index]["mesh"].as_u64())
        else {
            continue;
        };
        let (old, new) = (&before.root["meshes"][old as usize], &after.root["meshes"][new as usize]);
        assert_eq!(old["primitives"].as_array().unwrap().len(), new["primitives"].as_array().unwrap().len());
        let is_lit = after.root["nodes"][index]["extensions"]["LUMBRE_lightmap"].is_object();
        for (old, new) in
            old["primitives"].as_array().unwrap().iter().zip(new["primitives"].as_array().unwrap())
        {
            lit += usize::from(is_lit && new["attributes"]["TEXCOORD_1"].is_number());
            same_corners(what, &before, old, &after, new);
        }
    }
    lit
}

/// Every attribute of every corner is what it was, and textures read what they read.
fn same_corners(what: &str, before: &Read, old: &Value, after: &Read, new: &Value) {
    let (old_corners, new_corners) = (before.corners(old), after.corners(new));
    assert_eq!(old_corners.len(), new_corners.len(), "{what}");
    let same = |old: &Value, new: &Value, name: &str| {
        let (old, new) = (before.elements(old), after.elements(new));
        for (&from, &to) in old_corners.iter().zip(&new_corners) {
            assert_eq!(old[from], new[to], "{what}: {name} of vertex {from}, which is {to}");
        }
    };
    let sets = moved_sets(before, old, after, new);
    for (name, accessor) in old["attributes"].as_object().unwrap() {
        let now = match name.strip_prefix("TEXCOORD_") {
            Some(set) => format!("TEXCOORD_{}", sets(set.parse().unwrap())),
            None => name.clone(),
        };
        same(accessor, &new["attributes"][&now], name);
    }
    let targets = |primitive: &Value| primitive["targets"].as_array().cloned().unwrap_or_default();
    assert_eq!(targets(old).len(), targets(new).len(), "{what}");
    for (old, new) in targets(old).iter().zip(&targets(new)) {
        assert!(old.as_object().unwrap().keys().eq(new.as_object().unwrap().keys()));
        for (name, accessor) in old.as_object().unwrap() {
            same(accessor, &new[name], name);
        }
    }
    // Counts agree and ranges are true.
    let count = after.elements(&new["attributes"]["POSITION"]).len();
    for (name, accessor) in new["attributes"].as_object().unwrap() {
        assert_eq!(after.elements(accessor).len(), count, "{what}: {name}");
    }
    let position = &after.root["accessors"][new["attributes"]["POSITION"].as_u64().unwrap() as usize];
    if position["componentType"] == 5126 && position["max"].is_array() {
        let largest = after.elements(&new["attributes"]["POSITION"]);
        let largest = largest
            .iter()
            .map(|bytes| f32::from_le_bytes(bytes[..4].try_into().unwrap()))
            .fold(f32::MIN, f32::max);
        assert_eq!(position["max"][0].as_f64().unwrap() as f32, largest, "{what}");
    }
}

/// Where the sets of texture coordinates are now, by what the materials say.
fn moved_sets(before: &Read, old: &Value, after: &Read, new: &Value) -> impl Fn(u64) -> u64 + use<> {
    let texture_sets = |read: &Read, primitive: &Value| -> BTreeMap<String, u64> {
        let Some(material) = primitive["material"].as_u64() else { return BTreeMap::new() };
        let material = &read.root["materials"][material as usize];
        let places = ["/pbrMetallicRoughness/baseColorTexture", "/normalTexture", "/emissiveTexture"];
        let sets = places.iter().filter_map(|place| {
            let texture = material.pointer(place)?;
            Some(((*place).to_owned(), texture["texCoord"].as_u64().unwrap_or(0)))
        });
        sets.collect()
    };
    let (old, new) = (texture_sets(before, old), texture_sets(after, new));
    let pairs: Vec<(u64, u64)> = old.iter().map(|(place, &set)| (set, new[place])).collect();
    move |set| pairs.iter().find(|(from, _)| *from == set).map_or(set, |(_, to)| *to)
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
            // Once more: the file does not grow, and loses nothing either.
            let first = fs::read(at(output)).unwrap();
            baked(&at(output), &at(output));
            assert!(fs::read(at(output)).unwrap() == first, "{what}: {output} baked again");
            // What is read of it is the artist's file.
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

/// A .gltf with a buffer and an image beside it.
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
    // In the same folder nothing is copied.
    baked(&input, &level.join("room.baked.gltf"));
    compare("beside", &input, &level.join("room.baked.gltf"));
    let own = [
        "room.baked.bake.bin",
        "room.baked.cube.exr",
        "room.baked.gltf",
        "room.bin",
        "room.gltf",
        "textures",
    ];
    assert_eq!(names(&level), own);

    // In another everything is, and what was not there from an earlier bake stays.
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

    // The artist paints the wall anew: the copy follows.
    fs::write(level.join("textures/a wall.png"), png(5, 5)).unwrap();
    let before = names(&out);
    baked(&input, &output);
    assert_eq!(fs::read(out.join("textures/a wall.png")).unwrap(), png(5, 5));
    assert_eq!(names(&out), before);

    // A .glb takes the first buffer in, and images stay beside.
    fs::remove_dir_all(&out).unwrap();
    fs::create_dir(&out).unwrap();
    baked(&input, &out.join("room.glb"));
    assert_eq!(names(&out), ["room.cube.exr", "room.glb", "textures"]);
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
    let volume = IrradianceVolume { resolution: glam::UVec3::ONE, cubes: vec![AmbientCube::default()] };
    world.spawn((Name::new("volume"), Transform::from_xyz(1.0, 2.0, 3.0), volume));
    save_baked(&mut world, &source, &output, &SaveOptions::default()).unwrap();

    let mut again = World::new();
    let report = load(&mut again, &output).unwrap();
    assert_eq!(*again.query::<&Light>().single(&again).unwrap(), lamp);
    assert_eq!(again.resource::<SceneSettings>().sky, Vec3::new(0.5, 0.75, 1.0));
    let (_, transform) = again.query::<(&IrradianceVolume, &Transform)>().single(&again).unwrap();
    assert_eq!(*transform, Transform::from_xyz(1.0, 2.0, 3.0));
    assert_eq!(report.nodes.len(), 3);

    // Back to the artist's file, whose own sky is black.
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

/// Every file below the folder that the variable LUMBRE_CORPUS names. Without it there is nothing to do, and that is said.
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
                // Taken back, it is the artist's JSON again.
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
