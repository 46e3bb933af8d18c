//! Compares shading by need with Phong shading: no pixel differs by more than the requested error, nor by more than
//! predicted, and objects are shaded less often where the error allows. On spheres of eight subdivision depths
//! under many kinds of lights and exponents, the scanned bunny, the teapot, and the level from all its cameras.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{
    Attenuation, ErrorBound, Light, Lobe, Material, ReflectionModel, Shading, SpotCone, Surface,
};
use lumbre_render::{FrameOptions, ShadingNeeds, explain};
use lumbre_scene::{Camera, Mesh, Name, SceneSettings, Transform, default_camera};
use lumbre_tests::shared_files::shared_file;

use crate::adapter::{Canvas, linear};

/// The requested errors, from clearly visible ones to less than an eight-bit code.
const BOUNDS: [f32; 4] = [0.1, 0.03, 0.01, 0.003];
/// Error of f32, for sums over lights whose brightest pixel has a radiance of some 5 (balls.rs: 1.4e-5 at a
/// radiance of 1).
const ROUNDING: f64 = 1e-4;

fn auto(max_error: f32) -> Shading {
    Shading::Auto { max_error: ErrorBound::new(max_error).unwrap() }
}

/// The result of one frame with shading by need.
#[derive(Clone, Copy, Debug)]
struct ByNeed {
    needs: ShadingNeeds,
    /// The largest difference of any pixel and channel from Phong shading.
    error: f64,
}

/// A scene from one camera: by need with each bound, and the errors of flat and Gouraud shading for all objects.
struct Compared {
    by_need: [ByNeed; BOUNDS.len()],
    without: [f64; 2],
}

/// Draws a scene with all bounds and one renderer, so that its kept predictions are tested too, and compares.
#[allow(clippy::print_stdout, reason = "what is predicted, beside what is so")]
fn compared(name: &str, world: &mut World, (width, height): (u32, u32), options: &FrameOptions) -> Compared {
    let mut canvas = Canvas::new(width, height);
    let mut shaded =
        |shading| canvas.draw(world, &FrameOptions { shading: Some(shading), ..options.clone() });
    let (phong, report) = shaded(Shading::Phong);
    assert_eq!(report.statistics.shading_by_need, ShadingNeeds::default(), "{name}: nothing asks for it");
    let error = |pixels: &[DVec3]| {
        let apart = pixels.iter().zip(&phong).map(|(a, b)| (*a - *b).abs().max_element());
        apart.fold(0.0, f64::max)
    };
    let by_need = BOUNDS.map(|bound| {
        let (pixels, report) = shaded(auto(bound));
        let needs = report.statistics.shading_by_need;
        let by_need = ByNeed { needs, error: error(&pixels) };
        let ShadingNeeds { flat, gouraud, phong, predicted_error } = needs;
        println!(
            "{name:34} {bound:5}: {flat:3} flat, {gouraud:3} Gouraud, {phong:3} Phong; {:.5} off, {predicted_error:.5} predicted",
            by_need.error
        );
        assert!(flat + gouraud + phong > 0, "{name}: something is in view");
        assert!(predicted_error <= f64::from(bound), "{name} {bound}: {needs:?}");
        assert!(by_need.error <= predicted_error + ROUNDING, "{name} {bound}: {by_need:?}");
        by_need
    });
    for pair in by_need.windows(2) {
        assert!(pair[0].needs.phong <= pair[1].needs.phong, "{name}: less error, and less Phong shading");
    }
    let without = [Shading::Flat, Shading::Gouraud].map(|shading| error(&shaded(shading).0));
    println!("{name:34} throughout: flat {:.5} off, Gouraud {:.5}", without[0], without[1]);
    Compared { by_need, without }
}

/// Adds lights of one kind over the spheres.
fn lights(kind: &str, world: &mut World) {
    let white = Vec3::splat(1.0);
    let toward = |from: [f64; 3]| Transform::from_translation(from.into()).looking_at(DVec3::ZERO, DVec3::Y);
    let mut sun = || {
        world.spawn((Light::directional(white), toward([3.0, 5.0, 8.0])));
    };
    match kind {
        "sun" => sun(),
        "dim sun" => {
            world.spawn((Light::directional(white * 0.3), toward([3.0, 5.0, 8.0])));
        }
        "points" => {
            for (x, range) in [(-4.0, f32::INFINITY), (0.0, 12.0), (4.0, 7.0)] {
                let attenuation = Attenuation { range, ..Attenuation::INVERSE_SQUARE };
                let light = Light { attenuation, ..Light::point(white * 8.0) };
                world.spawn((light, Transform::from_xyz(x, 2.5, 4.0)));
            }
        }
        "spots" => {
            for (x, cone) in [
                (-3.0, SpotCone::Smooth { inner: 0.2, outer: 0.7 }),
                (3.0, SpotCone::Exponent { cutoff: 0.6, exponent: 3.0 }),
            ] {
                let light = Light { spot: Some(cone), ..Light::point(white * 20.0) };
                world.spawn((light, toward([x, 1.0, 6.0])));
            }
        }
        "sun that casts shadows" => {
            world
                .spawn((Light { shadow: true, ..Light::directional(white * 0.8) }, toward([-4.0, 6.0, 6.0])));
        }
        _ => {
            sun();
            let clamped =
                Attenuation { clamp: true, constant: 0.3, linear: 0.2, ..Attenuation::INVERSE_SQUARE };
            let near = Light { attenuation: clamped, ..Light::point(white * 0.5) };
            world.spawn((near, Transform::from_xyz(1.0, 0.3, 1.6)));
        }
    }
}

const KINDS: [&str; 6] =
    ["sun", "dim sun", "points", "spots", "sun that casts shadows", "sun and a near lamp"];

/// Spheres of depths 0 to 7 in two rows, with a highlight of this exponent, or matt.
fn spheres(kind: &str, shininess: Option<f32>, lobe: Lobe, model: ReflectionModel) -> World {
    let mut world = World::new();
    for depth in 0..8 {
        let ball = shapes::tetrahedral_sphere(0.9, depth, false);
        let front = Surface {
            diffuse: Vec3::new(0.6, 0.5, 0.4),
            specular: Vec3::splat(if shininess.is_some() { 0.4 } else { 0.0 }),
            shininess: shininess.unwrap_or(1.0),
            ..Surface::default()
        };
        let place =
            Transform::from_xyz(2.0 * f64::from(depth % 4) - 3.0, 1.0 - 2.0 * f64::from(depth / 4), 0.0);
        world.spawn((Mesh(Arc::new(ball)), Material { front, lobe, ..Material::default() }, place));
    }
    lights(kind, &mut world);
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 5.0).looking_at(DVec3::ZERO, DVec3::Y)));
    world.insert_resource(SceneSettings { reflection: model, ..SceneSettings::default() });
    world
}

#[test]
fn spheres_of_eight_depths_are_no_farther_from_phong_than_is_asked() {
    let materials = [
        (None, Lobe::Bare, ReflectionModel::Phong),
        (Some(4.0), Lobe::Bare, ReflectionModel::Phong),
        (Some(40.0), Lobe::Bare, ReflectionModel::Blinn),
        (Some(10.0), Lobe::EnergyConserving, ReflectionModel::Blinn),
        (Some(300.0), Lobe::EnergyConserving, ReflectionModel::BlinnMatched),
    ];
    let mut all = Vec::new();
    for (kind_number, kind) in KINDS.into_iter().enumerate() {
        for (number, (shininess, lobe, model)) in materials.into_iter().enumerate() {
            // Half of the combinations, and all matt ones.
            if number > 0 && (kind_number + number) % 2 == 0 {
                continue;
            }
            let name = format!("{kind}, {} {}", model.name(), shininess.unwrap_or(0.0));
            let mut world = spheres(kind, shininess, lobe, model);
            // The finest sphere has 32,770 vertices, so shading it less often is only cheaper with many pixels.
            let size = if number < 2 { (1280, 640) } else { (640, 320) };
            all.push(compared(&name, &mut world, size, &linear()));
        }
    }
    let count = |bound: usize, of: fn(&ShadingNeeds) -> usize| -> usize {
        all.iter().map(|one| of(&one.by_need[bound].needs)).sum()
    };
    for (number, bound) in BOUNDS.into_iter().enumerate() {
        let (cheaper, phong) = (count(number, |it| it.flat + it.gouraud), count(number, |it| it.phong));
        println!("{bound}: {cheaper} of {} spheres are not shaded at every fragment", cheaper + phong);
        // If every prediction were 0, the error would be that of Gouraud shading, which is larger; if it were
        // infinite, all spheres would have Phong shading.
        assert!(
            all.iter().filter(|one| one.without[1] > f64::from(bound) + ROUNDING).count() > all.len() / 2
        );
        assert!(cheaper > 0 && phong > cheaper / 8, "{bound}: {cheaper} and {phong}");
        // Predictions far above all errors would be useless: some are within a factor of four.
        let near = all.iter().map(|one| one.by_need[number]).filter(|one| one.needs.predicted_error > 0.0);
        let near = near.filter(|one| one.error > 0.25 * one.needs.predicted_error).count();
        assert!(near > 0, "{bound}: no prediction is near");
    }
}

/// If every triangle has its own vertices, flat shading costs no more than Gouraud shading.
#[test]
fn facets_in_the_sun_are_shaded_flat() {
    let mut world = spheres("sun", None, Lobe::Bare, ReflectionModel::Phong);
    let mut meshes = world.query::<&mut Mesh>();
    for (depth, mut mesh) in meshes.iter_mut(&mut world).enumerate() {
        mesh.0 = Arc::new(shapes::tetrahedral_sphere(0.9, depth.min(4) as u32, true));
    }
    let compared = compared("facets", &mut world, (640, 320), &linear());
    for one in compared.by_need {
        assert_eq!((one.needs.flat, one.needs.gouraud, one.needs.phong), (8, 0, 0));
    }
}

fn model(name: &str, light: bool) -> Option<World> {
    let mut world = World::new();
    lumbre_scene::load(&mut world, &shared_file(name)?).unwrap();
    if world.query::<&Camera>().iter(&world).next().is_none() {
        let camera = default_camera(&mut world, 1.0);
        world.spawn(camera);
    }
    if light {
        world.spawn((
            Light::directional(Vec3::ONE),
            Transform::from_xyz(1.0, 2.0, 3.0).looking_at(DVec3::ZERO, DVec3::Y),
        ));
    }
    Some(world)
}

#[test]
fn models_are_no_farther_from_phong_than_is_asked() {
    for (name, light) in [
        ("models/stanford-bunny.glb", true),
        ("models/stanford-bunny.glb", false),
        ("models/teapot.glb", true),
        ("models/many_lights_64.glb", false),
    ] {
        let Some(mut world) = model(name, light) else { continue };
        compared(name, &mut world, (192, 144), &linear());
    }
}

#[test]
fn the_levels_tour_is_no_farther_from_phong_than_is_asked() {
    let mut world = World::new();
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/demo.glb"));
    lumbre_scene::load(&mut world, path).unwrap();
    let mut query = world.query_filtered::<(Entity, &Name), With<Camera>>();
    let mut cameras: Vec<(String, Entity)> =
        query.iter(&world).map(|(entity, name)| (name.to_string(), entity)).collect();
    cameras.sort();
    assert!(cameras.len() > 4);
    let (mut cheaper, mut beyond) = ([0; BOUNDS.len()], 0);
    for (name, camera) in cameras {
        let options = FrameOptions { camera: Some(camera), ..linear() };
        let compared = compared(&name, &mut world, (160, 90), &options);
        for (cheaper, one) in cheaper.iter_mut().zip(&compared.by_need) {
            *cheaper += one.needs.flat + one.needs.gouraud;
        }
        beyond += usize::from(compared.without[1] > f64::from(BOUNDS[0]) + ROUNDING);
    }
    println!("meshes in view of all cameras that are not shaded at every fragment: {cheaper:?}");
    assert!(cheaper[0] > 0 && beyond > 0, "{cheaper:?} {beyond}");
}

#[test]
fn what_explain_names_is_what_the_frame_takes() {
    let mut world = spheres("sun", Some(4.0), Lobe::Bare, ReflectionModel::Phong);
    // One sphere has its own shading.
    let first = world.query_filtered::<Entity, With<Mesh>>().iter(&world).next().unwrap();
    world.entity_mut(first).insert(Shading::Flat);
    world.resource_mut::<SceneSettings>().shading = auto(0.1);
    let (_, report) = Canvas::new(640, 320).draw(&mut world, &linear());
    let explained = explain(&mut world, &linear(), 640, 320).unwrap();
    println!("{}", explained.to_short_text());
    let count = |shading: &str| -> usize {
        let groups = explained.shading_by_need.iter().filter(|group| group.shading == shading);
        groups.map(|group| group.objects).sum()
    };
    let ShadingNeeds { flat, gouraud, phong, .. } = report.statistics.shading_by_need;
    assert_eq!((count("flat"), count("gouraud"), count("phong")), (flat, gouraud, phong));
    assert_eq!((flat + gouraud + phong, explained.census.shaded_by_need, explained.census.flat), (7, 7, 1));
    let named = |variant: &str| explained.variants.keys().any(|name| name.contains(variant));
    assert!(named("SHADING_GOURAUD") && named("SHADING_PHONG"), "{:?}", explained.variants);
}

/// Predictions are kept, and updated when their inputs change.
#[test]
fn what_moves_is_predicted_anew() {
    let mut world = spheres("points", Some(4.0), Lobe::Bare, ReflectionModel::Phong);
    world.resource_mut::<SceneSettings>().shading = auto(0.1);
    let mut kept = Canvas::new(640, 320);
    let mut lamp = world.query_filtered::<Entity, With<Light>>();
    let lamp = lamp.iter(&world).next().unwrap();
    let mut camera = world.query_filtered::<Entity, With<Camera>>();
    let camera = camera.iter(&world).next().unwrap();
    let mut balls = world.query_filtered::<Entity, With<Mesh>>();
    let ball = balls.iter(&world).nth(5).unwrap();
    let mut seen = Vec::new();
    for step in 0..10 {
        match step {
            1 => world.get_mut::<Transform>(lamp).unwrap().translation.z = 1.4,
            2 => world.get_mut::<Transform>(camera).unwrap().translation.z = 3.0,
            3 => world.get_mut::<Transform>(ball).unwrap().translation = DVec3::new(-4.0, 2.0, 3.0),
            4 => world.get_mut::<Material>(ball).unwrap().front.shininess = 2000.0,
            5 => world.get_mut::<Light>(lamp).unwrap().diffuse = Vec3::splat(90.0),
            6 => world.get_mut::<Camera>(camera).unwrap().exposure = 0.1,
            7 => {
                world.entity_mut(lamp).despawn();
            }
            8 => world.get_mut::<Transform>(camera).unwrap().translation.z = 30.0,
            9 => world.resource_mut::<SceneSettings>().reflection = ReflectionModel::TorranceSparrow,
            _ => {}
        }
        let (_, report) = kept.draw(&mut world, &linear());
        let (_, fresh) = Canvas::new(640, 320).draw(&mut world, &linear());
        let (needs, fresh) = (report.statistics.shading_by_need, fresh.statistics.shading_by_need);
        assert_eq!(
            (needs.flat, needs.gouraud, needs.phong),
            (fresh.flat, fresh.gouraud, fresh.phong),
            "{step}"
        );
        seen.push(needs);
    }
    seen.dedup();
    assert!(seen.len() > 5, "each step changes what is predicted: {seen:?}");
}
