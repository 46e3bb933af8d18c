//! Compares a file with its baked version: the differences of their JSON, and the attributes of every
//! triangle corner.

use super::*;

/// The JSON and buffers of a file, read without the crate under test.
pub struct Read {
    pub root: Value,
    pub buffers: Vec<Vec<u8>>,
}

pub fn read(path: &Path) -> Read {
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
    pub fn elements(&self, accessor: &Value) -> Vec<Vec<u8>> {
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

    /// The vertex at each corner of each triangle, without triangles of a strip that repeat a vertex.
    pub fn corners(&self, primitive: &Value) -> Vec<usize> {
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

pub fn whole(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | usize::from(byte))
}

/// Collects the places (JSON pointers) at which two values differ.
pub fn differences(before: &Value, after: &Value, place: &str, found: &mut Vec<String>) {
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

/// Extensions whose data a bake expands or decompresses.
const WRITTEN_OUT: [&str; 2] = ["KHR_draco_mesh_compression", "EXT_mesh_gpu_instancing"];

/// Returns true if a bake may change the value at this place.
pub fn is_of_the_bake(place: &str, before: &Value, after: &Value) -> bool {
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
        ["nodes", node, "children" | "mesh" | "extensions", ..]
            if !before["nodes"][node.parse::<usize>().unwrap()]["extensions"]["EXT_mesh_gpu_instancing"]
                .is_null() =>
        {
            true
        }
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
        // Compressed data cannot hold the lightmap coordinates.
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
        ["extensionsUsed" | "extensionsRequired", ..] => {
            let names = |value: &Value, key: &str| -> Vec<String> {
                value[key]
                    .as_array()
                    .into_iter()
                    .flatten()
                    .map(|name| name.as_str().unwrap().to_owned())
                    .collect()
            };
            let (old, new) = (names(before, parts[0]), names(after, parts[0]));
            new.iter().all(|name| old.contains(name) || name.starts_with("LUMBRE_"))
                && old.iter().all(|name| new.contains(name) || WRITTEN_OUT.contains(&name.as_str()))
        }
        ["meshes", _, "primitives", _, "extensions"] => {
            at(before, place).as_object().unwrap().keys().eq(["KHR_draco_mesh_compression"])
        }
        _ => false,
    }
}

/// Loads, bakes and saves a file.
pub fn baked(input: &Path, output: &Path) -> (LoadReport, SaveReport) {
    let mut world = World::new();
    let mut source = SourceFile::read(input, &LoadOptions::default()).unwrap();
    let loaded = source.load_into(&mut world).unwrap();
    bake(&mut world);
    (loaded, save_baked(&mut world, &source, output, &SaveOptions::default()).unwrap())
}

/// Checks everything that must hold between a file and its baked version. Returns the number of lightmapped
/// primitives.
pub fn compare(what: &str, input: &Path, output: &Path) -> usize {
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

/// Checks that every attribute of every corner is unchanged, and that textures read the same coordinates.
pub fn same_corners(what: &str, before: &Read, old: &Value, after: &Read, new: &Value) {
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
    // Element counts agree, and stated ranges are correct.
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

/// The new number of each texture coordinate set, derived from the materials.
pub fn moved_sets(before: &Read, old: &Value, after: &Read, new: &Value) -> impl Fn(u64) -> u64 + use<> {
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
