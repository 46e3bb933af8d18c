//! The tests' own path tracer against closed forms and against the converged irradiance of another path tracer.

use std::f64::consts::PI;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{Mesh, SceneSettings, StaticObject, Transform};

use crate::held_out::path_tracer::{Effort, PathTracer};
use crate::held_out::reference_points::read;
use crate::held_out::scenes::{self, region::Region};
use crate::scene_parts::grey;
use crate::{common, held_out};

#[test]
fn agrees_with_another_path_tracer() {
    for (model, points) in [
        ("conformance/bake/alcove.glb", "conformance/bake/alcove.csv"),
        ("models/cornell_box.glb", "conformance/bake/cornell_box.csv"),
    ] {
        let (Some(model), Some(points)) = (common::shared(model), common::shared(points)) else { return };
        let mut world = World::new();
        lumbre_scene::load(&mut world, &model).expect("the model loads");
        let expected: Vec<_> = read(&points).into_iter().take(60).collect();
        // The file rounds positions to six digits: move the points off the surface by more than that.
        let places: Vec<(DVec3, DVec3)> = expected
            .iter()
            .map(|p| (p.position + p.normal * (1e-5 * p.position.length()), p.normal))
            .collect();
        let found = PathTracer::new(&mut world).at(&places, Effort::fixed(8, 24), 5);
        let (mut difference, mut variance, mut sum) = (0.0, 0.0, 0.0);
        for (traced, other) in found.iter().zip(&expected) {
            for channel in (0..3).filter(|&c| other.value[c].is_finite()) {
                difference += traced.value[channel] - other.value[channel];
                variance += traced.error[channel].powi(2) + other.error[channel].powi(2);
                sum += other.value[channel];
            }
        }
        println!(
            "{}: bias {:.3} % +- {:.3} %",
            model.display(),
            100.0 * difference / sum,
            100.0 * variance.sqrt() / sum
        );
        // The channels of a path are correlated; three times the variance of independent channels is an upper bound.
        // The limit is five sigma.
        assert!(difference.abs() < 5.0 * (3.0 * variance).sqrt(), "{}: {difference}", model.display());
    }
}

fn floor(world: &mut World) {
    world.spawn((Mesh(Arc::new(shapes::plane(20.0, 20.0, 1, 1))), grey(0.5, 0.0), StaticObject));
}

/// Points of the floor about the origin.
fn on_the_floor() -> Vec<(DVec3, DVec3)> {
    (0..25).map(|i| (DVec3::new(f64::from(i % 5) - 2.1, 0.0, f64::from(i / 5) - 2.2), DVec3::Y)).collect()
}

/// The root mean square of the points' errors in units of their standard errors.
fn sigmas(found: &[held_out::path_tracer::Irradiance], expected: impl Fn(DVec3) -> f64) -> f64 {
    let square = |p: &held_out::path_tracer::Irradiance| {
        let expected = expected(p.position);
        // Points without noise still differ by rounding.
        ((p.value.x - expected) / p.error.x.max(1e-6 * expected)).powi(2)
    };
    (found.iter().map(square).sum::<f64>() / found.len() as f64).sqrt()
}

#[test]
fn sun_and_sky() {
    // A black wall, 1 m high, stands on the floor. It hides a part of the sky that is known from the form factor of two
    // perpendicular rectangles, and casts a sharp shadow of the sun, which shines over its top at 45°.
    let mut world = World::new();
    floor(&mut world);
    let corners = [[0.0, 0.0, 50.0], [0.0, 0.0, -50.0], [0.0, 1.0, -50.0], [0.0, 1.0, 50.0]];
    let wall = |order: Vec<u32>| {
        let positions = corners.map(Vec3::from).to_vec();
        Mesh(Arc::new(TriangleMesh { positions, indices: order, ..TriangleMesh::default() }))
    };
    world.spawn((wall(vec![0, 1, 2, 0, 2, 3]), grey(0.0, 0.0), StaticObject));
    world.insert_resource(SceneSettings { sky: Vec3::splat(2.0), ..SceneSettings::default() });
    let sun = Light { bake: BakeMode::Static, ..Light::directional(Vec3::splat(3.0)) };
    world.spawn((sun, Transform::IDENTITY.looking_at(DVec3::new(1.0, -1.0, 0.0), DVec3::Y)));
    let dynamic = Light::directional(Vec3::splat(100.0));
    world.spawn((dynamic, Transform::IDENTITY.looking_at(DVec3::NEG_Y, DVec3::Z)));
    let places: Vec<_> =
        [0.2, 0.9, 1.1, 2.5].map(|x| (DVec3::new(x, 0.0, 0.1), DVec3::Y)).into_iter().collect();
    let found = PathTracer::new(&mut world).at(&places, Effort::fixed(16, 24), 3);
    let expected = |p: DVec3| {
        // The wall is practically infinite: it hides (1 - sin β)/2 of the sky, with tan β = x/1 m.
        let hidden = 0.5 * (1.0 - p.x / p.x.hypot(1.0));
        let sun = if p.x > 1.0 { PI * 3.0 / 2f64.sqrt() } else { 0.0 };
        2.0 * PI * (1.0 - hidden) + sun
    };
    for p in &found {
        println!(
            "{:.2}: {:.4} ± {:.4}, expected {:.4}",
            p.position.x,
            p.value.x,
            p.error.x,
            expected(p.position)
        );
    }
    let deviation = sigmas(&found, expected);
    assert!(deviation < 2.5, "{deviation}");
    // The edge of the sun's shadow lies between the second and the third point, but not within a texel of either.
    assert!(found.iter().all(|p| !p.edge && p.inside));
    let near =
        PathTracer::new(&mut world).at(&[(DVec3::new(0.99, 0.0, 0.1), DVec3::Y)], Effort::fixed(2, 4), 3);
    assert!(near[0].edge, "a centimetre beside the edge of a shadow");
}

#[test]
fn many_lamps_as_their_sum() {
    // Emissive squares of 4 mm, 1.5 to 2.5 m above a black floor: each acts as a point to within 10⁻⁵, and together
    // they hide less than 10⁻³ of each other. Then as many point lights.
    let places: Vec<DVec3> = (0..1500u32)
        .map(|i| {
            let [x, y, z] = [0.755, 0.57, 0.438].map(|step| (0.5 + step * f64::from(i)).fract());
            DVec3::new(6.0 * x - 3.0, 1.5 + y, 6.0 * z - 3.0)
        })
        .collect();
    let (side, radiance) = (0.004, 1250.0);
    let mut lamps = TriangleMesh::default();
    for at in &places {
        let first = lamps.positions.len() as u32;
        for (s, t) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            lamps.positions.push((*at + DVec3::new(s * side, 0.0, t * side)).as_vec3());
        }
        lamps.indices.extend([0, 1, 2, 0, 2, 3].map(|vertex| first + vertex));
    }
    let square = |p: DVec3| {
        let term = |at: &DVec3| at.y * at.y / p.distance_squared(*at).powi(2);
        radiance * side * side * places.iter().map(term).sum::<f64>()
    };
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(shapes::plane(20.0, 20.0, 1, 1))), grey(0.0, 0.0), StaticObject));
    world.spawn((Mesh(Arc::new(lamps)), grey(0.0, radiance as f32), StaticObject));
    let found = PathTracer::new(&mut world).at(&on_the_floor(), Effort::fixed(16, 16), 3);
    let relative = found.iter().map(|p| p.error.x / p.value.x).fold(0.0, f64::max);
    let off = sigmas(&found, square);
    println!("squares: {off:.2} sigma of at most {:.3} %", 100.0 * relative);
    assert!(off < 1.6 && relative < 0.01, "{off} {relative}");

    let mut world = World::new();
    world.spawn((Mesh(Arc::new(shapes::plane(20.0, 20.0, 1, 1))), grey(0.0, 0.0), StaticObject));
    for at in &places {
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(1e-2)) };
        world.spawn((light, Transform::from_translation(*at)));
    }
    let found = PathTracer::new(&mut world).at(&on_the_floor(), Effort::fixed(16, 16), 3);
    let expected = |p: DVec3| {
        let term = |at: &DVec3| at.y / p.distance(*at).powi(3);
        PI * 1e-2f32 as f64 * places.iter().map(term).sum::<f64>()
    };
    let off = sigmas(&found, expected);
    println!("points: {off:.2} sigma");
    assert!(off < 1.6, "{off}");
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn guided_paths_and_light_gathered_before_change_nothing_but_noise() {
    // The sunlit room by plain paths, by paths that are guided to its window and to the sun on its floor, and by paths
    // that end in the indirect cache.
    let places: Vec<_> = [
        ([2.5, 2.7, 2.0], DVec3::NEG_Y),
        ([5.0, 1.8, 1.0], DVec3::NEG_X),
        ([2.0, 1.9, 0.0], DVec3::Z),
        ([0.0, 1.0, 3.0], DVec3::X),
    ]
    .map(|(at, normal)| (DVec3::from(at), normal))
    .to_vec();
    let mut world = scenes::sunlit_room(0, 1.0);
    let guided = PathTracer::new(&mut world);
    let found = guided.at(&places, Effort::fixed(48, 24), 3);
    let short = guided.with_indirect_cache(1).at(&places, Effort::fixed(48, 24), 3);
    world.remove_resource::<Region>();
    let bare = PathTracer::new(&mut world).at(&places, Effort::fixed(96, 24), 4);
    for ((a, b), c) in found.iter().zip(&short).zip(&bare) {
        let show = |p: &held_out::path_tracer::Irradiance| format!("{:.4} ± {:.4}", p.value.x, p.error.x);
        println!("guided {}, gathered before {}, bare {}", show(a), show(b), show(c));
        for (one, other, allowed) in [(a, c, 0.0), (b, c, 0.01)] {
            let sigma = one.error.x.hypot(other.error.x) + allowed * other.value.x;
            // The cached light is constant over a tenth of a metre, for which 1 % is allowed.
            assert!((one.value.x - other.value.x).abs() < 4.0 * sigma, "{}", one.position);
        }
    }
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn light_in_the_gap_between_a_lamp_and_the_ceiling_does_not_leak_out() {
    let (build, layout) = scenes::find("cellar_0").expect("a level of the tests");
    let mut world = build(layout, 1.0);
    let place = [(DVec3::new(-1.242, 0.0, 2.731), DVec3::Y)];
    let full_paths = PathTracer::new(&mut world).at(&place, Effort::fixed(36, 24), 5)[0];
    let cached = PathTracer::new(&mut world).with_indirect_cache(7).at(&place, Effort::fixed(36, 24), 5)[0];
    let difference = (full_paths.value - cached.value).abs();
    let allowed = 4.0 * (full_paths.error + cached.error);
    // Light that leaked from the gap once made the cached result 16 % brighter.
    assert!(
        difference.cmple(allowed).all() && difference.max_element() < 0.05 * full_paths.value.max_element(),
        "{difference}"
    );
}
