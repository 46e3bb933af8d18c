//! Compares traced pictures with frames: with depth 0 and without shadows the tracer evaluates the same lighting
//! equation, light by light and model by model, over every pixel inside a surface.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec2, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material, ReflectionModel, Shading, Surface};
use lumbre_render::{Display, FrameOptions};
use lumbre_scene::{
    Camera, EmissiveLight, MaterialTextures, Mesh, Quadric, QuadricShape, SceneSettings, Transform,
};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::panes::{pane, perspective};
use lumbre_tests::scenes::{ball, every_light};
use lumbre_tests::twin::{self, TwinOptions};
use lumbre_trace::{Picture, TraceOptions, Tracer, trace};

use crate::adapter::{draw, linear, shown};

const SIZE: u32 = 192;

/// One step of eight bits.
const STEP: f64 = 1.0 / 255.0;

/// Options for rays that show no more than a frame without shadows does.
fn as_a_frame(camera: Option<Entity>) -> TraceOptions {
    TraceOptions { camera, size: (SIZE, SIZE), depth: Some(0), shadows: false, ..TraceOptions::default() }
}

fn traced(world: &mut World, reflection: Option<ReflectionModel>) -> Picture {
    let options = TraceOptions { reflection, ..as_a_frame(None) };
    trace(world, &options, &|_| ControlFlow::Continue(())).unwrap().0
}

/// Compares the pixels whose whole neighbourhood shows one surface, where no rounding of coverage can show another.
fn against_the_frame(world: &mut World, reflection: Option<ReflectionModel>) -> Difference {
    let twin = TwinOptions { shading: Some(Shading::Phong), reflection, ..TwinOptions::default() };
    let inside = twin::draw(world, SIZE as usize, SIZE as usize, twin).inside_surfaces(false);
    let options = FrameOptions { shading: Some(Shading::Phong), reflection, ..linear() };
    let (frame, _) = draw(world, SIZE, SIZE, &options);
    let moved = twin::by_moved_corners(world, SIZE as usize, SIZE as usize, twin, f64::INFINITY);
    let frame: Vec<DVec3> = frame.iter().zip(moved).map(|(frame, moved)| *frame - moved).collect();
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
    let options = as_a_frame(camera);
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

/// Pixels between what is compared and the edges of surfaces, which a coarse mesh moves.
const MARGIN: f64 = 5.0;

#[test]
fn meshes_of_exact_surfaces_approach_the_tracer_with_the_square_of_their_step() {
    let general = |coefficients| QuadricShape::General { coefficients };
    let trim = Some([DVec3::splat(-0.9), DVec3::new(0.6, 0.9, 0.9)]);
    for quadric in [
        Quadric::sphere(1.0),
        Quadric { trim, ..Quadric::sphere(1.0) },
        Quadric::new(QuadricShape::Cylinder { radius: 0.7, height: 1.6, closed: true }),
        Quadric::new(QuadricShape::Cone { radius: 0.9, height: 1.8, closed: true }),
        // x² + 2 y² + 3 z² + xy - 1 = 0.
        Quadric::new(general([1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0])),
        // A saddle: y = x² - z².
        Quadric { trim, ..Quadric::new(general([-1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])) },
    ] {
        let mut world = ball(every_light().swap_remove(2).1);
        let object = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
        let place =
            Transform::IDENTITY.with_rotation(DQuat::from_rotation_x(0.5) * DQuat::from_rotation_z(0.3));
        world.entity_mut(object).insert((quadric.clone(), place));
        world.get_mut::<Material>(object).unwrap().double_sided = true;
        let options = TraceOptions { size: (SIZE, SIZE), ..TraceOptions::default() };
        let tracer = Tracer::new(&mut world, &options).unwrap();
        let normal = |x: f64, y: f64| tracer.first_hit(DVec2::new(x, y)).map(|hit| hit.normal);
        let inside: Vec<bool> = (0..SIZE * SIZE)
            .map(|at| {
                let (x, y) = (f64::from(at % SIZE) + 0.5, f64::from(at / SIZE) + 0.5);
                let near = [(MARGIN, 0.0), (-MARGIN, 0.0), (0.0, MARGIN), (0.0, -MARGIN)];
                let smooth =
                    |own: DVec3, beside: Option<DVec3>| beside.is_some_and(|beside| own.dot(beside) > 0.9);
                normal(x, y).is_some_and(|own| near.iter().all(|by| smooth(own, normal(x + by.0, y + by.1))))
            })
            .collect();
        let count = inside.iter().filter(|&&inside| inside).count();
        assert!(count > 3000, "{count} pixels are too few to compare");
        let picture = traced(&mut world, None);
        let apart = [16, 32, 64].map(|segments| {
            world.entity_mut(object).insert(Mesh(Arc::new(quadric.mesh(segments))));
            let options = FrameOptions { shading: Some(Shading::Phong), ..linear() };
            let (frame, _) = draw(&mut world, SIZE, SIZE, &options);
            let pairs = picture.radiance.iter().zip(&frame).zip(&inside).filter(|(_, inside)| **inside);
            pairs.map(|((a, b), _)| (*a - *b).abs().max_element()).sum::<f64>() / count as f64
        });
        println!("{:?}: with 16, 32 and 64 segments {apart:?} apart on average", quadric.shape);
        // A quarter for half the step, but for the edges of triangles and the rounding of f32.
        assert!(apart[1] < 0.35 * apart[0] && apart[2] < (0.35 * apart[1]).max(1e-5), "{apart:?}");
        assert!(apart[2] < STEP, "{apart:?}");
    }
}

#[test]
fn the_level_without_textures_is_the_frames_inside_every_surface() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/demo.glb"));
    let mut world = World::new();
    lumbre_scene::load(&mut world, path).unwrap();
    let textured: Vec<Entity> =
        world.query_filtered::<Entity, With<MaterialTextures>>().iter(&world).collect();
    for entity in textured {
        world.entity_mut(entity).remove::<MaterialTextures>();
    }
    // Frames draw mirrors and what is behind glass, which depth 0 leaves out.
    for mut material in world.query::<&mut Material>().iter_mut(&mut world) {
        (material.mirror, material.transmission) = (Vec3::ZERO, Vec3::ZERO);
    }
    let mut cameras = world.query_filtered::<(Entity, &lumbre_scene::Name), With<Camera>>();
    let tour: Vec<(Entity, String)> = cameras
        .iter(&world)
        .map(|(entity, name)| (entity, name.to_string()))
        .filter(|(_, name)| name.starts_with("tour"))
        .collect();
    assert!(tour.len() >= 9, "{tour:?}");
    for (camera, name) in tour {
        let camera = Some(camera);
        let options = FrameOptions {
            camera,
            shading: Some(Shading::Phong),
            shadows: false,
            specular_antialiasing: Some(false),
            ..linear()
        };
        let (frame, _) = draw(&mut world, SIZE, SIZE, &options);
        let options = as_a_frame(camera);
        let (picture, _) = trace(&mut world, &options, &|_| ControlFlow::Continue(())).unwrap();
        let tracer = Tracer::new(&mut world, &options).unwrap();
        // Inside: the pixel and its neighbours show one object, without a crease and without a step in depth.
        let hits: Vec<_> = (0..SIZE * SIZE)
            .map(|at| tracer.first_hit(DVec2::new(f64::from(at % SIZE), f64::from(at / SIZE)) + 0.5))
            .collect();
        let (mut compared, mut largest) = (0, (0.0_f64, 0, 0));
        for (x, y) in (1..SIZE - 1).flat_map(|y| (1..SIZE - 1).map(move |x| (x, y))) {
            let Some(own) = &hits[(y * SIZE + x) as usize] else { continue };
            let near = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
            let inside = near.iter().all(|(x, y)| {
                hits[(y * SIZE + x) as usize].as_ref().is_some_and(|beside| {
                    let off = (beside.position - own.position).dot(own.normal).abs();
                    beside.object == own.object
                        && beside.normal.dot(own.normal) > 0.95
                        && off < 0.02 * own.depth
                })
            });
            if inside {
                let at = (y * SIZE + x) as usize;
                let apart = (picture.radiance[at] - frame[at]).abs().max_element();
                compared += 1;
                if apart > largest.0 {
                    largest = (apart, x, y);
                }
            }
        }
        println!("{name}: {compared} pixels, {largest:?} apart at most");
        assert!(compared > 15_000, "{name}: {compared} pixels are too few to compare");
        assert!(largest.0 < STEP, "{name}: {largest:?}");
    }
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
