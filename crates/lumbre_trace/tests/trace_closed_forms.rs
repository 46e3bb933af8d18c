//! Rays against geometric closed forms: mirrors, slabs, lenses, absorption, and exact surfaces near and far.

mod support;

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material};
use lumbre_scene::{EmissiveLight, Medium, Mesh, Quadric, QuadricShape, SceneSettings, Transform};
use lumbre_trace::{Kind, TraceOptions};

use support::*;

/// A dome around a scene, or a picture in front of a lamp, shows its colour to the eye and changes no light.
#[test]
fn unlit_surfaces_neither_block_light_nor_take_part_in_it() {
    let unlit = |mode| Material {
        unlit: true,
        double_sided: true,
        alpha: 0.5,
        alpha_mode: mode,
        ..Material::matt(Vec3::splat(0.4))
    };
    let lit = |mode: Option<AlphaMode>| {
        let mut world = World::new();
        let floor = Mesh(Arc::new(shapes::plane(20.0, 20.0, 1, 1)));
        world.spawn((floor, Material::matt(Vec3::splat(0.5))));
        let lamp = Transform::from_xyz(0.5, 2.0, 0.0);
        world.spawn((Light::point(Vec3::splat(4.0)), lamp));
        // A panel that shines down, and which the picture lies on.
        let panel = Transform::from_xyz(-1.0, 2.0, 0.0).with_rotation(DQuat::from_rotation_x(PI));
        let square = Mesh(Arc::new(shapes::plane(1.0, 1.0, 1, 1)));
        world.spawn((square.clone(), glowing(3.0, 0.0), EmissiveLight, panel));
        furnace(&mut world, 0.3);
        if let Some(mode) = mode {
            let dome = Mesh(Arc::new(shapes::uv_sphere(12.0, 24, 12)));
            world.spawn((dome, unlit(mode)));
            let pane = Mesh(Arc::new(shapes::plane(4.0, 4.0, 1, 1)));
            world.spawn((pane, unlit(mode), Transform::from_xyz(0.0, 1.5, 0.0)));
            world.spawn((square, unlit(mode), panel));
        }
        look_from(&mut world, DVec3::new(0.0, 1.0, 0.1), DVec3::ZERO, 0.5);
        world
    };
    for mode in [AlphaMode::Opaque, AlphaMode::Mask { cutoff: 0.3 }, AlphaMode::Blend] {
        for options in [options(16), paths(16, 4)] {
            let (open, _) = draw(&mut lit(None), &options);
            let (same, _) = draw(&mut lit(Some(mode)), &options);
            for (open, same) in open.radiance.iter().zip(&same.radiance) {
                assert!(
                    (*open - *same).abs().max_element() <= 1e-9 * open.max_element(),
                    "{mode:?}: {same} for {open}"
                );
                assert!(open.min_element() > 0.1);
            }
        }
    }
}

#[test]
fn a_mirror_ball_turns_rays_by_the_angle_of_their_offset() {
    // A ray that passes the centre at a distance b hits the sphere at the angle asin(b) and is turned by π -
    // 2 asin(b).
    for offset in [0.0, 0.1, 0.5, 0.9, 0.999, 0.999_999] {
        let mut world = World::new();
        exact(&mut world, Quadric::sphere(1.0), mirror(1.0), Transform::IDENTITY);
        camera(&mut world, DVec3::new(offset, 0.0, 5.0), DVec3::new(offset, 0.0, 0.0), 0.1);
        let tree = tree(&mut world, &options(64));
        let point = tree.point.as_ref().expect("it meets the ball").position;
        let expected = DVec3::new(offset, 0.0, ((1.0 - offset) * (1.0 + offset)).sqrt());
        assert!((point - expected).length() < 1e-12, "{offset}: {point}");
        let turned = next(&tree, Kind::Mirrored).expect("it is mirrored").direction;
        let angle = turned.x.atan2(-turned.z);
        let wanted = PI - 2.0 * f64::asin(offset);
        // Near the rim the error of the angle is the square root of the rounding error.
        assert!(
            (angle - wanted).abs() < 1e-12 / (1.0 - offset * offset).sqrt(),
            "{offset}: {angle} for {wanted}"
        );
    }
}

#[test]
fn a_slab_shifts_rays_and_does_not_turn_them() {
    let (thickness, index) = (0.5, 1.5);
    for degrees in [0.0_f64, 10.0, 30.0, 60.0, 80.0, 89.0] {
        let angle = degrees.to_radians();
        let mut world = World::new();
        let slab = shapes::cuboid(Vec3::new(400.0, thickness as f32, 400.0), 1);
        world.spawn((Mesh(Arc::new(slab)), glass(index as f32)));
        let eye = 40.0 * DVec3::new(-angle.sin(), angle.cos(), 0.0);
        camera(&mut world, eye, DVec3::ZERO, 0.1);
        let tree = tree(&mut world, &options(64));
        let last = through(&tree);
        let (sine, cosine) = angle.sin_cos();
        assert!((last.direction - tree.direction).length() < 1e-7, "{degrees}: {}", last.direction);
        let shift = (last.origin - eye).reject_from(tree.direction).length();
        let wanted = thickness * sine * (1.0 - cosine / (index * index - sine * sine).sqrt());
        assert!((shift - wanted).abs() < 1e-6, "{degrees}: {shift} for {wanted}");
        assert!(last.point.is_none(), "it leaves");
    }
}

#[test]
fn light_is_totally_reflected_beyond_the_critical_angle() {
    let critical = f64::asin(1.0 / 1.5);
    for (angle, leaves) in [
        (0.0, true),
        (critical - 1e-6, true),
        (critical + 1e-6, false),
        (1.2, false),
        (FRAC_PI_2 - 1e-3, false),
    ] {
        let mut world = World::new();
        // The eye is inside glass, below its upper face; a half space is enough.
        exact(&mut world, Quadric::new(QuadricShape::Plane), glass(1.5), Transform::IDENTITY);
        let eye = DVec3::new(0.0, -1.0, 0.0);
        camera(&mut world, eye, eye + DVec3::new(f64::sin(angle), f64::cos(angle), 0.0), 0.1);
        let tree = tree(&mut world, &options(64));
        let point = tree.point.as_ref().expect("it meets the face");
        assert!(!point.front && (point.index - 1.5).abs() < 1e-12, "inside: {point:?}");
        let transmitted = next(&tree, Kind::Transmitted);
        assert_eq!(transmitted.is_some(), leaves, "{angle}");
        match transmitted {
            Some(through) => {
                // Snell's law. Near the critical angle the remaining component is a square root of a small
                // difference.
                let sine = 1.5 * angle.sin();
                assert!((through.direction.x - sine).abs() < 1e-9, "{angle}: {}", through.direction);
                assert!(next(&tree, Kind::Mirrored).is_none());
            }
            None => {
                let mirrored = next(&tree, Kind::Mirrored).expect("all of it is mirrored");
                assert_eq!(mirrored.factor, DVec3::ONE);
            }
        }
    }
}

#[test]
fn a_ball_lens_focuses_near_its_axis_at_its_focal_length() {
    // Focal length n R/(2 (n - 1)) from the centre; spherical aberration grows with the square of the height.
    for index in [1.2, 1.5, 1.8] {
        let height = 1e-4;
        let mut world = World::new();
        exact(&mut world, Quadric::sphere(2.0), glass(index as f32), Transform::IDENTITY);
        camera(&mut world, DVec3::new(height, 0.0, 9.0), DVec3::new(height, 0.0, 0.0), 0.1);
        let tree = tree(&mut world, &options(64));
        let last = through(&tree);
        let crosses = last.origin.z - last.origin.x * last.direction.z / last.direction.x;
        let index = f64::from(index as f32);
        let focal_length = index * 2.0 / (2.0 * (index - 1.0));
        assert!((-crosses / focal_length - 1.0).abs() < 1e-7, "{index}: {crosses} for {focal_length}");
    }
}

/// Two weakly emissive mirrors that face each other.
fn facing_mirrors(weight: f32, emission: f32) -> World {
    let mut world = World::new();
    let mut glowing = mirror(weight);
    glowing.front.emission = Vec3::splat(emission);
    for (z, toward) in [(-1.0, DVec3::Z), (1.0, DVec3::NEG_Z)] {
        let rotation = DQuat::from_rotation_arc(DVec3::Y, toward);
        let place = Transform::from_xyz(0.0, 0.0, z).with_rotation(rotation);
        exact(&mut world, Quadric::new(QuadricShape::Plane), glowing.clone(), place);
    }
    camera(&mut world, DVec3::ZERO, DVec3::new(0.01, 0.0, -1.0), 0.1);
    world
}

#[test]
fn a_chain_of_mirrors_is_a_geometric_series() {
    for depth in [0u32, 1, 5, 50, 500] {
        let mut world = facing_mirrors(0.75, 2.0);
        let options = TraceOptions { depth: Some(depth), weight: 0.0, ..options(2) };
        let (picture, report) = draw(&mut world, &options);
        let ratio: f64 = 0.75;
        let wanted = 2.0 * (1.0 - ratio.powi(depth as i32 + 1)) / (1.0 - ratio);
        for pixel in &picture.radiance {
            assert!((pixel.x / wanted - 1.0).abs() < 1e-12, "{depth}: {pixel} for {wanted}");
        }
        // What was cut off is the rest of the series: its weight is reported, and the bound holds.
        let rest = 8.0 * ratio.powi(depth as i32 + 1);
        assert!((report.cut.largest_weight / ratio.powi(depth as i32 + 1) - 1.0).abs() < 1e-9);
        let bound = report.cut.bound.expect("the series ends");
        assert!((bound / rest - 1.0).abs() < 1e-9, "{depth}: {bound} for {rest}");
    }
    // Limited by weight: .75^n falls below 10⁻⁶ at the 49th mirror.
    let mut world = facing_mirrors(0.75, 2.0);
    let deep = TraceOptions { depth: Some(1000), weight: 1e-6, ..options(2) };
    let (picture, report) = draw(&mut world, &deep);
    assert!((picture.radiance[0].x - 8.0).abs() < 8.0 * 1e-6);
    assert!(report.cut.largest_weight > 0.0 && report.cut.largest_weight < 1e-6);
    // Between perfect mirrors, the depth ends the recursion.
    let (picture, _) = draw(&mut facing_mirrors(1.0, 1.0), &TraceOptions { depth: Some(1000), ..options(1) });
    assert!((picture.radiance[0].x - 1001.0).abs() < 1e-9);
}

#[test]
fn absorption_follows_beer_and_lambert() {
    let tinted = Medium {
        attenuation_color: Vec3::new(0.5, 0.1, 1.0),
        attenuation_distance: 0.25,
        ..Medium::default()
    };
    for degrees in [0.0_f64, 40.0, 75.0] {
        let angle = degrees.to_radians();
        let mut world = World::new();
        let slab = shapes::cuboid(Vec3::new(400.0, 0.5, 400.0), 1);
        world.spawn((Mesh(Arc::new(slab)), glass(1.5), tinted));
        furnace(&mut world, 3.0);
        camera(&mut world, 40.0 * DVec3::new(-angle.sin(), angle.cos(), 0.0), DVec3::ZERO, 1e-6);
        let (picture, _) = draw(&mut world, &options(3));
        let length = 0.5 / (1.0 - (angle.sin() / 1.5).powi(2)).sqrt();
        let left = DVec3::new(0.5_f64.ln(), f64::from(0.1_f32).ln(), 0.0) * (length / 0.25);
        let wanted = 3.0 * left.exp();
        let apart = (picture.radiance[4] / wanted - DVec3::ONE).abs().max_element();
        assert!(apart < 2e-6, "{degrees}: {} for {wanted}", picture.radiance[4]);
    }
}

#[test]
fn exact_surfaces_keep_their_digits_far_away_and_at_grazing_rays() {
    // A ball with a radius of one metre, seen from up to 10⁶ radii away at a known offset, where the
    // textbook's discriminant would have no digits left.
    for distance in [10.0, 1e3, 1e6] {
        for offset in [0.0, 0.5, 0.999] {
            let mut world = World::new();
            exact(&mut world, Quadric::sphere(1.0), black(), Transform::IDENTITY);
            camera(&mut world, DVec3::new(offset, 0.0, distance), DVec3::new(offset, 0.0, 0.0), 1e-3);
            let tree = tree(&mut world, &options(64));
            let point = tree.point.expect("it meets the ball");
            // In world space; far out, the tracer has an origin of its own.
            assert!((point.position.length() - 1.0).abs() < 1e-14 + 4e-16 * distance, "on the ball");
            let wanted = tree.origin.z - ((1.0_f64 - offset) * (1.0 + offset)).sqrt();
            assert!((point.distance - wanted).abs() < 4e-10, "{distance} {offset}: {}", point.distance);
        }
        // A ray just beside it.
        let mut world = World::new();
        exact(&mut world, Quadric::sphere(1.0), black(), Transform::IDENTITY);
        camera(&mut world, DVec3::new(1.0 + 1e-8, 0.0, distance), DVec3::new(1.0 + 1e-8, 0.0, 0.0), 1e-3);
        assert!(tree(&mut world, &options(64)).point.is_none(), "{distance}");
    }
    // A ball with a radius of 10⁶ metres below the eye, seen along its horizon.
    let radius = 1e6;
    let mut world = World::new();
    exact(&mut world, Quadric::sphere(radius), black(), Transform::IDENTITY);
    let height = 2.0;
    let horizon = (height * (2.0 * radius + height)).sqrt();
    let down = (horizon / radius).atan();
    for (angle, meets) in [(down + 1e-7, true), (down - 1e-7, false)] {
        let mut cameras = world.query_filtered::<Entity, With<lumbre_scene::Camera>>();
        let old: Vec<Entity> = cameras.iter(&world).collect();
        old.into_iter().for_each(|entity| {
            world.despawn(entity);
        });
        let eye = DVec3::new(0.0, radius + height, 0.0);
        camera(&mut world, eye, eye + DVec3::new(f64::cos(angle), -f64::sin(angle), 0.0), 1e-3);
        assert_eq!(tree(&mut world, &options(64)).point.is_some(), meets, "{angle}");
    }
}

#[test]
fn every_exact_surface_is_met_where_its_equation_says() {
    let shapes = [
        QuadricShape::Plane,
        QuadricShape::Sphere { radius: 0.7 },
        QuadricShape::Cylinder { radius: 0.5, height: 1.6, closed: true },
        QuadricShape::Cone { radius: 0.8, height: 1.5, closed: true },
        // x² + 2 y² + 3 z² + xy - 1 = 0.
        QuadricShape::General { coefficients: [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0] },
        // A saddle: y = x² - z².
        QuadricShape::General { coefficients: [-1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0] },
    ];
    let value = |shape: &QuadricShape, p: DVec3| match *shape {
        QuadricShape::Plane => p.y,
        QuadricShape::Sphere { radius } => p.length() - radius,
        QuadricShape::Cylinder { radius, height, .. } => {
            (p.x.hypot(p.z) - radius).max(p.y.abs() - 0.5 * height)
        }
        QuadricShape::Cone { radius, height, .. } => {
            (p.x.hypot(p.z) - radius / height * (0.5 * height - p.y)).max(-0.5 * height - p.y)
        }
        QuadricShape::General { coefficients: [a, b, c, d, e, f, g, h, i, j] } => {
            a * p.x * p.x
                + b * p.y * p.y
                + c * p.z * p.z
                + d * p.x * p.y
                + e * p.y * p.z
                + f * p.x * p.z
                + g * p.x
                + h * p.y
                + i * p.z
                + j
        }
    };
    for shape in shapes {
        // Rotated, stretched and mirrored.
        let place = Transform::from_xyz(0.3, -0.2, 0.1)
            .with_rotation(DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(0.9))
            .with_scale(DVec3::new(1.0, -1.5, 0.8));
        let trim = Some([DVec3::splat(-2.0), DVec3::splat(2.0)]);
        let mut met = 0;
        for step in 0..200 {
            let turn = f64::from(step) * 2.399_963;
            let y = 1.0 - 2.0 * (f64::from(step) + 0.5) / 200.0;
            let eye =
                6.0 * DVec3::new(turn.cos() * (1.0 - y * y).sqrt(), y, turn.sin() * (1.0 - y * y).sqrt());
            let mut world = World::new();
            let seen_from_both_sides = Material { double_sided: true, ..black() };
            exact(&mut world, Quadric { shape, trim }, seen_from_both_sides, place);
            let target = DVec3::new(0.4 * (turn * 3.0).sin(), 0.3 * (turn * 5.0).sin(), 0.2);
            camera(&mut world, eye, target, 0.1);
            let tree = tree(&mut world, &options(16));
            let own = place.affine().inverse();
            let (start, along) = (own.transform_point3(eye), own.transform_vector3(tree.direction));
            // The first change of sign along the ray, in small steps: the surface that the eye sees first.
            let inside = |t: f64| {
                let p = start + along * t;
                (value(&shape, p) < 0.0, p.abs().max_element() <= 2.0)
            };
            let fine = 40_000;
            let first = (1..fine).map(|step| 12.0 * f64::from(step) / f64::from(fine)).find(|&t| {
                let before = t - 12.0 / f64::from(fine);
                inside(t).0 != inside(before).0 && inside(t).1 && inside(before).1
            });
            match (&tree.point, first) {
                (Some(point), Some(t)) => {
                    met += 1;
                    assert!((point.distance - t).abs() < 1e-3, "{shape:?}: {} for {t}", point.distance);
                    let p = own.transform_point3(point.position);
                    assert!(value(&shape, p).abs() < 1e-12, "{shape:?}: off by {}", value(&shape, p));
                    // The normal points along the gradient, checked by a difference across the surface.
                    let step = 1e-6 * point.normal;
                    let across = value(&shape, own.transform_point3(point.position + step))
                        - value(&shape, own.transform_point3(point.position - step));
                    assert_eq!(across > 0.0, point.front, "{shape:?}: the front is outside");
                    assert!(point.normal.dot(tree.direction) < 0.0);
                }
                (None, None) => {}
                // Where a ray grazes the surface or leaves the box, the steps may miss it.
                (found, _) => assert!(
                    found.as_ref().is_none_or(|point| grazes(point.normal, tree.direction)
                        || own.transform_point3(point.position).abs().max_element() > 1.99),
                    "{shape:?}: {found:?} for {first:?}"
                ),
            }
        }
        assert!(met > 60, "{shape:?}: only {met} rays of 200 met it");
    }
}

fn grazes(normal: DVec3, direction: DVec3) -> bool {
    normal.dot(direction).abs() < 0.05
}

#[test]
fn a_light_shines_through_glass_in_part_and_makes_a_highlight_behind_it() {
    // A floor lit through a sheet with k_t = .25 in red: a quarter of the light, S_i between 0 and 1.
    let mut world = World::new();
    exact(&mut world, Quadric::new(QuadricShape::Plane), Material::matt(Vec3::ONE), Transform::IDENTITY);
    let sheet = Material { transmission: Vec3::new(0.25, 0.5, 0.0), ..black() };
    let thin = Medium { thin: true, ..Medium::default() };
    let entity =
        exact(&mut world, Quadric::new(QuadricShape::Plane), sheet, Transform::from_xyz(0.0, 1.0, 0.0));
    world.entity_mut(entity).insert(thin);
    world.spawn((Light::point(Vec3::splat(4.0)), Transform::from_xyz(0.0, 2.0, 0.0)));
    camera(&mut world, DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO, 0.1);
    let found = tree(&mut world, &options(8));
    assert!((found.radiance - DVec3::new(0.25, 0.5, 0.0)).length() < 1e-12, "{}", found.radiance);
    let lamp = &found.light.as_ref().expect("it is lit").lights[0];
    assert_eq!(lamp.visibility, DVec3::new(0.25, 0.5, 0.0));

    // Document [I]'s k_t L (t.v)^n: seen straight through glass of index 1 towards the lamp, it is all of k_t
    // L at the lamp's distance.
    let mut world = World::new();
    let mut lens = Material { transmission: Vec3::splat(0.5), ior: 1.0, ..black() };
    lens.front.shininess = 20.0;
    exact(&mut world, Quadric::new(QuadricShape::Plane), lens, Transform::IDENTITY);
    world.spawn((Light::point(Vec3::splat(4.0)), Transform::from_xyz(0.0, -2.0, 0.0)));
    for (angle, wanted) in
        [(0.0_f64, 0.5), (0.2, 0.5 * 0.2_f64.cos().powi(20)), (1.0, 0.5 * 1.0_f64.cos().powi(20))]
    {
        look_from(&mut world, DVec3::new(angle.sin(), angle.cos(), 0.0), DVec3::ZERO, 0.1);
        let found = tree(&mut world, &options(8));
        let transmitted = found.light.expect("it is lit").transmitted;
        assert!((transmitted.x - wanted).abs() < 1e-12, "{angle}: {transmitted} for {wanted}");
    }
}

#[test]
fn a_bulb_does_not_hide_its_own_lamp_and_a_shade_does() {
    for (emission, lit) in [(1.0, true), (0.0, false)] {
        let mut world = World::new();
        exact(&mut world, Quadric::new(QuadricShape::Plane), Material::matt(Vec3::ONE), Transform::IDENTITY);
        let around = Mesh(Arc::new(shapes::uv_sphere(0.1, 16, 8)));
        world.spawn((around, glowing(emission, 0.0), Transform::from_xyz(0.0, 2.0, 0.0)));
        world.spawn((Light::point(Vec3::splat(4.0)), Transform::from_xyz(0.0, 2.0, 0.0)));
        camera(&mut world, DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO, 0.1);
        let found = tree(&mut world, &options(8)).radiance;
        assert!((found.x - if lit { 1.0 } else { 0.0 }).abs() < 1e-12, "{emission}: {found}");
        let (picture, _) = draw(&mut world, &paths(1, 4));
        assert_eq!(picture.radiance[0].x > 0.9, lit, "{emission}: {}", picture.radiance[0]);
    }
}

#[test]
fn nothing_to_trace_is_the_background() {
    let mut world = World::new();
    world.insert_resource(SceneSettings { background: Vec3::new(0.1, 0.2, 0.3), ..SceneSettings::default() });
    camera(&mut world, DVec3::ZERO, DVec3::NEG_Z, 1.0);
    let (picture, report) = draw(&mut world, &options(4));
    assert!(
        picture.radiance.iter().all(|pixel| (*pixel - Vec3::new(0.1, 0.2, 0.3).as_dvec3()).length() == 0.0)
    );
    assert_eq!(report.rays, 16);
}

/// Spawns a square of 40 m at this height along z, which faces `toward`.
fn square(world: &mut World, z: f64, toward: DVec3, material: Material) -> Entity {
    let place = Transform::from_xyz(0.0, 0.0, z).with_rotation(DQuat::from_rotation_arc(DVec3::Y, toward));
    world.spawn((Mesh(Arc::new(shapes::plane(40.0, 40.0, 1, 1))), material, place)).id()
}

/// A wall that emits 1 behind the camera, 6 m from the mirror that the camera sees at 2 m, in fog that
/// leaves exp(-.3 d): a mirror, a sheet before it, and a half covering pane between it and the wall.
#[test]
fn fog_lies_before_what_is_seen_in_mirrors_and_through_panes() {
    let color = Vec3::new(0.2, 0.4, 0.9);
    let clear = |metres: f64| (-0.3 * metres).exp();
    let fogged =
        |radiance: DVec3, metres: f64| radiance * clear(metres) + color.as_dvec3() * (1.0 - clear(metres));
    let wall = |metres: f64| fogged(DVec3::ONE, metres);
    let pane = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..black() };
    let sheet = Material { transmission: Vec3::ONE, ..black() };
    let half_covered = 0.5 * fogged(DVec3::ZERO, 3.0) + 0.5 * wall(6.0);
    for (name, between, before, expected) in [
        ("mirror", None, false, fogged(wall(6.0), 2.0)),
        ("pane in the mirror", Some(pane), false, fogged(half_covered, 2.0)),
        // The light passes the sheet on its way to the mirror, too.
        ("sheet before the mirror", None, true, fogged(fogged(fogged(wall(5.0), 1.0), 1.0), 1.0)),
    ] {
        let mut world = World::new();
        let fog = Fog { mode: FogMode::Exponential { density: 0.3 }, color };
        world.insert_resource(SceneSettings { fog: Some(fog), ..SceneSettings::default() });
        square(&mut world, 0.0, DVec3::Z, mirror(1.0));
        square(&mut world, 6.0, DVec3::NEG_Z, glowing(1.0, 0.0));
        if let Some(pane) = between {
            square(&mut world, 3.0, DVec3::NEG_Z, pane);
        }
        if before {
            let sheet = square(&mut world, 1.0, DVec3::Z, sheet.clone());
            world.entity_mut(sheet).insert(Medium { thin: true, ..Medium::default() });
        }
        camera(&mut world, DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 1e-4);
        let seen = tree(&mut world, &options(16)).radiance;
        assert!((seen - expected).abs().max_element() < 1e-6, "{name}: {seen} for {expected}");
        let (picture, report) = draw(&mut world, &paths(16, 256));
        let mean = picture.radiance.iter().sum::<DVec3>() / picture.radiance.len() as f64;
        let error = report.standard_error.expect("there are passes enough") / 16.0;
        assert!((mean - expected).abs().max_element() < 5.0 * error + 1e-6, "{name}: {mean} for {expected}");
    }
}
