//! Input that is difficult for bakers: degenerate and duplicate triangles, reflectance above 1, thin sheets, mirrored
//! and instanced objects, alpha masks.

use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use crate::common;
use crate::scene_parts::grey;
use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Density, Quality};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{AlphaMode, BakeMode, Light, Material};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

fn run(world: &mut World) -> BakeReport {
    let options =
        BakeOptions { density: Density::MapSize(24), quality: Quality::Draft, ..BakeOptions::default() };
    Bake::new(&options).run(world).expect("the scene bakes")
}

fn spawn(world: &mut World, mesh: TriangleMesh, material: Material, place: Transform) -> Entity {
    world.spawn((Mesh(Arc::new(mesh)), material, StaticObject, place)).id()
}

/// A square of side 2 m at height `y`, looking up or down.
fn square(y: f32, up: bool) -> TriangleMesh {
    common::shapes::square(2.0, y, up)
}

/// The mean irradiance over the texels that are not black. Checks that no texel is negative, infinite or NaN.
fn mean(world: &World, entity: Entity) -> f32 {
    let map = &world.get::<Lightmap>(entity).expect("the entity was baked").image;
    assert!(map.texels.iter().all(|texel| texel.is_finite() && texel.min_element() >= 0.0));
    let lit: Vec<f32> = map.texels.iter().map(|texel| texel.x * PI).filter(|&e| e > 0.0).collect();
    lit.iter().sum::<f32>() / lit.len().max(1) as f32
}

#[test]
fn degenerate_triangles_are_dropped_by_name() {
    let mut mesh = square(0.0, true);
    mesh.positions.extend([Vec3::NAN, Vec3::new(0.5, 0.0, 0.5), Vec3::new(1e30, f32::INFINITY, 0.0)]);
    mesh.normals = vec![Vec3::ZERO, Vec3::NAN, Vec3::Y, Vec3::NEG_Y, Vec3::Y, Vec3::Y, Vec3::Y];
    mesh.indices.extend([0, 1, 4, 0, 1, 1, 5, 5, 5, 0, 1, 6]);
    let mut world = World::new();
    let floor = spawn(&mut world, mesh, grey(0.5, 0.0), Transform::IDENTITY);
    world.entity_mut(floor).insert(Name::new("bad floor"));
    spawn(&mut world, square(1.0, false), grey(0.5, 1.0), Transform::IDENTITY);
    let report = run(&mut world);
    for words in ["bad floor: 2 triangles with NaN", "bad floor: 2 triangles without area"] {
        assert!(report.warnings.iter().any(|line| line.contains(words)), "{:?}", report.warnings);
    }
    let mut good = World::new();
    let reference = spawn(&mut good, square(0.0, true), grey(0.5, 0.0), Transform::IDENTITY);
    spawn(&mut good, square(1.0, false), grey(0.5, 1.0), Transform::IDENTITY);
    run(&mut good);
    assert!(mean(&world, floor) > 0.5 && mean(&good, reference) > 0.5);
    // The light at the same points must agree, though the layouts of the maps differ.
    let points: Vec<_> = (0..9)
        .map(|i| common::ReferencePoint {
            position: DVec3::new(f64::from(i % 3) * 0.6 - 0.6, 0.0, f64::from(i / 3) * 0.6 - 0.6),
            normal: DVec3::Y,
            irradiance: DVec3::ONE,
        })
        .collect();
    let expected = common::compare(&mut good, &points).worst;
    let lit: Vec<_> = expected
        .iter()
        .map(|&(position, irradiance, _)| common::ReferencePoint { position, normal: DVec3::Y, irradiance })
        .collect();
    let found = common::compare(&mut world, &lit);
    // Both maps interpolate the same smooth light, at some ten texels per metre.
    assert!(lit.len() == 9 && found.missed == 0 && found.rmse < 0.01, "{found}");
}

#[test]
fn reflectance_above_one_is_clamped_with_a_warning() {
    let mut world = World::new();
    let floor = spawn(&mut world, square(0.0, true), grey(3.0, 0.0), Transform::IDENTITY);
    spawn(&mut world, square(1.0, false), grey(3.0, 1.0), Transform::IDENTITY);
    let report = run(&mut world);
    assert!(report.warnings.iter().any(|line| line.contains("above 0.999")), "{:?}", report.warnings);
    // ρ = 1, F = 0.415 for squares of side 2 at distance 1: B1 = F π / (1 - F²) = 1.58 at most.
    let found = mean(&world, floor);
    assert!(found > 0.9 && found < 1.6, "{found}");
}

#[test]
fn a_lamp_in_the_plane_of_the_ceiling_shines() {
    let floor_light = |with_ceiling: bool| {
        let mut world = World::new();
        let floor = spawn(&mut world, square(0.0, true), grey(0.0, 0.0), Transform::IDENTITY);
        if with_ceiling {
            spawn(&mut world, square(1.0, false), grey(0.0, 0.0), Transform::IDENTITY);
        }
        spawn(&mut world, square(1.0, false), grey(0.0, 1.0), Transform::IDENTITY);
        let report = run(&mut world);
        assert_eq!(report.warnings.iter().any(|line| line.contains("lie exactly on others")), with_ceiling);
        mean(&world, floor)
    };
    let (alone, with_ceiling) = (floor_light(false), floor_light(true));
    // F = 0.415253283577147 between the squares. The mean over texels gives border texels, which are half covered, full
    // weight.
    assert!((alone / (PI * 0.415_253_3) - 1.0).abs() < 0.06, "{alone}");
    assert!((with_ceiling / alone - 1.0).abs() < 1e-4, "{with_ceiling} {alone}");
}

#[test]
fn a_sheet_of_two_faces_keeps_its_sides_apart() {
    // A black sheet that is lit from above: two coincident faces that are split along different diagonals.
    let mut world = World::new();
    let top = spawn(&mut world, square(0.0, true), grey(0.0, 0.0), Transform::IDENTITY);
    let mut below = square(0.0, false);
    below.indices = vec![1, 2, 3, 1, 3, 0];
    let bottom = spawn(&mut world, below, grey(0.0, 0.0), Transform::IDENTITY);
    let light = Light { bake: BakeMode::Static, ..Light::directional(Vec3::splat(FRAC_1_PI)) };
    let down = Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::X);
    world.spawn((light, down));
    run(&mut world);
    // E = π L_d cos 0 = 1.
    assert!((mean(&world, top) - 1.0).abs() < 1e-3);
    assert_eq!(mean(&world, bottom), 0.0);
}

#[test]
fn a_mirrored_object_keeps_its_front() {
    let light = |scale: DVec3| {
        let mut world = World::new();
        let floor =
            spawn(&mut world, square(0.0, true), grey(0.0, 0.0), Transform::IDENTITY.with_scale(scale));
        let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        world.spawn((lamp, Transform::from_xyz(0.0, 1.0, 0.0)));
        run(&mut world);
        mean(&world, floor)
    };
    let plain = light(DVec3::ONE);
    assert!(plain > 0.5);
    assert!((light(DVec3::new(-1.0, 1.0, 1.0)) / plain - 1.0).abs() < 0.01);
}

#[test]
fn instances_share_coordinates_and_have_their_own_maps() {
    let mut world = World::new();
    let mesh = Arc::new(shapes::cuboid(Vec3::ONE, 1));
    let at = |x: f64| Transform::from_xyz(x, 0.0, 0.0);
    let [near, far] =
        [1.5, 6.0].map(|x| world.spawn((Mesh(mesh.clone()), grey(0.5, 0.0), StaticObject, at(x))).id());
    let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((lamp, Transform::IDENTITY));
    run(&mut world);
    let meshes = [near, far].map(|entity| world.get::<Mesh>(entity).unwrap().0.clone());
    assert!(Arc::ptr_eq(&meshes[0], &meshes[1]) && !meshes[0].uv1.is_empty());
    assert!(mean(&world, near) > 4.0 * mean(&world, far));
}

#[test]
fn parts_that_an_alpha_mask_cuts_out_let_light_through() {
    let below = |alpha: f32| {
        let mut world = World::new();
        let floor = spawn(&mut world, square(0.0, true), grey(0.0, 0.0), Transform::IDENTITY);
        let sheet = Material { alpha, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..grey(0.0, 0.0) };
        spawn(&mut world, square(0.5, true), sheet, Transform::IDENTITY);
        let lamp = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        world.spawn((lamp, Transform::from_xyz(0.0, 1.0, 0.0)));
        run(&mut world);
        mean(&world, floor)
    };
    assert!(below(0.4) > 0.5);
    assert_eq!(below(0.6), 0.0);
}
