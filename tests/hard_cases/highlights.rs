//! Cases of highlights in whole frames: exponents from 1 to a million at several angles near the peak, and
//! highlights smaller than a pixel.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, ReflectionModel, Surface};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::panes::{pane, pane_of};

use crate::adapter::{Canvas, draw, linear};
use crate::case::Outcome;

crate::cases! {
    "n = 1 to 10^6" {
        a_frame_of_exponent_1, a_frame_of_exponent_10, a_frame_of_exponent_128, a_frame_of_exponent_256,
        a_frame_of_exponent_257, a_frame_of_exponent_8192, a_frame_of_exponent_100_000, a_frame_of_exponent_a_million,
    }
    "specular aliasing" { a_highlight_smaller_than_a_pixel_keeps_its_light, without_the_filter_it_does_not }
}

/// The fractions of the peak at which the highlight is evaluated.
const SHARES: [f64; 6] = [1.0, 0.99, 0.9, 0.5, 0.1, 0.01];

fn shiny(shininess: f32) -> Material {
    let front = Surface {
        ambient: Vec3::ZERO,
        diffuse: Vec3::ZERO,
        specular: Vec3::ONE,
        shininess,
        ..Surface::default()
    };
    Material { front, ..Material::default() }
}

/// A distant light along a distant viewer's line of sight, and a pane with tilted normals: r.v is cos 2a for Phong
/// and n.h is cos a for Blinn, the same at every pixel.
fn peaks(shininess: f32, bound: f64, because: &'static str) -> Outcome {
    let mut pairs = Vec::new();
    for model in [ReflectionModel::Phong, ReflectionModel::Blinn] {
        let mut world = pane_of(shiny(shininess));
        world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
        world.insert_resource(SceneSettings {
            reflection: model,
            local_viewer: false,
            ..SceneSettings::default()
        });
        let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
        let mut canvas = Canvas::new(3, 3);
        for share in SHARES {
            let angle = share.powf(1.0 / f64::from(shininess)).acos();
            let tilt = if model == ReflectionModel::Phong { 0.5 * angle } else { angle };
            let mut mesh = pane();
            mesh.normals = vec![DVec3::new(tilt.sin(), 0.0, tilt.cos()).as_vec3(); 4];
            // The normal after rounding to f32, normalized.
            let normal = mesh.normals[0].as_dvec3().normalize();
            world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
            let cosine = match model {
                ReflectionModel::Phong => (2.0 * normal.z * normal - DVec3::Z).z,
                _ => normal.z,
            };
            // cos^n computed from the sine, as the cosine of a small angle loses its digits even in f64.
            let sine = normal.x * if model == ReflectionModel::Phong { 2.0 * normal.z } else { 1.0 };
            let logarithm = if cosine > 0.5 { 0.5 * (-sine * sine).ln_1p() } else { cosine.max(0.0).ln() };
            let expected = if cosine > 0.0 { (f64::from(shininess) * logarithm).exp() } else { 0.0 };
            pairs.push((expected, canvas.draw(&mut world, &linear()).0[4].x));
        }
    }
    Outcome::worst(pairs, bound, because)
}

// Up to exponent 256 it is pow(cosine, n): its logarithm is good to 2^-21, 8 roundings, and the cosine to some 10
// after two unit vectors and a reflection, so the bound is n (10 + 8 ln 2) 2^-24. Beyond it the sine matters: n/2
// times the error of sin^2, which is 5 roundings of the sine of the highlight's edge, sqrt(2 ln 100 / n), and 2 10
// roundings from the reflected vector; exp and the series add 10^-6.

fn plain(shininess: f32) -> Outcome {
    let u = 0.5f64.powi(24);
    let bound = f64::from(shininess) * 16.0 * u + 20.0 * u;
    peaks(shininess, bound, "pow(cos, n) from 100 to 1 % of the peak: n 16 u, of log2 and of the cosine")
}

fn sharp(shininess: f32) -> Outcome {
    let u = 0.5f64.powi(24);
    // The lobe has its steepest slope where s^2 = 1/n, e^(-1/2) sqrt(n), times a sine that is off by 20 u.
    let bound = 0.61 * f64::from(shininess).sqrt() * 20.0 * u + 1e-6;
    peaks(
        shininess,
        bound,
        "from |n x h|^2, 100 to 1 % of the peak: the lobe's slope sqrt(n/e) times 20 u of the sine, 1e-6",
    )
}

fn a_frame_of_exponent_1() -> Outcome {
    plain(1.0)
}

fn a_frame_of_exponent_10() -> Outcome {
    plain(10.0)
}

fn a_frame_of_exponent_128() -> Outcome {
    plain(128.0)
}

fn a_frame_of_exponent_256() -> Outcome {
    plain(256.0)
}

fn a_frame_of_exponent_257() -> Outcome {
    sharp(257.0)
}

fn a_frame_of_exponent_8192() -> Outcome {
    sharp(8192.0)
}

fn a_frame_of_exponent_100_000() -> Outcome {
    sharp(1e5)
}

fn a_frame_of_exponent_a_million() -> Outcome {
    sharp(1e6)
}

const BALL: u32 = 64;
const EXPONENT: f32 = 1e5;

/// Returns the light that a ball of 1 m reflects to a distant viewer behind the light, relative to its exact value:
/// the integral of cos^n over the ball's disc, 2 pi/(n + 2). The highlight is a tenth of a pixel wide; the ball is
/// shifted by fractions of a pixel.
fn light_of_a_ball(filtered: bool) -> Vec<f64> {
    let mut world = World::new();
    let ball = world.spawn((Mesh(Arc::new(shapes::uv_sphere(1.0, 256, 128))), shiny(EXPONENT))).id();
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    let reflection = ReflectionModel::Blinn;
    world.insert_resource(SceneSettings { reflection, local_viewer: false, ..SceneSettings::default() });
    let side = 1.25;
    let projection = Projection::Orthographic { half_width: side, half_height: side, near: 0.5, far: 16.0 };
    world.spawn((Camera { projection, exposure: 1.0 }, Transform::from_xyz(0.0, 0.0, 4.0)));
    let pixel = 2.0 * side / f64::from(BALL);
    let expected = 2.0 * std::f64::consts::PI / (f64::from(EXPONENT) + 2.0);
    let options = FrameOptions { specular_antialiasing: Some(filtered), ..linear() };
    [(0.0, 0.0), (0.5, 0.0), (0.25, 0.5), (0.5, 0.5), (0.1, 0.7)]
        .into_iter()
        .map(|(x, y)| {
            world.entity_mut(ball).insert(Transform::from_xyz(x * pixel, y * pixel, 0.0));
            let (pixels, _) = draw(&mut world, BALL, BALL, &options);
            pixels.iter().map(|color| color.x).sum::<f64>() * pixel * pixel / expected
        })
        .collect()
}

fn a_highlight_smaller_than_a_pixel_keeps_its_light() -> Outcome {
    // The widened lobe is a Gaussian whose standard deviation is half a pixel or more. Sums over pixels ripple by 2
    // exp(-2 pi^2 / 4) = 1.4 % along each axis, and derivatives are differences over a pixel of 0.04 rad, off by
    // less than 1 %.
    let pairs = light_of_a_ball(true).into_iter().map(|got| (1.0, got));
    Outcome::worst(
        pairs,
        0.04,
        "its light over 2 pi/(n + 2), wherever it falls: sampling ripples by 1.4 % an axis, derivatives 1 %",
    )
}

fn without_the_filter_it_does_not() -> Outcome {
    // Control: between four pixels the highlight is not visible at all.
    let least = light_of_a_ball(false).into_iter().fold(f64::MAX, f64::min);
    Outcome::number(
        0.0,
        least,
        1e-6,
        "negative control: unfiltered, a tenth of a pixel wide, it falls between pixels",
    )
}
