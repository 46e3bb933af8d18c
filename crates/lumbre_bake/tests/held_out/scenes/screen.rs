//! A room lit by a screen on its wall: an emissive texture of high contrast.

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec2};
use lumbre_mesh::TriangleMesh;
use lumbre_scene::{Image, MaterialTextures, Mesh, Name, Sampler, StaticObject, TextureReference, Wrap};

use super::builder::matt;
use super::lamps::furnished;

/// The furnished room of `lamps` with a screen of 3.2 by 1.6 m that has `texels` along its width and half as many along
/// its height.
pub fn screen(texels: u64, scale: f64) -> World {
    let mut b = furnished(scale);
    let (width, height) = (texels.max(2) as u32, (texels / 2).max(1) as u32);
    let (high, deep) = (1.6, 3.2);
    let corner = DVec3::new(0.03, 0.9, 1.4);
    b.block("screen's back", [0.0, 0.88, 1.38], [0.029, 2.52, 4.62], [0.05; 3], 0.0);
    // Seen from +x, its left side is at the greater z.
    let at = |s: f64, t: f64| ((corner + DVec3::new(0.0, high * t, deep * (1.0 - s))) * scale).as_vec3();
    let mesh = TriangleMesh {
        positions: vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
        normals: vec![DVec3::X.as_vec3(); 4],
        uv0: [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    };
    let image = Image { name: "screen".into(), width, height, rgba: pixels(width, height) };
    let clamped = Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: Wrap::ClampToEdge, ..Sampler::default() };
    let texture = TextureReference { sampler: clamped, ..TextureReference::new(Arc::new(image)) };
    let textures = MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() };
    b.world.spawn((
        Name::new("screen"),
        Mesh(Arc::new(mesh)),
        matt([0.0; 3], [25.0; 3]),
        textures,
        StaticObject,
    ));
    b.world
}

/// An image with lines that look like text, a window with a gradient, and discs; most of it is dark.
fn pixels(width: u32, height: u32) -> Vec<u8> {
    let mut rgba = Vec::with_capacity(4 * (width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = ((f64::from(x) + 0.5) / f64::from(width), (f64::from(y) + 0.5) / f64::from(height));
            rgba.extend(pixel(u, v));
        }
    }
    rgba
}

fn pixel(u: f64, v: f64) -> [u8; 4] {
    let (line, letter) = ((v * 60.0) as u64, (u * 200.0) as u64);
    let inked = line.wrapping_mul(0x9e37_79b9).wrapping_add(letter.wrapping_mul(0x85eb_ca6b)) >> 3 & 3 > 0;
    let in_line = (v * 60.0).fract() < 0.4 && (u * 200.0).fract() < 0.6;
    let disc = |x: f64, y: f64, radius: f64| (u - x).hypot(0.5 * (v - y)) < radius;
    match () {
        () if disc(0.82, 0.3, 0.07) => [255, 60, 30, 255],
        () if disc(0.9, 0.75, 0.03) => [255, 255, 255, 255],
        () if (0.55..0.75).contains(&u) && (0.5..0.85).contains(&v) => {
            let shade = (255.0 * (u - 0.55) / 0.2) as u8;
            [shade / 2, shade, 255, 255]
        }
        () if u < 0.5 && in_line && inked && line % 7 != 0 => [200, 230, 200, 255],
        () => [0, 0, 2, 255],
    }
}
