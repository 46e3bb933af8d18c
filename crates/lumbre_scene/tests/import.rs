//! What each feature of a file becomes in the World.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec2, Vec3, Vec4};
use lumbre_optics::*;
use lumbre_scene::*;
use serde_json::{Value, json};
use support::{File, png};

/// The only component of a type in the World.
fn only<T: Component + Clone>(world: &mut World) -> T {
    let found: Vec<T> = world.query::<&T>().iter(world).cloned().collect();
    let [one] = found.as_slice() else { panic!("{} instead of one", found.len()) };
    one.clone()
}

fn mesh_of(mode: Option<u32>, indices: Option<&[u16]>, positions: &[f32]) -> lumbre_mesh::TriangleMesh {
    let mut file = File::new();
    let position = file.floats("VEC3", 3, positions);
    let normal = file.floats("VEC3", 3, &[0.0, 0.0, 1.0].repeat(positions.len() / 3));
    let mut primitive = json!({"attributes": {"POSITION": position, "NORMAL": normal}});
    if let Some(mode) = mode {
        primitive["mode"] = mode.into();
    }
    if let Some(indices) = indices {
        primitive["indices"] = file.indices(indices).into();
    }
    file.push("meshes", json!({"primitives": [primitive]}));
    file.node(json!({"mesh": 0}));
    let (mut world, _) = file.load().unwrap();
    (*only::<Mesh>(&mut world).0).clone()
}

const FIVE: [f32; 15] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.];

#[test]
fn primitive_modes() {
    assert_eq!(mesh_of(None, None, &FIVE).indices, [0, 1, 2]);
    assert_eq!(mesh_of(Some(4), Some(&[2, 0, 1, 1, 3, 2]), &FIVE).indices, [2, 0, 1, 1, 3, 2]);
    // Every other triangle of a strip is reversed; a triangle with a repeated vertex only connects.
    assert_eq!(mesh_of(Some(5), None, &FIVE).indices, [0, 1, 2, 1, 3, 2, 2, 3, 4]);
    assert_eq!(mesh_of(Some(5), Some(&[0, 1, 2, 2, 3, 4]), &FIVE).indices, [0, 1, 2, 2, 4, 3]);
    assert_eq!(mesh_of(Some(6), None, &FIVE).indices, [1, 2, 0, 2, 3, 0, 3, 4, 0]);
    let strip = mesh_of(Some(5), None, &FIVE);
    for [a, b, c] in strip.triangles().map(|t| t.map(|i| strip.positions[i as usize])) {
        assert!((b - a).cross(c - a).z > 0.0, "all triangles of the strip wind alike");
    }
}

#[test]
fn points_and_lines_are_left_out_with_a_note() {
    let mut file = File::new();
    file.square(|_, primitive| primitive["mode"] = 1.into());
    let (mut world, report) = file.load().unwrap();
    assert_eq!((report.triangles, world.query::<&Mesh>().iter(&world).count()), (0, 0));
    assert!(report.notes.iter().any(|note| note.to_string().contains("square")), "{:?}", report.notes);
}

#[test]
fn missing_normals_are_flat() {
    let mut file = File::new();
    let position = file.floats("VEC3", 3, &[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}, "indices": indices}]}));
    file.node(json!({"mesh": 0}));
    let (mut world, _) = file.load().unwrap();
    let mesh = only::<Mesh>(&mut world).0;
    assert_eq!(mesh.indices, [0, 1, 2, 3, 4, 5]);
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::X, Vec3::X, Vec3::X]);
}

#[test]
fn broken_normals_are_repaired_and_the_mesh_is_named_once() {
    let mut file = File::new();
    file.square(|file, primitive| {
        let nan = f32::NAN;
        let normals = file.floats("VEC3", 3, &[0., 0., 0., nan, 0., 0., 0., 0., 5., 0., 1., 0.]);
        primitive["attributes"]["NORMAL"] = normals.into();
    });
    file.node(json!({"mesh": 0}));
    let (mut world, report) = file.load().unwrap();
    for mesh in world.query::<&Mesh>().iter(&world) {
        assert_eq!(mesh.0.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y]);
    }
    let notes: Vec<_> = report.notes.iter().filter(|note| note.text.contains("normals")).collect();
    assert_eq!(notes.len(), 1);
    assert!(notes[0].place.contains("square") && notes[0].text.contains('2'), "{}", notes[0]);
}

#[test]
fn normalized_integers_and_strides() {
    let mut file = File::new();
    file.square(|file, primitive| {
        // Two u16 and four u8 interleaved, 8 bytes per vertex.
        let mut bytes = Vec::new();
        for (u, v) in [(0u16, 65535u16), (65535, 0), (13107, 0), (0, 0)] {
            bytes.extend(u.to_le_bytes());
            bytes.extend(v.to_le_bytes());
            bytes.extend([255, 51, 0, 102]);
        }
        let view = file.view(&bytes);
        file.root["bufferViews"][view]["byteStride"] = 8.into();
        let mut accessor = |offset: u32, component: u32, shape: &str| {
            let accessor = json!({"bufferView": view, "byteOffset": offset, "componentType": component,
                "normalized": true, "count": 4, "type": shape});
            file.push("accessors", accessor)
        };
        primitive["attributes"]["TEXCOORD_0"] = accessor(0, 5123, "VEC2").into();
        primitive["attributes"]["COLOR_0"] = accessor(4, 5121, "VEC4").into();
    });
    let (mut world, _) = file.load().unwrap();
    let mesh = only::<Mesh>(&mut world).0;
    // The file has no normals, so vertices follow the indices 0 1 2 0 2 3.
    assert_eq!(mesh.uv0, [Vec2::Y, Vec2::X, Vec2::new(0.2, 0.0), Vec2::Y, Vec2::new(0.2, 0.0), Vec2::ZERO]);
    assert_eq!(mesh.colors, [Vec4::new(1.0, 0.2, 0.0, 0.4); 6]);
}

#[test]
fn sparse_accessors() {
    let mut file = File::new();
    file.square(|file, primitive| {
        let normal = file.floats("VEC3", 3, &[0.0, 0.0, 1.0].repeat(4));
        primitive["attributes"]["NORMAL"] = normal.into();
        let (at, new) =
            (file.view(&[1, 3]), file.view(&[5f32, 6., 7., 8., 9., 10.].map(f32::to_le_bytes).concat()));
        file.root["accessors"][0]["sparse"] = json!({"count": 2,
            "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": new}});
    });
    let (mut world, _) = file.load().unwrap();
    let expected = [Vec3::ZERO, Vec3::new(5., 6., 7.), Vec3::new(1., 1., 0.), Vec3::new(8., 9., 10.)];
    assert_eq!(only::<Mesh>(&mut world).0.positions, expected);
}

#[test]
fn nodes_with_matrices_and_mirrors() {
    let mut file = File::new();
    let child = file.push("nodes", json!({"name": "child", "translation": [0, 1, 0]}));
    // Columns: x mirrored and doubled, y to z with factor 3, z to -y, then the translation.
    let matrix = json!([-2, 0, 0, 0, 0, 0, 3, 0, 0, -1, 0, 0, 10, 20, 30, 1]);
    file.node(json!({"name": "parent", "matrix": matrix, "children": [child], "extras": {"key": 7}}));
    let sheared = json!([1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    file.node(json!({"name": "leaning", "matrix": sheared}));
    let (world, report) = file.load().unwrap();
    let place = world.get::<GlobalTransform>(report.nodes[child]).unwrap().translation();
    assert!(place.distance(DVec3::new(10.0, 20.0, 33.0)) < 1e-12, "{place}");
    let global = world.get::<GlobalTransform>(report.nodes[1]).unwrap().0;
    assert!(
        global.matrix3.x_axis.distance(DVec3::new(-2.0, 0.0, 0.0)) < 1e-12
            && global.matrix3.determinant() < 0.0
    );
    assert_eq!(world.get::<Extras>(report.nodes[1]), Some(&Extras(json!({"key": 7}))));
    assert_eq!(world.get::<ChildOf>(report.nodes[child]).unwrap().parent(), report.nodes[1]);
    assert!(
        report.notes.iter().any(|note| note.place.contains("leaning") && note.text.contains("shear")),
        "{:?}",
        report.notes
    );
}

fn light(light: Value) -> Light {
    let mut file = File::new();
    file.light(light);
    only(&mut file.load().unwrap().0)
}

#[test]
fn lights_of_khr() {
    let pi = std::f32::consts::PI;
    let point = light(json!({"type": "point", "color": [1, 0.5, 0.25], "intensity": 4, "range": 9}));
    let expected = Light {
        attenuation: Attenuation { range: 9.0, ..Attenuation::INVERSE_SQUARE },
        bake: BakeMode::Static,
        ..Light::point(Vec3::new(4.0, 2.0, 1.0) / pi)
    };
    assert_eq!(point, expected);
    let sun = light(json!({"type": "directional"}));
    assert_eq!(sun, Light { bake: BakeMode::Static, ..Light::directional(Vec3::ONE / pi) });
    let spot = light(json!({"type": "spot", "spot": {"innerConeAngle": 0.25}}));
    assert_eq!(spot.spot, Some(SpotCone::Smooth { inner: 0.25, outer: std::f32::consts::FRAC_PI_4 }));
}

#[test]
fn lights_in_the_documents_units() {
    let with = |phong: Value| {
        let spot = json!({"innerConeAngle": 0.1, "outerConeAngle": 0.4});
        light(
            json!({"type": "spot", "intensity": 4, "spot": spot, "extensions": {"LUMBRE_lights_phong": phong}}),
        )
    };
    let defaults = with(json!({}));
    assert_eq!(
        (defaults.diffuse, defaults.specular, defaults.ambient),
        (Vec3::splat(4.0), Vec3::splat(4.0), Vec3::ZERO)
    );
    assert_eq!(
        (defaults.attenuation, defaults.bake, defaults.enabled, defaults.shadow),
        (Attenuation::NONE, BakeMode::Static, true, false)
    );
    assert_eq!(defaults.spot, Some(SpotCone::Smooth { inner: 0.1, outer: 0.4 }));
    let all = with(
        json!({"ambient": [0.1, 0, 0], "diffuse": [1, 2, 3], "specular": [4, 5, 6], "attenuation": [0.5, 0.25, 2],
        "attenuationClamp": true, "spot": {"cutoff": 0.7, "exponent": 12}, "enabled": false, "shadow": true, "bake": "mixed",
        "radius": 0.5, "angle": 0.25}),
    );
    let expected = Light {
        kind: LightKind::Point,
        ambient: Vec3::new(0.1, 0.0, 0.0),
        diffuse: Vec3::new(1.0, 2.0, 3.0),
        specular: Vec3::new(4.0, 5.0, 6.0),
        attenuation: Attenuation {
            constant: 0.5,
            linear: 0.25,
            quadratic: 2.0,
            clamp: true,
            range: f32::INFINITY,
        },
        spot: Some(SpotCone::Exponent { cutoff: 0.7, exponent: 12.0 }),
        enabled: false,
        shadow: true,
        bake: BakeMode::Mixed,
        radius: 0.5,
        angle: 0.25,
    };
    assert_eq!(all, expected);
    assert_eq!(with(json!({"kind": "ambient", "ambient": [1, 1, 1]})).kind, LightKind::Ambient);
}

fn material(material: Value) -> Material {
    let mut file = File::new();
    file.square(|file, primitive| primitive["material"] = file.push("materials", material).into());
    only(&mut file.load().unwrap().0)
}

#[test]
fn materials_by_metallic_roughness() {
    let plain = material(json!({"doubleSided": true, "emissiveFactor": [0.5, 1, 0], "alphaMode": "MASK",
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 0.75], "metallicFactor": 0.5, "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}}));
    let front = Surface {
        ambient: Vec3::new(0.5, 0.25, 1.0),
        diffuse: Vec3::new(0.25, 0.125, 0.5),
        specular: (Vec3::splat(0.04) + Vec3::new(0.5, 0.25, 1.0)) * 0.5,
        emission: Vec3::new(4.0, 8.0, 0.0),
        // alpha = roughness² = 1/4, exponent n = 2 / alpha² - 2 = 2 * 16 - 2
        shininess: 30.0,
    };
    assert_eq!(
        (plain.front.ambient, plain.front.diffuse, plain.front.emission),
        (front.ambient, front.diffuse, front.emission)
    );
    assert!(
        plain.front.specular.distance(front.specular) < 1e-6 && (plain.front.shininess - 30.0).abs() < 1e-4
    );
    assert!(plain.double_sided && plain.alpha == 0.75 && plain.alpha_mode == AlphaMode::Mask { cutoff: 0.5 });
    let unlit = material(json!({"extensions": {"KHR_materials_unlit": {}}}));
    assert!(unlit.unlit && unlit.front.diffuse == Vec3::ONE);
}

#[test]
fn materials_by_phong() {
    let phong = |phong: Value| {
        material(
            json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1]}, "emissiveFactor": [0, 1, 0],
            "extensions": {"LUMBRE_materials_phong": phong}}),
        )
    };
    let defaults = phong(json!({}));
    let base = Vec3::new(0.5, 0.25, 1.0);
    let front = Surface { ambient: base, diffuse: base, emission: Vec3::Y, ..Surface::default() };
    assert_eq!(defaults, Material { front, ..Material::default() });
    let all = phong(
        json!({"ambient": [0.1, 0, 0], "specular": [0, 0.2, 0], "emission": [0, 0, 3], "shininess": 128,
        "back": {"diffuse": [1, 1, 0]}, "distribution": "gaussian", "eta": [0.2, 0.4, 1.4], "absorption": [3, 2.5, 2], "mirror": [0.5, 0.5, 0.5], "transmission": [0, 0, 0.25], "ior": 1.25}),
    );
    let front = Surface {
        ambient: Vec3::new(0.1, 0.0, 0.0),
        diffuse: base,
        specular: Vec3::new(0.0, 0.2, 0.0),
        emission: Vec3::new(0.0, 0.0, 3.0),
        shininess: 128.0,
    };
    let back = Some(Surface { diffuse: Vec3::new(1.0, 1.0, 0.0), ..front });
    let (mirror, transmission) = (Vec3::splat(0.5), Vec3::new(0.0, 0.0, 0.25));
    let (distribution, ior) = (Distribution::Gaussian, 1.25);
    let fresnel = Fresnel::Conductor { eta: Vec3::new(0.2, 0.4, 1.4), absorption: Vec3::new(3.0, 2.5, 2.0) };
    let rest = Material::default();
    assert_eq!(all, Material { front, back, mirror, transmission, ior, distribution, fresnel, ..rest });
    // If only one part of the index is given, the other is that of air.
    let (eta, absorption) = (Vec3::new(1.5, 2.0, 2.5), Vec3::new(3.0, 2.5, 2.0));
    let half = phong(json!({"eta": [1.5, 2, 2.5]}));
    assert_eq!(half.fresnel, Fresnel::Conductor { eta, absorption: Vec3::ZERO });
    let half = phong(json!({"absorption": [3, 2.5, 2]}));
    assert_eq!(half.fresnel, Fresnel::Conductor { eta: Vec3::ONE, absorption });
    let named = phong(json!({"fresnel": "normal-reflectance", "distribution": "cosine-power"}));
    assert_eq!((named.fresnel, named.distribution), (Fresnel::NormalReflectance, Distribution::CosinePower));
    // Plain glTF: k_s is the reflectance at normal incidence.
    let plain = material(json!({"pbrMetallicRoughness": {"metallicFactor": 0.5}}));
    assert_eq!(plain.fresnel, Fresnel::NormalReflectance);
}

#[test]
fn textures() {
    let mut file = File::new();
    let view = file.view(&png(3, 2));
    file.push("images", json!({"name": "tiles", "bufferView": view}));
    let mut jpeg = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(8, 8, image::Rgb([200, 100, 50]))
        .write_to(&mut jpeg, image::ImageFormat::Jpeg)
        .unwrap();
    let data: String = jpeg.into_inner().iter().map(|byte| format!("%{byte:02X}")).collect();
    file.push("images", json!({"uri": format!("data:image/jpeg,{data}")}));
    file.push("samplers", json!({"magFilter": 9728, "minFilter": 9984, "wrapS": 33071, "wrapT": 33648}));
    file.push("textures", json!({"source": 0, "sampler": 0}));
    file.push("textures", json!({"source": 1}));
    let transform = json!({"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 3], "texCoord": 1}});
    file.square(|file, primitive| {
        let uv = file.floats("VEC2", 2, &[0.0; 8]);
        primitive["attributes"]["TEXCOORD_0"] = uv.into();
        primitive["attributes"]["TEXCOORD_1"] = uv.into();
        let material = json!({"pbrMetallicRoughness": {"metallicFactor": 0.5, "roughnessFactor": 0.25,
            "baseColorTexture": {"index": 0, "extensions": transform}, "metallicRoughnessTexture": {"index": 1}},
            "emissiveTexture": {"index": 0}});
        primitive["material"] = file.push("materials", material).into();
    });
    let (mut world, report) = file.load().unwrap();
    assert_eq!(report.notes, []);
    let textures = only::<MaterialTextures>(&mut world);
    let base = textures.base_color.unwrap();
    assert_eq!((base.image.width, base.image.height, base.image.name.as_str()), (3, 2, "tiles"));
    assert_eq!(base.image.rgba[..8], [0, 0, 0, 255, 7, 0, 0, 254]);
    assert_eq!(
        (base.tex_coord, base.offset, base.rotation, base.scale),
        (1, Vec2::new(0.5, 0.25), 0.5, Vec2::new(2.0, 3.0))
    );
    let sampler = Sampler {
        wrap_u: Wrap::ClampToEdge,
        wrap_v: Wrap::MirroredRepeat,
        magnify_linear: false,
        minify_linear: false,
        mipmap: Mipmap::Nearest,
    };
    assert_eq!(base.sampler, sampler);
    assert!(std::sync::Arc::ptr_eq(&base.image, &textures.emissive.unwrap().image));
    let slot = textures.metallic_roughness.unwrap();
    assert_eq!(
        (slot.metallic, slot.roughness, slot.base_color, slot.texture.sampler),
        (0.5, 0.25, Vec3::ONE, Sampler::default())
    );
    // A grey JPEG block is decoded within its rounding.
    for (found, expected) in slot.texture.image.rgba[..4].iter().zip([200, 100, 50, 255]) {
        assert!(found.abs_diff(expected) <= 4, "{:?}", &slot.texture.image.rgba[..4]);
    }
}

#[test]
fn external_files_and_lightmaps() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = File::new();
    file.square(|file, primitive| {
        let uv = file.floats("VEC2", 2, &[0.0; 8]);
        primitive["attributes"]["TEXCOORD_0"] = uv.into();
        primitive["attributes"]["TEXCOORD_1"] = uv.into();
        file.push("images", json!({"uri": "my%20tiles.png"}));
        file.push("textures", json!({"source": 0}));
        primitive["material"] = file
            .push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}))
            .into();
    });
    let lightmap = json!({"image": "light.exr", "texCoord": 1, "encoding": "rgb32f"});
    file.root["nodes"][0]["extensions"] =
        json!({"LUMBRE_lightmap": lightmap, "LUMBRE_shading": {"technique": "gouraud"}});
    file.root["buffers"] = json!([{"byteLength": file.binary.len(), "uri": "data.bin"}]);
    std::fs::write(folder.path().join("my tiles.png"), png(2, 2)).unwrap();
    std::fs::write(folder.path().join("data.bin"), &file.binary).unwrap();
    let texels = image::Rgb32FImage::from_fn(2, 1, |x, _| image::Rgb([x as f32 + 0.1, 1e4, 0.0]));
    texels.save(folder.path().join("light.exr")).unwrap();
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, file.root.to_string()).unwrap();

    let mut world = World::new();
    load(&mut world, &path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(only::<MaterialTextures>(&mut world).base_color.unwrap().image.width, 2);
    assert_eq!(only::<Shading>(&mut world), Shading::Gouraud);
    let lightmap = only::<Lightmap>(&mut world).image;
    assert_eq!(lightmap.texels, [Vec3::new(0.1, 1e4, 0.0), Vec3::new(1.1, 1e4, 0.0)]);
    assert_eq!((lightmap.name.as_str(), lightmap.encoding), ("light.exr", LightmapEncoding::Rgb32Float));

    std::fs::remove_file(folder.path().join("light.exr")).unwrap();
    let error = load(&mut World::new(), &path).unwrap_err();
    assert!(error.to_string().contains("scene.gltf") && error.to_string().contains("light.exr"), "{error}");
    std::fs::write(folder.path().join("light.exr"), b"no image").unwrap();
    let error = load(&mut World::new(), &path).unwrap_err();
    assert!(matches!(*error.problem, LoadProblem::Image { .. }), "{error}");
}

#[test]
fn who_moves() {
    let mut file = File::new();
    let still = file.square(|_, _| {});
    let below = file.push("nodes", json!({"mesh": 0}));
    let cart = file.node(json!({"children": [below]}));
    file.node(json!({"mesh": 0, "extensions": {"LUMBRE_object": {"dynamic": true}}}));
    file.push("animations", json!({"channels": [{"target": {"node": cart, "path": "rotation"}}]}));
    let (mut world, report) = file.load().unwrap();
    assert_eq!(world.query::<(&Mesh, &StaticObject)>().iter(&world).count(), 1);
    assert_eq!(world.query::<(&Mesh, &DynamicObject)>().iter(&world).count(), 2);
    assert!(world.get::<DynamicObject>(report.nodes[cart]).is_some());
    assert!(world.get::<DynamicObject>(report.nodes[still]).is_none());
    // Three nodes with one mesh share it.
    let meshes: Vec<_> =
        world.query::<&Mesh>().iter(&world).map(|mesh| std::sync::Arc::as_ptr(&mesh.0)).collect();
    assert!(meshes.iter().all(|mesh| *mesh == meshes[0]));
    let census = Census::of(&mut world);
    assert_eq!((census.meshes, census.static_objects, census.dynamic_objects), (3, 1, 2));
}

#[test]
fn reflection_models_of_nodes() {
    let mut file = File::new();
    let phong = json!({"extensions": {"LUMBRE_materials_phong": {"specular": [1, 1, 1]}}});
    file.square(|file, primitive| primitive["material"] = file.push("materials", phong).into());
    let model = |name: &str| json!({"LUMBRE_shading": {"reflection": name}});
    file.root["scenes"][0]["extensions"] = json!({"LUMBRE_scene": {"reflection": "blinn"}});
    for extensions in [model("torrance-sparrow"), model("blinn-matched"), model("torrance-sparrow")] {
        file.node(json!({"mesh": 0, "extensions": extensions}));
    }
    let (mut world, _) = file.load().unwrap();
    let own: Vec<_> = world.query::<&ReflectionModel>().iter(&world).copied().collect();
    assert_eq!(own.len(), 3);
    let census = Census::of(&mut world);
    assert_eq!(census.own_reflection, 3);
    let used: Vec<_> = census.reflection_models.iter().map(|(name, count)| (*name, *count)).collect();
    assert_eq!(used, [("blinn", 1), ("blinn-matched", 1), ("torrance-sparrow", 2)]);
    let line = |effect: &str| census.lines().into_iter().find(|line| line.effect == effect).unwrap();
    assert_eq!(line("Torrance-Sparrow reflection").reason, "2 meshes with a highlight of that model");
    assert!(!line("Phong reflection").called_for);
}

#[test]
fn who_lights_others() {
    let mut file = File::new();
    file.square(|_, _| {});
    let glowing = file.push("materials", json!({"emissiveFactor": [1, 0.5, 0]}));
    let mut mesh = file.root["meshes"][0].clone();
    mesh["primitives"][0]["material"] = json!(glowing);
    let mesh = file.push("meshes", mesh);
    let asks = json!({"LUMBRE_object": {"emissiveLight": true}});
    for (mesh, extensions) in [(mesh, asks.clone()), (mesh, json!({})), (0, asks)] {
        file.node(json!({"mesh": mesh, "extensions": extensions}));
    }
    let (mut world, _) = file.load().unwrap();
    assert_eq!(world.query::<(&Mesh, &EmissiveLight)>().iter(&world).count(), 2);
    // Two meshes emit, two have the component, and one has both.
    let census = Census::of(&mut world);
    assert_eq!((census.emissive, census.emissive_lights), (2, 1));
}

#[test]
fn lightmaps_have_a_scale() {
    let file = |scale: serde_json::Value| {
        let mut file = File::new();
        file.square(|_, _| {});
        file.node(json!({"mesh": 0, "extensions": {"LUMBRE_object": {"lightmapScale": scale}}}));
        file
    };
    let (mut world, _) = file(json!(0.25)).load().unwrap();
    assert_eq!(only::<LightmapScale>(&mut world), LightmapScale(0.25));
    for wrong in [json!(0), json!(-2)] {
        let text = file(wrong).load().err().map(|error| error.to_string()).unwrap_or_default();
        assert!(text.contains("LUMBRE_object.lightmapScale") && text.contains("factor above 0"), "{text}");
    }
}

#[test]
fn scene_settings_and_cameras() {
    let mut file = File::new();
    file.root["scenes"][0]["extensions"] = json!({"LUMBRE_scene": {"ambient": [1, 2, 3], "localViewer": false,
        "sky": [0.25, 0.5, 1], "twoSided": true, "reflection": "blinn-4n", "shading": "flat",
        "fog": {"mode": "exp2", "density": 0.5, "color": [0, 1, 0]}}});
    let lens = json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.25, "aspectRatio": 2}});
    file.push("cameras", lens);
    file.node(json!({"camera": 0}));
    let (mut world, _) = file.load().unwrap();
    let expected = SceneSettings {
        ambient: Vec3::new(1.0, 2.0, 3.0),
        background: Vec3::ZERO,
        sky: Vec3::new(0.25, 0.5, 1.0),
        local_viewer: false,
        two_sided: true,
        reflection: ReflectionModel::Blinn4n,
        shading: Shading::Flat,
        fog: Some(Fog { mode: FogMode::ExponentialSquared { density: 0.5 }, color: Vec3::Y }),
        ..SceneSettings::default()
    };
    assert_eq!(*world.resource::<SceneSettings>(), expected);
    let projection = Projection::Perspective { vertical_fov: 0.5, aspect: Some(2.0), near: 0.25, far: None };
    assert_eq!(only::<Camera>(&mut world), Camera { projection, exposure: 1.0 });
}

#[test]
fn what_a_level_asks_of_its_frames() {
    let loaded = |frame: serde_json::Value| {
        let mut file = File::new();
        file.root["scenes"][0]["extensions"] = json!({"LUMBRE_scene": {"frame": frame}});
        file.load().map(|(world, _)| world.resource::<SceneSettings>().frame)
    };
    let all = json!({"multisample": true, "lightThreshold": 0.02, "shadows": false, "shadowResolution": 0.25, "shadowFilter": "hard", "lightmapFormat": "rgb9e5"});
    let expected = FrameSettings {
        multisample: Some(true),
        light_threshold: 0.02,
        shadows: false,
        shadow_resolution: 0.25,
        shadow_filter: ShadowFilter::Hard,
        lightmap_format: LightmapEncoding::Rgb9E5,
    };
    assert_eq!(loaded(all).unwrap(), expected);
    assert_eq!(loaded(json!({})).unwrap(), FrameSettings::default());
    for (bad, words) in [
        (json!({"lightThreshold": -0.1}), ["LUMBRE_scene.frame.lightThreshold", "at least 0"]),
        (json!({"shadowResolution": 0.0}), ["LUMBRE_scene.frame.shadowResolution", "0.0625 to 4"]),
        (json!({"shadowResolution": 5}), ["LUMBRE_scene.frame.shadowResolution", "0.0625 to 4"]),
        (json!({"shadowFilter": "blurred"}), ["\"blurred\"", "hard, percentage-closer, soft"]),
        (json!({"lightmapFormat": "rgb8"}), ["\"rgb8\"", "rgb32f, rgb16f, rgb9e5"]),
    ] {
        let error = loaded(bad).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

#[test]
fn the_census_says_what_is_not_called_for() {
    let mut file = File::new();
    file.square(|file, primitive| {
        primitive["material"] = file.push("materials", json!({"emissiveFactor": [1, 0, 0]})).into();
    });
    file.light(json!({"type": "point", "extensions": {"LUMBRE_lights_phong": {"enabled": false}}}));
    file.light(json!({"type": "spot"}));
    let (mut world, _) = file.load().unwrap();
    let census = Census::of(&mut world);
    let LightCensus { lights, lights_off, spot_lights, point_lights, static_lights, .. } = census.lights;
    assert_eq!((lights, lights_off, spot_lights, point_lights, static_lights), (1, 1, 1, 0, 1));
    assert_eq!((census.phong, census.emissive, census.triangles), (1, 1, 2));
    let line = |effect: &str| census.lines().into_iter().find(|line| line.effect == effect).unwrap();
    let textures = line("textures");
    assert_eq!(
        (textures.called_for, textures.count, textures.reason.as_str()),
        (false, 0, "no material has a texture")
    );
    assert!(
        line("spot lights").called_for && !line("point lights").called_for && line("emission").called_for
    );
    assert!(line("point lights").reason.contains("off"));
    let effects: std::collections::HashSet<&str> = census.lines().iter().map(|line| line.effect).collect();
    assert_eq!(effects.len(), census.lines().len());
    assert!(serde_json::to_value(&census).unwrap()["spot_lights"] == 1);
}
