//! Compares traced pictures with frames: with depth 0 and without shadows the tracer evaluates the same lighting
//! equation, light by light and model by model, over every pixel inside a surface.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec2, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material, ReflectionModel, Shading, Surface};
use lumbre_render::{Display, FrameOptions};
use lumbre_scene::{Camera, EmissiveLight, Mesh, SceneSettings, Transform};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::panes::{pane, perspective};
use lumbre_tests::scenes::{ball, every_light};
use lumbre_tests::twin::{self, TwinOptions};
use lumbre_trace::{Picture, TraceOptions, Tracer, trace};

use crate::adapter::{draw, linear, shown};

const SIZE: u32 = 192;

/// One step of eight bits.
const STEP: f64 = 1.0 / 255.0;

fn traced(world: &mut World, reflection: Option<ReflectionModel>) -> Picture {
    let options = TraceOptions {
        size: (SIZE, SIZE),
        depth: Some(0),
        shadows: false,
        reflection,
        ..TraceOptions::default()
    };
    trace(world, &options, &|_| ControlFlow::Continue(())).unwrap().0
}

/// Compares the pixels whose whole neighbourhood shows one surface, where no rounding of coverage can show another.
fn against_the_frame(world: &mut World, reflection: Option<ReflectionModel>) -> Difference {
    let twin = TwinOptions { shading: Some(Shading::Phong), reflection, ..TwinOptions::default() };
    let inside = twin::draw(world, SIZE as usize, SIZE as usize, twin).inside_surfaces(false);
    let options = FrameOptions { shading: Some(Shading::Phong), reflection, ..linear() };
    let (frame, _) = draw(world, SIZE, SIZE, &options);
    let picture = traced(world, reflection);
    let masked = |pixels: &[DVec3]| -> Vec<Option<DVec3>> {
        pixels.iter().zip(&inside).map(|(pixel, inside)| inside.map(|_| *pixel)).collect()
    };
    let difference = compare(&masked(&picture.radiance), &masked(&frame));
    assert!(difference.pixels > 3000, "{} pixels are too few to compare", difference.pixels);
    difference
}

#[test]
fn every_light_and_reflection_model_is_the_frames() {
    let mut largest: f64 = 0.0;
    for (name, light) in every_light() {
        for model in ReflectionModel::ALL {
            for shiny in [false, true] {
                let mut world = ball(light.clone());
                if shiny {
                    let plastic = Material::from_metallic_roughness(Vec3::new(0.7, 0.3, 0.2), 0.3, 0.4);
                    for mut material in world.query::<&mut Material>().iter_mut(&mut world) {
                        *material = plastic.clone();
                    }
                }
                let difference = against_the_frame(&mut world, Some(*model));
                assert!(difference.largest < STEP, "{name}, {}, {shiny}: {difference:?}", model.name());
                largest = largest.max(difference.largest);
            }
        }
    }
    println!("lights and models: {largest:.1e} at most");
}

#[test]
fn fog_backs_far_places_and_emissive_faces_are_the_frames() {
    // A ball in each fog.
    for mode in [
        FogMode::Linear { start: 2.0, end: 6.0 },
        FogMode::Exponential { density: 0.2 },
        FogMode::ExponentialSquared { density: 0.2 },
        FogMode::DepthCue { start: 2.5, end: 4.5, near_weight: 0.9, far_weight: 0.2 },
    ] {
        let mut world = ball(every_light().swap_remove(2).1);
        world.resource_mut::<SceneSettings>().fog = Some(Fog { mode, color: Vec3::new(0.4, 0.5, 0.6) });
        let difference = against_the_frame(&mut world, None);
        println!("{mode:?}: {difference:?}");
        assert!(difference.largest < STEP, "{mode:?}: {difference:?}");
    }
    for two_sided in [true, false] {
        let mut world = ball(every_light().swap_remove(2).1);
        world.resource_mut::<SceneSettings>().two_sided = two_sided;
        let inner =
            Surface { diffuse: Vec3::new(0.1, 0.6, 0.2), specular: Vec3::splat(0.3), ..Surface::default() };
        let mut objects = world.query::<(&mut Material, &mut Transform, &mut Mesh)>();
        for (mut material, mut place, mut mesh) in objects.iter_mut(&mut world) {
            (material.back, material.double_sided) = (Some(inner), true);
            // A tilted, mirrored sheet whose back is visible.
            *mesh = Mesh(Arc::new(shapes::plane(2.0, 2.0, 4, 4)));
            place.rotation = DQuat::from_rotation_x(-0.9);
            place.scale = DVec3::new(-1.0, 1.0, 1.2);
        }
        let difference = against_the_frame(&mut world, None);
        println!("two-sided {two_sided}: {difference:?}");
        assert!(difference.largest < STEP, "two-sided {two_sided}: {difference:?}");
    }
    let far = DVec3::new(3e6, -1e6, 2e6);
    let mut world = ball(every_light().swap_remove(2).1);
    for mut place in world.query::<&mut Transform>().iter_mut(&mut world) {
        place.translation += far;
    }
    let difference = against_the_frame(&mut world, None);
    println!("far away: {difference:?}");
    assert!(difference.largest < STEP, "far away: {difference:?}");

    let mut world = ball(Light::ambient(Vec3::splat(0.1)));
    let front = Surface { emission: Vec3::splat(5.0), ..Surface::default() };
    let panel = Material { front, ..Material::default() };
    let place = Transform::from_xyz(0.5, 1.8, 0.5).with_rotation(DQuat::from_rotation_x(2.8));
    world.spawn((Mesh(Arc::new(shapes::plane(1.0, 0.7, 1, 1))), panel, place, EmissiveLight));
    for model in ReflectionModel::ALL {
        let difference = against_the_frame(&mut world, Some(*model));
        println!("emissive panel, {}: {difference:?}", model.name());
        assert!(difference.largest < STEP, "emissive panel, {}: {difference:?}", model.name());
    }
}

#[test]
fn the_level_is_the_frames_but_for_minified_textures() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/demo.glb"));
    let mut world = World::new();
    lumbre_scene::load(&mut world, path).unwrap();
    let mut cameras = world.query_filtered::<(Entity, &lumbre_scene::Name), With<Camera>>();
    let camera = cameras.iter(&world).find(|(_, name)| name.as_str() == "tour 06").map(|found| found.0);
    let frame_options = FrameOptions { camera, shading: Some(Shading::Phong), ..linear() };
    let (frame, _) = draw(&mut world, SIZE, SIZE, &frame_options);
    let options = TraceOptions {
        camera,
        size: (SIZE, SIZE),
        depth: Some(0),
        shadows: false,
        ..TraceOptions::default()
    };
    let (picture, _) = trace(&mut world, &options, &|_| ControlFlow::Continue(())).unwrap();
    let mut apart: Vec<f64> =
        picture.radiance.iter().zip(&frame).map(|(a, b)| (*a - *b).abs().max_element()).collect();
    apart.sort_by(f64::total_cmp);
    let at = |share: f64| apart[(share * (apart.len() - 1) as f64) as usize];
    println!("tour 06: median {:.1e}, 75 % {:.1e}, 95 % {:.1e} apart", at(0.5), at(0.75), at(0.95));
    assert!(at(0.5) < STEP, "{}", at(0.5));
}

/// Half the sides of the square decals, in metres: slightly larger the younger they are, so that frames too, which
/// draw the nearest bounding ball last, draw them in the order of their age.
const DECALS: [f64; 3] = [0.58, 0.6, 0.62];

#[test]
fn decals_in_the_plane_of_a_wall_are_the_frames() {
    // In the plane z = 0, which faces the camera: all depths of a frame are the same number, so that rounding does
    // not decide there what is visible.
    let mut world = World::new();
    world.spawn(perspective());
    world.spawn((every_light().swap_remove(2).1, Transform::from_xyz(1.0, 1.5, 2.0)));
    let sheet = |half_side: f64, turn: DQuat| {
        let mut mesh = pane();
        for position in &mut mesh.positions {
            *position = (turn * (half_side * position.as_dvec3())).as_vec3();
        }
        Mesh(Arc::new(mesh))
    };
    let plastic = |color: Vec3| Material::from_metallic_roughness(color, 0.0, 0.4);
    world.spawn((sheet(3.0, DQuat::IDENTITY), plastic(Vec3::splat(0.7))));
    let turns = [0.0, 0.5, 1.1].map(DQuat::from_rotation_z);
    for ((turn, half_side), alpha) in turns.into_iter().zip(DECALS).zip([0.7, 0.3, 0.5]) {
        let color = Vec3::new(alpha, 0.8 - alpha, 0.2);
        let material = Material { alpha, alpha_mode: AlphaMode::Blend, ..plastic(color) };
        world.spawn((sheet(half_side, turn), material));
    }
    let picture = traced(&mut world, None);
    let (frame, _) =
        draw(&mut world, SIZE, SIZE, &FrameOptions { shading: Some(Shading::Phong), ..linear() });

    // The decals that cover each pixel, as bits; 8 beside the wall.
    let tracer =
        Tracer::new(&mut world, &TraceOptions { size: (SIZE, SIZE), ..TraceOptions::default() }).unwrap();
    let covers = |position: DVec3, decal: usize| {
        let own = turns[decal].inverse() * position;
        own.x.abs().max(own.y.abs()) < DECALS[decal]
    };
    let covering = |x: u32, y: u32| {
        let hit = tracer.first_hit(DVec2::new(f64::from(x), f64::from(y)) + 0.5);
        let bits = |position| (0..3).map(|decal| u32::from(covers(position, decal)) << decal).sum();
        hit.map_or(8, |hit| bits(hit.position))
    };
    let mut found: [u32; 8] = [0; 8];
    let mut largest: f64 = 0.0;
    for (x, y) in (1..SIZE - 1).flat_map(|y| (1..SIZE - 1).map(move |x| (x, y))) {
        let own = covering(x, y);
        let inside =
            [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)].iter().all(|at| covering(at.0, at.1) == own);
        if own < 8 && inside {
            let at = (y * SIZE + x) as usize;
            let apart = (picture.radiance[at] - frame[at]).abs().max_element();
            assert!(apart < STEP, "({x}, {y}), {own:03b}: {} and {}", picture.radiance[at], frame[at]);
            largest = largest.max(apart);
            found[own as usize] += 1;
        }
    }
    println!("decals: {largest:.1e} at most; pixels by what covers them: {found:?}");
    // The bare wall, each decal and their overlaps are in the picture.
    assert!(found.iter().filter(|&&pixels| pixels > 50).count() >= 6, "{found:?}");
}

#[test]
fn a_picture_is_shown_as_a_frame_is() {
    let mut world = ball(every_light().swap_remove(2).1);
    let options =
        FrameOptions { display: Display::Srgb, shading: Some(Shading::Phong), ..FrameOptions::default() };
    let bytes = shown(&mut world, SIZE, SIZE, &options);
    let twin = TwinOptions { shading: Some(Shading::Phong), ..TwinOptions::default() };
    let inside = twin::draw(&mut world, SIZE as usize, SIZE as usize, twin).inside_surfaces(false);
    let picture = traced(&mut world, None);
    let mut worst: f64 = 0.0;
    for ((pixel, radiance), inside) in bytes.chunks_exact(4).zip(&picture.radiance).zip(&inside) {
        if inside.is_none() {
            continue;
        }
        let own = lumbre_trace::shown(*radiance) * 255.0;
        for channel in 0..3 {
            worst = worst.max((own[channel] - f64::from(pixel[channel])).abs());
        }
    }
    // Half a step of rounding, and half floats before the tone curve.
    println!("as shown: {worst:.2} steps apart at most");
    assert!(worst < 1.0, "{worst}");
}
