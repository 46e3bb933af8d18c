//! Cases of extreme size or brightness: scenes of a millimetre and of a hundred kilometres, lights whose intensities
//! differ by a factor of 10⁸, lamps and charts far smaller than a texel, texture coordinates out of range. The expected
//! values are closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common;
use crate::common::shapes::room;
use crate::scene_parts::grey;
use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DVec3, Vec2, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::Material;
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

fn run(world: &mut World, side: u32) -> BakeReport {
    run_with(world, side, Quality::Draft)
}

fn run_with(world: &mut World, side: u32, quality: Quality) -> BakeReport {
    let options = BakeOptions { density: Density::MapSize(side), quality, ..BakeOptions::default() };
    Bake::new(&options).run(world).expect("the scene bakes")
}

fn spawn(world: &mut World, mesh: TriangleMesh, material: Material, at: DVec3) -> Entity {
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, Transform::from_translation(at))).id()
}

/// The irradiance (red channel) of the texels that are not black.
fn lit(world: &World, entity: Entity) -> Vec<f64> {
    let map = &world.get::<Lightmap>(entity).expect("the entity was baked").image;
    assert!(map.texels.iter().all(|texel| texel.is_finite()));
    map.texels.iter().map(|texel| f64::from(texel.x) * PI).filter(|&e| e > 0.0).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The irradiance (red channel) at a grid of points on each face of a cube seen from inside, in the order -x, x, -y, y,
/// -z, z.
fn on_the_walls(world: &mut World, half: f64) -> [Vec<f64>; 6] {
    const POINTS: i32 = 20;
    let surfaces = common::lightmapped(world);
    std::array::from_fn(|face| {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][face / 2] * if face % 2 == 0 { -1.0 } else { 1.0 };
        let (right, up) =
            ([DVec3::Y, DVec3::Z, DVec3::X][face / 2], [DVec3::Z, DVec3::X, DVec3::Y][face / 2]);
        let at = |i: i32| half * (f64::from(2 * i + 1) / f64::from(POINTS) - 1.0);
        let points = (0..POINTS * POINTS).map(|i| axis * half + right * at(i % POINTS) + up * at(i / POINTS));
        points
            .map(|position| {
                let point = common::ReferencePoint { position, normal: -axis, irradiance: DVec3::ZERO };
                common::look_up(&surfaces, &point).expect("the wall has a map").x
            })
            .collect()
    })
}

#[test]
fn no_ray_hits_the_face_it_left_from_a_millimetre_to_a_hundred_kilometres() {
    // A closed room whose walls emit: E = πL/(1 - ρ) everywhere. A ray that hits the face it starts on loses light, and
    // so does one that leaves the room.
    const REFLECTANCE: f32 = 0.7;
    let expected = PI / (1.0 - f64::from(REFLECTANCE));
    for size in [1e-3f32, 0.37, 1.0, 1e3, 1e5] {
        // Also far from the origin, where the rounding of the corners (2⁻²⁴ of their coordinates) is larger.
        for away in [0.0, 50.0] {
            let mut world = World::new();
            let at = DVec3::new(1.0, -0.3, 0.7) * (away * f64::from(size));
            let entity = spawn(&mut world, room(Vec3::new(1.0, 0.6, 0.8) * size), grey(REFLECTANCE, 1.0), at);
            let report = run(&mut world, 24);
            for e in lit(&world, entity) {
                // The form factors of a row sum to one within 2e-3, an error that is multiplied by 1/(1 - ρ).
                assert!(
                    (e / expected - 1.0).abs() < 0.01,
                    "{size} m, {away} away: {e} instead of {expected}"
                );
            }
            assert!(report.energy_lost < 0.01, "{size} m: {report:?}");
        }
    }
}

#[test]
fn a_lamp_a_thousandth_of_the_room_gives_all_its_light_and_no_sparks() {
    // The emitted and the absorbed power are equal: the mean of E over the walls is Φ / (A (1 - ρ)), Φ = π L a for a
    // lamp of area a.
    const REFLECTANCE: f32 = 0.5;
    for quality in [Quality::Draft, Quality::Final] {
        let mut world = World::new();
        spawn(&mut world, room(Vec3::splat(2.0)), grey(REFLECTANCE, 0.0), DVec3::ZERO);
        let side = 2e-3f32;
        let lamp = shapes::cuboid(Vec3::splat(side), 1);
        spawn(&mut world, lamp, grey(0.0, 1e6), DVec3::new(0.1, 0.2, -0.15));
        run_with(&mut world, 64, quality);
        let walls = on_the_walls(&mut world, 1.0);
        let all: Vec<f64> = walls.iter().flatten().copied().collect();
        let expected = PI * 1e6 * 6.0 * f64::from(side).powi(2) / (24.0 * 0.5);
        // The grid of 20 by 20 points and the texels contribute well under one per cent, and the patches of draft
        // quality another one.
        assert!((mean(&all) / expected - 1.0).abs() < 0.02, "{} instead of {expected}", mean(&all));
        // No point stands out from its neighbours in a row.
        for wall in &walls {
            for row in wall.chunks(20) {
                for three in row.windows(3) {
                    let between = 0.5 * (three[0] + three[2]);
                    assert!((three[1] / between - 1.0).abs() < 0.1, "a spark: {three:?}");
                }
            }
        }
    }
}

#[test]
fn a_room_lit_a_hundred_million_times_less_than_its_neighbour_is_as_bright_as_alone() {
    let dim_room = |bright: bool| {
        let mut world = World::new();
        let at = DVec3::new(5.0, 0.0, 0.0);
        let dim = spawn(&mut world, room(Vec3::splat(2.0)), grey(0.5, 0.0), at);
        let lamp = || shapes::cuboid(Vec3::splat(0.4), 1);
        spawn(&mut world, lamp(), grey(0.3, 1.0), at + DVec3::new(0.2, 0.4, 0.1));
        if bright {
            spawn(&mut world, room(Vec3::splat(2.0)), grey(0.6, 0.0), DVec3::ZERO);
            spawn(&mut world, lamp(), grey(0.3, 1e8), DVec3::new(-0.2, 0.4, 0.3));
        }
        run(&mut world, 32);
        mean(&lit(&world, dim))
    };
    let (alone, beside) = (dim_room(false), dim_room(true));
    // By the balance of power, the mean of E is Φ / Σ A (1 - ρ), where the sum includes the lamp's surface with ρ =
    // 0.3.
    assert!(alone > 0.15, "{alone}");
    assert!((beside / alone - 1.0).abs() < 0.02, "{beside} beside, {alone} alone");
}

#[test]
fn coordinates_out_of_range_and_overlapping_are_named_and_replaced() {
    for (name, change) in [
        ("out of range", (|uv| uv * 3.0 - 1.0) as fn(Vec2) -> Vec2),
        ("overlapping", |uv| uv),
        ("without area", |_| Vec2::splat(0.5)),
        ("not a number", |_| Vec2::NAN),
    ] {
        let mut world = World::new();
        // Each of the six faces covers the whole unit square.
        let mut mesh = room(Vec3::ONE);
        mesh.uv1 = mesh.uv0.iter().map(|&uv| change(uv)).collect();
        let entity = spawn(&mut world, mesh, grey(0.5, 1.0), DVec3::ZERO);
        world.entity_mut(entity).insert(Name::new("papered room"));
        let report = run(&mut world, 32);
        let named = |line: &String| line.contains("papered room") && line.contains("unwrapped anew");
        assert!(report.warnings.iter().any(named), "{name}: {:?}", report.warnings);
        // E = πL/(1 - ρ) in every texel: no face overwrote another.
        for e in lit(&world, entity) {
            assert!((e / (2.0 * PI) - 1.0).abs() < 0.01, "{name}: {e}");
        }
    }
}

#[test]
fn charts_below_a_texel_have_light() {
    // Boxes far smaller than a texel in a furnace: each of their triangles has E = πL/(1 - ρ), and none is black.
    let mut world = World::new();
    spawn(&mut world, room(Vec3::ONE), grey(0.5, 1.0), DVec3::ZERO);
    let mut crumbs = TriangleMesh::default();
    for i in 0..60 {
        let turn = f64::from(i) * 2.399_963;
        let at = DVec3::new(0.3 * turn.cos(), f64::from(i) / 60.0 - 0.5, 0.3 * turn.sin()) * 0.5;
        let tiny = shapes::cuboid(Vec3::splat(2e-4), 1);
        let first = crumbs.positions.len() as u32;
        crumbs.positions.extend(tiny.positions.iter().map(|p| *p + at.as_vec3()));
        crumbs.indices.extend(tiny.indices.iter().map(|index| index + first));
    }
    let entity = spawn(&mut world, crumbs.clone(), grey(0.5, 1.0), DVec3::ZERO);
    // The side of a box is 1/156 of a texel.
    let options = BakeOptions {
        density: Density::TexelsPerMeter(32.0),
        // With the rays of a draft, one sample more or less makes up 3 % of a texel's light.
        error: 0.002,
        ..BakeOptions::default()
    };
    Bake::new(&options).run(&mut world).expect("the scene bakes");
    let surfaces = common::lightmapped(&mut world);
    for [a, b, c] in crumbs.triangles().map(|t| t.map(|v| crumbs.positions[v as usize].as_dvec3())) {
        let normal = (b - a).cross(c - a).normalize();
        let point = common::ReferencePoint { position: (a + b + c) / 3.0, normal, irradiance: DVec3::ZERO };
        let found = common::look_up(&surfaces, &point).expect("the crumb has a map").x;
        // The boxes emit as the walls do, so that they do not darken the room.
        assert!((found / (2.0 * PI) - 1.0).abs() < 0.02, "{found} at {}", point.position);
    }
    assert!(!lit(&world, entity).is_empty());
}
