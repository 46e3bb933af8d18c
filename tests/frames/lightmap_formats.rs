//! Lightmaps in each format on the device: how far their frames are from those of 32-bit floats, what becomes of
//! values out of range, and what happens when the format changes.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::Material;
use lumbre_scene::{
    Camera, FrameSettings, Lightmap, LightmapEncoding, LightmapImage, Mesh, Projection, SceneSettings,
    Transform,
};

use crate::adapter::{Canvas, draw, linear};

/// Side of the frame in pixels.
const SIZE: u32 = 96;
/// Side of the lightmap in texels.
const SIDE: usize = 24;
/// Diffuse reflectance of the floor.
const ALBEDO: f32 = 0.5;

/// A floor that fills the frame, with these texels of baked light.
fn floor(texel: impl Fn(usize) -> Vec3) -> World {
    let mut world = World::new();
    world.insert_resource(SceneSettings::default());
    let mut plane = lumbre_mesh::shapes::plane(2.0, 2.0, 1, 1);
    plane.uv1 = plane.uv0.clone();
    let texels = (0..SIDE * SIDE).map(texel).collect();
    let (width, height, encoding) = (SIDE as u32, SIDE as u32, LightmapEncoding::Rgb32Float);
    let image = LightmapImage { name: "floor".to_owned(), width, height, texels, encoding };
    let map = Lightmap { image: Arc::new(image) };
    world.spawn((Mesh::from(plane), Material::matt(Vec3::splat(ALBEDO)), map));
    let projection = Projection::orthographic(1.0, 1.0, 10.0);
    let view = Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::NEG_Z);
    world.spawn((Camera { projection, ..Camera::default() }, view));
    world
}

fn ask(world: &mut World, lightmap_format: LightmapEncoding) {
    world.resource_mut::<SceneSettings>().frame =
        FrameSettings { lightmap_format, ..FrameSettings::default() };
}

/// Coloured light over eight orders of magnitude, in which one channel dominates here and there.
fn uneven(at: usize) -> Vec3 {
    let wave = |step: f32| 0.5 + 0.49 * (at as f32 * step).sin();
    10f32.powf(8.0 * wave(0.37) - 4.0) * Vec3::new(wave(1.3), wave(2.1).powi(8), wave(0.7))
}

#[test]
fn frames_differ_by_the_formats_bound_and_no_more() {
    let frame = |format, texel: &dyn Fn(usize) -> Vec3| {
        let mut world = floor(texel);
        ask(&mut world, format);
        draw(&mut world, SIZE, SIZE, &linear()).0
    };
    let exact = frame(LightmapEncoding::Rgb32Float, &uneven);
    for format in [LightmapEncoding::Rgb16Float, LightmapEncoding::Rgb9E5] {
        // A frame is linear in its lightmap, so a frame drawn with the texels' bounds is the bound of each pixel.
        let bound = frame(LightmapEncoding::Rgb32Float, &|at| format.largest_error(uneven(at)));
        let found = frame(format, &uneven);
        let (mut worst, mut squares, mut light) = (0.0f64, 0.0, 0.0);
        for ((exact, found), bound) in exact.iter().zip(&found).zip(&bound) {
            // Texels are filtered in f32, with a few roundings of its own.
            let over = ((*exact - *found).abs() / (*bound + exact.max_element() * 1e-6)).max_element();
            assert!(over <= 1.0, "{format:?}: {exact} and {found}, bound {bound}");
            worst = worst.max(over);
            squares += (*exact - *found).length_squared();
            light += exact.length_squared();
        }
        println!(
            "{}: error {:.2e} of the light, {worst:.2} of the bound at most",
            format.name(),
            (squares / light).sqrt()
        );
        // Negative control: the bound is reached, so that one of half the size would be exceeded.
        assert!(worst > 0.5, "{format:?}: {worst}");
    }
}

#[test]
fn what_a_format_cannot_hold_is_clamped() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -3.0, 1e9, 70_000.0, 1e-30, 0.25];
    for &format in LightmapEncoding::ALL {
        // Alike over each texel's neighbourhood, so that filtering mixes nothing.
        let columns = SIDE / odd.len();
        let mut world = floor(|at| Vec3::new(odd[at % SIDE / columns], 0.25, 0.0));
        ask(&mut world, format);
        // `draw` fails where a value is not finite.
        let (pixels, _) = draw(&mut world, SIZE, SIZE, &linear());
        let row = &pixels[(SIZE * SIZE / 2) as usize..][..SIZE as usize];
        for (place, value) in odd.iter().enumerate() {
            let wanted = format.clamped(Vec3::new(*value, 0.25, 0.0));
            let found = row[SIZE as usize * (2 * place + 1) / (2 * odd.len())];
            let bound = (format.largest_error(wanted) * ALBEDO).as_dvec3() * 1.001;
            let apart = (found - (wanted * ALBEDO).as_dvec3()).abs();
            assert!(
                apart.cmple(bound + wanted.as_dvec3() * 1e-6).all(),
                "{format:?}: {value} became {found}"
            );
        }
    }
}

#[test]
fn a_change_of_format_replaces_the_textures() {
    let mut world = floor(uneven);
    let mut canvas = Canvas::new(SIZE, SIZE);
    let mut frames = Vec::new();
    for format in [
        LightmapEncoding::Rgb16Float,
        LightmapEncoding::Rgb9E5,
        LightmapEncoding::Rgb32Float,
        LightmapEncoding::Rgb16Float,
    ] {
        ask(&mut world, format);
        let (pixels, report) = canvas.draw(&mut world, &linear());
        let (again, still) = canvas.draw(&mut world, &linear());
        assert!(pixels == again);
        let memory = report.statistics.lightmaps;
        let bytes = SIDE as u64 * SIDE as u64 * [16, 8, 4][format as usize];
        assert_eq!((memory.format, memory.textures, memory.bytes), (format.name(), 1, bytes));
        // They are uploaded once, and again only when the format changes.
        assert_eq!((report.statistics.uploads.lightmaps, still.statistics.uploads.lightmaps), (bytes, 0));
        frames.push(pixels);
    }
    assert!(frames[0] == frames[3], "half floats are the same again");
    assert!(frames[0] != frames[1] && frames[0] != frames[2] && frames[1] != frames[2]);
}
