//! Document [M]'s tables as frames: 2.1, one coefficient after the other, and 1.1, the three shadings on 990
//! polygons. Each is compared with the twin and with values that are known without it.

use std::collections::HashMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_mesh::shapes;
use lumbre_optics::Shading;
use lumbre_scene::{Camera, Mesh, Projection, SceneSettings, Transform};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::device::{least_compared, subpixel_bits};
use lumbre_tests::scenes::documents::{
    AMBIENT, AMBIENT_LIGHT, BACKGROUND, COLOR, DIFFUSE, EXPONENTS, EYE, LIGHT, SPECULAR, table_1_1,
    table_2_1, toward_light,
};
use lumbre_tests::twin::{self, TwinFrame, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: usize = 160;

/// As in balls.rs, f32 compared with f64: n (a few ulp) for the power, with n = 100 at most here, 100 · 4 · 2^-24 =
/// 2.4e-5, and the position's rounding times the slope of the highlight. Measured at most 2.4e-5.
const LARGEST: f64 = 1e-4;

fn frame(world: &mut World) -> Vec<DVec3> {
    draw(world, SIZE as u32, SIZE as u32, &linear()).0
}

fn twin_of(world: &mut World) -> TwinFrame {
    twin::draw(world, SIZE, SIZE, TwinOptions::default())
}

fn difference(got: &[DVec3], expected: &[Option<DVec3>]) -> Difference {
    compare(&got.iter().copied().map(Some).collect::<Vec<_>>(), expected)
}

#[test]
fn table_2_1_agrees_with_the_twin() {
    for row in 0..3 {
        for column in 0..3 {
            let expected = twin_of(&mut table_2_1(row, column)).inside_surfaces(false);
            let got = frame(&mut table_2_1(row, column));
            let difference = difference(&got, &expected);
            println!("table 2.1, row {row}, column {column}: {difference:?}");
            assert!(difference.pixels > least_compared(SIZE * SIZE / 2), "{difference:?}");
            assert!(difference.largest < LARGEST, "row {row}, column {column}: {difference:?}");
            // Negative control: the neighbouring cell.
            let beside = frame(&mut table_2_1(row, (column + 1) % 3));
            let wrong = compare(&beside.into_iter().map(Some).collect::<Vec<_>>(), &expected);
            assert!(wrong.largest > 0.05, "row {row}: column {column} looks like the next");
        }
    }
}

#[test]
fn the_plain_ambient_ball_is_everywhere_the_same_and_exactly_k_a_i_a() {
    // "No se observa tridimensionalidad": one colour, whatever the normal.
    let surface = twin_of(&mut table_2_1(0, 0)).inside_surfaces(false);
    for (column, ambient) in AMBIENT.into_iter().enumerate() {
        // Products of numbers with few binary digits, which are exact in f32.
        let expected = (COLOR * ambient * AMBIENT_LIGHT).as_dvec3();
        assert_eq!(expected, COLOR.as_dvec3() * f64::from(ambient) * f64::from(AMBIENT_LIGHT));
        let pixels = frame(&mut table_2_1(0, column));
        for (pixel, inside) in pixels.iter().zip(&surface) {
            assert!(*pixel == expected || (inside.is_none() && *pixel == BACKGROUND.as_dvec3()), "{pixel}");
        }
        let ball = pixels.iter().filter(|pixel| **pixel == expected).count();
        assert!(ball > SIZE * SIZE / 2, "{ball} pixels show the ball");
    }
}

/// Changes a scene to an orthographic camera and an infinitely distant viewer, with a finer ball, so that a pixel's
/// position determines the normal.
fn from_afar(mut world: World) -> World {
    let mut cameras = world.query::<(&mut Camera, &mut Transform)>();
    for (mut camera, mut place) in cameras.iter_mut(&mut world) {
        camera.projection =
            Projection::Orthographic { half_width: 1.0, half_height: 1.0, near: 0.5, far: 2.0 * EYE };
        *place = Transform::from_xyz(0.0, 0.0, EYE);
    }
    world.resource_mut::<SceneSettings>().local_viewer = false;
    for mut mesh in world.query::<&mut Mesh>().iter_mut(&mut world) {
        *mesh = Mesh(Arc::new(shapes::uv_sphere(1.0, 512, 256)));
    }
    world
}

/// Returns the exact normals of the pixels of such a frame that are not near the rim.
fn normals() -> Vec<Option<DVec3>> {
    let at = |index: usize| (2 * index + 1) as f64 / SIZE as f64 - 1.0;
    let normal = |index: usize| {
        let (x, y) = (at(index % SIZE), -at(index / SIZE));
        let across = x * x + y * y;
        (across < 0.9 * 0.9).then(|| DVec3::new(x, y, (1.0 - across).sqrt()))
    };
    (0..SIZE * SIZE).map(normal).collect()
}

/// Largest error of the mesh's normals at such a pixel, in radians: a facet with the diagonal h = 2π/512 · √2 is up
/// to h²/8 below the sphere, and its interpolated normal is that of a point up to h²/8 · tan θ away, with tan θ ≤
/// 2.07.
const NORMAL: f64 = 0.0174 * 0.0174 / 8.0 * 2.07;

#[test]
fn the_diffuse_part_is_lamberts_cosine_and_the_same_in_every_column() {
    for column in 0..3 {
        let ambient = frame(&mut from_afar(table_2_1(0, column)));
        let diffuse = frame(&mut from_afar(table_2_1(1, column)));
        let (mut brightest, mut dark) = (DVec3::ZERO, 0);
        for ((ambient, diffuse), normal) in ambient.iter().zip(&diffuse).zip(normals()) {
            let Some(normal) = normal else { continue };
            let full = COLOR.as_dvec3() * f64::from(DIFFUSE) * f64::from(LIGHT);
            let expected = full * normal.dot(toward_light()).max(0.0);
            let added = *diffuse - *ambient;
            // A point of the unit ball is the less determined, the more obliquely its pixel's ray meets it.
            let moved =
                subpixel_bits().map_or(0.0, |bits| 1.0 / f64::from(SIZE as u32 >> 1 << bits) / normal.z);
            assert!(
                (added - expected).abs().max_element() < full.max_element() * (NORMAL + moved) + 1e-6,
                "{added} is not {expected}"
            );
            brightest = brightest.max(added);
            dark += usize::from(added == DVec3::ZERO);
            if normal.dot(toward_light()) < -NORMAL {
                assert_eq!(added, DVec3::ZERO, "light from behind");
            }
        }
        // Where the normal points to the light: k_d I_p O_d, up to half a pixel.
        let full = COLOR.as_dvec3() * f64::from(DIFFUSE) * f64::from(LIGHT);
        assert!((brightest - full).abs().max_element() < 1e-4, "{brightest} is not {full}");
        assert!(dark > 100, "only {dark} pixels lie in the dark");
    }
}

#[test]
fn highlights_have_the_peak_and_the_half_width_of_their_exponent() {
    // With the infinite viewer r.v depends on the normal alone: r.v = 2 (n.l)(n.v) - l.v, which is 1 where n is h.
    let (light, viewer) = (toward_light(), DVec3::Z);
    let half_vector = (light + viewer).normalize();
    let peak = f64::from(SPECULAR) * f64::from(LIGHT);
    // Directions across the plane of l and v, and within it.
    let across = light.cross(viewer).normalize();
    let along = across.cross(half_vector);
    for (column, exponent) in EXPONENTS.into_iter().enumerate() {
        let n = f64::from(exponent);
        let diffuse = frame(&mut from_afar(table_2_1(1, column)));
        let specular = frame(&mut from_afar(table_2_1(2, column)));
        // cos^n is 1/2 at this angle between r and v.
        let half = 0.5f64.powf(1.0 / n).acos();
        // In the plane of l and v the normal turns r by twice its own angle; across it r.v = cos^2 a (1 + l.v) -
        // l.v.
        let half_along = 0.5 * half;
        let half_across = ((half.cos() + light.dot(viewer)) / (1.0 + light.dot(viewer))).sqrt().acos();
        // The slope of cos^n is at most sqrt(n/e) per radian, and r turns by twice as much as the normal.
        let slope = peak * (n / std::f64::consts::E).sqrt() * 2.0;
        let (mut brightest, mut widest, mut nearest) = (0.0f64, 0.0f64, f64::INFINITY);
        let (mut width_along, mut width_across) = (0.0f64, 0.0f64);
        for ((diffuse, specular), normal) in diffuse.iter().zip(&specular).zip(normals()) {
            let Some(normal) = normal else { continue };
            let added = *specular - *diffuse;
            let white = (added - DVec3::splat(added.x)).abs().max_element() < 1e-6;
            assert!(white, "a white light's highlight is white: {added}");
            let cosine = 2.0 * normal.dot(light) * normal.dot(viewer) - light.dot(viewer);
            let lit = normal.dot(light) > 0.0;
            let expected = if lit { peak * cosine.max(0.0).powf(n) } else { 0.0 };
            let bound = slope * NORMAL + LARGEST;
            assert!((added.x - expected).abs() < bound, "n = {n}: {} is not {expected} at {normal}", added.x);
            brightest = brightest.max(added.x);
            let angle = cosine.clamp(-1.0, 1.0).acos();
            if added.x >= 0.5 * peak {
                widest = widest.max(angle);
                width_along = width_along.max(normal.dot(along).abs().asin());
                width_across = width_across.max(normal.dot(across).abs().asin());
            } else {
                nearest = nearest.min(angle);
            }
        }
        println!(
            "n = {n}: peak {brightest:.5} of {peak:.5}; half of it at {:.3} to {:.3} degrees between r and v, closed form {:.3}; \
             half widths {:.2} and {:.2}, closed form {:.2} and {:.2}",
            widest.to_degrees(),
            nearest.to_degrees(),
            half.to_degrees(),
            width_along.to_degrees(),
            width_across.to_degrees(),
            half_along.to_degrees(),
            half_across.to_degrees()
        );
        // Half a pixel's diagonal, foreshortened, which is the largest distance of the peak from the nearest pixel
        // centre.
        let pixel = 0.5f64.sqrt() * 2.0 / SIZE as f64 / half_vector.z;
        assert!(brightest <= peak * (1.0 + 1e-6) && brightest > peak * (2.0 * pixel).cos().powf(n) - 1e-5);
        // Pixels on either side of the half value are distinguished by their normals, so the size of a pixel does
        // not matter.
        assert!(widest < half + 2.0 * NORMAL + 1e-5, "n = {n}: {widest} is beyond {half}");
        assert!(nearest > half - 2.0 * NORMAL - 1e-5, "n = {n}: {nearest} is within {half}");
        // The width of the lit patch agrees up to the pixels' size, with foreshortening at the rim of up to 1 / cos
        // 35 degrees.
        let apart = (width_along - half_along).abs().max((width_across - half_across).abs());
        assert!(
            apart < 2.0 * pixel,
            "n = {n}: {width_along} of {half_along}, {width_across} of {half_across}"
        );
    }
}

#[test]
fn table_1_1_agrees_with_the_twin() {
    let mut frames = Vec::new();
    for shading in Shading::ALL {
        let twin = twin_of(&mut table_1_1(*shading));
        let got = frame(&mut table_1_1(*shading));
        let difference = difference(&got, &twin.inside_surfaces(*shading == Shading::Flat));
        println!("table 1.1, {:8}: {difference:?}", shading.name());
        let least = SIZE * SIZE / if *shading == Shading::Flat { 50 } else { 2 };
        assert!(difference.pixels > least_compared(least), "{difference:?}");
        assert!(difference.largest < LARGEST, "{}: {difference:?}", shading.name());
        frames.push(got);
    }
    let mut meshes = table_1_1(Shading::Flat);
    let mesh = meshes.query::<&Mesh>().single(&meshes).unwrap();
    let points = lumbre_mesh::weld_positions(&mesh.0.positions);
    let points = points.iter().enumerate().filter(|&(vertex, &first)| vertex == first as usize).count();
    assert_eq!((mesh.0.triangle_count(), points), (990, 497));
    assert!(frames[0] != frames[1] && frames[1] != frames[2], "the shadings draw one picture");
}

#[test]
fn flat_polygons_have_one_colour_and_the_smooth_shadings_many() {
    let colors_per_polygon = |shading| {
        let twin = twin_of(&mut table_1_1(shading));
        let pixels = frame(&mut table_1_1(shading));
        let inside = twin.inside_surfaces(true);
        let mut polygons: HashMap<(usize, usize), Vec<DVec3>> = HashMap::new();
        for ((pixel, surface), inside) in pixels.iter().zip(&twin.surface).zip(&inside) {
            if let (Some(surface), Some(_)) = (surface, inside) {
                polygons.entry(*surface).or_default().push(*pixel);
            }
        }
        polygons.retain(|_, colors| colors.len() >= 4);
        assert!(polygons.len() > 80, "{} polygons are large enough", polygons.len());
        let of_one =
            polygons.values().filter(|colors| colors.iter().all(|color| *color == colors[0])).count();
        (of_one, polygons.len())
    };
    let (of_one, all) = colors_per_polygon(Shading::Flat);
    assert_eq!(of_one, all, "a flat polygon has one colour");
    for shading in [Shading::Gouraud, Shading::Phong] {
        let (of_one, all) = colors_per_polygon(shading);
        assert!(of_one * 20 < all, "{}: {of_one} of {all} polygons have one colour", shading.name());
    }
}

#[test]
fn phong_keeps_the_highlight_that_gouraud_and_flat_lose_between_vertices() {
    // The highlight's peak is known: k_s I_p plus the ambient and diffuse light there; the local viewer is 6 radii
    // away.
    let brightest = |shading| frame(&mut table_1_1(shading)).iter().map(|pixel| pixel.y).fold(0.0, f64::max);
    let (flat, gouraud, phong) =
        (brightest(Shading::Flat), brightest(Shading::Gouraud), brightest(Shading::Phong));
    let mut fine = table_1_1(Shading::Phong);
    for mut mesh in fine.query::<&mut Mesh>().iter_mut(&mut fine) {
        *mesh = Mesh(Arc::new(shapes::uv_sphere(1.0, 512, 256)));
    }
    let exact = frame(&mut fine).iter().map(|pixel| pixel.y).fold(0.0, f64::max);
    println!(
        "brightest pixel: flat {flat:.4}, Gouraud {gouraud:.4}, Phong {phong:.4}, of a fine sphere {exact:.4}"
    );
    assert!((phong - exact).abs() < 0.01 * exact, "Phong's peak is the sphere's");
    assert!(gouraud < 0.99 * exact && flat < 0.99 * exact, "the others lose part of it");
}
