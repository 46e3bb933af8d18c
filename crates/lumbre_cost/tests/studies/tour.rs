//! The study of a scene's cameras where the answer is known: the error of a planted fault of the frame, and
//! the effect that removes it.

use lumbre_cost::{CostOptions, Study};
use lumbre_optics::{Light, Material};
use lumbre_scene::{Camera, Mesh, Name, Transform};

use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::shapes;

use super::{measured, options, saved};

/// A floor with a ball above it and a wall, under a lamp that does not ask for a shadow, or with a mirror on
/// the wall and no visible shadow.
fn scene(mirror: bool) -> World {
    let mut world = World::new();
    let mut spawn = |name: &str, mesh, material: Material, place: Transform| {
        world.spawn((Name::new(name.to_owned()), Mesh(Arc::new(mesh)), material, place));
    };
    spawn("floor", shapes::plane(8.0, 8.0, 1, 1), Material::matt(Vec3::splat(0.6)), Transform::default());
    if mirror {
        let upright = Transform::from_xyz(0.0, 1.0, -2.0)
            .with_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
        let mirror = Material { mirror: Vec3::splat(0.9), ..Material::matt(Vec3::ZERO) };
        spawn("mirror", shapes::plane(4.0, 2.0, 1, 1), mirror, upright);
    } else {
        let above = Transform::from_xyz(0.0, 1.2, 0.0);
        spawn("ball", shapes::uv_sphere(0.6, 32, 16), Material::matt(Vec3::splat(0.4)), above);
    }
    world.spawn((Name::new("lamp"), Light::point(Vec3::splat(9.0)), Transform::from_xyz(0.0, 3.0, 0.2)));
    let eye = Transform::from_xyz(0.4, 1.6, 3.5).looking_at(DVec3::new(0.0, 0.6, 0.0), DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye));
    world
}

fn study_of(world: World) -> Study {
    let folder = tempfile::tempdir().unwrap();
    let path = saved(folder.path(), "scene.glb", world);
    let asked = CostOptions { size: (120, 80), ..options(&["tour"], vec![path]) };
    measured(&asked, &folder.path().join("report")).study("tour").unwrap().clone()
}

fn error_of(study: &Study, label: &str) -> f64 {
    let point = study.of_series("eye").find(|point| point.label == label).unwrap();
    point.error.unwrap().relative_rmse
}

#[test]
fn a_missing_shadow_is_what_a_frame_is_said_to_lack() {
    let study = study_of(scene(false));
    let [now, shadows, without] = ["as it is", "a shadow of every lamp", "without mirrors and glass"]
        .map(|label| error_of(&study, label));
    assert!(now > 0.1 && shadows < 0.5 * now && without == now, "{now} {shadows} {without}");
    let said = "the single change that reduces it most is \"a shadow of every lamp\"";
    assert!(study.findings.iter().any(|finding| finding.contains(said)), "{:?}", study.findings);
}

/// A reference of one ray per pixel would have the same jagged edges as a frame, and call smooth ones worse.
#[test]
fn smooth_edges_are_an_improvement() {
    let mut world = scene(false);
    let mut lights = world.query::<&mut Light>();
    lights.iter_mut(&mut world).for_each(|mut light| light.shadow = true);
    let study = study_of(world);
    let [now, smooth] = ["as it is", "four samples per pixel"].map(|label| error_of(&study, label));
    assert!(smooth < 0.8 * now, "{now} {smooth}");
    let said = "the single change that reduces it most is \"four samples per pixel\"";
    assert!(study.findings.iter().any(|finding| finding.contains(said)), "{:?}", study.findings);
}

#[test]
fn what_mirrors_show_is_said_where_nothing_is_lacking() {
    let study = study_of(scene(true));
    let [now, without] = ["as it is", "without mirrors and glass"].map(|label| error_of(&study, label));
    // The remaining error is that of the shadow behind the mirror.
    assert!(now < 0.05 && without > 0.2, "{now} {without}");
    let said = study.findings.iter().any(|finding| finding.contains("without mirrors and glass it would be"));
    assert!(said, "{:?}", study.findings);
}
