//! Metals under baked light: a lightmap or an irradiance volume lights what stands for their highlight, in every
//! shading, with any lists and on either path; the highlights of baked lamps are not counted twice; under even light
//! a metal is as bright as paths say.

#![allow(clippy::print_stdout, reason = "the differences are what a reader of the output wants")]

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3, Vec2, Vec3, Vec4};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{
    BakeMode, ErrorBound, Light, Lobe, Material, ReflectionModel, Shading, SpotCone, SurfaceSample,
    lobe_albedo,
};
use lumbre_render::{FrameOptions, LightLists, RenderingPath};
use lumbre_scene::{
    AmbientCube, Camera, Census, EmissiveLight, IrradianceVolume, Lightmap, LightmapEncoding, LightmapImage,
    MaterialTextures, Mesh, MetallicRoughnessTexture, OcclusionTexture, Projection, SceneSettings,
    StaticObject, Transform,
};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::panes::{image, sharp};
use lumbre_tests::twin::{self, TwinOptions};
use lumbre_trace::{Integrator, TraceOptions, trace};

use crate::adapter::{draw, linear};

const SIZE: usize = 120;

/// Half floats of the lightmap, 2^-11, and of its filter's weights of eight bits, for light of at most 2 with steps
/// of at most 0.3; lobes as in the other comparisons with the twin.
const LARGEST: f64 = 2.0 / 2048.0 + 0.3 / 256.0 + 1e-3;

fn metal(base: Vec3, metallic: f32, roughness: f32) -> Material {
    Material::from_metallic_roughness(base, metallic, roughness)
}

fn lightmap(texels: Vec<Vec3>) -> Lightmap {
    let width = if texels.len() == 1 { 1 } else { 2 };
    let height = texels.len() as u32 / width;
    let encoding = LightmapEncoding::default();
    Lightmap { image: Arc::new(LightmapImage { name: "map".to_owned(), width, height, texels, encoding }) }
}

fn ball() -> TriangleMesh {
    let mut ball = shapes::uv_sphere(0.6, 20, 10);
    ball.uv1 = ball.positions.iter().map(|at| Vec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y)).collect();
    ball
}

/// Balls and a sheet that is seen from behind, from rough metal to plastic, in bright lightmaps, under baked lamps of
/// every kind and one that is not baked.
fn scene() -> World {
    let mut world = World::new();
    let texels =
        [Vec3::new(1.5, 1.2, 1.3), Vec3::new(1.4, 1.5, 1.2), Vec3::new(1.3, 1.4, 1.5), Vec3::splat(1.3)];
    let map = lightmap(texels.to_vec());
    let looks = [
        metal(Vec3::new(0.9, 0.7, 0.3), 1.0, 1.0),
        metal(Vec3::new(0.6, 0.7, 0.8), 1.0, 0.6),
        metal(Vec3::new(0.8, 0.4, 0.3), 0.4, 0.8),
        metal(Vec3::new(0.3, 0.6, 0.4), 0.0, 0.7),
    ];
    for (number, look) in looks.into_iter().enumerate() {
        let (x, y) = ((number % 2) as f64 * 1.4 - 0.7, (number / 2) as f64 * 1.4 - 0.5);
        world.spawn((Mesh::from(ball()), look, map.clone(), StaticObject, Transform::from_xyz(x, y, 0.0)));
    }
    let mut sheet = shapes::plane(2.6, 0.6, 6, 3);
    sheet.uv1.clone_from(&sheet.uv0);
    let two_sided = Material { double_sided: true, ..metal(Vec3::new(0.8, 0.8, 0.5), 1.0, 0.7) };
    let place = Transform::from_xyz(0.0, -1.5, 0.2).with_rotation(glam::DQuat::from_rotation_x(-2.1));
    world.spawn((Mesh::from(sheet), two_sided, map, StaticObject, place));
    let baked = |light: Light| Light { bake: BakeMode::Static, ..light };
    let cone = SpotCone::Smooth { inner: 0.3, outer: 0.6 };
    for (light, x) in [
        (baked(Light::point(Vec3::splat(2.0))), -2.0),
        (baked(Light::point(Vec3::new(1.0, 1.2, 0.8)).with_range(9.0)), -1.0),
        (baked(Light::spot(Vec3::splat(3.0), cone)), 0.0),
        (baked(Light::directional(Vec3::new(0.2, 0.1, 0.3))), 1.0),
        (Light { bake: BakeMode::Dynamic, ..Light::point(Vec3::new(0.5, 1.0, 0.5)) }, 2.0),
    ] {
        world.spawn((light, Transform::from_xyz(x, 1.5, 2.5).looking_at(DVec3::ZERO, DVec3::Y)));
    }
    world.insert_resource(SceneSettings { two_sided: true, ..SceneSettings::default() });
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.1, 4.4)));
    world
}

/// Adds a lamp in the form of a panel, whose light is baked.
fn add_panel(world: &mut World) {
    let place = Transform::from_xyz(0.5, 2.6, 1.0).with_rotation(glam::DQuat::from_rotation_x(2.6));
    let mut panel = Material::emissive(Vec3::splat(3.0));
    panel.double_sided = false;
    world.spawn((Mesh::from(shapes::plane(1.0, 0.6, 1, 1)), panel, EmissiveLight, StaticObject, place));
}

fn expected(world: &mut World, shading: Shading) -> Vec<Option<DVec3>> {
    let twin = TwinOptions { shading: Some(shading), ..TwinOptions::default() };
    twin::draw(world, SIZE, SIZE, twin).inside_surfaces(shading == Shading::Flat)
}

fn got(world: &mut World, options: &FrameOptions) -> Vec<Option<DVec3>> {
    draw(world, SIZE as u32, SIZE as u32, options).0.into_iter().map(Some).collect()
}

fn checked(name: &str, difference: &Difference, least: usize) {
    println!("{name}: {:.1e} at most of {LARGEST:.1e}", difference.largest);
    assert!(difference.pixels > least, "{name}: {difference:?}");
    assert!(difference.largest < LARGEST, "{name}: {difference:?}");
}

#[test]
fn every_shading_and_every_list_agrees_with_the_twin() {
    let mut world = scene();
    // All but the plastic ball.
    assert_eq!(Census::of(&mut world).baked_metals, 4);
    for shading in Shading::ALL {
        let expected = expected(&mut world, *shading);
        for light_lists in [LightLists::Everything, LightLists::Objects, LightLists::Clusters] {
            let deferred = [RenderingPath::Deferred, RenderingPath::DeferredCompute];
            for rendering_path in [RenderingPath::Forward].into_iter().chain(deferred) {
                let options =
                    FrameOptions { shading: Some(*shading), light_lists, rendering_path, ..linear() };
                let difference = compare(&got(&mut world, &options), &expected);
                let name = format!("{}, {light_lists:?}, {rendering_path:?}", shading.name());
                checked(&name, &difference, 400);
            }
        }
    }
    add_panel(&mut world);
    let with_panel = expected(&mut world, Shading::Phong);
    let options = FrameOptions { shading: Some(Shading::Phong), ..linear() };
    checked("panel", &compare(&got(&mut world, &options), &with_panel), 1500);
    // Without any light but the lightmap.
    let lamps: Vec<Entity> =
        world.query_filtered::<Entity, Or<(With<Light>, With<EmissiveLight>)>>().iter(&world).collect();
    lamps.into_iter().for_each(|lamp| _ = world.despawn(lamp));
    let alone = expected(&mut world, Shading::Phong);
    let frame = got(&mut world, &options);
    checked("no lamps", &compare(&frame, &alone), 1500);
    let bare = {
        let mut looks = world.query::<&mut Material>();
        looks.iter_mut(&mut world).for_each(|mut look| look.lobe = Lobe::Bare);
        let bare = got(&mut world, &options);
        looks.iter_mut(&mut world).for_each(|mut look| look.lobe = Lobe::EnergyConserving);
        bare
    };
    // Negative control: with bare lobes the metals are black.
    assert!(compare(&bare, &alone).largest > 0.3);
    // In a volume instead, with an occlusion texture.
    let objects: Vec<Entity> = world.query_filtered::<Entity, With<Lightmap>>().iter(&world).collect();
    for object in &objects {
        let occlusion = OcclusionTexture { texture: sharp(&image(1, &[[120; 4]])), strength: 0.9 };
        let textures = MaterialTextures { occlusion: Some(occlusion), ..MaterialTextures::default() };
        world.entity_mut(*object).remove::<Lightmap>().insert(textures);
    }
    let sides = [0.3, 0.5, 0.9, 0.6, 0.8, 0.4].map(Vec3::splat);
    let volume =
        IrradianceVolume { resolution: UVec3::ONE, cubes: vec![AmbientCube(sides)], inside: Vec::new() };
    world.spawn((volume, Transform::from_scale(8.0)));
    for lit in [false, true] {
        if lit {
            let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
            world.spawn((lamp, Transform::from_xyz(1.0, 1.5, 3.0)));
        }
        for shading in Shading::ALL {
            let in_volume = expected(&mut world, *shading);
            let options = FrameOptions { shading: Some(*shading), ..linear() };
            let name = format!("{} in a volume", shading.name());
            checked(&name, &compare(&got(&mut world, &options), &in_volume), 400);
        }
    }
    // A back with its own material, of which it shows most.
    let mut looks = world.query_filtered::<&mut Material, With<StaticObject>>();
    for mut look in looks.iter_mut(&mut world).filter(|look| look.double_sided) {
        look.back = Some(metal(Vec3::new(0.2, 0.5, 0.9), 1.0, 0.9).front);
    }
    for shading in Shading::ALL {
        let behind = expected(&mut world, *shading);
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        checked("own back", &compare(&got(&mut world, &options), &behind), 400);
    }
}

#[test]
fn shading_by_need_keeps_its_bound() {
    let mut world = scene();
    let mut with = |shading| got(&mut world, &FrameOptions { shading: Some(shading), ..linear() });
    let phong = with(Shading::Phong);
    let mut largest = 0.0;
    for max_error in [0.003, 0.03, 0.3, 1.0] {
        let difference =
            compare(&with(Shading::Auto { max_error: ErrorBound::new(max_error).unwrap() }), &phong);
        println!("{max_error}: {:.1e}", difference.largest);
        assert!(difference.largest <= f64::from(max_error) + 1e-5, "{max_error}: {difference:?}");
        largest = difference.largest;
    }
    assert!(largest > 1e-3, "nothing was shaded more cheaply");
}

/// A metal pane that fills the frame, with a lightmap of one texel.
fn pane(look: Material, arriving: Vec3) -> World {
    let mut world = World::new();
    let mut pane = shapes::plane(8.0, 8.0, 1, 1);
    pane.uv1 = vec![Vec2::splat(0.5); pane.positions.len()];
    let facing = Transform::from_rotation(glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    world.spawn((Mesh::from(pane), look, lightmap(vec![arriving]), StaticObject, facing));
    let projection = Projection::orthographic(1.0, 1.0, 10.0);
    world.spawn((Camera { projection, ..Camera::default() }, Transform::from_xyz(0.0, 0.0, 5.0)));
    world
}

#[test]
fn the_highlight_of_a_baked_lamp_is_not_counted_twice() {
    let look = metal(Vec3::new(0.9, 0.6, 0.4), 1.0, 0.8);
    let lamp = Light { bake: BakeMode::Static, ..Light::directional(Vec3::new(0.8, 0.6, 0.7)) };
    let place = Transform::from_xyz(1.0, 0.5, 2.0).looking_at(DVec3::ZERO, DVec3::Y);
    let cosine = (2.0 / 5.25_f64.sqrt()) as f32;
    let from_lamp = Vec3::new(0.8, 0.6, 0.7) * cosine;
    let middle = |world: &mut World| got(world, &linear())[SIZE * SIZE / 2 + SIZE / 2].unwrap();
    let reflectance = SurfaceSample::new(&look, true).reflectance_as_metal();
    let lit = |bounced: Vec3, shines: bool| {
        let mut world = pane(look.clone(), if shines { from_lamp + bounced } else { bounced });
        if shines {
            world.spawn((lamp.clone(), place));
        }
        middle(&mut world)
    };
    let highlight = lit(Vec3::ZERO, true);
    let bounced = Vec3::new(0.2, 0.3, 0.4);
    let both = lit(bounced, true);
    let reflected = reflectance * bounced.as_dvec3();
    assert!((lit(bounced, false) - reflected).abs().max_element() < 1e-3);
    assert!((both - highlight - reflected).abs().max_element() < 2e-3, "{both}, {highlight}, {reflected}");
    assert!(highlight.min_element() > 0.02, "{highlight}");
    // Negative control: a lamp that is not baked is added to the lightmap.
    let mut world = pane(look.clone(), from_lamp + bounced);
    world.spawn((Light { bake: BakeMode::Dynamic, ..lamp.clone() }, place));
    let twice = middle(&mut world);
    assert!(
        (twice - both - reflectance * from_lamp.as_dvec3()).abs().max_element() < 3e-3,
        "{twice}, {both}"
    );
    // Where the lamp is in shadow in the lightmap and its highlight has no shadow, no light is taken away.
    let mut world = pane(look, Vec3::ZERO);
    world.spawn((lamp, place));
    assert!((middle(&mut world) - highlight).abs().max_element() < 1e-3);
}

/// A metallic-roughness texture of one texel: green is roughness, blue is metallic.
fn slot(texel: [u8; 4], base_color: Vec3, roughness: f32) -> MetallicRoughnessTexture {
    let texture = sharp(&image(1, &[texel]));
    MetallicRoughnessTexture { texture, base_color, metallic: 1.0, roughness, dielectric: Vec3::splat(0.04) }
}

#[test]
fn textures_say_where_there_is_metal_as_rays_find_it() {
    let mut world = scene();
    add_panel(&mut world);
    let texels = [[255, 255, 255, 255], [255, 120, 255, 255], [255, 200, 0, 255], [255, 180, 128, 255]];
    let mut objects = world.query_filtered::<Entity, With<Lightmap>>();
    let objects: Vec<Entity> = objects.iter(&world).collect();
    for (object, texel) in objects.into_iter().zip(texels) {
        let slot = slot(texel, Vec3::new(0.9, 0.8, 0.6), 1.0);
        world.entity_mut(object).insert(MaterialTextures {
            base_color: Some(sharp(&image(1, &[[230, 180, 120, 255]]))),
            metallic_roughness: Some(slot),
            occlusion: Some(OcclusionTexture { texture: sharp(&image(1, &[[160; 4]])), strength: 0.8 }),
            ..MaterialTextures::default()
        });
    }
    let inside = expected(&mut world, Shading::Phong);
    let options = FrameOptions { shading: Some(Shading::Phong), ..linear() };
    let frame = got(&mut world, &options);
    let size = (SIZE as u32, SIZE as u32);
    let traced = |world: &mut World| -> Vec<Option<DVec3>> {
        let options = TraceOptions { size, depth: Some(0), shadows: false, ..TraceOptions::default() };
        let (picture, _) = trace(world, &options, &|_| ControlFlow::Continue(())).unwrap();
        picture.radiance.iter().zip(&inside).map(|(color, inside)| inside.map(|_| *color)).collect()
    };
    let difference = compare(&frame, &traced(&mut world));
    println!("{difference:?}");
    // One step of eight bits, as in other comparisons of frames and rays.
    assert!(difference.pixels > 1500 && difference.largest < LARGEST + 1.0 / 255.0, "{difference:?}");
    // Negative control: without metal it is another picture.
    let mut slots = world.query::<&mut MaterialTextures>();
    for mut slots in slots.iter_mut(&mut world) {
        if let Some(slot) = &mut slots.metallic_roughness {
            slot.metallic = 0.0;
        }
    }
    assert!(compare(&frame, &traced(&mut world)).largest > 0.1);
}

#[test]
fn textured_metal_is_the_same_in_every_shading() {
    // Under a distant light a pane has the same colour everywhere, however it is shaded.
    let from_lamp = Vec3::splat(0.6);
    let of = |shading: Shading, colors: bool| {
        let mut world = pane(metal(Vec3::ONE, 1.0, 0.7), from_lamp + Vec3::splat(0.5));
        let object = world.query_filtered::<Entity, With<Lightmap>>().single(&world).unwrap();
        if colors {
            let mut mesh = world.get_mut::<Mesh>(object).unwrap();
            let mesh = Arc::make_mut(&mut mesh.0);
            mesh.colors = vec![Vec4::new(0.2, 0.4, 0.6, 1.0); mesh.positions.len()];
        } else {
            let slot = slot([255; 4], Vec3::ONE, 0.7);
            world.entity_mut(object).insert(MaterialTextures {
                base_color: Some(sharp(&image(1, &[[120, 180, 220, 255]]))),
                metallic_roughness: Some(slot),
                ..MaterialTextures::default()
            });
        }
        let sun =
            Light { bake: BakeMode::Static, specular: Vec3::splat(1e-6), ..Light::directional(from_lamp) };
        world.spawn((sun, Transform::from_xyz(0.0, 0.0, 5.0).looking_at(DVec3::ZERO, DVec3::Y)));
        let options = FrameOptions { shading: Some(shading), ..linear() };
        got(&mut world, &options)[SIZE * SIZE / 2 + SIZE / 2].unwrap()
    };
    for colors in [false, true] {
        let [flat, gouraud, phong] =
            [Shading::Flat, Shading::Gouraud, Shading::Phong].map(|shading| of(shading, colors));
        println!("{flat} {gouraud} {phong}");
        // What the sun does not bring, in the colour of the metal.
        assert!(phong.x > 0.01 && phong.z > 1.5 * phong.x, "{phong}");
        for other in [flat, gouraud] {
            assert!((other - phong).abs().max_element() < 1e-3, "{other} {phong}");
        }
    }
}

#[test]
fn what_mirrors_or_transmits_light_is_no_metal() {
    let mirror = Material { mirror: Vec3::splat(0.5), ..metal(Vec3::ONE, 1.0, 0.3) };
    let glass = Material { transmission: Vec3::splat(0.5), ..metal(Vec3::ONE, 1.0, 0.3) };
    for look in [mirror, glass] {
        let mut world = pane(look, Vec3::ONE);
        assert_eq!(Census::of(&mut world).baked_metals, 0);
        let options = FrameOptions { refraction: false, ..linear() };
        let seen = got(&mut world, &options)[SIZE * SIZE / 2 + SIZE / 2].unwrap();
        assert_eq!(seen, DVec3::ZERO);
    }
}

/// A metal ball in even light, by a volume, seen from afar.
fn ball_in_even_light(roughness: f32) -> World {
    let mut world = World::new();
    let ball = Mesh::from(shapes::uv_sphere(0.9, 64, 32));
    world.spawn((ball, metal(Vec3::ONE, 1.0, roughness), Transform::IDENTITY));
    let cubes = vec![AmbientCube([Vec3::ONE; 6])];
    let volume = IrradianceVolume { resolution: UVec3::ONE, cubes, inside: Vec::new() };
    world.spawn((volume, Transform::from_scale(8.0)));
    let projection = Projection::orthographic(1.0, 1.0, 10.0);
    world.spawn((Camera { projection, ..Camera::default() }, Transform::from_xyz(0.0, 0.0, 5.0)));
    world.insert_resource(SceneSettings {
        sky: Vec3::ONE,
        reflection: ReflectionModel::TorranceSparrow,
        ..SceneSettings::default()
    });
    world
}

/// The mean over the disc of a ball is the mean over its normals, weighted by their cosines: the albedo.
#[test]
fn in_even_light_a_metal_is_as_bright_as_paths_say() {
    for roughness in [1.0, 0.7, 0.4] {
        let mut world = ball_in_even_light(roughness);
        let (frame, _) = draw(&mut world, 64, 64, &linear());
        let options = TraceOptions {
            size: (64, 64),
            integrator: Integrator::Path,
            samples: Some(64),
            ..TraceOptions::default()
        };
        let (picture, _) = trace(&mut world, &options, &|_| ControlFlow::Continue(())).unwrap();
        let on_disc = |pixels: &[DVec3]| {
            let inside = |at: usize| {
                let [x, y] = [at % 64, at / 64].map(|place| (place as f64 + 0.5) / 32.0 - 1.0);
                x * x + y * y < 0.895 * 0.895
            };
            let seen: Vec<f64> = (0..64 * 64).filter(|at| inside(*at)).map(|at| pixels[at].y).collect();
            seen.iter().sum::<f64>() / seen.len() as f64
        };
        let [shown, true_mean] = [on_disc(&frame), on_disc(&picture.radiance)];
        println!("roughness {roughness}: {shown:.4}, by paths {true_mean:.4}");
        let shininess = SurfaceSample::new(&metal(Vec3::ONE, 1.0, roughness), true).shininess;
        assert!((shown - lobe_albedo(shininess)).abs() < 2e-3);
        assert!((shown / true_mean - 1.0).abs() < 0.02, "{roughness}: {shown}, {true_mean}");
    }
}
