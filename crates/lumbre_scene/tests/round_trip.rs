//! Saving and loading a World gives the same World, and other readers accept the files.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec2, Vec3, Vec4};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::*;
use lumbre_scene::*;
use support::described;

fn triangle(shift: f32) -> Arc<TriangleMesh> {
    Arc::new(TriangleMesh {
        positions: vec![
            Vec3::new(shift, 0.0, 0.0),
            Vec3::new(shift + 1.0, 0.0, 0.0),
            Vec3::new(shift, 1.0, 0.1),
        ],
        normals: vec![Vec3::Z, Vec3::Y, Vec3::new(0.6, 0.8, 0.0)],
        tangents: vec![
            Vec4::new(1.0, 0.0, 0.0, 1.0),
            Vec4::new(0.0, 0.6, 0.8, -1.0),
            Vec4::new(0.0, 0.0, 1.0, 1.0),
        ],
        uv0: vec![Vec2::ZERO, Vec2::X, Vec2::new(0.1, 0.7)],
        uv1: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        colors: vec![Vec4::ONE, Vec4::new(0.1, 0.2, 0.3, 0.4), Vec4::W],
        indices: vec![0, 1, 2],
    })
}

fn image(name: &str, seed: u8) -> Arc<Image> {
    let rgba = (0..6 * 4).map(|i: u8| i.wrapping_mul(37).wrapping_add(seed)).collect();
    Arc::new(Image { name: name.to_owned(), width: 3, height: 2, rgba })
}

fn texture(image: &Arc<Image>) -> TextureReference {
    TextureReference {
        image: image.clone(),
        sampler: Sampler {
            wrap_v: Wrap::MirroredRepeat,
            magnify_linear: false,
            mipmap: Mipmap::None,
            ..Sampler::default()
        },
        tex_coord: 1,
        offset: Vec2::new(0.1, 0.2),
        rotation: 0.3,
        scale: Vec2::new(1.5, -2.0),
    }
}

/// A World with at least one of every component that a file stores.
fn everything() -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings {
        ambient: Vec3::new(0.1, 0.2, 0.3),
        background: Vec3::new(0.4, 0.5, 7.0),
        sky: Vec3::new(0.3, 0.6, 1.1),
        local_viewer: false,
        two_sided: true,
        reflection: ReflectionModel::BlinnMatched,
        shading: Shading::Gouraud,
        flat_rule: FlatRule::FirstVertex,
        specular_antialiasing: true,
        fog: Some(Fog {
            mode: FogMode::DepthCue { start: 1.1, end: 20.3, near_weight: 0.9, far_weight: 0.2 },
            color: Vec3::new(0.7, 0.1, 0.2),
        }),
        frame: FrameSettings {
            multisample: Some(true),
            light_threshold: 0.0625,
            shadows: false,
            shadow_resolution: 2.0,
            shadow_filter: ShadowFilter::PercentageCloser,
            lightmap_format: LightmapEncoding::Rgb32Float,
        },
    });
    let (shared, other) = (triangle(0.0), triangle(5.0));
    let lightmap = Arc::new(LightmapImage {
        name: "old.exr".to_owned(),
        width: 2,
        height: 2,
        texels: vec![Vec3::ZERO, Vec3::new(0.1, 20.0, 3e4), Vec3::ONE, Vec3::splat(1e-4)],
        encoding: LightmapEncoding::Rgb9E5,
    });
    let picture = image("bricks", 3);
    let odd = DQuat::from_euler(glam::EulerRot::XYZ, 0.1, 0.2, 0.3);
    let place = Transform {
        translation: DVec3::new(1e7, 0.1, -3.3),
        rotation: odd,
        scale: DVec3::new(-1.0, 2.0, 0.0),
    };
    let room = world
        .spawn((
            Name::new("room/ä"),
            place,
            Extras(serde_json::json!({"door": [1, null, {"extensions": 3}]})),
        ))
        .id();
    let materials = [
        Material::from_metallic_roughness(Vec3::new(0.7, 0.3, 0.1), 0.25, 0.6),
        Material {
            front: Surface {
                specular: Vec3::splat(0.3),
                emission: Vec3::new(0.0, 3.3, 17.1),
                shininess: 33.3,
                ..Surface::default()
            },
            back: Some(Surface { diffuse: Vec3::X, ..Surface::default() }),
            alpha: 0.3,
            alpha_mode: AlphaMode::Blend,
            double_sided: true,
            unlit: false,
            mirror: Vec3::splat(0.1),
            transmission: Vec3::new(0.0, 0.2, 0.0),
            ior: 1.33,
            lobe: lumbre_optics::Lobe::EnergyConserving,
            distribution: Distribution::Gaussian,
            fresnel: Fresnel::Conductor {
                eta: Vec3::new(0.17, 0.42, 1.38),
                absorption: Vec3::new(3.1, 2.4, 1.9),
            },
        },
        Material {
            unlit: true,
            alpha_mode: AlphaMode::Mask { cutoff: 0.7 },
            ..Material::matt(Vec3::new(0.2, 0.4, 0.6))
        },
    ];
    let textured = MaterialTextures {
        base_color: Some(texture(&picture)),
        emissive: Some(TextureReference { scale: Vec2::ONE, ..texture(&image("", 9)) }),
        metallic_roughness: Some(MetallicRoughnessTexture {
            texture: texture(&picture),
            base_color: Vec3::new(0.7, 0.3, 0.1),
            metallic: 0.25,
            roughness: 0.6,
            dielectric: Vec3::splat(0.04),
        }),
        normal: Some(NormalTexture { texture: texture(&image("bumps", 3)), scale: -0.75 }),
        occlusion: Some(OcclusionTexture { texture: texture(&picture), strength: 0.25 }),
    };
    for instance in 0..2 {
        let node = world
            .spawn((Name::new("crate"), Transform::from_xyz(f64::from(instance), 0.0, 0.0), ChildOf(room)))
            .id();
        for (index, material) in materials.iter().enumerate() {
            let label = Primitive { index, mesh: "crate".into(), material: format!("side {index}").into() };
            let mesh = Mesh(if index == 1 { other.clone() } else { shared.clone() });
            let mut primitive = world.spawn((mesh, material.clone(), label, ChildOf(node), StaticObject));
            if index == 0 {
                primitive.insert(textured.clone());
            }
            primitive.insert(LightmapScale(2.5));
            primitive.insert((Shading::Flat, ReflectionModel::Blinn4n, Lightmap { image: lightmap.clone() }));
        }
    }
    let cart = world.spawn((Name::new("cart"), Transform::IDENTITY, DynamicObject)).id();
    let label = Primitive { index: 0, mesh: "cart".into(), material: "".into() };
    world.spawn((
        Mesh(other),
        Material::default(),
        label,
        ChildOf(cart),
        DynamicObject,
        Hidden,
        EmissiveLight,
    ));
    let spot = |cone| Light::spot(Vec3::new(1.0, 0.3, 0.2), cone);
    let window = Attenuation { range: 7.7, clamp: true, ..Attenuation::INVERSE_SQUARE };
    let lights = [
        Light { bake: BakeMode::Static, attenuation: window, ..Light::point(Vec3::new(0.3, 0.2, 0.1)) },
        spot(SpotCone::Smooth { inner: 0.1, outer: 0.7 }),
        spot(SpotCone::Exponent { cutoff: 0.4, exponent: 8.5 }),
        spot(SpotCone::Exponent { cutoff: std::f32::consts::PI, exponent: 0.0 }),
        Light { shadow: true, bake: BakeMode::Mixed, angle: 0.0093, ..Light::directional(Vec3::ONE) },
        Light { radius: 0.25, bake: BakeMode::Static, ..Light::point(Vec3::ONE) },
        Light { spot: Some(SpotCone::Smooth { inner: 0.2, outer: 0.3 }), ..Light::directional(Vec3::ONE) },
        Light { enabled: false, ..Light::ambient(Vec3::new(0.1, 0.0, 0.3)) },
    ];
    for (number, light) in lights.into_iter().enumerate() {
        world.spawn((
            Name::new(format!("lamp {number}")),
            Transform::from_xyz(0.1, number as f64, 0.0),
            light,
            ChildOf(cart),
            DynamicObject,
        ));
    }
    let lens = Projection::Orthographic { half_width: 3.3, half_height: 2.2, near: 0.0, far: 9.9 };
    world.spawn((Transform::IDENTITY, Camera { projection: lens, exposure: 0.25 }, ActiveCamera));
    world.spawn((Name::new("eye"), Transform::from_xyz(0.0, 1.7, 0.0), Camera::default()));
    update_transforms(&mut world);
    world
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn everything_comes_back() {
    let mut original = everything();
    let expected = described(&mut original);
    for name in ["level one.glb", "level one.gltf"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        let report = save(&mut original, &path).unwrap();
        assert_eq!(report.notes, []);
        assert_eq!(report.files.last(), Some(&path));
        // One lightmap folder, the .bin of a .gltf, and no temporary files.
        let bin = if name.ends_with(".gltf") { 1 } else { 0 };
        assert_eq!(names_in(folder.path()).len(), 2 + bin, "{:?}", names_in(folder.path()));
        assert!(folder.path().join("level one.lightmaps/crate.exr").is_file());

        let mut again = World::new();
        let loaded = load(&mut again, &path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(loaded.notes, []);
        let found = described(&mut again);
        for (expected, found) in expected.lines().zip(found.lines()) {
            assert_eq!(found, expected, "{name}");
        }
        assert_eq!(found.lines().count(), expected.lines().count());

        // Meshes, images and lightmaps are still shared: 2 meshes in 7 primitives, 3 images in 10 slots.
        let census = Census::of(&mut again);
        assert_eq!(census, Census::of(&mut original));
        assert_eq!((census.meshes, shared(&mut again)), (6, [2, 3, 1]));

        // Saving and loading again changes nothing.
        let second = folder.path().join(format!("again {name}"));
        save(&mut again, &second).unwrap();
        let mut third = World::new();
        load(&mut third, &second).unwrap();
        assert_eq!(described(&mut third), found);
    }
}

/// The numbers of distinct meshes, images and lightmaps among the entities that are not hidden.
fn shared(world: &mut World) -> [usize; 3] {
    let hidden = lumbre_scene::hidden_entities(world);
    let (mut meshes, mut pictures, mut lightmaps) = (HashSet::new(), HashSet::new(), HashSet::new());
    let mut query = world.query::<(Entity, &Mesh, Option<&MaterialTextures>, Option<&Lightmap>)>();
    for (_, mesh, textures, lightmap) in query.iter(world).filter(|object| !hidden.contains(&object.0)) {
        meshes.insert(Arc::as_ptr(&mesh.0));
        let references = textures.into_iter().flat_map(MaterialTextures::references);
        pictures.extend(references.map(|texture| Arc::as_ptr(&texture.image)));
        lightmaps.extend(lightmap.map(|lightmap| Arc::as_ptr(&lightmap.image)));
    }
    [meshes.len(), pictures.len(), lightmaps.len()]
}

#[test]
fn another_reader_accepts_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.glb");
    let mut world = everything();
    save(&mut world, &path).unwrap();
    let file = gltf::Gltf::open(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(file.meshes().count(), 2);
    assert_eq!(file.nodes().filter(|node| node.light().is_some()).count(), 8);
    assert_eq!(file.materials().count(), 4);
    let used: Vec<&str> = file.extensions_used().collect();
    for name in [
        "KHR_lights_punctual",
        "KHR_materials_unlit",
        "LUMBRE_scene",
        "LUMBRE_lightmap",
        "KHR_texture_transform",
    ] {
        assert!(used.contains(&name), "{name} is not in {used:?}");
    }
    assert!(file.extensions_required().next().is_none());
}

#[test]
fn a_world_made_in_code() {
    let mut world = World::new();
    let mesh = triangle(0.0);
    // Meshes directly on entities, without Primitive or Name and with outdated GlobalTransforms.
    world.spawn((Mesh(mesh.clone()), Transform::from_xyz(1.0, 2.0, 3.0)));
    world.spawn((Mesh(mesh), Transform::from_xyz(4.0, 2.0, 3.0), Light::point(Vec3::ONE)));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.glb");
    save(&mut world, &path).unwrap();
    let mut again = World::new();
    let report = load(&mut again, &path).unwrap();
    assert_eq!((report.nodes.len(), report.meshes, report.triangles), (2, 1, 2));
    let mut meshes = again.query::<(&Mesh, &Material, &GlobalTransform)>();
    let found: Vec<DVec3> = meshes.iter(&again).map(|(_, _, transform)| transform.translation()).collect();
    assert_eq!(found, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 2.0, 3.0)]);
    assert!(meshes.iter(&again).all(|(_, material, _)| *material == Material::default()));
    let first = again.query::<&Mesh>().iter(&again).next().unwrap().0.clone();
    assert_eq!(first.positions, triangle(0.0).positions);
}

#[test]
fn atlases_keep_their_names_however_often_they_are_saved() {
    let folder = tempfile::tempdir().unwrap();
    let map = |name: &str| {
        let (width, height, encoding) = (1, 1, LightmapEncoding::Rgb32Float);
        let (name, texels) = (name.to_owned(), vec![Vec3::ONE]);
        Lightmap { image: Arc::new(LightmapImage { name, width, height, texels, encoding }) }
    };
    let mut world = World::new();
    let atlas = map("atlas-1.lightmap.exr");
    for (name, lightmap) in [("floor", atlas.clone()), ("wall", atlas), ("roof", map("roof.lightmap.exr"))] {
        world.spawn((Name::new(name), Mesh(triangle(0.0)), Transform::IDENTITY, lightmap));
    }
    for name in ["hall.glb", "hall.glb", "copy.gltf", "copy.gltf"] {
        let path = folder.path().join(name);
        save(&mut world, &path).unwrap();
        let maps = path.with_extension("lightmaps");
        assert_eq!(names_in(&maps), ["atlas-1.exr", "roof.exr"], "{name}");
        world = World::new();
        load(&mut world, &path).unwrap();
    }
}

#[test]
fn what_cannot_be_saved_is_named_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let save_one = |bundle: (Name, Transform, Light), name: &str| {
        let mut world = World::new();
        world.spawn(bundle);
        save(&mut world, &folder.path().join(name)).unwrap_err()
    };
    let lamp = |light: Light| (Name::new("lamp"), Transform::IDENTITY, light);
    let error = save_one(lamp(Light::point(Vec3::NAN)), "a.glb");
    assert!(matches!(&error, SaveError::Light { place, .. } if place == "lamp"), "{error}");
    let error = save_one(
        (Name::new("lost"), Transform::from_xyz(f64::NAN, 0.0, 0.0), Light::point(Vec3::ONE)),
        "a.gltf",
    );
    assert!(matches!(&error, SaveError::NotFinite { place, .. } if place == "lost"), "{error}");
    let error = save_one(lamp(Light::point(Vec3::ONE)), "a.obj");
    assert!(matches!(error, SaveError::Extension { .. }), "{error}");
    let error = save_one(lamp(Light::point(Vec3::ONE)), "no such folder/a.glb");
    assert!(matches!(error, SaveError::Write { .. }), "{error}");
    let mut world = World::new();
    let broken =
        TriangleMesh { positions: vec![Vec3::ZERO], indices: vec![0, 0, 7], ..TriangleMesh::default() };
    world.spawn((Name::new("shard"), Mesh(Arc::new(broken))));
    let error = save(&mut world, &folder.path().join("a.glb")).unwrap_err();
    assert!(matches!(&error, SaveError::Mesh { place, .. } if place == "shard"), "{error}");
    let mut world = World::new();
    world.spawn((Name::new("ball"), Mesh(triangle(0.0)), Quadric::sphere(f64::NAN)));
    let error = save(&mut world, &folder.path().join("a.glb")).unwrap_err();
    assert!(matches!(&error, SaveError::Quadric { place, .. } if place == "ball"), "{error}");
    assert!(error.to_string().contains("LUMBRE_quadric") && error.to_string().contains("radius"), "{error}");
    assert_eq!(names_in(folder.path()), Vec::<String>::new());
}

#[test]
fn a_moved_primitive_becomes_a_node() {
    let mut world = World::new();
    let node = world.spawn((Name::new("table"), Transform::IDENTITY)).id();
    for index in 0..2 {
        let label = Primitive { index, mesh: "table".into(), material: "wood".into() };
        let moved = Transform::from_xyz(index as f64, 0.0, 0.0);
        let shading = if index == 0 { Shading::Flat } else { Shading::Phong };
        world.spawn((Mesh(triangle(0.0)), Material::default(), label, moved, shading, ChildOf(node)));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    assert_eq!(save(&mut world, &path).unwrap().notes.len(), 1);
    let mut again = World::new();
    load(&mut again, &path).unwrap();
    let mut found: Vec<(f64, Shading)> = again
        .query::<(&Mesh, &GlobalTransform, &Shading)>()
        .iter(&again)
        .map(|(_, transform, shading)| (transform.translation().x, *shading))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(found, [(0.0, Shading::Flat), (1.0, Shading::Phong)]);
}
