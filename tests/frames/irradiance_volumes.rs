//! Irradiance volumes: objects without a lightmap receive the baked light around them, in every shading, only once,
//! and without light from inside walls. The frame agrees with the f64 twin, and the traced picture with the frame;
//! a ball that is carried through a baked room has the colour of its surroundings, compared with path tracing.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, UVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, Density, Probes, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material, Shading, Surface};
use lumbre_render::{FrameOptions, explain};
use lumbre_scene::{
    AmbientCube, Camera, DynamicObject, IrradianceVolume, Lightmap, LightmapEncoding, LightmapImage,
    MaterialTextures, Mesh, Name, NormalTexture, OcclusionTexture, SceneSettings, StaticObject, Transform,
};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::panes::{image, sharp};
use lumbre_tests::twin::{self, TwinOptions};
use lumbre_trace::{Integrator, TraceOptions, trace};

use crate::adapter::{Canvas, draw, gpu, linear};

const SIZE: usize = 96;

/// Half floats of the probes' light, 2^-11 relative, and a filter's weights of eight bits along each of three axes,
/// for light up to 1.5 with steps up to 1 between probes, reflected with at most 0.9. Software rounds the weights to
/// 2^-9; graphics processors may also cut them off, to 2^-8 (Vulkan does not say which). An NVIDIA H100 is off by
/// 4.1e-2 at one of 2,558 pixels.
fn bound() -> f64 {
    // Beside probes inside of walls the light is divided by the sum of the others' weights, here a quarter or more.
    let weight = if gpu().is_software() { 1.0 / 512.0 } else { 1.0 / 256.0 / 0.25 };
    0.9 * (1.5 / 2048.0 + 3.0 * weight)
}

/// Pseudo-random numbers that are the same in every run.
fn numbers(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Light between 0.5 and 1.5, different in every cell and for every side.
fn varied(resolution: UVec3, seed: u64) -> IrradianceVolume {
    let mut number = numbers(seed);
    let mut light = || 0.5 + Vec3::new(number(), number(), number());
    let cubes = (0..resolution.element_product()).map(|_| AmbientCube([(); 6].map(|()| light()))).collect();
    IrradianceVolume { resolution, cubes, inside: Vec::new() }
}

/// The same light everywhere.
fn even(light: Vec3) -> IrradianceVolume {
    IrradianceVolume { resolution: UVec3::ONE, cubes: vec![AmbientCube([light; 6])], inside: Vec::new() }
}

fn ball(radius: f32) -> Mesh {
    let mut ball = shapes::uv_sphere(radius, 16, 8);
    ball.uv1.clone_from(&ball.uv0);
    Mesh(Arc::new(ball))
}

/// Two balls and a sheet, one of them with its own lightmap, under lights of every kind and two ambient ones.
fn scene() -> World {
    let mut world = World::new();
    let front = Surface {
        ambient: Vec3::new(0.9, 0.2, 0.4),
        diffuse: Vec3::new(0.3, 0.9, 0.6),
        specular: Vec3::splat(0.2),
        shininess: 20.0,
        ..Surface::default()
    };
    let material = Material { front, ..Material::default() };
    world.spawn((ball(0.6), material.clone(), Transform::from_xyz(-0.7, 0.2, 0.0)));
    let lightmap = LightmapImage {
        name: "map".to_owned(),
        width: 2,
        height: 2,
        texels: vec![Vec3::new(0.4, 0.3, 0.2); 4],
        encoding: LightmapEncoding::default(),
    };
    let baked = (Lightmap { image: Arc::new(lightmap) }, StaticObject);
    world.spawn((ball(0.6), material, Transform::from_xyz(0.8, 0.2, 0.0), baked));
    // A sheet that is seen from behind.
    let back = Surface { diffuse: Vec3::new(0.8, 0.3, 0.1), ..front };
    let sheet = Material { back: Some(back), double_sided: true, front, ..Material::default() };
    let place = Transform::from_xyz(0.0, -0.9, 0.2).with_rotation(DQuat::from_rotation_x(-2.1));
    world.spawn((Mesh(Arc::new(shapes::plane(2.0, 0.8, 6, 3))), sheet, place));
    for (light, x) in [
        (Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(2.0)) }, -2.0),
        (Light { bake: BakeMode::Mixed, ..Light::point(Vec3::new(0.5, 2.0, 0.5)) }, 2.0),
        (Light { bake: BakeMode::Dynamic, ..Light::directional(Vec3::new(0.2, 0.1, 0.3)) }, 0.0),
        (Light::ambient(Vec3::new(0.1, 0.3, 0.2)), 0.0),
    ] {
        world.spawn((light, Transform::from_xyz(x, 1.5, 2.5).looking_at(DVec3::ZERO, DVec3::Y)));
    }
    world.insert_resource(SceneSettings {
        ambient: Vec3::new(0.3, 0.1, 0.2),
        sky: Vec3::new(0.1, 0.2, 0.4),
        ..SceneSettings::default()
    });
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.1, 3.6)));
    world
}

/// Adds a volume with cells that are not cubes to a world; the balls extend beyond it.
fn place(world: &mut World, volume: IrradianceVolume) -> Entity {
    let box_of_probes = Transform::from_xyz(0.1, 0.0, -0.1).with_scale(DVec3::new(2.2, 1.6, -1.3));
    world.spawn((volume, box_of_probes)).id()
}

fn against_the_twin(world: &mut World, shading: Shading) -> Difference {
    let options = FrameOptions { shading: Some(shading), ..linear() };
    let (got, _) = draw(world, SIZE as u32, SIZE as u32, &options);
    let twin = TwinOptions { shading: Some(shading), ..TwinOptions::default() };
    let expected = twin::draw(world, SIZE, SIZE, twin).inside_surfaces(shading == Shading::Flat);
    compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected)
}

#[test]
fn every_shading_agrees_with_the_twin_and_counts_nothing_twice() {
    for shading in Shading::ALL {
        let mut world = scene();
        let mut volume = varied(UVec3::new(3, 2, 4), 3);
        volume.inside = (0..24).map(|probe| probe % 7 == 3).collect();
        let volume = place(&mut world, volume);
        let mut worst = against_the_twin(&mut world, *shading);
        assert!(worst.pixels > 400, "{worst:?}");
        // With normal and occlusion textures.
        let mut bare = world.query_filtered::<Entity, (With<Mesh>, Without<Lightmap>)>();
        let bare = bare.iter(&world).next().unwrap();
        let texels = [[150, 90, 240, 255], [100, 160, 220, 255], [60, 128, 230, 255], [128, 200, 200, 255]];
        world.entity_mut(bare).insert(MaterialTextures {
            normal: (*shading == Shading::Phong)
                .then(|| NormalTexture { texture: sharp(&image(1, &texels[..1])), scale: 1.0 }),
            occlusion: Some(OcclusionTexture { texture: sharp(&image(1, &texels[1..2])), strength: 0.8 }),
            ..MaterialTextures::default()
        });
        let textured = against_the_twin(&mut world, *shading);
        // Without any other light.
        let lamps: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(&world).collect();
        lamps.into_iter().for_each(|lamp| {
            world.despawn(lamp);
        });
        let alone = against_the_twin(&mut world, *shading);
        for difference in [textured, alone] {
            worst.largest = worst.largest.max(difference.largest);
        }
        println!("{}: {:.1e} at most of {:.1e}", shading.name(), worst.largest, bound());
        assert!(worst.largest < bound(), "{}: {worst:?}", shading.name());
        // Negative control: different light in one cell is detected.
        let mut changed = world.get_mut::<IrradianceVolume>(volume).unwrap();
        changed.cubes[8].0.iter_mut().for_each(|side| *side += 0.3);
        let (other, _) = draw(&mut world, 24, 24, &linear());
        world.get_mut::<IrradianceVolume>(volume).unwrap().cubes[8]
            .0
            .iter_mut()
            .for_each(|side| *side -= 0.3);
        let (own, _) = draw(&mut world, 24, 24, &linear());
        assert!(own != other);
    }
}

#[test]
fn even_light_is_exact_wherever_a_ball_goes() {
    let mut world = World::new();
    world.spawn((ball(0.5), Material::matt(Vec3::splat(0.5))));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.0)));
    // Ambient light that the volume replaces.
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.7), ..SceneSettings::default() });
    let volume = world.spawn((even(Vec3::new(0.5, 1.0, 0.25)), Transform::IDENTITY)).id();
    let mut canvas = Canvas::new(40, 40);
    let resolutions = [UVec3::ONE, UVec3::new(1, 5, 1), UVec3::new(4, 3, 2)];
    for (resolution, scale) in resolutions.into_iter().zip([1.0, 1e-6, 1e4]) {
        let cubes = vec![AmbientCube([Vec3::new(0.5, 1.0, 0.25); 6]); resolution.element_product() as usize];
        let inside = (0..cubes.len()).map(|probe| probe % 3 == 1).collect();
        world
            .entity_mut(volume)
            .insert((IrradianceVolume { resolution, cubes, inside }, Transform::from_scale(scale)));
        // With the ball within the box, on its face, and far outside.
        for x in [0.0, 0.5 * scale, -30.0 * scale] {
            world.get_mut::<Transform>(volume).unwrap().translation.x = x;
            let (pixels, report) = canvas.draw(&mut world, &linear());
            assert_eq!(report.left_out, [""; 0]);
            let lit: Vec<_> = pixels.iter().filter(|pixel| **pixel != DVec3::ZERO).collect();
            assert!(lit.len() > 100, "{}", lit.len());
            let expected = DVec3::new(0.25, 0.5, 0.125);
            let worst = lit.iter().map(|pixel| (**pixel - expected).abs().max_element()).fold(0.0, f64::max);
            assert!(worst < 1e-6, "{resolution} {scale} {x}: {worst}");
        }
    }
    // The replaced ambient light is back when the volume is removed or switched off.
    let options = FrameOptions { irradiance_volumes: false, ..linear() };
    let (off, _) = canvas.draw(&mut world, &options);
    world.despawn(volume);
    let (gone, _) = canvas.draw(&mut world, &linear());
    assert!(off == gone && gone.iter().any(|pixel| (pixel.x - 0.35).abs() < 1e-6));
}

#[test]
fn what_is_bright_behind_a_wall_does_not_shine_through_it() {
    // A dark room and a bright one, and between them a wall in whose cell the bake has put the mean of both.
    let lights = [0.1, 0.1, 5.05, 10.0, 10.0];
    let cubes = lights.map(|light| AmbientCube([Vec3::splat(light); 6])).to_vec();
    let volume = |inside: Vec<bool>| IrradianceVolume {
        resolution: UVec3::new(5, 1, 1),
        cubes: cubes.clone(),
        inside,
    };
    let brightest = |inside: Vec<bool>| {
        let mut world = World::new();
        world.spawn((volume(inside), Transform::from_scale(5.0)));
        // The ball touches the wall, whose face is at x = -0.5.
        world.spawn((ball(0.5), Material::matt(Vec3::ONE), Transform::from_xyz(-1.01, 0.0, 0.0)));
        world.spawn((Camera::default(), Transform::from_xyz(-1.0, 0.0, 3.0)));
        let (pixels, _) = draw(&mut world, 60, 60, &linear());
        pixels.iter().map(|pixel| pixel.x).fold(0.0, f64::max)
    };
    let marked = brightest(vec![false, false, true, false, false]);
    // Half a cell away the wall's probe has 1/1024 of the weight of the other: 5.05 and 0.1, and half floats.
    let bound = (0.1 + 5.05 / 1024.0) * (1.0 + 2.0 / 1024.0);
    println!("beside a wall: {marked:.4}; without marks {:.2}", brightest(Vec::new()));
    assert!(marked < bound, "{marked} of {bound}");
    // Negative control.
    assert!(brightest(Vec::new()) > 2.0);
}

#[test]
fn each_object_takes_the_volume_around_it() {
    let mut world = World::new();
    for (x, light) in [(-1.0, Vec3::X), (1.0, Vec3::Y)] {
        world.spawn((even(light), Transform::from_xyz(x, 0.0, 0.0).with_scale(DVec3::splat(2.0))));
        for height in [-0.6, 0.6] {
            world.spawn((ball(0.4), Material::matt(Vec3::ONE), Transform::from_xyz(x, height, 0.0)));
        }
    }
    // A smaller volume within the second one, which the upper ball on the right takes.
    world.spawn((even(Vec3::Z), Transform::from_xyz(1.0, 0.6, 0.0)));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 4.0)));
    let (pixels, _) = draw(&mut world, 64, 64, &linear());
    let seen = |x: usize, y: usize| pixels[y * 64 + x];
    assert_eq!([seen(15, 22), seen(15, 42)], [DVec3::X; 2]);
    assert_eq!([seen(48, 22), seen(48, 42)], [DVec3::Z, DVec3::Y]);
}

#[test]
fn volumes_that_cannot_be_used_are_named_and_left_out() {
    let without = draw(&mut scene(), SIZE as u32, SIZE as u32, &linear()).0;
    let fine = || varied(UVec3::new(2, 1, 1), 1);
    let nan = |mut volume: IrradianceVolume| {
        volume.cubes[1].0[4].y = f32::NAN;
        volume
    };
    let cases: [(&str, IrradianceVolume, Transform); 6] = [
        ("ambient cubes", IrradianceVolume { cubes: Vec::new(), ..fine() }, Transform::IDENTITY),
        ("finite", nan(fine()), Transform::IDENTITY),
        ("inside", IrradianceVolume { inside: vec![true], ..fine() }, Transform::IDENTITY),
        ("rotated", fine(), Transform::from_rotation(DQuat::from_rotation_y(0.3))),
        ("measures", fine(), Transform::from_scale(0.0)),
        ("no place", fine(), Transform::from_scale(f64::NAN)),
    ];
    for (word, volume, place) in cases {
        let mut world = scene();
        world.spawn((Name::new("broken"), volume, place));
        let (pixels, report) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
        let [fault] = &report.left_out[..] else { panic!("{word}: {:?}", report.left_out) };
        assert!(fault.contains("irradiance volume `broken`") && fault.contains(word), "{word}: {fault}");
        assert!(pixels == without, "{word}: not the frame without it");
        assert_eq!(report.census.irradiance_volumes, 0);
        // Another volume that can be used still is.
        self::place(&mut world, fine());
        let (pixels, report) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
        assert!(pixels != without && report.census.irradiance_volumes == 1 && report.left_out.len() == 1);
    }
}

#[test]
fn light_that_changes_or_moves_is_seen() {
    let mut world = scene();
    let volume = place(&mut world, varied(UVec3::new(2, 2, 2), 5));
    let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
    let mut former = Vec::new();
    let changes: [&dyn Fn(&mut World); 5] = [
        &|_| (),
        &|world| world.get_mut::<IrradianceVolume>(volume).unwrap().cubes[2].0[1] = Vec3::X,
        &|world| world.get_mut::<Transform>(volume).unwrap().translation.y += 0.4,
        &|world| world.get_mut::<IrradianceVolume>(volume).unwrap().inside = vec![true; 8],
        &|world| *world.get_mut::<IrradianceVolume>(volume).unwrap() = even(Vec3::Y),
    ];
    for (number, change) in changes.iter().enumerate() {
        change(&mut world);
        let (pixels, report) = canvas.draw(&mut world, &linear());
        assert!(pixels == draw(&mut world, SIZE as u32, SIZE as u32, &linear()).0, "change {number}");
        // Marking all probes changes only weights, not the light.
        assert_eq!(pixels != former, number != 3, "change {number}: is it seen?");
        assert!(report.statistics.uploads.irradiance_volumes > 0, "change {number}");
        former = pixels;
        let (again, report) = canvas.draw(&mut world, &linear());
        assert!(again == former && report.statistics.uploads.irradiance_volumes == 0);
    }
}

#[test]
fn the_ray_tree_reads_what_a_frame_reads() {
    let mut world = scene();
    place(&mut world, varied(UVec3::new(3, 2, 4), 3));
    let options = FrameOptions { shading: Some(Shading::Phong), ..linear() };
    let (frame, _) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
    let interior = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
    let mut differences = [true, false].map(|irradiance_volumes| {
        let size = (SIZE as u32, SIZE as u32);
        let options = TraceOptions {
            size,
            depth: Some(0),
            shadows: false,
            irradiance_volumes,
            ..TraceOptions::default()
        };
        let (picture, _) = trace(&mut world, &options, &|_| ControlFlow::Continue(())).unwrap();
        let inside = |(color, inside): (&DVec3, &Option<DVec3>)| inside.map(|_| *color);
        let traced: Vec<_> = picture.radiance.iter().zip(&interior).map(inside).collect();
        compare(&frame.iter().copied().map(Some).collect::<Vec<_>>(), &traced)
    });
    // The same bound, plus one eight-bit step, as in other comparisons of frames and rays.
    assert!(differences[0].largest < bound() + 1.0 / 255.0, "{:?}", differences[0]);
    differences.reverse();
    assert!(differences[0].largest > 0.1, "negative control: {:?}", differences[0]);
}

#[test]
fn explain_says_where_a_volume_is_missing() {
    let mut world = scene();
    let line = |world: &mut World| {
        let explained = explain(world, &FrameOptions::default(), 64, 64).unwrap();
        let lines = explained.census.lines();
        lines.into_iter().find(|line| line.effect == "irradiance volumes").unwrap()
    };
    assert_eq!(line(&mut world).reason, "no volume, and nothing moves");
    let bare: Vec<Entity> =
        world.query_filtered::<Entity, (With<Mesh>, Without<Lightmap>)>().iter(&world).collect();
    world.entity_mut(bare[0]).insert(DynamicObject);
    let proposed = line(&mut world);
    assert!(!proposed.called_for && proposed.reason.contains("1 mesh moves: `lumbre bake`"), "{proposed:?}");
    let volume = place(&mut world, even(Vec3::ONE));
    let used = line(&mut world);
    assert_eq!(
        (used.called_for, used.count, used.reason.as_str()),
        (true, 2, "2 meshes without a lightmap, lit by 1 volume")
    );
    for entity in bare {
        world.despawn(entity);
    }
    assert_eq!(line(&mut world).reason, "1 volume, and no lit mesh without a lightmap");
    world.despawn(volume);
}

/// A room of 6 m by 3 m by 4 m, red on the left, green on the right, white elsewhere, with a lamp under its ceiling
/// and a block in it.
fn room() -> World {
    let mut world = World::new();
    let half = Vec3::new(3.0, 1.5, 2.0);
    let walls = [
        (Vec3::X, Vec3::new(0.75, 0.1, 0.1)),
        (Vec3::NEG_X, Vec3::new(0.1, 0.7, 0.15)),
        (Vec3::Y, Vec3::splat(0.7)),
        (Vec3::NEG_Y, Vec3::splat(0.7)),
        (Vec3::Z, Vec3::splat(0.7)),
        (Vec3::NEG_Z, Vec3::splat(0.7)),
    ];
    let matt = |color: Vec3, emission: Vec3| Material {
        front: Surface { ambient: color, diffuse: color, emission, ..Surface::default() },
        ..Material::default()
    };
    for (normal, color) in walls {
        let (middle, u) = (-normal * half, normal.any_orthogonal_vector().normalize());
        let v = normal.cross(u);
        let corner = |a: f32, b: f32| middle + (a * u + b * v) * half;
        let mesh = TriangleMesh {
            positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            normals: vec![normal; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..TriangleMesh::default()
        };
        world.spawn((Mesh(Arc::new(mesh)), matt(color, Vec3::ZERO), StaticObject));
    }
    let lamp = Mesh(Arc::new(shapes::cuboid(Vec3::new(1.2, 0.05, 0.8), 1)));
    let place = |x: f64, y: f64, z: f64| Transform::from_xyz(x, y, z);
    world.spawn((lamp, matt(Vec3::splat(0.2), Vec3::splat(9.0)), StaticObject, place(0.0, 1.45, 0.0)));
    let block = Mesh(Arc::new(shapes::cuboid(Vec3::new(0.8, 1.6, 0.8), 1)));
    world.spawn((block, matt(Vec3::splat(0.6), Vec3::ZERO), StaticObject, place(1.4, -0.7, -0.8)));
    world
}

/// The path of the ball from the red wall to the green one, in front of and behind the block.
const WAY: [[f64; 3]; 6] = [
    [-2.5, -0.6, 0.0],
    [-1.2, 0.4, 0.8],
    [0.0, -0.3, 0.6],
    [0.8, -0.9, 0.2],
    [1.6, 0.6, 0.9],
    [2.5, -0.4, 0.3],
];

#[test]
fn a_ball_takes_the_colour_of_its_surroundings_against_paths() {
    let mut world = room();
    let carried = shapes::uv_sphere(0.25, 32, 16);
    let carried = (Mesh(Arc::new(carried)), Material::matt(Vec3::splat(0.5)), DynamicObject);
    let carried = world.spawn((carried, Transform::IDENTITY)).id();
    let options = BakeOptions {
        density: Density::TexelsPerMeter(6.0),
        quality: Quality::Final,
        error: 0.02,
        probes: Probes::Automatic,
        ..BakeOptions::default()
    };
    Bake::new(&options).run(&mut world).unwrap();
    let camera = world.spawn((Camera::default(), Transform::IDENTITY)).id();
    // For each position the error of the volume, and that of the same light from everywhere, as in a game without a
    // bake.
    let mut errors: Vec<[f64; 2]> = Vec::new();
    let mut tints = Vec::new();
    for place in WAY.map(DVec3::from_array) {
        world.get_mut::<Transform>(carried).unwrap().translation = place;
        let towards = DVec3::new(if place.x > 0.0 { -1.0 } else { 1.0 }, 0.3, 1.2).normalize();
        *world.get_mut::<Transform>(camera).unwrap() =
            Transform::from_translation(place + 0.9 * towards).looking_at(place, DVec3::Y);
        let trace_options = TraceOptions {
            size: (32, 32),
            integrator: Integrator::Path,
            samples: Some(400),
            ..TraceOptions::default()
        };
        let (picture, _) = trace(&mut world, &trace_options, &|_| ControlFlow::Continue(())).unwrap();
        let surface = twin::draw(&mut world, 32, 32, TwinOptions::default());
        let names: Vec<Entity> = world.query_filtered::<Entity, With<Mesh>>().iter(&world).collect();
        let inside = surface.inside_surfaces(false);
        let of_the_ball = |at: &usize| {
            inside[*at].is_some() && surface.surface[*at].is_some_and(|(object, _)| names[object] == carried)
        };
        let pixels: Vec<usize> = (0..32 * 32).filter(of_the_ball).collect();
        assert!(pixels.len() > 80, "{}", pixels.len());
        let mean = |frame: &[DVec3]| pixels.iter().map(|at| frame[*at]).sum::<DVec3>() / pixels.len() as f64;
        let truth = mean(&picture.radiance);
        let error = |frame: &[DVec3]| {
            let squares = pixels.iter().map(|at| (frame[*at] - picture.radiance[*at]).length_squared() / 3.0);
            (squares.sum::<f64>() / pixels.len() as f64).sqrt() / (truth.element_sum() / 3.0)
        };
        let (frame, _) = draw(&mut world, 32, 32, &linear());
        // As bright overall as the truth, and the same from all directions.
        let flat = vec![DVec3::splat(truth.element_sum() / 3.0); 32 * 32];
        errors.push([error(&frame), error(&flat)]);
        let seen = mean(&frame);
        tints.push([seen.x / seen.y, truth.x / truth.y]);
        println!(
            "at {place}: {seen:.3} for {truth:.3}; {:.1} % of it off, {:.1} % with the same light from everywhere",
            100.0 * errors[errors.len() - 1][0],
            100.0 * errors[errors.len() - 1][1]
        );
    }
    let mean = |which: usize| errors.iter().map(|errors| errors[which]).sum::<f64>() / errors.len() as f64;
    println!("on average {:.1} %, and {:.1} %", 100.0 * mean(0), 100.0 * mean(1));
    println!("red over green, seen and true: {tints:.2?}");
    // Red near the red wall, green near the green one, and in between as much of each as in the truth; of two walls
    // at half a metre the six directions make slightly too much.
    assert!(tints[0][0] > 1.1 && tints[5][0] < 0.95, "{tints:?}");
    assert!(tints.iter().all(|[seen, truth]| (seen - truth).abs() < 0.15), "{tints:?}");
    // Most of the error is due to the ambient cube: of a lamp straight above it reflects a sixth on average where a
    // ball reflects a quarter, and of one along a diagonal more than that.
    assert!(mean(0) < 0.25 && mean(0) < 0.65 * mean(1), "{errors:?}");
}

#[test]
fn volumes_leave_what_has_lightmaps_alone() {
    let mut world = scene();
    let mapped = |world: &mut World| {
        let mut bare = world.query_filtered::<Entity, (With<Mesh>, Without<Lightmap>)>();
        let bare: Vec<Entity> = bare.iter(world).collect();
        bare.into_iter().for_each(|entity| {
            world.entity_mut(entity).insert(lumbre_scene::Hidden);
        });
        draw(world, SIZE as u32, SIZE as u32, &linear())
    };
    let (without, _) = mapped(&mut world);
    place(&mut world, varied(UVec3::new(2, 2, 2), 9));
    let (with, report) = mapped(&mut world);
    assert!(with == without && report.census.lit_by_volume == 0);
    let uploads = report.statistics.uploads;
    let pictures = (uploads.lightmaps, uploads.irradiance_volumes, uploads.textures);
    assert_eq!(pictures, (4 * 8, 0, 0), "the lightmap of four texels, and nothing else");
    // An object whose lightmap is switched off does not take the volume either.
    let off = FrameOptions { lightmaps: false, ..linear() };
    let (_, report) = draw(&mut world, SIZE as u32, SIZE as u32, &off);
    assert_eq!(report.census.lit_by_volume, 0);
}
