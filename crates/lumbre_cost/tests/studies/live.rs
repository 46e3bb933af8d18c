//! Measurements of a view between the frames of a window, on scenes whose answers are known. They leave the
//! World unchanged.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_cost::{BesideReference, LightCost, LightCosts, SideView, ViewFront, ViewWalk};
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material, Shading};
use lumbre_render::{FrameOptions, Gpu};
use lumbre_scene::{
    ActiveCamera, Camera, EmissiveLight, Mesh, Name, SceneSettings, Transform, update_transforms,
};

const SIZE: (u32, u32) = (192, 120);

fn side() -> SideView {
    let gpu = Gpu::headless().expect("a Vulkan driver; the software one will do");
    SideView::new(&gpu, SIZE).expect("the size is small")
}

fn floor(pieces: u32) -> World {
    let mut world = World::new();
    let plane = Mesh(Arc::new(shapes::plane(24.0, 24.0, pieces, pieces)));
    world.spawn((Name::new("floor"), plane, Material::matt(Vec3::splat(0.6))));
    let eye = Transform::from_xyz(0.0, 6.0, 0.5).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("eye"), Camera::default(), eye, ActiveCamera));
    world
}

fn lamp(world: &mut World, name: &str, color: f32, (x, y, z): (f64, f64, f64)) {
    let light = Light { radius: 0.0, ..Light::point(Vec3::splat(color)) };
    world.spawn((Name::new(name.to_owned()), light, Transform::from_xyz(x, y, z)));
}

fn front(side: &mut SideView, world: &mut World, options: &FrameOptions) -> ViewFront {
    let mut walk = ViewWalk::begin(side, world, options).expect("a frame is drawn");
    let mut before = 0.0;
    loop {
        if let Some(front) = walk.step(side, world, options).expect("a frame is drawn") {
            return front;
        }
        let fraction = walk.fraction();
        assert!((before..=1.0).contains(&fraction), "{fraction} after {before}");
        before = fraction;
    }
}

fn costs(side: &mut SideView, world: &mut World) -> Vec<LightCost> {
    let options = FrameOptions::default();
    let mut costs = LightCosts::begin(side, world, &options).expect("a frame is drawn");
    loop {
        if let Some(found) = costs.step(side, world, &options).expect("a frame is drawn") {
            return found;
        }
    }
}

/// Light that is almost linear between vertices needs no more than Gouraud shading, while flat shading has
/// too large an error. The exact way is at the end of the front.
#[test]
fn a_views_front_leads_from_what_is_cheap_to_what_is_exact() {
    let mut world = floor(16);
    for number in 0..24 {
        let (x, z) = (f64::from(number % 6) - 2.5, f64::from(number / 6) - 1.5);
        lamp(&mut world, "lamp", 4.0, (3.0 * x, 5.0, 3.0 * z));
    }
    world.insert_resource(SceneSettings { shading: Shading::Flat, ..SceneSettings::default() });
    update_transforms(&mut world);
    let options = FrameOptions { multisample: Some(true), ..FrameOptions::default() };
    let found = front(&mut side(), &mut world, &options);
    // Times decide which of the ways is the cheapest; the errors do not depend on them.
    let cheap = &found.ways[found.within_error(0.01)];
    assert!(cheap.error <= 0.01 && cheap.settings.shading != Shading::Flat, "{found:?}");
    let best = found.ways.last().expect("there is a front");
    assert!(best.error < 1e-4, "{best:?}");
    for pair in found.ways.windows(2) {
        let dearer = pair[0].milliseconds.median <= pair[1].milliseconds.median;
        assert!(dearer && pair[0].error > pair[1].error, "{pair:?} are no front");
    }
    // As it was drawn: flat, with four samples.
    assert_eq!((found.now.settings.shading, found.now.settings.multisample), (Shading::Flat, true));
    assert!(found.now.error > 0.01, "{:?}", found.now);
    let better = found.next_better(&found.now).expect("something is better than flat");
    assert!(found.ways[better].error < found.now.error);
    let settings = world.resource::<SceneSettings>();
    let before = SceneSettings { shading: Shading::Flat, ..SceneSettings::default() };
    assert_eq!(*settings, before, "the World has its own settings again");
}

/// A lamp below the floor contributes nothing, and one of two equal lamps half of what both do. Of many
/// lamps those that give most are measured alone.
#[test]
fn what_lights_give_is_known() {
    let mut world = floor(1);
    lamp(&mut world, "left", 4.0, (-1e-3, 5.0, 0.0));
    lamp(&mut world, "right", 4.0, (1e-3, 5.0, 0.0));
    lamp(&mut world, "below", 4.0, (0.0, -5.0, 0.0));
    let glow = Material::matt(Vec3::ZERO);
    let panel = Mesh(Arc::new(shapes::plane(0.5, 0.5, 1, 1)));
    let panel = world.spawn((Name::new("dark panel"), panel, glow, EmissiveLight)).id();
    world.entity_mut(panel).insert(Transform::from_xyz(40.0, 1.0, 0.0));
    update_transforms(&mut world);
    let mut side = side();
    let found = costs(&mut side, &mut world);
    let of = |name: &str| found.iter().find(|cost| cost.name == name).expect("it is measured");
    assert_eq!(found.len(), 4, "{found:?}");
    for name in ["left", "right"] {
        assert!((of(name).difference - 0.5).abs() < 0.01, "{:?}", of(name));
    }
    assert_eq!((of("below").difference, of("glowing surfaces").difference), (0.0, 0.0));
    let mut lights = world.query::<&Light>();
    assert!(lights.iter(&world).all(|light| light.enabled), "they shine again");
    assert!(world.get::<EmissiveLight>(panel).is_some());
    // Of many lights those that contribute most are measured one by one, and the others together.
    for number in 0..20 {
        lamp(&mut world, &format!("faint {number}"), 0.01, (0.1 * f64::from(number), 3.0, 0.0));
    }
    for number in 0..10 {
        lamp(&mut world, &format!("bright {number}"), 1.0, (0.1 * f64::from(number), 3.0, 0.0));
    }
    update_transforms(&mut world);
    let found = costs(&mut side, &mut world);
    let of = |name: &str| found.iter().find(|cost| cost.name == name);
    // Twelve alone, the faint ones and the one below the floor together, and the panel.
    assert_eq!(found.len(), 14, "{found:?}");
    for name in (0..10).map(|number| format!("bright {number}")).chain(["left", "right"].map(str::to_owned)) {
        assert!(
            of(&name).is_some_and(|cost| cost.lights == 1 && cost.difference > 0.01),
            "{name}: {found:?}"
        );
    }
    let others = of("other point lights").expect("they are one group");
    assert_eq!(others.lights, 21, "{others:?}");
    assert!(others.difference > 0.0 && others.difference < 0.05, "{others:?}");
    assert_eq!(found.iter().map(|cost| cost.lights).sum::<usize>(), 34, "each light is in one of them");
    let mut lights = world.query::<&Light>();
    assert!(lights.iter(&world).all(|light| light.enabled), "they shine again");
}

/// The error of a frame of one quad under Gouraud shading, computed from two pictures; none where the frame
/// is drawn as the reference is.
#[test]
fn the_error_beside_the_reference_is_that_of_the_pictures() {
    let mut world = floor(1);
    lamp(&mut world, "lamp", 4.0, (0.0, 1.0, 0.0));
    update_transforms(&mut world);
    let mut side = side();
    let gouraud = FrameOptions { shading: Some(Shading::Gouraud), ..FrameOptions::default() };
    let best =
        FrameOptions { shading: Some(Shading::Phong), multisample: Some(true), ..FrameOptions::default() };
    let mut pictures = [&best, &gouraud].map(|options| side.radiance(&mut world, options).expect("drawn"));
    let (mut apart, mut whole) = (0.0, 0.0);
    let [reference, frame] = &mut pictures;
    for (a, b) in reference.iter().zip(frame) {
        apart += (a.truncate().as_dvec3() - b.truncate().as_dvec3()).length_squared();
        whole += a.truncate().as_dvec3().length_squared();
    }
    for (options, expected) in [(gouraud, (apart / whole).sqrt()), (best, 0.0)] {
        let mut beside = BesideReference::default();
        let begun = Instant::now();
        let found = loop {
            assert!(begun.elapsed() < Duration::from_secs(120), "the comparison ends");
            if let Some(found) = beside.update(&mut side, &mut world, &options).expect("drawn") {
                break found;
            }
        };
        let error = found.error.relative_rmse;
        assert!((error - expected).abs() < 1e-9, "{error} and {expected}");
        assert_eq!((found.size, found.rgba.len()), (SIZE, (4 * SIZE.0 * SIZE.1) as usize));
        assert_eq!(found.error.flip.is_some_and(|flip| flip > 0.0), expected > 0.0);
    }
}
