//! Reflection models object by object, and the microfacet model with every distribution and Fresnel reflectance,
//! compared with the f64 twin.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Distribution, Fresnel, Light, Lobe, Material, ReflectionModel, Shading, Surface};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::compare::compare;
use lumbre_tests::device::least_compared;
use lumbre_tests::scenes::{ball, ball_of, every_light};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{Canvas, draw, linear};

const SIZE: usize = 192;
/// As in the ball tests, f32 compared with f64. The Fresnel reflectance of a conductor adds some twenty roundings,
/// a Gaussian distribution forty. A matched Blinn exponent, 4 n n·l, is off by 80 times n·l's error at grazing
/// light, with |ln n·h| about 1: 5·10⁻⁵.
const LARGEST: f64 = 1e-4;
const RELATIVE_L2: f64 = 1e-5;

fn gold() -> Fresnel {
    Fresnel::Conductor { eta: Vec3::new(0.17, 0.42, 1.38), absorption: Vec3::new(3.15, 2.35, 1.92) }
}

fn material_of(world: &mut World) -> Mut<'_, Material> {
    let mut query = world.query::<&mut Material>();
    query.iter_mut(world).next().expect("the ball has a material")
}

#[test]
fn every_distribution_and_fresnel_reflectance_agrees_with_the_twin() {
    let (_, light) = every_light().swap_remove(2);
    let model = Some(ReflectionModel::TorranceSparrow);
    let mut frames: Vec<Vec<DVec3>> = Vec::new();
    for distribution in Distribution::ALL {
        for fresnel in [Fresnel::Dielectric, gold(), Fresnel::NormalReflectance] {
            for shading in Shading::ALL {
                let mut world = ball(light.clone());
                {
                    let mut material = material_of(&mut world);
                    (material.distribution, material.fresnel) = (*distribution, fresnel);
                    material.front.shininess = 40.0;
                    material.front.specular = Vec3::new(0.9, 0.5, 0.04);
                }
                let twin_options =
                    TwinOptions { shading: Some(*shading), reflection: model, ..TwinOptions::default() };
                let expected = twin::draw(&mut world, SIZE, SIZE, twin_options)
                    .inside_surfaces(*shading == Shading::Flat);
                let options = FrameOptions { shading: Some(*shading), reflection: model, ..linear() };
                let (got, _) = draw(&mut world, SIZE as u32, SIZE as u32, &options);
                if *shading == Shading::Phong {
                    assert!(!frames.contains(&got), "{distribution:?} {fresnel:?} draws another's frame");
                    frames.push(got.clone());
                }
                let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
                println!(
                    "{:16} {:18} {:8} {difference:?}",
                    distribution.name(),
                    fresnel.name(),
                    shading.name()
                );
                assert!(difference.pixels > least_compared(SIZE * SIZE / 30), "{difference:?}");
                assert!(difference.largest < LARGEST, "{distribution:?} {fresnel:?}: {difference:?}");
                assert!(difference.relative_l2 < RELATIVE_L2, "{distribution:?} {fresnel:?}: {difference:?}");
            }
        }
    }
}

#[test]
fn every_model_in_every_shading_agrees_with_the_twin_side_by_side() {
    let (_, light) = every_light().swap_remove(2);
    // Five objects with five models, which only the objects define. Their polygons are large enough to have an
    // interior.
    let mut world = ball_of(shapes::uv_sphere(1.0, 16, 9), light);
    let query = &mut world.query_filtered::<(Entity, &Mesh, &Material), Without<Camera>>();
    let (first, mesh, material) = query
        .iter(&world)
        .map(|(entity, mesh, material)| (entity, mesh.clone(), material.clone()))
        .next()
        .unwrap();
    world.despawn(first);
    let balls: Vec<Entity> = ReflectionModel::ALL
        .iter()
        .enumerate()
        .map(|(at, model)| {
            let place =
                Transform::from_xyz(0.72 * (at as f64 - 2.0), 0.0, 0.0).with_scale(DVec3::splat(0.34));
            world.spawn((mesh.clone(), material.clone(), *model, place)).id()
        })
        .collect();
    let (width, height) = (5 * SIZE, SIZE);
    for mut camera in world.query::<&mut Camera>().iter_mut(&mut world) {
        camera.projection =
            Projection::Perspective { vertical_fov: 0.225, aspect: None, near: 0.1, far: None };
    }
    let mut canvas = Canvas::new(width as u32, height as u32);
    for shading in Shading::ALL {
        for ball in &balls {
            world.entity_mut(*ball).insert(*shading);
        }
        let expected = twin::draw(&mut world, width, height, TwinOptions::default());
        let (got, _) = canvas.draw(&mut world, &linear());
        let got: Vec<_> = got.into_iter().map(Some).collect();
        let compared = expected.inside_surfaces(*shading == Shading::Flat);
        for (at, model) in ReflectionModel::ALL.iter().enumerate() {
            let of_ball = |pixel: usize| expected.surface[pixel].is_some_and(|(object, _)| object == at);
            let own: Vec<_> =
                compared.iter().enumerate().map(|(pixel, color)| color.filter(|_| of_ball(pixel))).collect();
            let difference = compare(&got, &own);
            println!("{:8} {:16} {difference:?}", shading.name(), model.name());
            assert!(
                difference.pixels > least_compared(if *shading == Shading::Flat { 4000 } else { 12_000 }),
                "{difference:?}"
            );
            assert!(difference.largest < LARGEST, "{} {}: {difference:?}", shading.name(), model.name());
            assert!(
                difference.relative_l2 < RELATIVE_L2,
                "{} {}: {difference:?}",
                shading.name(),
                model.name()
            );
        }
        // Negative control: using one ball's model for the others is detected.
        let wrong = TwinOptions { reflection: Some(ReflectionModel::BlinnMatched), ..TwinOptions::default() };
        let wrong = twin::draw(&mut world, width, height, wrong).inside_surfaces(*shading == Shading::Flat);
        assert!(compare(&got, &wrong).largest > 100.0 * LARGEST);
    }
}

/// A plane lit and, by a viewer infinitely far away, seen along its normal, so that only the Fresnel reflectance of
/// the model remains.
fn straight_on(material: Material) -> DVec3 {
    let mut world = World::new();
    // The plane's own normal is +Y; it is rotated towards the camera.
    let turned = Transform {
        rotation: glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2),
        ..Transform::default()
    };
    world.spawn((Mesh(std::sync::Arc::new(shapes::plane(20.0, 20.0, 1, 1))), material, turned));
    let above = Transform::from_xyz(0.0, 0.0, 5.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::directional(Vec3::ONE), above));
    world.spawn((Camera::default(), above));
    let model = ReflectionModel::TorranceSparrow;
    world.insert_resource(SceneSettings {
        reflection: model,
        local_viewer: false,
        ..SceneSettings::default()
    });
    let (pixels, _) = draw(&mut world, 9, 9, &linear());
    pixels[40]
}

#[test]
fn metallic_roughness_materials_reflect_what_gltf_says_at_normal_incidence() {
    let base = Vec3::new(0.5, 0.25, 0.75);
    let mut plastic = Material::from_metallic_roughness(base, 0.0, 0.3);
    (plastic.front.diffuse, plastic.front.ambient) = (Vec3::ZERO, Vec3::ZERO);
    let metal = Material::from_metallic_roughness(base, 1.0, 0.3);
    for (name, material, expected) in
        [("plastic", plastic, DVec3::splat(0.04)), ("metal", metal, base.as_dvec3())]
    {
        // The peak of the lobe is 1/(4 alpha^2) if it conserves energy, and 1 for a bare lobe.
        let alpha = 0.3f64 * 0.3;
        for (lobe, peak) in [(Lobe::EnergyConserving, 0.25 / (alpha * alpha)), (Lobe::Bare, 1.0)] {
            let got = straight_on(Material { lobe, ..material.clone() });
            // Some tens of roundings in the Fresnel term, and that of 0.04 in f32.
            let apart = (got - peak * expected).abs().max_element();
            assert!(apart < 1e-5 * peak, "{name}, {}: {got} is not {}", lobe.name(), peak * expected);
        }
    }
    let front = Surface { diffuse: Vec3::ZERO, specular: Vec3::ONE, shininess: 80.0, ..Surface::default() };
    let glass = straight_on(Material { front, ..Material::default() });
    assert!((glass - 0.04).abs().max_element() < 1e-5, "glass of index 1.5 reflects 0.04, not {glass}");
}

#[test]
fn an_object_has_a_model_of_its_own_from_one_frame_to_the_next() {
    let (_, light) = every_light().swap_remove(2);
    let mut world = ball(light);
    let ball = world.query_filtered::<Entity, With<Mesh>>().iter(&world).next().unwrap();
    let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
    let by_options = |model| FrameOptions { reflection: Some(model), ..linear() };
    let (scenes, _) = canvas.draw(&mut world, &linear());
    for model in ReflectionModel::ALL {
        world.entity_mut(ball).insert(*model);
        let (own, _) = canvas.draw(&mut world, &linear());
        let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
        let difference = compare(&own.iter().copied().map(Some).collect::<Vec<_>>(), &expected);
        assert!(difference.largest < LARGEST, "{}: {difference:?}", model.name());
        // The caller's option overrides all.
        let (forced, _) = canvas.draw(&mut world, &by_options(ReflectionModel::Phong));
        assert!(forced == scenes, "{}: the option does not override the object's own", model.name());
        assert!((own == scenes) == (*model == ReflectionModel::Phong), "{} has no effect", model.name());
    }
    world.entity_mut(ball).remove::<ReflectionModel>();
    assert!(canvas.draw(&mut world, &linear()).0 == scenes, "the scene's model comes back");
}

#[test]
fn a_matt_material_pays_for_no_highlight() {
    let (_, light) = every_light().swap_remove(2);
    let mut world = ball(light);
    let variants = |world: &mut World| {
        let explanation = lumbre_render::explain(world, &linear(), 64, 64).unwrap();
        explanation.variants.into_keys().collect::<Vec<_>>().join("\n")
    };
    let shiny = variants(&mut world);
    assert!(shiny.contains("LOCAL_VIEWER") && !shiny.contains("MATT"), "{shiny}");
    material_of(&mut world).front.specular = Vec3::ZERO;
    let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
    let mut frames = Vec::new();
    for model in ReflectionModel::ALL {
        world.resource_mut::<SceneSettings>().reflection = *model;
        let matt = variants(&mut world);
        assert!(matt.contains("MATT") && matt.contains("REFLECTION_PHONG"), "{matt}");
        assert!(!matt.contains("LOCAL_VIEWER"), "without a highlight the viewer does not matter: {matt}");
        frames.push(canvas.draw(&mut world, &linear()).0);
    }
    assert!(frames.windows(2).all(|pair| pair[0] == pair[1]), "a model shows without a highlight");
    for shading in Shading::ALL {
        let options = TwinOptions { shading: Some(*shading), ..TwinOptions::default() };
        let expected = twin::draw(&mut world, SIZE, SIZE, options).inside_surfaces(*shading == Shading::Flat);
        let (got, _) = canvas.draw(&mut world, &FrameOptions { shading: Some(*shading), ..linear() });
        let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
        assert!(
            difference.pixels > least_compared(SIZE * SIZE / 30) && difference.largest < LARGEST,
            "{difference:?}"
        );
    }
}
