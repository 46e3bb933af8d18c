//! Two measured reports, of which the second is of a slower and of a worse level: `--compare` finds what was
//! planted, and nothing where nothing was.

use std::path::Path;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_cost::{Change, CostOptions, CostReport, What, compare_reports};
use lumbre_mesh::shapes::tetrahedral_sphere;
use lumbre_optics::{Light, Material, Surface};
use lumbre_scene::{Camera, Mesh, Name, Transform};

use super::{measured, options, saved};

/// A shiny ball with this number of subdivisions, drawn this many times over itself from the inside outwards,
/// so that every copy is shaded.
fn balls(depth: u32, layers: u32) -> World {
    let mut world = World::new();
    let shiny = Surface {
        specular: Vec3::splat(0.5),
        shininess: 40.0,
        ..Material::matt(Vec3::new(0.3, 0.4, 0.7)).front
    };
    for layer in 0..layers {
        let ball = tetrahedral_sphere(1.0 + 1e-4 * layer as f32, depth, false);
        let material = Material { front: shiny, ..Material::default() };
        world.spawn((Name::new("ball"), Mesh(Arc::new(ball)), material));
    }
    let above = Transform::from_xyz(1.0, 2.0, 1.5).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("sun"), Light::directional(Vec3::splat(0.8)), above));
    let eye = Transform::from_xyz(0.0, 0.0, 3.0);
    world.spawn((Name::new("eye"), Camera::default(), eye));
    world
}

/// The report of the study `shading` on a level, which has the same name each time.
fn report(folder: &Path, name: &str, world: World) -> CostReport {
    let own = folder.join(name);
    std::fs::create_dir_all(&own).unwrap();
    let path = saved(&own, "level.glb", world);
    let asked = CostOptions { size: (96, 64), ..options(&["shading"], vec![path]) };
    measured(&asked, &own.join("report"))
}

#[test]
fn a_slow_down_and_an_error_that_are_planted_in_a_level_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let before = report(folder.path(), "before", balls(5, 1));
    let worse = |change: &&Change| change.is_worse();

    // Forty balls in place of one change the time and the triangles far beyond any noise, and the picture
    // hardly at all.
    let slow = compare_reports(&before, &report(folder.path(), "slow", balls(5, 40)), 1.5);
    let slower: Vec<&Change> = slow.iter().filter(|change| change.is_slower()).collect();
    assert_eq!(slower.len(), 3, "flat, Gouraud and Phong: {slow:?}");
    let is_triangles =
        |change: &Change| matches!(&change.what, What::Count { name, .. } if name == "triangles");
    assert!(slow.iter().any(|change| change.is_worse() && is_triangles(change)), "{slow:?}");

    // On a coarser ball, Gouraud shading has a larger error at every pixel, and the frame is not slower.
    let coarse = compare_reports(&before, &report(folder.path(), "coarse", balls(3, 1)), 1.5);
    let errors: Vec<&Change> =
        coarse.iter().filter(worse).filter(|change| matches!(change.what, What::Error { .. })).collect();
    assert!(errors.iter().any(|change| change.point.starts_with("Gouraud")), "{coarse:?}");
    assert!(!coarse.iter().any(Change::is_slower), "{coarse:?}");

    // On the same level again, nothing has grown.
    let same = compare_reports(&before, &report(folder.path(), "same", balls(5, 1)), 1.5);
    assert_eq!(same.iter().filter(worse).count(), 0, "{same:?}");
}
