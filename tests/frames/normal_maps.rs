//! Normal maps and occlusion textures: bumps are oriented as their texels say, on both faces, mirrored, rotated and
//! scaled; occlusion weakens indirect light only; neither leaves anything behind in a scene without them.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DMat2, DQuat, DVec2, DVec3, Vec2, Vec3, Vec4};
use lumbre_mesh::{TextureCoordinateSet, TriangleMesh, shapes};
use lumbre_optics::{
    Light, Material, ReflectionModel, Shading, Surface, SurfaceSample, evaluate_light, shade,
};
use lumbre_render::{FrameOptions, explain};
use lumbre_scene::{
    Camera, Image, Lightmap, LightmapEncoding, LightmapImage, MaterialTextures, Mesh, Mipmap, NormalTexture,
    OcclusionTexture, Sampler, SceneSettings, TextureReference, Transform,
};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::panes::{EYE, image, orthographic, pane, pixel_point, pixel_uv, sharp};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};
use crate::textures::{self, SIZE};

/// Texels along a side of the maps in these tests.
const TEXELS: usize = 8;

/// f32 throughout: a texel of eight bits, three products and sums, and a root; then the exponent of 40 times the
/// roundings of the cosine.
const BOUND: f64 = 2e-5;

/// A map with slopes in all directions, all different.
fn bumps() -> Vec<[u8; 4]> {
    let texel = |at: usize| {
        let (x, y) = ((at % TEXELS) as f64, (at / TEXELS) as f64);
        let slope =
            DVec3::new((1.9 * x + 0.3 * y).sin() * 0.6, (1.3 * y - 0.7 * x).cos() * 0.5, 1.0).normalize();
        let byte = |number: f64| ((0.5 * number + 0.5) * 255.0).round() as u8;
        [byte(slope.x), byte(slope.y), byte(slope.z), 255]
    };
    (0..TEXELS * TEXELS).map(texel).collect()
}

/// Returns the vector of the texel at these coordinates: right, up and out of the picture.
fn vector_at(texels: &[[u8; 4]], uv: DVec2) -> DVec3 {
    let at = (uv - uv.floor()) * TEXELS as f64;
    let texel = texels[at.y as usize * TEXELS + at.x as usize];
    DVec3::new(texel[0].into(), texel[1].into(), texel[2].into()) / 127.5 - 1.0
}

/// Returns true if f32 may be on the other side of an edge between texels.
fn on_an_edge(uv: DVec2) -> bool {
    let at = uv * TEXELS as f64;
    (at - at.round()).abs().min_element() < 1e-4
}

fn normal_map(texels: &[[u8; 4]]) -> NormalTexture {
    NormalTexture { texture: sharp(&image(TEXELS as u32, texels)), scale: 1.0 }
}

fn with_map(map: NormalTexture) -> MaterialTextures {
    MaterialTextures { normal: Some(map), ..MaterialTextures::default() }
}

fn shiny() -> Material {
    let front = Surface {
        ambient: Vec3::splat(0.1),
        diffuse: Vec3::new(0.6, 0.5, 0.4),
        specular: Vec3::splat(0.5),
        emission: Vec3::ZERO,
        shininess: 40.0,
    };
    Material { front, ..Material::default() }
}

fn lamp() -> (Light, Transform) {
    (Light::point(Vec3::splat(3.0)), Transform::from_xyz(0.6, -0.4, 1.5))
}

/// A pane with textures and the given transform, a lamp, and a camera whose frame the pane fills exactly.
fn scene(mesh: TriangleMesh, textures: MaterialTextures, material: Material, place: Transform) -> World {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(mesh)), material, textures, place));
    world.spawn(lamp());
    world.spawn(orthographic());
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, ..SceneSettings::default() });
    world
}

/// Returns the colour of a pixel with a known unit normal, lit and seen from `side` (1 or -1 along z).
fn lit_pixel(x: usize, y: usize, normal: DVec3, side: f64) -> DVec3 {
    let (light, place) = lamp();
    let point = pixel_point(x, y, SIZE);
    let position = place.translation * DVec3::new(1.0, 1.0, side);
    let sample = evaluate_light(&light, position, DVec3::NEG_Z, point);
    let viewer = (DVec3::Z * EYE * side - point).normalize();
    let surface = SurfaceSample::new(&shiny(), true);
    shade(ReflectionModel::Phong, surface, DVec3::ONE, [sample], normal, viewer).total()
}

fn difference(world: &mut World, expected: impl Fn(usize, usize) -> Option<DVec3>) -> Difference {
    textures::difference(world, &linear(), expected)
}

#[test]
fn bumps_lean_where_their_texels_say() {
    let texels = bumps();
    let made = pane().with_tangents(TextureCoordinateSet::First).unwrap();
    for mesh in [pane(), made] {
        for scale in [1.0, 0.4, 0.0, -1.0] {
            let map = NormalTexture { scale, ..normal_map(&texels) };
            let mut world = scene(mesh.clone(), with_map(map), shiny(), Transform::IDENTITY);
            let factor = DVec3::new(scale.into(), scale.into(), 1.0);
            let normal = |x, y| (vector_at(&texels, pixel_uv(x, y, SIZE)) * factor).normalize();
            let right = difference(&mut world, |x, y| Some(lit_pixel(x, y, normal(x, y), 1.0)));
            assert!(right.largest < BOUND, "scale {scale}: {right:?}");
            // Negative controls: inverted green (as in DirectX's maps), and no map at all.
            let down = |x, y| Some(lit_pixel(x, y, normal(x, y) * DVec3::new(1.0, -1.0, 1.0), 1.0));
            let flat = |x, y| Some(lit_pixel(x, y, DVec3::Z, 1.0));
            for wrong in [difference(&mut world, down), difference(&mut world, flat)] {
                assert!(scale == 0.0 || wrong.largest > 0.1, "scale {scale}: {wrong:?}");
            }
        }
    }
}

#[test]
fn a_files_tangents_are_followed() {
    // Tangents that point up instead of right, with both handednesses: red leans along y, green along -x or x.
    let texels = bumps();
    for side in [1.0, -1.0] {
        let mesh = TriangleMesh { tangents: vec![Vec4::new(0.0, 1.0, 0.0, side as f32); 4], ..pane() };
        let mut world = scene(mesh, with_map(normal_map(&texels)), shiny(), Transform::IDENTITY);
        let expected = |x, y| {
            let vector = vector_at(&texels, pixel_uv(x, y, SIZE));
            let normal = DVec3::new(-side * vector.y, vector.x, vector.z).normalize();
            Some(lit_pixel(x, y, normal, 1.0))
        };
        let found = difference(&mut world, expected);
        assert!(found.largest < BOUND, "side {side}: {found:?}");
    }
}

#[test]
fn a_turned_picture_turns_its_bumps() {
    let texels = bumps();
    for (rotation, scale) in
        [(0.4, Vec2::ONE), (-2.5, Vec2::splat(1.5)), (0.0, Vec2::new(-1.0, 1.0)), (0.9, Vec2::new(1.0, -1.0))]
    {
        let mut map = normal_map(&texels);
        map.texture = TextureReference { rotation, scale, ..map.texture };
        let mut world = scene(pane(), with_map(map), shiny(), Transform::IDENTITY);
        // Texture coordinates after the transform, and how they change with (u, v).
        let (sin, cos) = f64::from(rotation).sin_cos();
        let turn = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
        let linear = turn * DMat2::from_diagonal(scale.as_dvec2());
        let inverse = linear.inverse();
        // The directions on the pane of the picture's right and up: u increases to the right, v downwards.
        let on_pane = |step: DVec2| DVec3::new(step.x, -step.y, 0.0).normalize();
        let (right, up) = (on_pane(inverse * DVec2::X), on_pane(inverse * DVec2::NEG_Y));
        let expected = |right: DVec3, up: DVec3| {
            let texels = &texels;
            move |x, y| {
                let uv = linear * pixel_uv(x, y, SIZE);
                let vector = vector_at(texels, uv);
                let normal = (vector.x * right + vector.y * up + vector.z * DVec3::Z).normalize();
                (!on_an_edge(uv)).then(|| lit_pixel(x, y, normal, 1.0))
            }
        };
        let found = difference(&mut world, expected(right, up));
        assert!(found.largest < BOUND, "{rotation} {scale}: {found:?}");
        let unturned = difference(&mut world, expected(DVec3::X, DVec3::Y));
        assert!(unturned.largest > 0.1, "{rotation} {scale}: a map that is not turned is told apart");
    }
}

#[test]
fn a_mirrored_node_shows_the_mirrored_bumps() {
    let texels = bumps();
    for scale in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(-1.0, -1.0, 1.0)] {
        let place = Transform { scale, ..Transform::IDENTITY };
        let mut world = scene(pane(), with_map(normal_map(&texels)), shiny(), place);
        let mirrored = |x: usize, y: usize| {
            (if scale.x < 0.0 { SIZE - 1 - x } else { x }, if scale.y < 0.0 { SIZE - 1 - y } else { y })
        };
        let expected = |factor: DVec3| {
            let texels = &texels;
            move |x, y| {
                let (u, v) = mirrored(x, y);
                let normal = (vector_at(texels, pixel_uv(u, v, SIZE)) * factor).normalize();
                Some(lit_pixel(x, y, normal, 1.0))
            }
        };
        let found = difference(&mut world, expected(scale));
        assert!(found.largest < BOUND, "{scale}: {found:?}");
        // Negative control: bumps that stay the same while the picture is mirrored.
        assert!(difference(&mut world, expected(DVec3::ONE)).largest > 0.1, "{scale}");
    }
}

#[test]
fn the_back_of_a_bump_is_a_dent() {
    let texels = bumps();
    // Seen and lit from behind: the pane is rotated by half a turn about its y axis, so that the picture appears
    // mirrored.
    let place = Transform::from_rotation(DQuat::from_rotation_y(std::f64::consts::PI));
    let material = Material { double_sided: true, ..shiny() };
    let mut world = scene(pane(), with_map(normal_map(&texels)), material, place);
    let expected = |outward: f64| {
        let texels = &texels;
        move |x: usize, y| {
            let vector = vector_at(texels, pixel_uv(SIZE - 1 - x, y, SIZE));
            // Rotated by half a turn, then reversed for the back.
            let normal = DVec3::new(-vector.x, vector.y, -vector.z).normalize();
            Some(lit_pixel(x, y, outward * normal, 1.0))
        }
    };
    let found = difference(&mut world, expected(-1.0));
    assert!(found.largest < BOUND, "{found:?}");
    // Without two-sided lighting it is lit like the front, which faces away from the lamp.
    world.resource_mut::<SceneSettings>().two_sided = false;
    let found = difference(&mut world, expected(1.0));
    assert!(found.largest < BOUND, "{found:?}");
}

#[test]
fn what_has_no_direction_is_as_if_there_were_no_map() {
    let plain = scene(pane(), MaterialTextures::default(), shiny(), Transform::IDENTITY);
    let flat = |mut world: World| draw(&mut world, SIZE as u32, SIZE as u32, &linear()).0;
    let expected = flat(plain);
    let bumpy = with_map(normal_map(&bumps()));
    let zero_texels = with_map(normal_map(&[[128, 127, 128, 255]; TEXELS * TEXELS]));
    let point = TriangleMesh { uv0: vec![Vec2::splat(0.3); 4], ..pane() };
    let line = TriangleMesh { uv0: pane().uv0.iter().map(|uv| Vec2::new(uv.x, uv.x)).collect(), ..pane() };
    let zero_tangents = TriangleMesh { tangents: vec![Vec4::ZERO; 4], ..pane() };
    let broken_tangents =
        TriangleMesh { tangents: vec![Vec4::new(f32::NAN, 1.0, f32::INFINITY, f32::NAN); 4], ..pane() };
    let mut no_scale = normal_map(&bumps());
    no_scale.texture.scale = Vec2::ZERO;
    for (name, mesh, textures) in [
        ("texels", pane(), zero_texels),
        ("coordinates in a point", point, bumpy.clone()),
        ("zero tangents", zero_tangents, bumpy.clone()),
        ("tangents that are no numbers", broken_tangents, bumpy.clone()),
        ("a transform to a point", pane(), with_map(no_scale)),
    ] {
        let got = flat(scene(mesh, textures, shiny(), Transform::IDENTITY));
        let largest =
            got.iter().zip(&expected).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max);
        // The exponent is converted to alpha^2 and back as 2/alpha^2 - 2.
        assert!(largest < BOUND, "{name}: {largest}");
    }
    // All of these pictures are finite, which `draw` checks.
    for (mesh, scale) in [(line, 1.0), (pane(), f32::NAN), (pane(), f32::MAX), (pane(), -1e30)] {
        let map = NormalTexture { scale, ..normal_map(&bumps()) };
        flat(scene(mesh, with_map(map), shiny(), Transform::IDENTITY));
    }
    let no_normals = TriangleMesh { normals: vec![Vec3::ZERO; 4], ..pane() };
    let dark = flat(scene(no_normals, bumpy, shiny(), Transform::IDENTITY));
    assert!(
        dark.iter().all(|pixel| (*pixel - 0.1).abs().max_element() < 1e-6),
        "ambient light only: {}",
        dark[0]
    );
}

/// Two bumpy tori, rotated and stretched, one of them mirrored, with a filtered map.
fn balls(model: ReflectionModel, double_sided: bool) -> World {
    let mut world = World::new();
    let texture = TextureReference {
        sampler: Sampler { mipmap: Mipmap::None, ..Sampler::default() },
        ..normal_map(&bumps()).texture
    };
    let turned = TextureReference {
        rotation: 0.5,
        scale: Vec2::splat(2.0),
        offset: Vec2::new(0.1, 0.3),
        ..texture.clone()
    };
    let mesh = Arc::new(shapes::torus(0.9, 0.4, 48, 24));
    let material = Material { double_sided, ..shiny() };
    for (x, texture, scale) in
        [(-1.6, texture.clone(), DVec3::new(1.0, 1.4, 0.7)), (1.6, turned, DVec3::new(-1.2, 0.8, 1.0))]
    {
        let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.9, 0.4, x);
        let place = Transform { translation: DVec3::new(x, 0.0, 0.0), rotation, scale };
        let textures = with_map(NormalTexture { texture, scale: 0.8 });
        world.spawn((Mesh(Arc::clone(&mesh)), material.clone(), textures, place));
    }
    for at in [DVec3::new(1.0, 3.0, 4.0), DVec3::new(-3.0, -1.0, 3.0)] {
        world.spawn((Light::point(Vec3::splat(9.0)), Transform::from_translation(at)));
    }
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 6.0)));
    let settings = SceneSettings { ambient: Vec3::splat(0.2), reflection: model, ..SceneSettings::default() };
    world.insert_resource(settings);
    world
}

#[test]
fn bumpy_bodies_agree_with_the_twin() {
    for model in ReflectionModel::ALL {
        for (double_sided, filtered) in [(false, false), (true, true)] {
            let mut world = balls(*model, double_sided);
            world.resource_mut::<SceneSettings>().specular_antialiasing = filtered;
            let expected = twin::draw(&mut world, 128, 128, TwinOptions::default());
            let (got, _) = draw(&mut world, 128, 128, &linear());
            let got: Vec<_> = got.into_iter().map(Some).collect();
            let expected = expected.inside_surfaces(false);
            let found = compare(&got, &expected);
            println!("{:16} two-sided {double_sided}, filtered {filtered}: {found:?}", model.name());
            assert!(found.pixels > 1500, "{found:?}");
            // Texture units have the weights between texels in 8 bits (the minimum precision of D3D and Vulkan):
            // 1/256 of the change between texels, up to 0.6 here, turns a normal by 2e-3, and the exponents of 40
            // and 160 turn that into this bound.
            const NEAR: f64 = 0.05;
            if *model == ReflectionModel::BlinnMatched {
                // Its exponent is 0 at grazing light, so its highlight ends there at full height, and a fragment on
                // that line may be on either side.
                let far = |(got, expected): (&Option<DVec3>, &Option<DVec3>)| {
                    got.zip(*expected).is_some_and(|(a, b)| (a - b).abs().max_element() > NEAR)
                };
                let far = got.iter().zip(&expected).filter(|pair| far(*pair)).count();
                assert!(far * 100 < found.pixels && found.mean < 3e-3, "{}: {far}, {found:?}", model.name());
            } else {
                assert!(found.largest < NEAR && found.relative_l2 < 5e-3, "{}: {found:?}", model.name());
            }
            // Negative control: the same objects without their maps.
            let mut plain = balls(*model, double_sided);
            let mapped: Vec<Entity> =
                plain.query_filtered::<Entity, With<MaterialTextures>>().iter(&plain).collect();
            mapped.into_iter().for_each(|entity| {
                plain.entity_mut(entity).remove::<MaterialTextures>();
            });
            let smooth = twin::draw(&mut plain, 128, 128, TwinOptions::default()).inside_surfaces(false);
            let wrong = compare(&got, &smooth);
            assert!(wrong.relative_l2 > 0.1, "{}: {wrong:?}", model.name());
        }
    }
}

#[test]
fn a_map_seen_from_afar_has_the_highlight_of_what_it_averages() {
    // Slopes that repeat many times within a pixel, under a light whose highlight is on the pane. The reference for
    // a pixel is a frame with sixteen times the resolution, without mip levels.
    let (size, finer) = (24u32, 16u32);
    let mut map = normal_map(&bumps());
    map.texture.scale = Vec2::splat(24.0 * 2.0);
    map.texture.sampler = Sampler::default();
    let frame = |map: Option<NormalTexture>, size: u32| {
        let textures = MaterialTextures { normal: map, ..MaterialTextures::default() };
        let mut world = scene(pane(), textures, shiny(), Transform::IDENTITY);
        world.resource_mut::<SceneSettings>().reflection = ReflectionModel::Blinn;
        draw(&mut world, size, size, &linear()).0
    };
    let mut bare = map.clone();
    bare.texture.sampler = Sampler { mipmap: Mipmap::None, ..Sampler::default() };
    let fine = frame(Some(bare), size * finer);
    let held: Vec<DVec3> = (0..size * size)
        .map(|at| {
            let (left, top) = (at % size * finer, at / size * finer);
            let samples = (0..finer * finer)
                .map(|i| fine[((top + i / finer) * size * finer + left + i % finer) as usize]);
            samples.sum::<DVec3>() / f64::from(finer * finer)
        })
        .collect();
    let error = |got: &[DVec3]| {
        let squares: f64 = got.iter().zip(&held).map(|(a, b)| (*a - *b).length_squared()).sum();
        (squares / held.iter().map(|pixel| pixel.length_squared()).sum::<f64>()).sqrt()
    };
    // Without the spread a minified map is a smooth plane with the plain highlight.
    let (filtered, smooth) = (error(&frame(Some(map), size)), error(&frame(None, size)));
    println!("relative error of a minified map: {filtered:.4}, without its spread {smooth:.4}");
    // The slopes reach 30 degrees, more than a lobe of one width can represent: measured 0.137 and 0.400.
    assert!(filtered < 0.15 && filtered < 0.4 * smooth, "{filtered} against {smooth}");
}

#[test]
fn no_map_leaves_nothing_behind() {
    let explained = |textures: MaterialTextures, options: &FrameOptions| {
        let mut world = scene(pane(), textures, shiny(), Transform::IDENTITY);
        explain(&mut world, options, 64, 64).unwrap()
    };
    let bumpy = with_map(normal_map(&bumps()));
    let options = linear();
    let with = explained(bumpy.clone(), &options);
    assert!(with.variants.keys().all(|variant| variant.contains("NORMAL_TEXTURE")), "{:?}", with.variants);
    assert!(with.to_text().contains("+ normal textures: 1 mesh with one"), "{}", with.to_text());
    let without = explained(MaterialTextures::default(), &options);
    assert!(without.variants.keys().all(|variant| !variant.contains("TEXTURE")), "{:?}", without.variants);
    assert!(without.to_text().contains("- normal textures: no material has one"));
    // Flat and Gouraud shading light no fragments: the same frames, bit for bit, and the same shaders.
    for shading in [Shading::Flat, Shading::Gouraud] {
        let options = FrameOptions { shading: Some(shading), ..linear() };
        let variants = |textures| explained(textures, &options).variants;
        assert_eq!(variants(bumpy.clone()), variants(MaterialTextures::default()));
        let frame = |textures| {
            let mut world = scene(pane(), textures, shiny(), Transform::IDENTITY);
            draw(&mut world, SIZE as u32, SIZE as u32, &options).0
        };
        assert_eq!(frame(bumpy.clone()), frame(MaterialTextures::default()), "{}", shading.name());
    }
    // A mesh with tangents and no map is drawn like one without tangents.
    let mesh = pane().with_tangents(TextureCoordinateSet::First).unwrap();
    let frame = |mesh| {
        let mut world = scene(mesh, MaterialTextures::default(), shiny(), Transform::IDENTITY);
        draw(&mut world, SIZE as u32, SIZE as u32, &linear()).0
    };
    assert_eq!(frame(mesh), frame(pane()));
}

fn occlusion_map(strength: f32) -> MaterialTextures {
    // Only red is read.
    let texels: Vec<[u8; 4]> = (0..TEXELS * TEXELS).map(|at| [(at * 4) as u8, 9, 200, 255]).collect();
    let texture = sharp(&image(TEXELS as u32, &texels));
    MaterialTextures {
        occlusion: Some(OcclusionTexture { texture, strength }),
        ..MaterialTextures::default()
    }
}

#[test]
fn occlusion_weakens_indirect_light_and_no_other() {
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let frame = |textures: MaterialTextures, ambient: f32, lit: bool| {
            let mut mesh = pane();
            mesh.uv1 = mesh.uv0.clone();
            let mut world = scene(mesh, textures, shiny(), Transform::IDENTITY);
            world.resource_mut::<SceneSettings>().ambient = Vec3::splat(ambient);
            if !lit {
                let lamp = world.query_filtered::<Entity, With<Light>>().single(&world).unwrap();
                world.despawn(lamp);
            } else {
                // Ambient light of the lamp itself, which stands for its bounces.
                let mut lights = world.query::<&mut Light>();
                lights.single_mut(&mut world).unwrap().ambient = Vec3::splat(ambient);
            }
            draw(&mut world, SIZE as u32, SIZE as u32, &options).0
        };
        for strength in [0.0, 0.6, 1.0] {
            let got = frame(occlusion_map(strength), 1.0, true);
            let (indirect_and_direct, direct) = (
                frame(MaterialTextures::default(), 1.0, true),
                frame(MaterialTextures::default(), 0.0, true),
            );
            for at in 0..SIZE * SIZE {
                let uv = pixel_uv(at % SIZE, at / SIZE, SIZE) * TEXELS as f64;
                let red = f64::from((uv.y as usize * TEXELS + uv.x as usize) as u8 * 4) / 255.0;
                let factor = 1.0 + f64::from(strength) * (red - 1.0);
                let expected = direct[at] + factor * (indirect_and_direct[at] - direct[at]);
                // Sums of numbers up to 4, in another order.
                let apart = (got[at] - expected).abs().max_element();
                assert!(apart < 3e-6, "{} strength {strength}: {} {expected}", shading.name(), got[at]);
            }
        }
        // Negative control: the pattern is strong enough to be visible.
        let occluded = frame(occlusion_map(1.0), 1.0, false);
        let whole = frame(MaterialTextures::default(), 1.0, false);
        let apart =
            occluded.iter().zip(&whole).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max);
        assert!(apart > 0.09, "{}: {apart}", shading.name());
    }
}

#[test]
fn occlusion_weakens_a_lightmap_and_bumps_leave_it_alone() {
    let baked = Vec3::new(0.5, 0.75, 1.0);
    let (encoding, texels) = (LightmapEncoding::Rgb32Float, vec![baked; 4]);
    let map = Arc::new(LightmapImage { name: "map".to_owned(), width: 2, height: 2, texels, encoding });
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        for (textures, occluded) in [(occlusion_map(1.0), true), (with_map(normal_map(&bumps())), false)] {
            let mut mesh = pane();
            mesh.uv1 = mesh.uv0.clone();
            let mut world = scene(mesh, textures, shiny(), Transform::IDENTITY);
            let lamp = world.query_filtered::<Entity, With<Light>>().single(&world).unwrap();
            world.despawn(lamp);
            let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
            world.entity_mut(entity).insert(Lightmap { image: Arc::clone(&map) });
            let got = draw(&mut world, SIZE as u32, SIZE as u32, &options).0;
            for (at, got) in got.iter().enumerate() {
                let uv = pixel_uv(at % SIZE, at / SIZE, SIZE) * TEXELS as f64;
                let red = f64::from((uv.y as usize * TEXELS + uv.x as usize) as u8 * 4) / 255.0;
                let factor = if occluded { red } else { 1.0 };
                let expected = shiny().front.diffuse.as_dvec3() * baked.as_dvec3() * factor;
                assert!((*got - expected).abs().max_element() < 1e-6, "{}: {got} {expected}", shading.name());
            }
        }
    }
}

#[test]
fn one_image_may_be_roughness_and_occlusion() {
    // The usual packing: red is occlusion, green roughness, blue metalness. It is uploaded once and read by both.
    let packed: Arc<Image> = image(1, &[[128, 200, 0, 255]]);
    let textures = MaterialTextures {
        metallic_roughness: Some(lumbre_scene::MetallicRoughnessTexture {
            texture: sharp(&packed),
            base_color: Vec3::splat(0.5),
            metallic: 1.0,
            roughness: 1.0,
            dielectric: Vec3::splat(0.04),
        }),
        occlusion: Some(OcclusionTexture { texture: sharp(&packed), strength: 1.0 }),
        ..MaterialTextures::default()
    };
    let mut world = scene(
        pane(),
        textures,
        Material::from_metallic_roughness(Vec3::splat(0.5), 0.0, 1.0),
        Transform::IDENTITY,
    );
    let lamp = world.query_filtered::<Entity, With<Light>>().single(&world).unwrap();
    world.despawn(lamp);
    let expected = DVec3::splat(0.5 * 128.0 / 255.0);
    let found = difference(&mut world, |_, _| Some(expected));
    assert!(found.largest < 1e-6, "{found:?}");
}
