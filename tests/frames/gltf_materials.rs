//! glTF's metallic-roughness materials compared with the reflectance that the specification defines (glTF 2.0,
//! appendix B), which is implemented independently here: balls over roughness and metalness under one point light,
//! in every reflection model.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Lobe, Material, ReflectionModel, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::device::least_compared;
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const ROUGHNESS: [f64; 6] = [0.15, 0.3, 0.45, 0.6, 0.8, 1.0];
const METALLIC: [f64; 3] = [0.0, 0.5, 1.0];
const BASE: DVec3 = DVec3::new(0.8, 0.3, 0.2);
/// Intensity of the lamp in candela.
const INTENSITY: f64 = 400.0;
const LAMP: DVec3 = DVec3::new(4.0, 6.0, 12.0);
const RADIUS: f64 = 0.9;
/// Side length in pixels of a ball's square, which is 2 m.
const PIXELS: usize = 64;
/// Squared distance from the centre of a ball's picture, in radii, up to which it is compared: up to 76 degrees.
/// Beyond it one pixel contains many directions.
const RIM: f64 = 0.94;

/// The reflectance of appendix B (B.2.1 to B.3.5) times the cosine, per steradian.
fn appendix_b(roughness: f64, metallic: f64, normal: DVec3, light: DVec3, viewer: DVec3) -> DVec3 {
    let alpha = roughness * roughness;
    let half = (light + viewer).normalize();
    let (n_l, n_v, n_h, v_h) = (normal.dot(light), normal.dot(viewer), normal.dot(half), viewer.dot(half));
    if n_l <= 0.0 || n_v <= 0.0 {
        return DVec3::ZERO;
    }
    let a = alpha * alpha;
    let distribution = a / (PI * ((n_h * n_h) * (a - 1.0) + 1.0).powi(2));
    let root = |cosine: f64| (a + (1.0 - a) * cosine * cosine).sqrt();
    // Height-correlated masking and shadowing.
    let visibility = 0.5 / (n_l * root(n_v) + n_v * root(n_l));
    let specular = visibility * distribution;
    let weight = (1.0 - v_h).powi(5);
    let metal = specular * (BASE + (DVec3::ONE - BASE) * weight);
    let fresnel = 0.04 + 0.96 * weight;
    let dielectric = BASE * FRAC_1_PI * (1.0 - fresnel) + DVec3::splat(specular * fresnel);
    dielectric.lerp(metal, metallic) * n_l
}

fn middle(column: usize, row: usize) -> DVec3 {
    DVec3::new(2.0 * column as f64 - 5.0, 2.0 - 2.0 * row as f64, 0.0)
}

fn balls(lobe: Option<Lobe>) -> World {
    let mut world = World::new();
    let ball = Arc::new(shapes::uv_sphere(RADIUS as f32, 192, 96));
    for (row, metallic) in METALLIC.into_iter().enumerate() {
        for (column, roughness) in ROUGHNESS.into_iter().enumerate() {
            let mut material =
                Material::from_metallic_roughness(BASE.as_vec3(), metallic as f32, roughness as f32);
            material.lobe = lobe.unwrap_or(material.lobe);
            let place = Transform::from_translation(middle(column, row));
            world.spawn((Mesh(Arc::clone(&ball)), material, place));
        }
    }
    // Divided by π, as the importer does with candela.
    world.spawn((Light::point(Vec3::splat((INTENSITY / PI) as f32)), Transform::from_translation(LAMP)));
    let projection = Projection::Orthographic { half_width: 6.0, half_height: 3.0, near: 0.1, far: 100.0 };
    world.spawn((Camera { projection, exposure: 1.0 }, Transform::from_xyz(0.0, 0.0, 20.0)));
    // Parallel rays, and an infinitely distant viewer.
    world.insert_resource(SceneSettings { local_viewer: false, ..SceneSettings::default() });
    world
}

/// Returns the relative root mean square and the largest difference from appendix B for each ball.
fn errors(pixels: &[DVec3]) -> [[(f64, f64); 6]; 3] {
    let mut found = [[(0.0, 0.0); 6]; 3];
    for (row, metallic) in METALLIC.into_iter().enumerate() {
        for (column, roughness) in ROUGHNESS.into_iter().enumerate() {
            let (mut squares, mut size, mut largest) = (0.0, 0.0, 0.0f64);
            for y in 0..PIXELS {
                for x in 0..PIXELS {
                    let at = |pixel: usize| (pixel as f64 + 0.5) / PIXELS as f64 * 2.0 - 1.0;
                    let (x_of, y_of) = (at(x) / RADIUS, -at(y) / RADIUS);
                    let squared = x_of * x_of + y_of * y_of;
                    if squared > RIM {
                        continue;
                    }
                    let normal = DVec3::new(x_of, y_of, (1.0 - squared).sqrt());
                    let point = middle(column, row) + RADIUS * normal;
                    let to_light = LAMP - point;
                    let light = to_light.normalize();
                    let expected = appendix_b(roughness, metallic, normal, light, DVec3::Z) * INTENSITY
                        / to_light.length_squared();
                    let got = pixels[(row * PIXELS + y) * 6 * PIXELS + column * PIXELS + x];
                    squares += (got - expected).length_squared();
                    size += expected.length_squared();
                    largest = largest.max((got - expected).abs().max_element());
                }
            }
            found[row][column] = ((squares / size).sqrt(), largest);
        }
    }
    found
}

fn frame(world: &mut World, model: ReflectionModel) -> Vec<DVec3> {
    let options = FrameOptions { reflection: Some(model), shading: Some(Shading::Phong), ..linear() };
    draw(world, 6 * PIXELS as u32, 3 * PIXELS as u32, &options).0
}

/// Returns the root mean square over the balls.
fn overall(errors: &[[(f64, f64); 6]; 3]) -> f64 {
    let all = errors.iter().flatten();
    (all.map(|(relative, _)| relative * relative).sum::<f64>() / 18.0).sqrt()
}

#[test]
fn metallic_roughness_balls_look_as_the_specification_says() {
    println!("relative root mean square from appendix B (largest difference), by roughness {ROUGHNESS:?}");
    let mut found = Vec::new();
    for model in ReflectionModel::ALL {
        let kept = errors(&frame(&mut balls(None), *model));
        let bare = errors(&frame(&mut balls(Some(Lobe::Bare)), *model));
        for (metallic, row) in METALLIC.iter().zip(&kept) {
            let row: Vec<String> =
                row.iter().map(|(relative, largest)| format!("{relative:.3} ({largest:.3})")).collect();
            println!("{:16} metallic {metallic:3}: {}", model.name(), row.join("  "));
        }
        println!("{:16} all: {:.3}, with bare lobes {:.3}", model.name(), overall(&kept), overall(&bare));
        // With bare lobes these materials would be a plastic without a highlight, and metals without light.
        assert!(overall(&kept) < 0.5 * overall(&bare), "{}", model.name());
        found.push((*model, kept));
    }
    for (model, errors) in found {
        let (of_all, of_dielectrics) = match model {
            // The specification's own reflectance. What remains are the diffuse part, which here is not reduced by
            // what the surface reflects before it (4 % at normal incidence), and the facets of the balls.
            ReflectionModel::TorranceSparrow => (0.035, 0.05),
            // Lobes without the tail of the specification's, and without masking.
            ReflectionModel::Blinn | ReflectionModel::BlinnMatched | ReflectionModel::Blinn4n => (0.19, 0.19),
            ReflectionModel::Phong => (0.21, 0.2),
        };
        assert!(overall(&errors) < of_all, "{}: {}", model.name(), overall(&errors));
        let worst = errors[0].iter().map(|(relative, _)| *relative).fold(0.0, f64::max);
        assert!(worst < of_dielectrics, "{}: {worst}", model.name());
    }
}

#[test]
fn a_smooth_plastic_shows_the_lamp() {
    // At roughness .15 the peak is .04/(4 alpha^2) = 20 times k_s, much brighter than the diffuse light around it.
    for model in ReflectionModel::ALL {
        let pixels = frame(&mut balls(None), *model);
        let ball =
            |pixel: &(usize, &DVec3)| pixel.0 % (6 * PIXELS) < PIXELS && pixel.0 / (6 * PIXELS) < PIXELS;
        let blue = pixels.iter().enumerate().filter(ball).map(|(_, pixel)| pixel.z).fold(0.0, f64::max);
        // The base colour has .2 of blue; the lamp's irradiance over pi is at most .7.
        assert!(blue > 1.5, "{}: {blue}", model.name());
        let bare = frame(&mut balls(Some(Lobe::Bare)), *model);
        let faint = bare.iter().enumerate().filter(ball).map(|(_, pixel)| pixel.z).fold(0.0, f64::max);
        assert!(faint < 0.25, "{}: {faint}", model.name());
    }
}

#[test]
fn energy_conserving_frames_agree_with_the_twin() {
    for model in ReflectionModel::ALL {
        for filtered in [false, true] {
            let mut world = balls(None);
            let lens = world.query_filtered::<Entity, With<Camera>>().single(&world).unwrap();
            world.entity_mut(lens).insert((Camera::default(), Transform::from_xyz(0.0, 0.0, 14.0)));
            world.resource_mut::<SceneSettings>().local_viewer = true;
            let options =
                FrameOptions { reflection: Some(*model), specular_antialiasing: Some(filtered), ..linear() };
            let twin_options = TwinOptions {
                reflection: Some(*model),
                specular_antialiasing: Some(filtered),
                ..TwinOptions::default()
            };
            let expected = twin::draw(&mut world, 192, 96, twin_options).inside_surfaces(false);
            let (got, _) = draw(&mut world, 192, 96, &options);
            let got: Vec<_> = got.into_iter().map(Some).collect();
            let found = lumbre_tests::compare::compare(&got, &expected);
            println!("{:16} filtered {filtered}: {found:?}", model.name());
            assert!(found.pixels > least_compared(1200), "{found:?}");
            // Sharp lobes with the exponent 4000, 500 times as bright at their peak as bare ones, of rounded
            // cosines.
            assert!(found.relative_l2 < 2e-4, "{}: {found:?}", model.name());
        }
    }
}
