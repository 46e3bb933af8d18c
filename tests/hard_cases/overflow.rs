//! Cases of numbers that are too large or not numbers, in components made in code: products that overflow f32 or
//! half floats, and fog, exposure and vertex colours that are not numbers.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3, Vec4};
use lumbre_optics::{
    AlphaMode, Attenuation, Distribution, Fog, FogMode, Fresnel, Light, Material, ReflectionModel, Surface,
};
use lumbre_render::FrameOptions;
use lumbre_scene::{Mesh, SceneSettings, Transform};
use lumbre_tests::panes::{pane, pane_of};

use crate::adapter::{draw, linear, shown};
use crate::case::Outcome;

crate::cases! {
    "the largest product stays below the target's overflow" {
        coefficients_beyond_1000_are_refused_in_files, emission_beyond_1e30_is_refused_in_files,
        the_largest_product_on_the_lit_side, the_largest_product_behind_the_surface, the_brightest_highlight,
        ambient_light_beyond_f32, a_background_beyond_half_floats, emission_beyond_half_floats,
        a_bright_pane_behind_a_bright_glass, an_exposure_of_1e35, fog_over_emission_of_1e38,
        the_strongest_inverse_square_light_in_the_surface,
    }
    "NaN in any frame" {
        fog_of_no_numbers, vertex_colours_of_no_numbers, infinite_normals, optical_constants_of_no_numbers,
        an_exponent_of_no_number, lights_of_every_wrong_number, a_light_left_out_is_named, a_fog_left_out_is_named,
    }
}

/// Largest coefficient of a material that is used, and largest channel of a light.
const COEFFICIENT: f64 = 1e3;
const INTENSITY: f32 = 1e30;

fn grey(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

fn middle(world: &mut World) -> f64 {
    grey(draw(world, 9, 9, &linear()).0[40])
}

/// A directional light perpendicular to the pane, from its front or from behind.
fn sun(color: f32, in_front: bool) -> (Light, Transform) {
    let z = if in_front { 1.0 } else { -1.0 };
    (
        Light::directional(Vec3::splat(color)),
        Transform::from_xyz(0.0, 0.0, z).looking_at(DVec3::ZERO, DVec3::Y),
    )
}

/// A pane with all coefficients of this size, under ambient light of 1.
fn coefficients(size: f32) -> World {
    let color = Vec3::splat(size);
    let front =
        Surface { ambient: Vec3::ONE, diffuse: color, specular: color, shininess: 1.0, ..Surface::default() };
    pane_of(Material { front, ..Material::default() })
}

fn mesh_entity(world: &mut World) -> Entity {
    world.query_filtered::<Entity, With<Mesh>>().single(world).unwrap()
}

fn white(world: &mut World, options: FrameOptions, because: &'static str) -> Outcome {
    let bytes = shown(world, 9, 9, &options);
    Outcome::worst(bytes.into_iter().map(|byte| (255.0, f64::from(byte))), 0.0, because)
}

fn the_largest_product_on_the_lit_side() -> Outcome {
    let mut world = coefficients(1e30);
    world.spawn(sun(INTENSITY, true));
    // k_d L (n.l) + k_s L (r.v), both with a cosine of 1, at the pixel straight ahead.
    let expected = 2.0 * COEFFICIENT * f64::from(INTENSITY);
    Outcome::number(
        expected,
        middle(&mut world),
        expected * 1e-6,
        "k is used up to 1000: 2 k L; a few roundings",
    )
}

fn the_largest_product_behind_the_surface() -> Outcome {
    let mut world = coefficients(1e30);
    world.spawn(sun(INTENSITY, false));
    Outcome::number(
        1.0,
        middle(&mut world),
        0.0,
        "k L stays finite, so that times n.l = 0 it is 0: k_a I_a is left",
    )
}

fn the_brightest_highlight() -> Outcome {
    // Blinn's model divides by n.v: normals that graze a distant viewer give 10^4 times the light.
    let color = Vec3::splat(1e30);
    let front = Surface { ambient: Vec3::ZERO, diffuse: Vec3::ZERO, specular: color, ..Surface::default() };
    let mut world = pane_of(Material { front, ..Material::default() });
    let mut mesh = pane();
    mesh.normals = vec![Vec3::new(1.0, 0.0, 1e-4); 4];
    let entity = mesh_entity(&mut world);
    world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
    let reflection = ReflectionModel::TorranceSparrow;
    world.insert_resource(SceneSettings { reflection, local_viewer: false, ..SceneSettings::default() });
    // The mirror direction of the viewer.
    let light = DVec3::new(2e-4, 0.0, -1.0).normalize();
    let place = Transform::from_translation(light).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::splat(INTENSITY)), place));
    let normal = DVec3::new(1.0, 0.0, 1e-4).normalize();
    let model = lumbre_optics::torrance_sparrow(normal, light, DVec3::Z, 1.0, 1.5);
    let expected = model * COEFFICIENT * f64::from(INTENSITY);
    // n.v, n.l and v.h are 10^-4, computed from components of 1: a rounding of 2^-24 is 6e-4 of them, and G/(n.v)
    // has three of them.
    let because = "10^4 F k L, n.v at its floor: three cosines of 1e-4 from components of 1 in f32";
    Outcome::number(expected, middle(&mut world), expected * 2e-3, because)
}

fn ambient_light_beyond_f32() -> Outcome {
    let mut world = pane_of(Material {
        front: Surface { ambient: Vec3::ZERO, ..Surface::default() },
        ..Material::default()
    });
    world.insert_resource(SceneSettings { ambient: Vec3::splat(3e38), ..SceneSettings::default() });
    for _ in 0..4 {
        world.spawn(Light::ambient(Vec3::splat(INTENSITY)));
    }
    Outcome::number(0.0, middle(&mut world), 0.0, "I_a is used up to 10^30, so that times k_a = 0 it is 0")
}

fn a_background_beyond_half_floats() -> Outcome {
    let mut world = pane_of(Material::matt(Vec3::ONE));
    let entity = mesh_entity(&mut world);
    world.despawn(entity);
    world.insert_resource(SceneSettings { background: Vec3::splat(1e30), ..SceneSettings::default() });
    white(&mut world, FrameOptions::default(), "white: cleared to the largest half, 65504, and no infinity")
}

fn emission_beyond_half_floats() -> Outcome {
    let front = Surface { emission: Vec3::splat(3e38), ..Surface::default() };
    let mut world = pane_of(Material { front, ..Material::default() });
    white(&mut world, FrameOptions::default(), "white: the largest half")
}

fn a_bright_pane_behind_a_bright_glass() -> Outcome {
    let front = Surface { emission: Vec3::splat(1e30), ..Surface::default() };
    let bright = Material { front, ..Material::default() };
    let mut world = pane_of(bright.clone());
    let glass = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..bright };
    world.spawn((Mesh(Arc::new(pane())), glass, Transform::from_xyz(0.0, 0.0, 0.5)));
    white(&mut world, FrameOptions::default(), "65504 (a + (1 - a)) is no more than 65504")
}

fn an_exposure_of_1e35() -> Outcome {
    let mut world = coefficients(1.0);
    world.spawn(sun(1e20, true));
    white(
        &mut world,
        FrameOptions { exposure: Some(1e35), ..FrameOptions::default() },
        "white: the tone curve gets no infinity",
    )
}

fn fog_over_emission_of_1e38() -> Outcome {
    let front = Surface { emission: Vec3::splat(3e38), ..Surface::default() };
    let mut world = pane_of(Material { front, ..Material::default() });
    let fog = Fog { mode: FogMode::Linear { start: 0.0, end: 1.0 }, color: Vec3::splat(0.25) };
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, fog: Some(fog), ..SceneSettings::default() });
    Outcome::number(0.25, middle(&mut world), 0.0, "a weight of 0 times a finite number: the fog's colour")
}

fn the_strongest_inverse_square_light_in_the_surface() -> Outcome {
    let mut world = coefficients(1.0);
    let light = Light {
        ambient: Vec3::splat(9.9e25),
        attenuation: Attenuation::INVERSE_SQUARE,
        ..Light::point(Vec3::splat(9.9e25))
    };
    world.spawn((light, Transform::IDENTITY));
    // k_a L_a at the minimum distance of a centimetre, where there is no direction.
    Outcome::number(9.9e29, middle(&mut world), 1e24, "k_a L_a 10^4 at the light: the largest that is taken")
}

fn fog_of_no_numbers() -> Outcome {
    let modes = |number: f32| {
        [
            FogMode::Linear { start: number, end: 8.0 },
            FogMode::Linear { start: 1.0, end: number },
            FogMode::Exponential { density: number },
            FogMode::ExponentialSquared { density: number },
            FogMode::DepthCue { start: 1.0, end: 2.0, near_weight: number, far_weight: number },
        ]
    };
    let mut pairs = Vec::new();
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        for mode in modes(number) {
            let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
            let fog = Some(Fog { mode, color: Vec3::splat(0.25) });
            world.insert_resource(SceneSettings { ambient: Vec3::ONE, fog, ..SceneSettings::default() });
            pairs.push((0.5, middle(&mut world)));
        }
        let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
        let fog = Some(Fog { mode: FogMode::Exponential { density: 0.1 }, color: Vec3::splat(number) });
        world.insert_resource(SceneSettings { ambient: Vec3::ONE, fog, ..SceneSettings::default() });
        pairs.push((0.5, middle(&mut world)));
    }
    Outcome::worst(pairs, 0.0, "a fog whose numbers files may not have is no fog: k_a I_a")
}

fn vertex_colours_of_no_numbers() -> Outcome {
    let mut pairs = Vec::new();
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for shading in lumbre_optics::Shading::ALL {
            let mut mesh = pane();
            mesh.colors = vec![Vec4::new(number, 1.0, 1.0, number); 4];
            let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
            let entity = mesh_entity(&mut world);
            world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
            world.spawn(sun(1.0, true));
            let options = FrameOptions { shading: Some(*shading), ..linear() };
            let pixel = draw(&mut world, 9, 9, &options).0[40];
            pairs.extend([(0.0, pixel.x), (1.0, pixel.y)]);
        }
    }
    Outcome::worst(pairs, 1e-6, "black in the channel without a number, k_a I_a + k_d L in the others")
}

fn infinite_normals() -> Outcome {
    let mut pairs = Vec::new();
    for normal in
        [Vec3::INFINITY, Vec3::new(0.0, 0.0, f32::INFINITY), Vec3::splat(3e38), Vec3::new(f32::NAN, 0.0, 1.0)]
    {
        let mut mesh = pane();
        mesh.normals = vec![normal; 4];
        for shading in [lumbre_optics::Shading::Gouraud, lumbre_optics::Shading::Phong] {
            let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
            let entity = mesh_entity(&mut world);
            world.entity_mut(entity).insert(Mesh(Arc::new(mesh.clone())));
            world.spawn(sun(1.0, true));
            let pixel = draw(&mut world, 9, 9, &FrameOptions { shading: Some(shading), ..linear() }).0[40];
            // A huge normal still has a direction.
            let cosine = if normal.is_finite() { 1.0 / 3f64.sqrt() } else { 0.0 };
            pairs.push((0.5 + 0.5 * cosine, grey(pixel)));
        }
    }
    Outcome::worst(pairs, 1e-6, "no direction: ambient light only; 3e38 (1, 1, 1) is a direction")
}

fn optical_constants_of_no_numbers() -> Outcome {
    let mut pairs = Vec::new();
    let conductor =
        |eta, absorption| Fresnel::Conductor { eta: Vec3::splat(eta), absorption: Vec3::splat(absorption) };
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        for (ior, fresnel) in
            [(number, Fresnel::Dielectric), (1.5, conductor(number, 3.0)), (1.5, conductor(1.0, number))]
        {
            let front = Surface {
                specular: Vec3::ONE,
                diffuse: Vec3::ZERO,
                ambient: Vec3::ZERO,
                ..Surface::default()
            };
            let mut world = pane_of(Material {
                front,
                ior,
                fresnel,
                distribution: Distribution::Gaussian,
                ..Material::default()
            });
            world.insert_resource(SceneSettings {
                reflection: ReflectionModel::TorranceSparrow,
                ..SceneSettings::default()
            });
            world.spawn(sun(1.0, true));
            let got = middle(&mut world);
            // Whatever replaces the constant, the reflected fraction is between 0 and 1: D = G = 1, n.v = 1.
            pairs.push((got.clamp(0.0, 1.0), got));
        }
    }
    Outcome::worst(pairs, 1e-6, "a reflectance in [0, 1], whatever stands in")
}

fn an_exponent_of_no_number() -> Outcome {
    let pairs: Vec<_> = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -3.0]
        .into_iter()
        .flat_map(|shininess| {
            ReflectionModel::ALL.iter().map(move |model| {
                let front = Surface {
                    specular: Vec3::ONE,
                    diffuse: Vec3::ZERO,
                    ambient: Vec3::ZERO,
                    shininess,
                    ..Surface::default()
                };
                let mut world = pane_of(Material { front, ..Material::default() });
                world.insert_resource(SceneSettings {
                    reflection: *model,
                    local_viewer: false,
                    ..SceneSettings::default()
                });
                world.spawn(sun(1.0, true));
                // Light, viewer and normal coincide: the peak, which is the same for every exponent (F = 0.04 for
                // Torrance-Sparrow).
                let peak = if *model == ReflectionModel::TorranceSparrow { 0.04 } else { 1.0 };
                (peak, middle(&mut world))
            })
        })
        .collect();
    Outcome::worst(pairs, 1e-6, "the peak of the lobe is 1 for every exponent, 0.04 times that by Fresnel")
}

fn lights_of_every_wrong_number() -> Outcome {
    let mut world = pane_of(Material::matt(Vec3::splat(0.5)));
    world.spawn(sun(1.0, true));
    let place = Transform::from_xyz(0.0, 0.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y);
    let point = Light { attenuation: Attenuation::NONE, ambient: Vec3::ONE, ..Light::point(Vec3::ONE) };
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1.1e30] {
        for light in [
            Light { diffuse: Vec3::new(1.0, number, 1.0), ..point.clone() },
            Light { specular: Vec3::splat(number), ..point.clone() },
            Light { ambient: Vec3::splat(number), ..point.clone() },
            Light::ambient(Vec3::splat(number)),
            Light::directional(Vec3::splat(number)),
        ] {
            world.spawn((light, place));
        }
    }
    let law = Attenuation::NONE;
    for attenuation in [
        Attenuation { constant: 0.0, ..law },
        Attenuation { constant: -1.0, ..law },
        Attenuation { linear: f32::NAN, ..law },
        Attenuation { quadratic: f32::INFINITY, ..law },
        Attenuation { quadratic: -0.5, ..law },
        Attenuation { range: 0.0, ..law },
        Attenuation { range: -3.0, ..law },
        Attenuation { range: f32::NAN, ..law },
    ] {
        world.spawn((Light { attenuation, ..point.clone() }, place));
    }
    let (pixels, report) = draw(&mut world, 9, 9, &linear());
    assert_eq!(report.statistics.lights, 1, "the sun is left");
    Outcome::number(1.0, grey(pixels[40]), 1e-6, "every one is left out: k_a I_a + k_d L of the sun")
}

fn a_light_left_out_is_named() -> Outcome {
    let mut world = pane_of(Material::default());
    let broken = Light::point(Vec3::new(1.0, f32::NAN, 1.0));
    world.spawn((bevy_ecs::name::Name::new("desk lamp"), broken, Transform::IDENTITY));
    let (_, report) = draw(&mut world, 1, 1, &linear());
    assert_eq!(report.left_out.len(), 1);
    Outcome::text("light \"desk lamp\": diffuse is NaN", report.left_out[0].clone())
}

fn a_fog_left_out_is_named() -> Outcome {
    let mut world = pane_of(Material::default());
    let fog = Some(Fog { mode: FogMode::Exponential { density: f32::NAN }, color: Vec3::ONE });
    world.insert_resource(SceneSettings { fog, ..SceneSettings::default() });
    let (_, report) = draw(&mut world, 1, 1, &linear());
    Outcome::text("density is NaN", report.left_out.join("; "))
}

fn refused(front: Surface) -> String {
    let material = Material { front, ..Material::default() };
    material.validate("shiny").err().map_or_else(|| "accepted".to_owned(), |error| error.to_string())
}

fn coefficients_beyond_1000_are_refused_in_files() -> Outcome {
    let said = refused(Surface { specular: Vec3::new(0.0, 1001.0, 0.0), ..Surface::default() });
    Outcome::text("material \"shiny\": front.specular is 1001; give a number up to 1000", said)
}

fn emission_beyond_1e30_is_refused_in_files() -> Outcome {
    let said = refused(Surface { emission: Vec3::splat(1e31), ..Surface::default() });
    Outcome::text("give a number up to 1e30", said)
}
