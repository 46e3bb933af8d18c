//! Path tracing against closed forms, against the ray tree, and against the irradiance that an independent
//! path tracer found; hard cases of glass; and the same bits on any number of threads.

mod support;

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec2, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Light, Lobe, Material, ReflectionModel, SpotCone, Surface};
use lumbre_scene::{Medium, Mesh, Quadric, QuadricShape, Transform};
use lumbre_trace::{Ended, Integrator, Kind, TraceOptions, Tracer};

use support::*;

/// Returns the mean over all pixels and channels.
fn mean(pixels: &[DVec3]) -> f64 {
    pixels.iter().map(|pixel| pixel.element_sum() / 3.0).sum::<f64>() / pixels.len() as f64
}

#[test]
fn a_furnace_of_one_reflectance_glows_as_the_series_says() {
    // Inside a closed box of emission 1 and reflectance ρ, the radiance is 1/(1 - ρ) in every direction.
    for reflectance in [0.0, 0.5, 0.8] {
        let mut world = World::new();
        let mut walls = glowing(1.0, reflectance);
        walls.double_sided = true;
        walls.back = Some(walls.front);
        world.spawn((Mesh(Arc::new(shapes::cuboid(Vec3::splat(2.0), 3))), walls));
        camera(&mut world, DVec3::new(0.2, -0.1, 0.3), DVec3::new(0.0, 0.5, -1.0), 1.2);
        let (picture, report) = draw(&mut world, &paths(16, 128));
        let (found, wanted) = (mean(&picture.radiance), 1.0 / (1.0 - f64::from(reflectance)));
        let error = report.standard_error.expect("there are passes enough");
        let of_mean = error * wanted / 16.0;
        println!("{reflectance}: {found} for {wanted}, standard error {of_mean:.1e}");
        assert!((found - wanted).abs() < 5.0 * of_mean.max(1e-12 * wanted), "{reflectance}: {found}");
        assert!(of_mean < 0.01 * wanted);
    }
}

#[test]
fn what_shines_lights_a_floor_by_its_form_factor() {
    // A square lamp above a floor: irradiance over π is L F at every point, whether light sampling or the
    // path itself finds the lamp. The lamp is a mesh of several triangles, which must not matter either.
    let form_factor = |x: f64, z: f64, side: f64, height: f64| {
        let corner = |a: f64, b: f64| {
            let (a, b) = (a / height, b / height);
            let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
            (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
        };
        let h = 0.5 * side;
        corner(h - x, h - z) + corner(h + x, h - z) + corner(h - x, h + z) + corner(h + x, h + z)
    };
    for (side, height) in [(0.1, 1.0), (3.0, 0.4)] {
        let mut world = World::new();
        let front = Surface { diffuse: Vec3::splat(0.5), ..Surface::default() };
        let floor = Material { front, ..Material::default() };
        world.spawn((Mesh(Arc::new(shapes::plane(60.0, 60.0, 1, 1))), floor));
        let lamp = shapes::plane(side as f32, side as f32, 4, 4);
        let down = Transform::from_xyz(0.0, height, 0.0).with_rotation(DQuat::from_rotation_x(PI));
        world.spawn((Mesh(Arc::new(lamp)), glowing(2.0, 0.0), down));
        let (x, z) = (0.3, 0.2);
        let at = DVec3::new(x, 0.0, z);
        camera(&mut world, at + DVec3::new(0.0, 0.05, 0.001), at, 1e-4);
        let (picture, report) = draw(&mut world, &paths(4, 1024));
        let wanted = 0.5 * 2.0 * form_factor(x, z, side, height);
        let found = mean(&picture.radiance);
        let error = report.standard_error.expect("there are passes enough") * wanted / 4.0;
        println!("side {side}: {found} for {wanted}, standard error {error:.1e}");
        assert!(
            (found - wanted).abs() < 5.0 * error + 1e-5 * wanted,
            "{side}: {found} for {wanted} ± {error}"
        );
        assert!(error < 0.01 * wanted);
    }
}

#[test]
fn lobes_in_a_furnace_reflect_what_the_lighting_equation_reflects() {
    // A shiny floor under a uniform sky: paths against the lighting equation integrated over a grid on the
    // hemisphere.
    for model in [ReflectionModel::Phong, ReflectionModel::Blinn, ReflectionModel::TorranceSparrow] {
        for lobe in [Lobe::Bare, Lobe::EnergyConserving] {
            let front = Surface {
                diffuse: Vec3::splat(0.2),
                specular: Vec3::splat(0.6),
                shininess: 60.0,
                ..Surface::default()
            };
            let material = Material { front, lobe, ..Material::default() };
            let mut world = World::new();
            exact(&mut world, Quadric::new(QuadricShape::Plane), material.clone(), Transform::IDENTITY);
            furnace(&mut world, 1.0);
            let eye = DVec3::new(0.7, 1.0, 0.0);
            camera(&mut world, eye, DVec3::ZERO, 1e-6);
            let options = TraceOptions { reflection: Some(model), ..paths(4, 512) };
            let (picture, report) = draw(&mut world, &options);
            let viewer = eye.normalize();
            let surface = lumbre_optics::SurfaceSample::new(&material, true);
            let (rows, columns) = (800, 800);
            let mut wanted = 0.0;
            for row in 0..rows {
                let cosine = (f64::from(row) + 0.5) / f64::from(rows);
                let sine = (1.0 - cosine * cosine).sqrt();
                for column in 0..columns {
                    let turn = 2.0 * PI * (f64::from(column) + 0.5) / f64::from(columns);
                    let direction = DVec3::new(sine * turn.cos(), cosine, sine * turn.sin());
                    let light = lumbre_optics::LightSample {
                        diffuse: DVec3::splat(1.0 / PI),
                        specular: DVec3::splat(1.0 / PI),
                        direction,
                        attenuation: 1.0,
                        spot: 1.0,
                        ..lumbre_optics::LightSample::DARK
                    };
                    let lit = lumbre_optics::light_contribution(model, surface, &light, DVec3::Y, viewer);
                    wanted += (lit.diffuse + lit.specular).x * 2.0 * PI / f64::from(rows * columns);
                }
            }
            let found = mean(&picture.radiance);
            let error = report.standard_error.expect("there are passes enough") * wanted / 4.0;
            println!("{} {lobe:?}: {found} for {wanted}, standard error {error:.1e}", model.name());
            assert!((found - wanted).abs() < 5.0 * error + 1e-4 * wanted, "{} {lobe:?}", model.name());
        }
    }
}

#[test]
fn a_lamp_with_a_size_is_as_bright_as_its_middle() {
    let floor = |radius: f32, angle: f32, sun: bool| {
        let mut world = World::new();
        exact(&mut world, Quadric::new(QuadricShape::Plane), Material::matt(Vec3::ONE), Transform::IDENTITY);
        let light = if sun { Light::directional(Vec3::ONE) } else { Light::point(Vec3::ONE) };
        let place = Transform::from_xyz(1.0, 2.0, 0.0).looking_at(DVec3::ZERO, DVec3::X);
        world.spawn((Light { radius, angle, ..light }, place));
        camera(&mut world, DVec3::new(0.0, 1.0, 0.01), DVec3::ZERO, 1e-6);
        let (picture, report) = draw(&mut world, &paths(4, 1024));
        let found = mean(&picture.radiance);
        (found, report.standard_error.expect("there are passes enough") * found / 4.0)
    };
    for sun in [false, true] {
        let (point, _) = floor(0.0, 0.0, sun);
        let (sized, error) = floor(0.8, 0.5, sun);
        println!("sun {sun}: {sized} ± {error} for {point}");
        assert!((sized - point).abs() < 5.0 * error, "{sized} ± {error} for {point}");
    }
}

/// A lamp of unit strength with a radius, as a light, or as an emissive sphere that is as bright.
fn round_lamp(world: &mut World, radius: f32, at: DVec3, as_surface: bool) {
    let place = Transform::from_translation(at);
    if as_surface {
        // The radiance of a sphere that lights a surface at a distance d by 1/d² of π is 1/r².
        let material = glowing(radius.powi(-2), 0.0);
        exact(world, Quadric::sphere(f64::from(radius)), material, place);
    } else {
        world.spawn((Light { radius, ..Light::point(Vec3::ONE) }, place));
    }
}

/// The mean over a small picture of paths, and its standard error.
fn mean_of_paths(world: &mut World, options: &TraceOptions) -> (f64, f64) {
    let (picture, report) = draw(world, options);
    let found = mean(&picture.radiance);
    let pixels = (picture.radiance.len() as f64).sqrt();
    (found, report.standard_error.expect("there are passes enough") * found / pixels)
}

#[test]
fn a_lamp_with_a_size_shines_through_clear_glass() {
    // A slab of index 1 does not bend light, and its two faces leave a quarter of it.
    let lit = |radius: f32| {
        let mut world = World::new();
        let floor = Quadric::new(QuadricShape::Plane);
        exact(&mut world, floor, Material::matt(Vec3::splat(0.5)), Transform::IDENTITY);
        let slab = shapes::cuboid(Vec3::new(90.0, 0.2, 90.0), 1);
        let half = Material { transmission: Vec3::splat(0.5), ior: 1.0, ..black() };
        world.spawn((Mesh(Arc::new(slab)), half, Transform::from_xyz(0.0, 0.8, 0.0)));
        round_lamp(&mut world, radius, DVec3::new(0.3, 2.0, 0.0), false);
        camera(&mut world, DVec3::new(0.0, 0.1, 0.01), DVec3::ZERO, 1e-6);
        mean_of_paths(&mut world, &paths(4, 4096))
    };
    let distance = 2.0_f64.hypot(0.3);
    let wanted = 0.5 * 0.25 * 2.0 / distance.powi(3);
    let (found, error) = lit(0.7);
    println!("{found} ± {error} for {wanted}");
    assert!((found - wanted).abs() < 5.0 * error && error < 0.02 * wanted, "{found} ± {error} for {wanted}");
    // Nothing but a path that starts at the lamp finds a point behind glass.
    assert_eq!(lit(0.0).0, 0.0);
}

#[test]
fn a_lamp_in_its_own_bulb_of_glass_is_counted_once() {
    // Light passes a lamp's own bulb, which glows itself: it must not come through its glass besides.
    let lit = |with_bulb: bool| {
        let mut world = World::new();
        let floor = Quadric::new(QuadricShape::Plane);
        exact(&mut world, floor, Material::matt(Vec3::splat(0.5)), Transform::IDENTITY);
        let at = DVec3::new(0.3, 2.0, 0.0);
        if with_bulb {
            let mut bulb = glass(1.0);
            bulb.front.emission = Vec3::splat(1e-6);
            exact(&mut world, Quadric::sphere(0.8), bulb, Transform::from_translation(at));
        }
        round_lamp(&mut world, 0.7, at, false);
        camera(&mut world, DVec3::new(0.0, 0.1, 0.01), DVec3::ZERO, 1e-6);
        mean_of_paths(&mut world, &paths(4, 4096))
    };
    let [(bare, _), (found, error)] = [false, true].map(lit);
    println!("{found} ± {error} in its bulb for {bare}");
    assert!((found - bare).abs() < 5.0 * error + 1e-3 * bare, "{found} ± {error} for {bare}");
}

#[test]
fn a_lamp_with_a_size_lights_others_as_an_emissive_sphere_does() {
    // Directly, through a slab that bends light and reflects it, by a mirror, by a shiny floor and past a pane: every
    // way to find it, alone and together with the others.
    let lit = |as_surface: bool, shininess: f32| {
        let mut world = World::new();
        let front = Surface {
            diffuse: Vec3::splat(0.4),
            specular: Vec3::splat(0.5),
            shininess,
            ..Surface::default()
        };
        let shiny = Material { front, lobe: Lobe::EnergyConserving, ..Material::default() };
        exact(&mut world, Quadric::new(QuadricShape::Plane), shiny, Transform::IDENTITY);
        // The slab covers a part of the lamp.
        let slab = shapes::cuboid(Vec3::new(2.0, 0.3, 2.0), 1);
        world.spawn((Mesh(Arc::new(slab)), glass(1.5), fresnel(), Transform::from_xyz(1.1, 0.8, 0.0)));
        let mirror = Transform::from_xyz(-1.0, 0.0, 0.0).with_rotation(DQuat::from_rotation_z(-0.5 * PI));
        world.spawn((Mesh(Arc::new(shapes::plane(6.0, 6.0, 1, 1))), self::mirror(0.8), mirror));
        let pane = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, double_sided: true, ..black() };
        world.spawn((
            Mesh(Arc::new(shapes::plane(0.6, 0.6, 1, 1))),
            pane,
            Transform::from_xyz(-0.1, 0.9, 0.3),
        ));
        round_lamp(&mut world, 0.6, DVec3::new(0.2, 1.9, 0.0), as_surface);
        camera(&mut world, DVec3::new(-0.3, 0.5, 0.7), DVec3::new(0.1, 0.0, 0.0), 0.02);
        mean_of_paths(&mut world, &paths(8, 2048))
    };
    for shininess in [8.0, 300.0] {
        let [(lamp, own), (sphere, other)] = [lit(false, shininess), lit(true, shininess)];
        println!("exponent {shininess}: {lamp} ± {own} as a lamp, {sphere} ± {other} as a sphere");
        assert!((lamp - sphere).abs() < 5.0 * own.hypot(other), "{lamp} ± {own}, {sphere} ± {other}");
        assert!(own.hypot(other) < 0.015 * sphere, "the test sees nothing");
    }
}

#[test]
fn the_eye_sees_no_lamp_with_a_size() {
    // Neither directly, nor in a mirror, nor through glass: as in frames.
    let mut world = World::new();
    round_lamp(&mut world, 0.5, DVec3::ZERO, false);
    let mirror = Transform::from_xyz(0.0, -2.0, 0.0);
    world.spawn((Mesh(Arc::new(shapes::plane(8.0, 8.0, 1, 1))), self::mirror(1.0), mirror));
    exact(&mut world, Quadric::sphere(0.2), glass(1.5), Transform::from_xyz(0.0, 0.0, 1.5));
    camera(&mut world, DVec3::new(0.0, 0.3, 5.0), DVec3::new(0.0, -0.5, 0.0), 0.8);
    let (picture, _) = draw(&mut world, &paths(32, 16));
    assert!(picture.radiance.iter().all(|pixel| *pixel == DVec3::ZERO));
    // Negative control: a matt floor instead of the mirror is lit.
    world.spawn((
        Mesh(Arc::new(shapes::plane(8.0, 8.0, 1, 1))),
        Material::matt(Vec3::ONE),
        Transform::from_xyz(0.0, -1.5, 0.0),
    ));
    let (picture, _) = draw(&mut world, &paths(32, 16));
    assert!(picture.radiance.iter().any(|pixel| pixel.x > 0.1));
}

#[test]
fn a_large_lamp_in_a_shiny_floor_is_found_by_the_better_of_two_ways() {
    // Sampling the lamp alone, as paths without reflections do, seldom meets a sharp lobe; paths do. Both have the
    // same mean.
    let mut world = World::new();
    let front = Surface { diffuse: Vec3::ZERO, specular: Vec3::ONE, shininess: 3000.0, ..Surface::default() };
    let shiny = Material { front, lobe: Lobe::EnergyConserving, ..Material::default() };
    exact(&mut world, Quadric::new(QuadricShape::Plane), shiny, Transform::IDENTITY);
    round_lamp(&mut world, 0.8, DVec3::new(0.0, 1.5, -1.5), false);
    camera(&mut world, DVec3::new(0.0, 1.5, 1.5), DVec3::ZERO, 1e-3);
    let [(alone, of_one), (both, of_two)] =
        [Some(0), None].map(|depth| mean_of_paths(&mut world, &TraceOptions { depth, ..paths(4, 1024) }));
    println!("{alone} ± {of_one} by lamps alone, {both} ± {of_two} by both");
    assert!((alone - both).abs() < 5.0 * of_one.hypot(of_two), "{alone} ± {of_one}, {both} ± {of_two}");
    assert!(of_two < 0.25 * of_one && of_two < 0.01 * both, "{of_two} against {of_one}");
}

#[test]
fn a_ball_of_glass_in_a_furnace_is_not_to_be_seen() {
    // What Fresnel's equations take from one ray they give to the other: 1 everywhere. By trees down to
    // weights of 10⁻⁶, and by paths.
    let ball = || {
        let mut world = World::new();
        let entity = exact(&mut world, Quadric::sphere(1.0), glass(1.5), Transform::IDENTITY);
        world.entity_mut(entity).insert(fresnel());
        furnace(&mut world, 1.0);
        camera(&mut world, DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 0.6);
        world
    };
    let deep = TraceOptions { depth: Some(50), weight: 1e-6, ..options(24) };
    let (picture, report) = draw(&mut ball(), &deep);
    let worst = picture.radiance.iter().map(|pixel| (pixel.x - 1.0).abs()).fold(0.0, f64::max);
    println!("trees: {worst:.1e} off at most, {:.1e} cut off", report.cut.largest_weight);
    let bound = report.cut.bound.expect("glass adds no light");
    assert!(worst < 1e-3 && worst <= bound + 1e-12, "{worst} against {bound}");

    let (picture, report) = draw(&mut ball(), &paths(24, 256));
    let error = report.standard_error.expect("there are passes enough") / 24.0;
    let found = mean(&picture.radiance);
    println!("paths: {found} ± {error:.1e}");
    assert!((found - 1.0).abs() < (5.0 * error).max(1e-12) && (found - 1.0).abs() < 1e-3);
}

/// Blocks of glass in a row along -z; each is given by its thickness, its index and the gap in front of it.
fn blocks(parts: &[(f64, f32, f64)]) -> World {
    let mut world = World::new();
    let mut z = 0.0;
    for (thickness, ior, gap) in parts {
        let middle = z - gap - 0.5 * thickness;
        let block = shapes::cuboid(Vec3::new(90.0, 90.0, *thickness as f32), 1);
        world.spawn((Mesh(Arc::new(block)), glass(*ior), fresnel(), Transform::from_xyz(0.0, 0.0, middle)));
        z -= gap + thickness;
    }
    furnace(&mut world, 1.0);
    world
}

#[test]
fn glass_that_touches_glass_has_no_face_between() {
    // Two blocks of the same glass in contact are one block; with a gap of a millimetre they are two. With
    // coordinates that f32 can represent exactly, and others.
    for unit in [0.25, 0.1, 7.3] {
        for slant in [0.0, 0.4] {
            let count = |parts: &[(f64, f32, f64)]| {
                let mut world = blocks(parts);
                camera(&mut world, DVec3::new(slant, 0.0, 1.0), DVec3::ZERO, 1e-3);
                let tree = tree(&mut world, &TraceOptions { weight: 0.0, depth: Some(12), ..options(8) });
                let mut faces = 0;
                let mut branch = &tree;
                while branch.point.is_some() {
                    // No light is reflected where the index does not change.
                    let mirrored = next(branch, Kind::Mirrored);
                    faces += usize::from(mirrored.is_some_and(|mirrored| mirrored.factor.x > 1e-9));
                    branch = next(branch, Kind::Transmitted).expect("light goes on");
                }
                assert!((branch.direction - tree.direction).length() < 1e-6);
                faces
            };
            assert_eq!(count(&[(unit, 1.5, 0.0), (unit, 1.5, 0.0)]), 2, "{unit} {slant}");
            assert_eq!(count(&[(unit, 1.5, 0.0), (unit, 1.5, 1e-3)]), 4, "{unit} {slant}");
            assert_eq!(count(&[(unit, 1.5, 0.0), (unit, 1.8, 0.0), (unit, 1.5, 0.0)]), 4, "{unit} {slant}");
        }
    }
}

#[test]
fn a_bubble_in_glass_is_air_and_a_stone_in_water_is_stone() {
    for (outer, inner) in [(1.5_f32, 1.0_f32), (1.33, 2.4)] {
        let mut world = World::new();
        exact(&mut world, Quadric::sphere(2.0), glass(outer), Transform::IDENTITY);
        exact(&mut world, Quadric::sphere(1.0), glass(inner), Transform::IDENTITY);
        camera(&mut world, DVec3::new(0.3, 0.0, 5.0), DVec3::new(0.3, 0.0, 0.0), 0.1);
        let mut branch = &tree(&mut world, &options(8));
        let mut indices = Vec::new();
        loop {
            indices.push(branch.point.as_ref().map(|point| point.index as f32));
            // By Bouguer's formula n r sin φ is the same in every shell.
            if let Some(point) = &branch.point {
                let reach = branch.origin.cross(branch.direction).length() * point.index;
                assert!((reach - 0.3).abs() < 1e-12, "{outer} {inner}: {reach}");
            }
            match next(branch, Kind::Transmitted) {
                Some(next) => branch = next,
                None => break,
            }
        }
        assert_eq!(indices, [Some(1.0), Some(outer), Some(inner), Some(outer), None]);
        // The media of an eye at the centre are found as well.
        look_from(&mut world, DVec3::ZERO, DVec3::NEG_Z, 0.1);
        let tree = tree(&mut world, &options(8));
        assert_eq!(tree.point.as_ref().map(|point| point.index as f32), Some(inner));
        let out = next(&tree, Kind::Transmitted).and_then(|branch| branch.point.as_ref());
        assert_eq!(out.map(|point| point.index as f32), Some(outer));
    }
}

#[test]
fn rays_that_start_on_a_surface_do_not_meet_it() {
    // A lit sphere, near the origin and far from it, as a mesh and as an exact surface: without shadow acne.
    for place in [DVec3::ZERO, DVec3::new(1e5, -2e5, 3e5)] {
        for is_exact in [true, false] {
            let mut world = World::new();
            let at = Transform::from_translation(place);
            let matt = Material::matt(Vec3::ONE);
            if is_exact {
                exact(&mut world, Quadric::sphere(1.0), matt, at);
            } else {
                world.spawn((Mesh(Arc::new(shapes::uv_sphere(1.0, 64, 32))), matt, at));
            }
            world
                .spawn((Light::point(Vec3::splat(9.0)), Transform::from_translation(place + DVec3::Z * 3.0)));
            camera(&mut world, place + DVec3::Z * 3.0, place, 0.5);
            let (lit, _) = draw(&mut world, &options(64));
            let open = TraceOptions { shadows: false, ..options(64) };
            let (open, _) = draw(&mut world, &open);
            // Seen from the lamp, nothing is in shadow.
            let dark = lit.radiance.iter().zip(&open.radiance).filter(|(lit, open)| lit != open).count();
            assert_eq!(dark, 0, "{place} exact {is_exact}");
        }
    }
}

#[test]
fn the_bits_are_the_same_on_any_number_of_threads() {
    let world = || {
        let mut world = facing_scene();
        camera(&mut world, DVec3::new(0.3, 1.0, 3.0), DVec3::ZERO, 1.0);
        world
    };
    for integrator in [Integrator::Whitted, Integrator::Path] {
        let drawn = |threads: usize| {
            let samples = Some(8);
            let options = TraceOptions { integrator, samples, threads: Some(threads), ..options(50) };
            draw(&mut world(), &options).0
        };
        let one = drawn(1);
        assert!(one.radiance.iter().any(|pixel| pixel.x > 0.0));
        for threads in [2, 5] {
            let many = drawn(threads);
            let bits = |pixels: &[DVec3]| {
                pixels.iter().flat_map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>()
            };
            assert!(bits(&one.radiance) == bits(&many.radiance), "{integrator:?} on {threads} threads");
        }
    }
}

/// A glass ball, a mirror and a lamp above a floor.
fn facing_scene() -> World {
    let mut world = World::new();
    exact(
        &mut world,
        Quadric::new(QuadricShape::Plane),
        Material::matt(Vec3::splat(0.6)),
        Transform::from_xyz(0.0, -1.0, 0.0),
    );
    let ball = exact(&mut world, Quadric::sphere(0.6), glass(1.5), Transform::IDENTITY);
    world.entity_mut(ball).insert(fresnel());
    let mirror = shapes::cuboid(Vec3::new(2.0, 2.0, 0.1), 1);
    world.spawn((Mesh(Arc::new(mirror)), self::mirror(0.8), Transform::from_xyz(0.0, 0.0, -2.0)));
    world.spawn((Light::point(Vec3::splat(6.0)), Transform::from_xyz(1.5, 2.5, 1.0)));
    furnace(&mut world, 0.1);
    world
}

#[test]
fn an_error_asked_for_ends_it_and_an_interruption_keeps_what_is_there() {
    let mut world = facing_scene();
    camera(&mut world, DVec3::new(0.3, 1.0, 3.0), DVec3::ZERO, 1.0);
    let wanted = TraceOptions { samples: None, error: Some(0.1), ..paths(32, 1) };
    let (picture, report) = draw(&mut world, &wanted);
    assert_eq!(report.ended, Ended::Error);
    let stated = report.standard_error.expect("it is stated");
    assert!(stated <= 0.1);
    // The reported error is about the difference from a picture with forty times the samples.
    let samples = 40 * report.samples[1];
    let (better, _) = draw(&mut world, &paths(32, samples));
    let squares: f64 =
        picture.radiance.iter().zip(&better.radiance).map(|(a, b)| (*a - *b).length_squared()).sum();
    let off = (squares / (3.0 * 1024.0)).sqrt() / mean(&better.radiance);
    println!("stated {stated}, found {off}");
    assert!(off < 1.6 * stated && off > 0.4 * stated, "{off} for {stated}");

    let options = TraceOptions { threads: Some(1), ..options(64) };
    let tracer = Tracer::new(&mut world, &options).expect("the world can be traced");
    let halfway = |progress: lumbre_trace::Progress| match progress.fraction < 0.5 {
        true => std::ops::ControlFlow::Continue(()),
        false => std::ops::ControlFlow::Break(()),
    };
    let (picture, report) = tracer.picture(&halfway).expect("it is traced");
    assert_eq!(report.ended, Ended::Interrupted);
    assert!(report.finished > 0.4 && report.finished < 0.7, "{}", report.finished);
    assert!(picture.radiance.iter().any(|pixel| pixel.x > 0.0));
}

/// Position, normal and irradiance with its standard error, as the other path tracer found them.
struct Reference {
    position: DVec3,
    normal: DVec3,
    irradiance: DVec3,
    error: DVec3,
}

fn references(path: &Path) -> Vec<Reference> {
    let text = std::fs::read_to_string(path).expect("the reference file is readable text");
    let rows = text.lines().skip(1).map(|line| {
        let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect();
        let at = |first: usize| DVec3::new(v[first], v[first + 1], v[first + 2]);
        Reference { position: at(0), normal: at(3), irradiance: at(6), error: at(9) }
    });
    rows.collect()
}

fn shared(path: &str) -> Option<std::path::PathBuf> {
    let found = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join(path);
    if found.exists() {
        return Some(found);
    }
    eprintln!("SKIPPED: {} is missing; nothing was compared", found.display());
    None
}

#[test]
fn paths_agree_with_another_path_tracer_at_its_points() {
    for (model, points) in [
        ("conformance/bake/alcove.glb", "conformance/bake/alcove.csv"),
        ("models/cornell_box.glb", "conformance/bake/cornell_box.csv"),
    ] {
        let (Some(model), Some(points)) = (shared(model), shared(points)) else { return };
        let mut world = World::new();
        lumbre_scene::load(&mut world, &model).expect("the model loads");
        // The reference has diffuse surfaces only.
        for mut material in world.query::<&mut Material>().iter_mut(&mut world) {
            material.front.specular = Vec3::ZERO;
        }
        let cameras: Vec<Entity> =
            world.query_filtered::<Entity, With<lumbre_scene::Camera>>().iter(&world).collect();
        cameras.into_iter().for_each(|entity| {
            world.despawn(entity);
        });
        let (mut difference, mut variance, mut sum, mut worst, mut count) = (0.0, 0.0, 0.0, 0.0_f64, 0);
        for reference in references(&points).iter().take(60) {
            let eye = reference.position + reference.normal * 2e-3;
            look_from(&mut world, eye, reference.position, 1e-4);
            let options = TraceOptions { lightmaps: false, ..paths(2, 1024) };
            let tracer = Tracer::new(&mut world, &options).expect("the model can be traced");
            let Some(hit) = tracer.first_hit(DVec2::ONE) else { continue };
            if hit.position.distance(reference.position) > 1e-3 {
                continue;
            }
            let (picture, _) =
                tracer.picture(&|_| std::ops::ControlFlow::Continue(())).expect("it is traced");
            let pixels = picture.radiance.len() as f64;
            let radiance: DVec3 = picture.radiance.iter().sum::<DVec3>() / pixels;
            let errors = picture.standard_error.expect("there are passes enough");
            let squares: DVec3 =
                errors.iter().map(|error| *error * *error).sum::<DVec3>() / (pixels * pixels);
            for channel in 0..3 {
                let albedo = hit.albedo[channel];
                if albedo < 0.02 || !reference.irradiance[channel].is_finite() {
                    continue;
                }
                let own = PI * (radiance[channel] - hit.emission[channel]) / albedo;
                let off = own - reference.irradiance[channel];
                let both = squares[channel] * (PI / albedo).powi(2) + reference.error[channel].powi(2);
                worst = worst.max(off.abs() / both.sqrt());
                difference += off;
                variance += both;
                sum += reference.irradiance[channel];
                count += 1;
            }
        }
        println!(
            "{}: {count} channels, bias {:.3} % ± {:.3} %, worst {worst:.1} sigma",
            model.display(),
            100.0 * difference / sum,
            100.0 * variance.sqrt() / sum
        );
        assert!(count > 100, "{count} channels are too few to compare");
        // Of this many normally distributed numbers hardly any is beyond five standard deviations: fewer than one
        // in a thousand runs of the test.
        assert!(count < 1000 && worst < 5.0, "{}: {worst} sigma", model.display());
        // The channels of one path are correlated, so that three times the variance of independent ones is a
        // bound.
        assert!(difference.abs() < 5.0 * (3.0 * variance).sqrt(), "{}: {difference}", model.display());
    }
}

#[test]
fn a_sheet_in_the_way_leaves_what_both_ways_agree_on() {
    // A lamp behind a thin sheet: both shadow rays and paths through the sheet find it, and must count it
    // once, not twice.
    let mut world = World::new();
    let front = Surface { diffuse: Vec3::splat(0.5), ..Surface::default() };
    world.spawn((Mesh(Arc::new(shapes::plane(60.0, 60.0, 1, 1))), Material { front, ..Material::default() }));
    let down = |y: f64| Transform::from_xyz(0.0, y, 0.0).with_rotation(DQuat::from_rotation_x(PI));
    world.spawn((Mesh(Arc::new(shapes::plane(1.0, 1.0, 1, 1))), glowing(3.0, 0.0), down(1.0)));
    camera(&mut world, DVec3::new(0.3, 0.05, 0.201), DVec3::new(0.3, 0.0, 0.2), 1e-4);
    let (open, _) = draw(&mut world, &paths(4, 256));
    let sheet = Material { transmission: Vec3::splat(0.5), ..black() };
    let medium = Medium { thin: true, ..Medium::default() };
    world.spawn((Mesh(Arc::new(shapes::plane(60.0, 60.0, 1, 1))), sheet, medium, down(0.5)));
    let (behind, report) = draw(&mut world, &paths(4, 1024));
    let (found, wanted) = (mean(&behind.radiance), 0.5 * mean(&open.radiance));
    let error = report.standard_error.expect("there are passes enough") * wanted / 4.0;
    println!("{found} ± {error} for {wanted}");
    assert!((found - wanted).abs() < 5.0 * error + 2e-3 * wanted);
}

#[test]
fn one_lamp_among_hundreds_is_chosen_without_leaving_any_out() {
    // Lamps of many strengths, cones and ranges above a floor, two of them distant: without bounces, paths
    // must find the light that the ray tree sums over all of them.
    let world = || {
        let mut world = World::new();
        let floor = Transform::from_xyz(0.0, 0.0, 0.0);
        exact(&mut world, Quadric::new(QuadricShape::Plane), Material::matt(Vec3::splat(0.5)), floor);
        exact(
            &mut world,
            Quadric::sphere(0.5),
            Material::matt(Vec3::splat(0.5)),
            Transform::from_xyz(0.0, 0.6, 0.0),
        );
        for number in 0..300_u32 {
            let at = |step: f64| (f64::from(number) * step).fract() * 8.0 - 4.0;
            let strength = 0.02 + (f64::from(number) * 0.317).fract().powi(4);
            let mut light = Light::point(Vec3::new(strength as f32, 0.1, 0.2 * strength as f32));
            if number % 3 == 0 {
                light.attenuation.range = 1.5;
            }
            if number % 7 == 0 {
                light.spot = Some(SpotCone::Exponent { cutoff: 0.6, exponent: 2.0 });
            }
            let height = 0.8 + (f64::from(number) * 0.713).fract();
            world.spawn((light, Transform::from_xyz(at(0.618), height, at(0.414))));
        }
        for x in [-0.5, 0.7] {
            let place = Transform::from_xyz(x, 1.0, 0.2).looking_at(DVec3::ZERO, DVec3::Y);
            world.spawn((Light::directional(Vec3::splat(0.2)), place));
        }
        camera(&mut world, DVec3::new(0.0, 3.0, 4.0), DVec3::ZERO, 0.9);
        world
    };
    let (whole, _) = draw(&mut world(), &TraceOptions { samples: Some(256), ..options(16) });
    let (found, report) = draw(&mut world(), &TraceOptions { depth: Some(0), ..paths(16, 4096) });
    let [wanted, got] = [&whole, &found].map(|picture| mean(&picture.radiance));
    let error = report.standard_error.expect("there are passes enough");
    println!("300 lamps: {got:.5} of {wanted:.5}, noise of the picture {:.2} %", 100.0 * error);
    // A lamp that is left out, or chosen with another probability than stated, shows as more than noise: in
    // the mean over 256 pixels, and in each.
    assert!((got / wanted - 1.0).abs() < 5.0 * error / 16.0, "{got} for {wanted}");
    let apart = |(a, b): (&DVec3, &DVec3)| (*a - *b).length_squared() / 3.0;
    let squares: f64 = whole.radiance.iter().zip(&found.radiance).map(apart).sum();
    let apart = (squares / 256.0).sqrt() / wanted;
    assert!(apart < 1.5 * error && error < 0.03, "{apart} with {error}");
}
