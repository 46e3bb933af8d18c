//! A quick report bakes a level of many static triangles less often, since each of its bakes takes seconds. All of it
//! is seen in counts.

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_cost::{CostOptions, CostReport, Study};
use lumbre_mesh::shapes;
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{Camera, Mesh, Name, StaticObject, Transform};

use super::{measured, options, saved};

/// A block on a floor of 2 × `pieces` × `pieces` triangles, under a lamp that is baked and one that is not.
fn floor_of(pieces: u32) -> World {
    let mut world = World::new();
    let floor = Mesh(Arc::new(shapes::plane(6.0, 6.0, pieces, pieces)));
    world.spawn((Name::new("floor"), floor, Material::matt(Vec3::splat(0.6)), StaticObject));
    let block = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.8), 1)));
    let place = Transform::from_xyz(-0.5, 0.4, -0.5);
    world.spawn((Name::new("block"), block, Material::matt(Vec3::splat(0.4)), StaticObject, place));
    for (bake, x) in [(BakeMode::Static, 1.0), (BakeMode::Dynamic, -1.0)] {
        let lamp = Light { bake, ..Light::point(Vec3::splat(2.0)) };
        world.spawn((Name::new("lamp"), lamp, Transform::from_xyz(x, 2.0, 0.5)));
    }
    let eye = Transform::from_xyz(2.0, 3.0, 4.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye));
    world
}

fn counted(pieces: u32) -> CostReport {
    let folder = tempfile::tempdir().unwrap();
    let level = saved(folder.path(), "level.glb", floor_of(pieces));
    let studies = ["bake", "preprocessing", "transport", "lightmaps"];
    let asked = CostOptions { counts_only: true, ..options(&studies, vec![level]) };
    measured(&asked, &folder.path().join("report"))
}

#[test]
fn a_level_of_many_triangles_is_baked_less_often() {
    // 1,800 and 5,202 triangles and the block's; up to 5,000 are baked as often as in any quick report.
    let [usual, many] = [30, 51].map(counted);
    let study = |report: &CostReport, name: &str| -> Study { report.study(name).unwrap().clone() };
    let both = |name: &str| [study(&usual, name), study(&many, name)];

    let bakes = both("bake").map(|study| {
        let of = |series: &str| study.of_series(series).count();
        ["final", "draft", "patches", "without smoothing", "without bounces"].map(of)
    });
    assert_eq!(bakes, [[2, 1, 2, 1, 1], [1, 1, 0, 0, 1]]);

    // After a change the level is baked for the error of the bake before it, and not for a third of that.
    let rays = both("preprocessing").map(|study| {
        let whole = study.of_series("bake after a change").next().unwrap();
        whole.counts["rays"] / whole.counts["texels"]
    });
    assert!(rays[1] < 0.5 * rays[0], "{rays:?}");

    let bounces = both("transport").map(|study| {
        let of_every_lamp = |label: &str| label == "and bounces of every lamp";
        study.points.iter().filter(|point| of_every_lamp(&point.label)).count()
    });
    assert_eq!(bounces, [1, 0]);

    // The highest density has the texels of the other studies' bakes, and lower ones are means of them.
    let densities = both("lightmaps").map(|study| {
        let points: Vec<_> = study.of_series("rgb32f").collect();
        let reduced = points.iter().filter(|point| point.command.contains("--lightmap-reduction")).count();
        (points.len(), reduced, points[0].counts["texels"])
    });
    let [(3, 0, all), (3, 2, few)] = densities else { panic!("{densities:?}") };
    assert!(few < 0.5 * all, "{densities:?}");
}
