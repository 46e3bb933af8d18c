//! Surfaces of constant colour, on which no light with a direction shines: their colour is computed at the
//! vertices, and no pixel differs from one that is shaded separately.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{Vec3, Vec4};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Light, LightKind, Material, Shading, Surface};
use lumbre_render::{Display, FrameOptions, Offscreen, OffscreenFormat, Renderer};
use lumbre_scene::{Camera, Mesh, SceneSettings, Transform};
use lumbre_tests::device::same_by_another_pipeline;

use crate::adapter::gpu;

/// Balls with emission, with ambient light, with both, or without any light. A mask that cuts nothing out changes
/// nothing, but has to be evaluated for each pixel.
fn scene(shading: Shading, masked: bool) -> World {
    let mut world = World::new();
    let mesh = Mesh(Arc::new(shapes::uv_sphere(0.45, 24, 12)));
    let alpha_mode = if masked { AlphaMode::Mask { cutoff: 0.5 } } else { AlphaMode::Opaque };
    let colors =
        [Vec3::new(0.9, 0.6, 0.3), Vec3::new(0.01, 0.2, 4.0), Vec3::splat(0.037), Vec3::new(90.0, 0.0, 1.0)];
    for (index, color) in colors.into_iter().enumerate() {
        let glow = if index % 2 == 0 { 0.3 * color } else { Vec3::ZERO };
        let material = Material {
            front: Surface { emission: glow, specular: Vec3::splat(0.5), ..Material::matt(color).front },
            unlit: index == 3,
            alpha_mode,
            ..Material::matt(color)
        };
        let (x, y) = ((index % 2) as f64 - 0.5, (index / 2) as f64 - 0.5);
        world.spawn((mesh.clone(), material, Transform::from_xyz(x, y, 0.0)));
    }
    let ambient = Light { kind: LightKind::Ambient, ambient: Vec3::splat(0.4), ..Light::point(Vec3::ZERO) };
    world.spawn((ambient, Transform::IDENTITY));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 2.5)));
    world.insert_resource(SceneSettings {
        shading,
        ambient: Vec3::new(0.1, 0.2, 0.3),
        ..SceneSettings::default()
    });
    world
}

fn frame(shading: Shading, options: &FrameOptions, masked: bool) -> (Vec<Vec4>, String) {
    let target = Offscreen::new(gpu(), 96, 96, OffscreenFormat::LinearFloat).unwrap();
    let mut renderer = Renderer::new(gpu());
    renderer.render(&mut scene(shading, masked), &target.target(), options).unwrap();
    let variants: Vec<String> = renderer.drawn_variants().into_keys().collect();
    (target.read_linear(gpu()).unwrap(), variants.join(", "))
}

#[test]
fn a_colour_that_is_made_once_is_that_of_every_pixel() {
    for (display, shading) in
        Display::ALL.iter().flat_map(|one| Shading::ALL.iter().map(move |two| (*one, *two)))
    {
        let options = FrameOptions { display, exposure: Some(0.7), ..FrameOptions::default() };
        let (constant, variants) = frame(shading, &options, false);
        let (each, shaded) = frame(shading, &options, true);
        assert!(variants.contains("CONSTANT") && !shaded.contains("CONSTANT"), "{variants}; {shaded}");

        let colors_of =
            |pixels: &[Vec4]| pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).collect::<Vec<_>>();
        let same = same_by_another_pipeline(&colors_of(&constant), &colors_of(&each));
        assert!(same, "{} {shading:?}: {variants} beside {shaded}", display.name());
        assert!(constant.iter().zip(&each).all(|(one, other)| one.w == other.w), "{}", display.name());
        // OpenGL's display clamps at the vertices and interpolates the clamped colours.
        if display != Display::Clamp || shading == Shading::Phong {
            let colors: std::collections::HashSet<String> =
                constant.iter().map(|pixel| format!("{pixel}")).collect();
            assert_eq!(colors.len(), 5, "four balls and what lies behind them");
        }
    }
}
