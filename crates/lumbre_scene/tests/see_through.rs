//! Import and export of the media of transmissive surfaces and of exact surfaces.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_scene::{Material, Medium, Mesh, Name, Quadric, QuadricShape, load_slice, save};

/// A .gltf with one triangle; `material` and `node` are the extensions of its material and node.
fn file(material: &str, node: &str) -> Vec<u8> {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"mesh":0,"extensions":{{{node}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "materials":[{{"extensions":{{{material}}}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}]}}"#
    )
    .into_bytes()
}

fn read(bytes: &[u8]) -> World {
    let mut world = World::new();
    load_slice(&mut world, bytes, "see_through.gltf", None).expect("the file is sound");
    world
}

#[test]
fn media_are_what_the_extensions_say() {
    let medium = |material: &str| {
        let mut world = read(&file(material, ""));
        world.query::<&Medium>().iter(&world).next().copied()
    };
    let transmission = r#""KHR_materials_transmission":{"transmissionFactor":0.5}"#;
    assert_eq!(medium(""), None);
    assert_eq!(medium(transmission), Some(Medium { thin: true, fresnel: true, ..Medium::default() }));
    let volume = r#""KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[0.5,0.25,1]}"#;
    let tinted = Medium {
        thin: false,
        fresnel: true,
        attenuation_color: Vec3::new(0.5, 0.25, 1.0),
        attenuation_distance: 2.0,
    };
    assert_eq!(medium(&format!("{transmission},{volume}")), Some(tinted));
    let own = r#""LUMBRE_materials_phong":{"transmission":[1,1,1],"thin":true}"#;
    assert_eq!(medium(own), Some(Medium { thin: true, ..Medium::default() }));
    let all = r#""LUMBRE_materials_phong":{"fresnelSplit":true,"attenuationColor":[0.5,0.25,1],"attenuationDistance":2}"#;
    assert_eq!(medium(all), Some(tinted));
    for (bad, field) in [
        (r#""KHR_materials_volume":{"attenuationDistance":0}"#, "attenuationDistance"),
        (r#""LUMBRE_materials_phong":{"attenuationColor":[2,0,0]}"#, "attenuationColor"),
    ] {
        let error =
            load_slice(&mut World::new(), &file(bad, ""), "bad.gltf", None).expect_err("it is refused");
        let words = format!("{error:#}");
        assert!(words.contains(field) && words.contains("materials[0]"), "{words}");
    }
}

#[test]
fn exact_surfaces_need_a_mesh_of_one_primitive_and_a_size() {
    let sphere = r#""LUMBRE_quadric":{"kind":"sphere","radius":0.5}"#;
    let mut world = read(&file("", sphere));
    let found: Vec<_> = world.query::<&Quadric>().iter(&world).cloned().collect();
    assert_eq!(found, [Quadric::sphere(0.5)]);
    let bad = file("", r#""LUMBRE_quadric":{"kind":"sphere","radius":-1}"#);
    let error = load_slice(&mut World::new(), &bad, "bad.gltf", None).expect_err("it is refused");
    assert!(format!("{error:#}").contains("LUMBRE_quadric"), "{error:#}");
    let two = String::from_utf8(file("", sphere)).expect("it is text");
    let primitive = r#"{"attributes":{"POSITION":0},"material":0}"#;
    let two = two.replace(primitive, &format!("{primitive},{primitive}"));
    let mut world = World::new();
    let report = load_slice(&mut world, two.as_bytes(), "two.gltf", None).expect("the file is sound");
    assert!(
        report.notes.iter().any(|note| note.to_string().contains("LUMBRE_quadric")),
        "{:?}",
        report.notes
    );
    assert_eq!(world.query::<&Quadric>().iter(&world).count(), 0);
}

/// The name of a surface, the surface, a measure of the distance of a point from it, and its area.
type KnownSurface = (&'static str, Quadric, fn(DVec3) -> f64, f64);

/// All kinds of surfaces.
fn surfaces() -> Vec<KnownSurface> {
    use std::f64::consts::PI;
    let general = |coefficients| Quadric::new(QuadricShape::General { coefficients });
    let ellipsoid = general([-4.0, -1.0, -4.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let trim = |low: DVec3, high: DVec3| Some([low, high]);
    let half_space = trim(DVec3::NEG_INFINITY.with_y(0.0), DVec3::INFINITY);
    let slant = f64::hypot(1.0, 0.5);
    vec![
        ("sphere", Quadric::sphere(2.0), |p| p.length() - 2.0, 16.0 * PI),
        (
            "half a sphere",
            Quadric { trim: half_space, ..Quadric::sphere(2.0) },
            |p| p.length() - 2.0,
            8.0 * PI,
        ),
        (
            "cylinder",
            Quadric::new(QuadricShape::Cylinder { radius: 0.5, height: 2.0, closed: false }),
            |p| p.x.hypot(p.z) - 0.5,
            2.0 * PI,
        ),
        (
            "closed cylinder, cut",
            Quadric {
                trim: trim(DVec3::new(0.0, -0.25, -9.0), DVec3::splat(9.0)),
                ..Quadric::new(QuadricShape::Cylinder { radius: 0.5, height: 2.0, closed: true })
            },
            |p| (p.x.hypot(p.z) - 0.5).max(p.y - 1.0),
            PI * 0.5 * 1.25 + 0.5 * PI * 0.25,
        ),
        (
            "cone",
            Quadric::new(QuadricShape::Cone { radius: 0.5, height: 1.0, closed: true }),
            |p| (p.x.hypot(p.z) - 0.5 * (0.5 - p.y)).max(-0.5 - p.y),
            PI * 0.5 * slant + PI * 0.25,
        ),
        (
            "plane",
            Quadric {
                trim: trim(DVec3::splat(-1.0), DVec3::new(3.0, 1.0, 1.0)),
                ..Quadric::new(QuadricShape::Plane)
            },
            |p| p.y,
            8.0,
        ),
        // 1 - 4 x² - (y - 1)² - 4 z²: an egg with its front inside, of a known area (a prolate spheroid).
        ("egg", ellipsoid, |p| 4.0 * p.x * p.x + (p.y - 1.0).powi(2) + 4.0 * p.z * p.z - 1.0, {
            let (a, c) = (0.5_f64, 1.0_f64);
            let e = (1.0 - a * a / (c * c)).sqrt();
            2.0 * PI * a * a * (1.0 + c / (a * e) * e.asin())
        }),
        // y = x² + z² up to 1.
        (
            "paraboloid",
            Quadric {
                trim: trim(DVec3::new(-1.5, -0.5, -1.5), DVec3::new(1.5, 1.0, 1.5)),
                ..general([1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0])
            },
            |p| p.x * p.x + p.z * p.z - p.y,
            PI / 6.0 * (5.0_f64.powf(1.5) - 1.0),
        ),
    ]
}

#[test]
fn meshes_of_exact_surfaces_converge_with_the_square_of_their_step() {
    for (name, quadric, apart, area) in surfaces() {
        quadric.validate().expect("a surface");
        let measured = [16, 32, 64].map(|segments| {
            let mesh = quadric.mesh(segments);
            mesh.validate().expect("a sound mesh");
            let [low, high] = quadric.bounds();
            let (mut sum, mut distances) = (0.0, 0.0);
            for triangle in mesh.triangles() {
                let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
                let normal =
                    triangle.map(|vertex| mesh.normals[vertex as usize].as_dvec3()).iter().sum::<DVec3>();
                let cross = (b - a).cross(c - a);
                sum += 0.5 * cross.length();
                assert!(cross.length() < 1e-7 || cross.dot(normal) > 0.0, "{name}: turned at {a}");
                distances += 0.5 * cross.length() * apart((a + b + c) / 3.0).abs();
            }
            let inside = mesh.positions.iter().all(|at| {
                let at = at.as_dvec3();
                at.cmpge(low - 1e-6).all() && at.cmple(high + 1e-6).all()
            });
            assert!(inside, "{name} leaves its trim");
            assert!(
                mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3),
                "{name}: normals"
            );
            ((sum - area).abs() / area, distances / sum)
        });
        println!("{name}: relative error of the area, and mean distance from the surface, {measured:?}");
        assert!(measured[0].0 < 0.06 && measured[2].0 < 0.004, "{name}: {measured:?}");
        for (coarse, fine) in [(measured[0], measured[1]), (measured[1], measured[2])] {
            // A quarter for half the step; not less than the rounding of f32.
            assert!(fine.0 < (0.32 * coarse.0).max(1e-6), "{name}: area {measured:?}");
            assert!(fine.1 < (0.32 * coarse.1).max(1e-6), "{name}: distance {measured:?}");
        }
    }
    // What is cut away completely has no mesh.
    let gone = Quadric { trim: Some([DVec3::splat(5.0), DVec3::splat(6.0)]), ..Quadric::sphere(2.0) };
    assert!(gone.mesh(64).indices.is_empty());
}

#[test]
fn exact_surfaces_without_a_mesh_get_one() {
    // In a file: the material is the extension's.
    let sphere = r#""LUMBRE_quadric":{"kind":"sphere","radius":0.5,"material":0}"#;
    let own = r#""LUMBRE_materials_phong":{"diffuse":[0.5,0.25,0.125]}"#;
    let bare = String::from_utf8(file(own, sphere)).expect("it is text").replace("\"mesh\":0,", "");
    let mut world = World::new();
    let report = load_slice(&mut world, bare.as_bytes(), "bare.gltf", None).expect("the file is sound");
    assert!(report.notes.is_empty(), "{:?}", report.notes);
    let mut found = world.query::<(&Quadric, &Mesh, &Material)>();
    let (quadric, mesh, material) = found.single(&world).expect("one surface");
    assert_eq!((quadric, material.front.diffuse), (&Quadric::sphere(0.5), Vec3::new(0.5, 0.25, 0.125)));
    let expected = quadric.mesh(Quadric::SEGMENTS);
    assert_eq!((&mesh.0.positions, &mesh.0.indices), (&expected.positions, &expected.indices));
    assert!(!expected.uv0.is_empty() && mesh.0.uv0 == expected.uv0, "textures lie as on one made in a World");
    // It comes back from a saved file with its mesh, for programs that know no exact surfaces.
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path = folder.path().join("bare.glb");
    let count = mesh.0.triangle_count();
    save(&mut world, &path).expect("it can be saved");
    let mut again = World::new();
    lumbre_scene::load(&mut again, &path).expect("it can be loaded");
    let mut found = again.query::<(&Quadric, &Mesh)>();
    let (quadric, mesh) = found.single(&again).expect("one surface");
    assert_eq!((quadric, mesh.0.triangle_count()), (&Quadric::sphere(0.5), count));
    // A surface without an end is noted, and one that is cut away is left out.
    for (json, word) in [
        (r#""LUMBRE_quadric":{"kind":"plane"}"#, "no end"),
        (r#""LUMBRE_quadric":{"kind":"sphere","min":[5,5,5],"max":[6,6,6]}"#, "nothing"),
    ] {
        let bare = String::from_utf8(file("", json)).expect("it is text").replace("\"mesh\":0,", "");
        let report =
            load_slice(&mut World::new(), bare.as_bytes(), "bare.gltf", None).expect("the file is sound");
        assert!(report.notes.iter().any(|note| note.to_string().contains(word)), "{:?}", report.notes);
    }
    // A larger one than f32 can hold is left out, and a wrong material is reported at its own field.
    let read_sphere = |members: &str| {
        let json = format!(r#""LUMBRE_quadric":{{"kind":"sphere",{members}}}"#);
        let bare = String::from_utf8(file("", &json)).expect("it is text").replace("\"mesh\":0,", "");
        load_slice(&mut World::new(), bare.as_bytes(), "bare.gltf", None)
    };
    let huge = read_sphere(r#""radius":1e60"#).expect("the file is sound");
    assert!(huge.notes.iter().any(|note| note.to_string().contains("f32")), "{:?}", huge.notes);
    let error =
        format!("{:#}", read_sphere(r#""radius":1,"material":7"#).expect_err("there is one material"));
    assert!(error.contains("LUMBRE_quadric.material"), "{error}");
    // In a World: on insertion, and again for another surface; a mesh of its own is kept.
    let mut world = World::new();
    let entity = world.spawn((Quadric::sphere(1.0), Material::default())).id();
    world.flush();
    let radius = |world: &World| world.get::<Mesh>(entity).map(|mesh| mesh.0.positions[0].length());
    assert_eq!(radius(&world), Some(1.0));
    world.entity_mut(entity).insert(Quadric::sphere(3.0));
    world.flush();
    assert_eq!(radius(&world), Some(3.0));
    let own = Arc::new(shapes::cuboid(Vec3::ONE, 1));
    let kept = world.spawn((Quadric::sphere(1.0), Mesh(own.clone()))).id();
    world.flush();
    assert!(world.get::<Mesh>(kept).is_some_and(|mesh| Arc::ptr_eq(&mesh.0, &own)));
}

#[test]
fn worlds_come_back_with_their_media_and_exact_surfaces() {
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path = folder.path().join("glass.glb");
    let mut world = World::new();
    let glass = Material {
        transmission: Vec3::ONE,
        mirror: Vec3::splat(0.1),
        ior: 1.7,
        ..Material::matt(Vec3::ZERO)
    };
    let medium = Medium {
        thin: false,
        fresnel: true,
        attenuation_color: Vec3::new(0.9, 0.5, 0.1),
        attenuation_distance: 0.3,
    };
    let shapes_of = [
        Quadric::sphere(1.0),
        Quadric::new(QuadricShape::Cone { radius: 0.5, height: 2.0, closed: false }),
        Quadric { trim: Some([DVec3::splat(-1.0), DVec3::ONE]), ..Quadric::new(QuadricShape::Plane) },
        // The upper half of a ball: the box is open on all other sides.
        Quadric { trim: Some([DVec3::NEG_INFINITY.with_y(0.0), DVec3::INFINITY]), ..Quadric::sphere(2.0) },
    ];
    let mesh = Arc::new(shapes::uv_sphere(1.0, 8, 4));
    for (number, quadric) in shapes_of.iter().enumerate() {
        let name = Name::new(format!("{number}"));
        world.spawn((name, Mesh(mesh.clone()), glass.clone(), medium, quadric.clone()));
    }
    save(&mut world, &path).expect("it can be saved");
    let mut again = World::new();
    lumbre_scene::load(&mut again, &path).expect("it can be loaded");
    let found: Vec<_> = again
        .query::<(&Quadric, &Medium, &Material)>()
        .iter(&again)
        .collect::<Vec<_>>()
        .into_iter()
        .map(|(quadric, medium, material)| (quadric.clone(), *medium, material.clone()))
        .collect();
    assert_eq!(found.len(), shapes_of.len());
    assert!(shapes_of.iter().all(|quadric| found.iter().any(|(found, ..)| found == quadric)), "{found:?}");
    for (_, found_medium, material) in &found {
        assert_eq!((*found_medium, material.mirror, material.ior), (medium, glass.mirror, glass.ior));
    }
}
