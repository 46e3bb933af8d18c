//! Changes between frames: a renderer that has drawn before draws bit for bit the same as a new one, and uploads
//! only what changed.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{Attenuation, BakeMode, Light, LightKind, Material, Shading};
use lumbre_render::FrameReport;
use lumbre_scene::{
    Camera, FrameSettings, GlobalTransform, Hidden, MaterialTextures, Mesh, Projection, SceneSettings,
    Transform,
};
use lumbre_tests::panes::{image, sharp};

use crate::adapter::{Canvas, draw, linear};

const SIZE: u32 = 48;
/// Number of objects in the scene.
const OBJECTS: usize = 60;

// Sizes in bytes of the shaders' records for one of each (crates/lumbre_render/src/layout.rs asserts these sizes).
const OBJECT: u64 = 96;
const MATERIAL: u64 = 288;
const LIGHT: u64 = 96;
/// Per visible object: its index, and where its list of lights is.
const INSTANCE: u64 = 16;
/// Per light in a list.
const INDEX: u64 = 4;

struct Scene {
    world: World,
    objects: Vec<Entity>,
    lights: Vec<Entity>,
    canvas: Canvas,
}

/// A grid of balls and boxes under five lamps, drawn once.
fn scene() -> Scene {
    let mut world = World::new();
    let shapes = [Arc::new(shapes::uv_sphere(0.3, 12, 8)), Arc::new(shapes::cuboid(Vec3::splat(0.45), 1))];
    let mut objects = Vec::new();
    for number in 0..OBJECTS {
        let (x, y) = ((number % 10) as f64 * 0.6 - 2.7, (number / 10) as f64 * 0.6 - 1.5);
        let mut material = Material::matt(Vec3::new(0.1 + 0.015 * number as f32, 0.5, 0.3));
        material.front.specular = Vec3::splat(0.3);
        let object = (Mesh(Arc::clone(&shapes[number % 2])), material, Transform::from_xyz(x, y, 0.0));
        objects.push(world.spawn(object).id());
    }
    let lights = (0..5)
        .map(|number| {
            let place = Transform::from_xyz(f64::from(number) - 2.0, 1.5, 2.0);
            world.spawn((Light::point(Vec3::splat(1.0)), place)).id()
        })
        .collect();
    let eye = Transform::from_xyz(0.4, 0.3, 5.5).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Camera::default(), eye));
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
    let mut scene = Scene { world, objects, lights, canvas: Canvas::new(SIZE, SIZE) };
    let (_, report) = scene.canvas.draw(&mut scene.world, &linear());
    assert_eq!(report.statistics.objects, OBJECTS, "all are in view");
    let all = OBJECTS as u64 * (OBJECT + MATERIAL + INSTANCE) + 5 * (LIGHT + INDEX);
    assert_eq!(report.statistics.uploads.components(), all, "the first frame uploads everything once");
    scene
}

impl Scene {
    /// Draws with the old renderer and with a new one.
    fn redrawn(&mut self) -> (Vec<DVec3>, FrameReport) {
        let (kept, report) = self.canvas.draw(&mut self.world, &linear());
        let (fresh, _) = draw(&mut self.world, SIZE, SIZE, &linear());
        let differ = kept.iter().zip(&fresh).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{differ} pixels differ from a fresh renderer's");
        (kept, report)
    }

    /// Applies a change, checks that it is visible and that it uploads no more than `bytes`.
    fn change(&mut self, bytes: u64, change: impl FnOnce(&mut Self)) -> FrameReport {
        let (before, _) = self.canvas.draw(&mut self.world, &linear());
        change(self);
        let (after, report) = self.redrawn();
        assert!(before != after, "negative control: the change is seen");
        let uploaded = report.statistics.uploads.components();
        assert!(uploaded <= bytes, "{uploaded} bytes were uploaded, not {bytes}");
        // Every change is uploaded only once.
        let (_, report) = self.canvas.draw(&mut self.world, &linear());
        assert_eq!(report.statistics.uploads.components(), 0);
        report
    }
}

#[test]
fn a_frame_in_which_nothing_changed_uploads_nothing() {
    // This concerns components: the uniform of the frame (the camera, 144 bytes) is written every time and not
    // counted.
    let mut scene = scene();
    let (first, report) = scene.redrawn();
    assert_eq!(report.statistics.uploads.components(), 0);
    let (second, report) = scene.redrawn();
    assert_eq!(report.statistics.uploads.components(), 0);
    assert!(first == second);
}

#[test]
fn a_moved_object_uploads_its_transform() {
    let mut scene = scene();
    scene.change(OBJECT, |scene| {
        let moved = scene.objects[34];
        // In the plane of the grid, and so little that the order of the draws stays the same.
        scene.world.get_mut::<Transform>(moved).unwrap().translation.y += 0.02;
    });
    // Far to the front, which can also change the order of all draws.
    scene.change(OBJECT + OBJECTS as u64 * INSTANCE, |scene| {
        let moved = scene.objects[34];
        scene.world.get_mut::<Transform>(moved).unwrap().translation.z += 2.0;
    });
}

#[test]
fn a_turned_light_and_a_dimmed_one_upload_themselves() {
    let mut scene = scene();
    scene.change(LIGHT, |scene| {
        let light = scene.lights[2];
        scene.world.get_mut::<Transform>(light).unwrap().translation += DVec3::new(0.3, -0.2, 0.5);
    });
    scene.change(LIGHT, |scene| {
        let light = scene.lights[4];
        scene.world.get_mut::<Light>(light).unwrap().diffuse = Vec3::new(0.1, 0.2, 3.0);
    });
    // With the first light switched off, those after it move up and every list gets shorter by one.
    let rest = 4 * (LIGHT + INDEX) + OBJECTS as u64 * INSTANCE;
    scene.change(rest, |scene| {
        let light = scene.lights[0];
        scene.world.get_mut::<Light>(light).unwrap().enabled = false;
    });
    scene.change(rest + LIGHT, |scene| {
        let light = scene.lights[0];
        scene.world.get_mut::<Light>(light).unwrap().enabled = true;
    });
}

#[test]
fn a_changed_material_uploads_itself() {
    let mut scene = scene();
    scene.change(MATERIAL, |scene| {
        let object = scene.objects[12];
        scene.world.get_mut::<Material>(object).unwrap().front.diffuse = Vec3::new(0.9, 0.1, 0.0);
    });
    let texture = sharp(&image(2, &[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]]));
    let textures = MaterialTextures { base_color: Some(texture), ..MaterialTextures::default() };
    scene.change(MATERIAL, |scene| {
        let object = scene.objects[35];
        scene.world.entity_mut(object).insert(textures);
    });
    scene.change(MATERIAL, |scene| {
        let object = scene.objects[35];
        scene.world.entity_mut(object).remove::<MaterialTextures>();
    });
    // The technique only changes pipelines, no data.
    scene.change(0, |scene| {
        let object = scene.objects[34];
        scene.world.entity_mut(object).insert(Shading::Flat);
    });
}

#[test]
fn a_changed_mesh_shows() {
    let mut scene = scene();
    let taller = Arc::new(shapes::cuboid(Vec3::new(0.3, 0.9, 0.3), 2));
    scene.change(OBJECTS as u64 * INSTANCE, |scene| {
        let object = scene.objects[34];
        scene.world.entity_mut(object).insert(Mesh(taller));
    });
}

#[test]
fn despawned_hidden_and_spawned_objects() {
    let mut scene = scene();
    let instances = OBJECTS as u64 * INSTANCE;
    let report = scene.change(instances, |scene| {
        let object = scene.objects[34];
        scene.world.despawn(object);
    });
    assert_eq!(report.statistics.objects, OBJECTS - 1);
    scene.change(instances, |scene| {
        let object = scene.objects[25];
        scene.world.entity_mut(object).insert(Hidden);
    });
    // When it is shown again, it counts as a new object.
    scene.change(instances + OBJECT + MATERIAL, |scene| {
        let object = scene.objects[25];
        scene.world.entity_mut(object).remove::<Hidden>();
    });
    let report = scene.change(instances + OBJECT + MATERIAL, |scene| {
        let added = (
            Mesh(Arc::new(shapes::torus(0.3, 0.1, 16, 8))),
            Material::default(),
            Transform::from_xyz(0.0, 0.0, 1.0),
        );
        scene.world.spawn(added);
    });
    assert_eq!(report.statistics.objects, OBJECTS);
}

/// The renderer's data of lights follows every way in which a light can appear, disappear, or change.
#[test]
fn lights_that_come_and_go_and_change() {
    let mut scene = scene();
    let ranged = |range| Attenuation { range, ..Attenuation::INVERSE_SQUARE };
    type Step = fn(&mut World, Entity);
    let steps: [(&str, Step); 16] = [
        ("moved", |world, light| world.get_mut::<Transform>(light).unwrap().translation.x += 0.7),
        ("of another colour", |world, light| world.get_mut::<Light>(light).unwrap().diffuse = Vec3::X),
        ("off", |world, light| world.get_mut::<Light>(light).unwrap().enabled = false),
        ("on", |world, light| world.get_mut::<Light>(light).unwrap().enabled = true),
        ("baked", |world, light| world.get_mut::<Light>(light).unwrap().bake = BakeMode::Static),
        ("out of range", |world, light| world.get_mut::<Light>(light).unwrap().diffuse.y = f32::NAN),
        ("in range again", |world, light| world.get_mut::<Light>(light).unwrap().diffuse.y = 2.0),
        ("ambient", |world, light| world.get_mut::<Light>(light).unwrap().kind = LightKind::Ambient),
        ("of another kind", |world, light| {
            world.get_mut::<Light>(light).unwrap().kind = LightKind::Directional
        }),
        ("nowhere", |world, light| {
            world.entity_mut(light).remove::<(Transform, GlobalTransform)>();
        }),
        ("somewhere", |world, light| {
            world.entity_mut(light).insert(Transform::from_xyz(0.0, 1.0, 2.0));
        }),
        ("not finite", |world, light| world.get_mut::<Transform>(light).unwrap().translation.x = f64::NAN),
        ("finite", |world, light| world.get_mut::<Transform>(light).unwrap().translation.x = 0.5),
        ("no light", |world, light| {
            world.entity_mut(light).remove::<Light>();
        }),
        ("a light", |world, light| {
            world.entity_mut(light).insert(Light::point(Vec3::Z));
        }),
        ("gone, and another there", |world, light| {
            world.despawn(light);
            world.spawn((Light::point(Vec3::Y), Transform::from_xyz(0.0, 0.0, 2.0)));
        }),
    ];
    for (name, step) in steps {
        let light = scene.lights[2];
        step(&mut scene.world, light);
        let (kept, report) = scene.canvas.draw(&mut scene.world, &linear());
        let (fresh, of_fresh) = draw(&mut scene.world, SIZE, SIZE, &linear());
        assert!(kept == fresh, "{name}");
        assert_eq!(report.left_out, of_fresh.left_out, "{name}");
        let at_fault = ["out of range", "nowhere", "not finite"].contains(&name);
        assert_eq!(report.left_out.len(), usize::from(at_fault), "{name}");
    }
    // Settings affect lights that have not changed, and the three with a range are found by clusters.
    for light in [0, 1, 3] {
        scene.world.get_mut::<Light>(scene.lights[light]).unwrap().attenuation = ranged(4.0);
    }
    scene.world.get_mut::<Light>(scene.lights[0]).unwrap().shadow = true;
    for (light_threshold, shadows) in [(0.0, true), (0.2, true), (0.0, false), (0.0, true)] {
        let frame = FrameSettings { light_threshold, shadows, ..FrameSettings::default() };
        scene.world.resource_mut::<SceneSettings>().frame = frame;
        let (kept, _) = scene.canvas.draw(&mut scene.world, &linear());
        let (fresh, _) = draw(&mut scene.world, SIZE, SIZE, &linear());
        assert!(kept == fresh, "a threshold of {light_threshold}, with shadows: {shadows}");
    }
    // So far away that camera-relative space has its origin at the camera.
    let camera = scene.world.query_filtered::<Entity, With<Camera>>().single(&scene.world).unwrap();
    *scene.world.get_mut::<Transform>(camera).unwrap() =
        Transform::from_xyz(50.0, 40.0, 700.0).looking_at(DVec3::ZERO, DVec3::Y);
    scene.world.get_mut::<Camera>(camera).unwrap().projection =
        Projection::Perspective { vertical_fov: 0.007, aspect: None, near: 1.0, far: None };
    let (kept, _) = scene.canvas.draw(&mut scene.world, &linear());
    let (fresh, _) = draw(&mut scene.world, SIZE, SIZE, &linear());
    assert!(kept == fresh && kept.iter().any(|pixel| pixel.x > 0.2), "from far away");
}

#[test]
fn growing_beyond_every_buffer_keeps_what_was_there() {
    // There is room for 64 objects; another 200 make every buffer grow.
    let mut scene = scene();
    let mesh = scene.world.get::<Mesh>(scene.objects[0]).unwrap().clone();
    for number in 0..200 {
        let place =
            Transform::from_xyz(f64::from(number % 20) * 0.3 - 3.0, f64::from(number / 20) * 0.3 - 1.5, -1.0);
        scene.world.spawn((mesh.clone(), Material::matt(Vec3::new(0.2, 0.004 * number as f32, 0.9)), place));
    }
    for number in 0..40 {
        let place = Transform::from_xyz(f64::from(number) * 0.1 - 2.0, -1.0, 1.0);
        scene.world.spawn((Light::point(Vec3::new(0.1, 0.02, 0.05)), place));
    }
    let (_, report) = scene.redrawn();
    assert_eq!(report.statistics.lights, 45);
    let (_, report) = scene.redrawn();
    assert_eq!(report.statistics.uploads.components(), 0);
}

#[test]
fn one_renderer_serves_two_worlds_in_turn() {
    let (mut first, mut second) = (scene(), scene());
    let object = second.objects[34];
    second.world.get_mut::<Transform>(object).unwrap().translation.z += 1.0;
    for light in second.lights.drain(1..) {
        second.world.despawn(light);
    }
    for _ in 0..2 {
        for world in [&mut first.world, &mut second.world] {
            let (kept, _) = first.canvas.draw(world, &linear());
            let (fresh, _) = draw(world, SIZE, SIZE, &linear());
            assert!(kept == fresh);
        }
    }
}
