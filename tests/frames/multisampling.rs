//! Four samples per pixel: edges become averages, and everything else stays the same.

use bevy_ecs::prelude::*;
use glam::{DQuat, Vec3};
use lumbre_optics::{Material, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{Mesh, Transform};
use lumbre_tests::panes::pane_of;
use lumbre_tests::scenes::{ball, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: usize = 112;

#[test]
fn inside_a_surface_nothing_changes() {
    let (_, light) = every_light().swap_remove(2);
    let mut world = ball(light);
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let (single, _) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
        let (four, _) =
            draw(&mut world, SIZE as u32, SIZE as u32, &FrameOptions { multisample: Some(true), ..options });
        let twin_options = TwinOptions { shading: Some(*shading), ..TwinOptions::default() };
        // Inside one triangle: a pixel with two triangles is shaded for each.
        let inside = twin::draw(&mut world, SIZE, SIZE, twin_options).inside_surfaces(true);
        let inside: Vec<usize> = (0..SIZE * SIZE).filter(|&at| inside[at].is_some()).collect();
        assert!(inside.len() > 60, "{} pixels are too few", inside.len());
        for at in inside {
            // Four equal samples are added and divided by four, two roundings. The attributes come from plane
            // equations that the rasterizer sets up around another point: 2^-24 of values below 2 m, times the
            // exponent of 20 and a few.
            let apart = (single[at] - four[at]).abs().max_element();
            assert!(apart <= 5e-6, "{}: pixel {at}: {apart}", shading.name());
        }
    }
}

#[test]
fn edges_are_averages_of_four_samples() {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    let pane = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    // At this angle the four samples of the standard pattern are at four distances from either edge.
    let turned = Transform::from_rotation(DQuat::from_rotation_z(-0.15)).with_scale(glam::DVec3::splat(0.6));
    world.entity_mut(pane).insert(turned);
    let frame = |world: &mut World, multisample| {
        draw(world, SIZE as u32, SIZE as u32, &FrameOptions { multisample: Some(multisample), ..linear() }).0
    };
    let four = frame(&mut world, true);
    let mut seen = [0_usize; 5];
    for pixel in &four {
        let quarters = pixel.x * 4.0;
        assert_eq!(quarters, quarters.round(), "{pixel} is no quarter");
        seen[quarters as usize] += 1;
    }
    assert!(seen[1..4].iter().all(|count| *count > 0), "{seen:?}");
    // The pane covers 0.36 of the frame. Its edges cross about 4 * 0.6 * 64 pixels, each with an error of either
    // sign of less than half a sample: 8 standard deviations of a sum of that many uniform errors of up to 1/8.
    let area = four.iter().map(|pixel| pixel.x).sum::<f64>() / (SIZE * SIZE) as f64;
    let bound = 8.0 * (4.0 * 0.6 * SIZE as f64).sqrt() * 0.125 / 3.0_f64.sqrt() / (SIZE * SIZE) as f64;
    assert!((area - 0.36).abs() < bound, "{area} is not within {bound} of 0.36");
    // Negative control: with one sample per pixel it is all or nothing.
    assert!(frame(&mut world, false).iter().all(|pixel| pixel.x == 0.0 || pixel.x == 1.0));
}
