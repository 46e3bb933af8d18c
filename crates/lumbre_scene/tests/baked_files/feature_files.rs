//! The test files to be baked: one for each feature that a bake must preserve. The comparison is in
//! `comparison`.

use super::*;

/// A cube of eight vertices, which its six charts split. `change` adds attributes.
pub fn cube(file: &mut File, change: impl FnOnce(&mut File, &mut Value)) -> usize {
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

/// Eight distinct values with this many components.
pub fn values(components: usize, offset: f32) -> Vec<f32> {
    (0..8 * components).map(|at| offset + at as f32 * 0.125).collect()
}

pub fn accessor(
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

pub fn texture(file: &mut File) -> usize {
    let view = file.view(&png(2, 3));
    let image = file.push("images", json!({"name": "wall", "bufferView": view, "mimeType": "image/png"}));
    let sampler = file.push("samplers", json!({"name": "nearest", "magFilter": 9728}));
    file.push("textures", json!({"name": "wall", "source": image, "sampler": sampler}))
}

/// All test files, named by their feature.
pub fn files() -> Vec<(&'static str, File)> {
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
        // The same, but marked as static by the artist.
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

pub fn joints(file: &mut File, primitive: &mut Value) {
    let joints: Vec<u8> = vec![0; 32];
    primitive["attributes"]["JOINTS_0"] = accessor(file, &joints, 5121, "VEC4", 8, None).into();
    let weights = [255, 0, 0, 0].repeat(8);
    let weights = accessor(file, &weights, 5121, "VEC4", 8, None);
    file.root["accessors"][weights]["normalized"] = true.into();
    primitive["attributes"]["WEIGHTS_0"] = weights.into();
}
