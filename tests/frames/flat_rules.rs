//! Flat shading with each rule: the centroid and the face's normal of document [M], the first vertex of document
//! [I], the last vertex of OpenGL.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3, Vec4};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{FlatRule, Light, Material, Shading, Surface};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, Mesh, SceneSettings, Transform};
use lumbre_tests::compare::compare;
use lumbre_tests::scenes::{ball, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: usize = 256;
/// The bound of balls.rs: f32 compared with f64.
const LARGEST: f64 = 1e-4;

fn options(rule: Option<FlatRule>) -> FrameOptions {
    FrameOptions { shading: Some(Shading::Flat), flat_rule: rule, ..linear() }
}

#[test]
fn every_rule_agrees_with_the_twin() {
    let (_, light) = every_light().swap_remove(2);
    let mut frames = Vec::new();
    for rule in FlatRule::ALL {
        for mirrored in [1.0, -1.0] {
            let mut world = ball(light.clone());
            for mut place in world.query_filtered::<&mut Transform, With<Mesh>>().iter_mut(&mut world) {
                place.scale.x = mirrored;
            }
            let twin_options = TwinOptions {
                shading: Some(Shading::Flat),
                flat_rule: Some(*rule),
                ..TwinOptions::default()
            };
            let expected = twin::draw(&mut world, SIZE, SIZE, twin_options).inside_surfaces(true);
            let (got, _) = draw(&mut world, SIZE as u32, SIZE as u32, &options(Some(*rule)));
            frames.push(got.clone());
            let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
            println!("{:12} {mirrored:4} {difference:?}", rule.name());
            assert!(difference.pixels > SIZE * SIZE / 24, "{difference:?}");
            assert!(difference.largest < LARGEST, "{}: {difference:?}", rule.name());
        }
    }
    assert!(frames[0] != frames[2] && frames[2] != frames[4], "the rules draw the same frame");
}

/// One triangle whose vertices have three different normals and colours, under a light of 1 from the viewer's side.
fn triangle() -> World {
    let mut world = World::new();
    let tilted = |degrees: f32| Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
    let mesh = TriangleMesh {
        positions: vec![Vec3::new(-2.0, -2.0, 0.0), Vec3::new(2.0, -2.0, 0.0), Vec3::new(0.0, 2.0, 0.0)],
        normals: vec![tilted(60.0), tilted(0.0), tilted(-45.0)],
        colors: vec![
            Vec4::new(1.0, 0.5, 0.25, 1.0),
            Vec4::new(0.0, 1.0, 0.5, 1.0),
            Vec4::new(0.5, 0.0, 0.75, 1.0),
        ],
        indices: vec![0, 1, 2],
        ..TriangleMesh::default()
    };
    let front = Surface { ambient: Vec3::ZERO, diffuse: Vec3::ONE, ..Surface::default() };
    world.spawn((Mesh(Arc::new(mesh)), Material { front, ..Material::default() }));
    let above = Transform::from_xyz(0.0, 0.0, 5.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::ONE), above));
    world.spawn((Camera::default(), above));
    world
}

#[test]
fn a_polygon_takes_the_light_and_the_colour_of_its_rule() {
    // n.l is 1 for the face, cos 60 for the first vertex and cos 45 for the last.
    let known = [
        (FlatRule::Centroid, DVec3::new(0.5, 0.5, 0.5)),
        (FlatRule::FirstVertex, 0.5 * DVec3::new(1.0, 0.5, 0.25)),
        (FlatRule::LastVertex, 0.5f64.sqrt() * DVec3::new(0.5, 0.0, 0.75)),
    ];
    for (rule, expected) in known {
        let mut world = triangle();
        let (by_caller, _) = draw(&mut world, 16, 16, &options(Some(rule)));
        world.insert_resource(SceneSettings { flat_rule: rule, ..SceneSettings::default() });
        let (by_scene, _) = draw(&mut world, 16, 16, &options(None));
        for pixels in [by_caller, by_scene] {
            // The middle pixel and a neighbour in another part of the triangle.
            for pixel in [pixels[8 * 16 + 8], pixels[9 * 16 + 7]] {
                let apart = (pixel - expected).abs().max_element();
                // Normals are rounded to f32 and normalized again: a few roundings.
                assert!(apart < 1e-6, "{}: {pixel} is not {expected}", rule.name());
            }
        }
    }
}
