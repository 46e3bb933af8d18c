//! The study of shadows where the answer is known: nothing that casts a shadow, and a lamp whose penumbra is
//! as wide as its block.

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_cost::{CostOptions, Study};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, SpotCone};
use lumbre_scene::{Camera, Mesh, Name, Transform};

use super::{measured, options, saved};

/// A matt floor under a spotlight with a shadow, with or without a bar above it.
fn floor_under_a_lamp(radius: f32, bar: bool) -> World {
    let mut world = World::new();
    let floor = Mesh(Arc::new(shapes::plane(30.0, 30.0, 1, 1)));
    world.spawn((Name::new("floor"), floor, Material::matt(Vec3::splat(0.6))));
    if bar {
        let bar = Mesh(Arc::new(shapes::cuboid(Vec3::new(3.0, 0.05, 0.3), 1)));
        let place = Transform::from_xyz(0.0, 1.5, -0.5);
        world.spawn((Name::new("bar"), bar, Material::matt(Vec3::splat(0.3)), place));
    }
    let cone = SpotCone::Smooth { inner: 0.9, outer: 1.0 };
    let lamp = Light { shadow: true, radius, ..Light::spot(Vec3::splat(12.0), cone) };
    let above = Transform::from_xyz(0.0, 4.0, -0.8).looking_at(DVec3::ZERO, DVec3::Z);
    world.spawn((Name::new("lamp"), lamp, above));
    let eye = Transform::from_xyz(0.0, 4.0, 2.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye));
    world
}

fn study_of(world: World) -> Study {
    let folder = tempfile::tempdir().unwrap();
    let path = saved(folder.path(), "floor.glb", world);
    let asked = CostOptions { size: (120, 80), ..options(&["shadows"], vec![path]) };
    let report = measured(&asked, &folder.path().join("report"));
    report.study("shadows").unwrap().clone()
}

fn error_of(study: &Study, series: &str, resolution: f64) -> f64 {
    let asked = |point: &&lumbre_cost::Point| point.parameters.values().any(|value| *value == resolution);
    let point = study.of_series(series).find(asked).unwrap();
    point.error.unwrap().relative_rmse
}

#[test]
fn where_nothing_is_in_the_way_no_filter_is_off() {
    let study = study_of(floor_under_a_lamp(0.0, false));
    assert!(study.points.len() > 10);
    for point in &study.points {
        // The light itself has the rounding errors of f32.
        let error = point.error.unwrap().relative_rmse;
        assert!(error < 1e-5, "{}, {}: {error}", point.series, point.label);
    }
}

#[test]
fn a_penumbra_wants_soft_shadows_and_a_sharp_edge_texels() {
    let wide = study_of(floor_under_a_lamp(0.3, true));
    let without = wide.of_series("no shadows").next().unwrap().error.unwrap().relative_rmse;
    let [hard, soft] = ["hard", "soft"].map(|series| error_of(&wide, series, 1.0));
    assert!(soft < 0.7 * hard && hard < without, "{soft} {hard} {without}: {:?}", wide.findings);
    let sharp = study_of(floor_under_a_lamp(0.0, true));
    let [few, many] = [0.25, 4.0].map(|resolution| error_of(&sharp, "hard", resolution));
    assert!(many < 0.6 * few, "{many} {few}: {:?}", sharp.findings);
    // Redrawing the maps in every frame does not change the picture.
    for resolution in [1.0, 4.0] {
        let anew = error_of(&sharp, "soft, all maps drawn anew", resolution);
        assert_eq!(anew, error_of(&sharp, "soft", resolution));
    }
    assert!(sharp.findings.len() >= 5, "{:?}", sharp.findings);
}
