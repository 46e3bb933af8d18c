//! Draws one lit frame without a window, from a World, a Renderer and a target.
//! `cargo run -p lumbre_render --example first_frame -- frame.png`

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material};
use lumbre_render::{FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, Transform};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = World::new();
    let ball = shapes::uv_sphere(1.0, 64, 32);
    world
        .spawn((Mesh(Arc::new(ball)), Material::from_metallic_roughness(Vec3::new(0.7, 0.3, 0.2), 0.0, 0.4)));
    world.spawn((Light::point(Vec3::splat(6.0)), Transform::from_xyz(2.0, 2.0, 2.0)));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.5).looking_at(DVec3::ZERO, DVec3::Y)));

    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu);
    let frame = Offscreen::new(&gpu, 640, 480, OffscreenFormat::Rgba8)?;
    renderer.render(&mut world, &frame.target(), &FrameOptions::default())?;

    let path = std::env::args().nth(1).unwrap_or_else(|| "first_frame.png".into());
    image::save_buffer(path, &frame.read_rgba8(&gpu)?, 640, 480, image::ColorType::Rgba8)?;
    Ok(())
}
