//! The lights that a pass tests and those that contribute, as counted by its shaders, compared with the f64 twin of
//! the same scene: with every kind of light list, every kind of light, and every rate of shading.

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{AlphaMode, Attenuation, BakeMode, Light, Material, ReflectionModel, Shading, SpotCone};
use lumbre_render::{FrameOptions, LightCount, LightLists, Measure, RenderingPath};
use lumbre_scene::{
    Camera, EmissiveLight, Lightmap, LightmapEncoding, LightmapImage, Mesh, Projection, SceneSettings,
    Transform,
};
use lumbre_tests::device::same_by_another_pipeline;
use lumbre_tests::twin::{TwinOptions, reflected_by_corner, reflected_by_pixel};

use crate::adapter::{Canvas, linear};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const PIXELS: u64 = (WIDTH * HEIGHT) as u64;
/// Smallest radiance at exposure 1 that counts as a contribution.
const LEAST: f64 = 1.0 / 255.0;
/// How much f32 may be off where a light is compared with that, which is far more than the twins' bounds.
const ROUNDING: f64 = 1e-4;

/// A camera in front of a wall that fills its frame.
fn wall(material: Material) -> (World, Entity) {
    let mut world = World::new();
    let projection =
        Projection::Perspective { vertical_fov: 50.0_f64.to_radians(), aspect: None, near: 0.1, far: None };
    world.spawn((Camera { projection, exposure: 1.0 }, Transform::from_xyz(0.0, 0.0, 5.0)));
    let wall = pane(&mut world, 20.0, 0.0, material);
    world.insert_resource(SceneSettings { reflection: ReflectionModel::Blinn, ..SceneSettings::default() });
    (world, wall)
}

/// Adds an upright square that faces the camera.
fn pane(world: &mut World, side: f32, z: f64, material: Material) -> Entity {
    let upright = Transform::from_xyz(0.0, 0.0, z).looking_at(DVec3::new(0.0, -1.0, z), DVec3::Z);
    let mut mesh = shapes::plane(side, side, 1, 1);
    mesh.uv1.clone_from(&mesh.uv0);
    world.spawn((Mesh::from(mesh), material, upright)).id()
}

fn glossy() -> Material {
    let mut material = Material::matt(Vec3::splat(0.6));
    material.front.specular = Vec3::splat(0.3);
    material.front.shininess = 30.0;
    material
}

/// Adds lamps that each light a part of the wall, with every kind of cone, attenuation and colour, and a
/// directional one. Returns their number.
fn lamps(world: &mut World, range: f32) -> u64 {
    let ranged = Attenuation { range, ..Attenuation::INVERSE_SQUARE };
    let own = Attenuation { range, constant: 0.5, linear: 0.4, quadratic: 0.3, clamp: false };
    let smooth = SpotCone::Smooth { inner: 0.2, outer: 0.5 };
    let exponent = SpotCone::Exponent { cutoff: 0.6, exponent: 8.0 };
    let color = Vec3::new(0.05, 0.2, 0.1);
    let lights = [
        Light { attenuation: ranged, ..Light::point(color) },
        Light { attenuation: ranged, ..Light::spot(color * 3.0, smooth) },
        Light { attenuation: own, ..Light::point(color) },
        Light { attenuation: ranged, ..Light::spot(color * 3.0, exponent) },
        Light { attenuation: ranged, specular: Vec3::X, ..Light::point(color) },
        Light { ambient: Vec3::splat(0.004), attenuation: ranged, ..Light::point(color) },
        Light::directional(Vec3::splat(0.003)),
    ];
    for (number, light) in lights.iter().enumerate() {
        let (x, y) = (number as f64 * 0.8 - 2.4, (number % 3) as f64 - 1.0);
        let place = Transform::from_xyz(x, y, 1.2).looking_at(DVec3::new(x * 0.8, y, 0.0), DVec3::Y);
        world.spawn((light.clone(), place));
    }
    // Ambient lights and lights that are off are not tested.
    world.spawn((Light::ambient(Vec3::splat(0.2)), Transform::IDENTITY));
    world.spawn((Light { enabled: false, ..Light::point(Vec3::ONE) }, Transform::IDENTITY));
    lights.len() as u64
}

fn counting(lists: LightLists, shading: Shading) -> FrameOptions {
    FrameOptions { light_lists: lists, shading: Some(shading), measure: Measure::Lights, ..linear() }
}

/// Returns the counts of the passes of a frame: opaque surfaces with a lightmap, without one, and blended ones.
fn counted(world: &mut World, options: &FrameOptions) -> [LightCount; 3] {
    let mut canvas = Canvas::new(WIDTH, HEIGHT);
    let (picture, _) = canvas.draw(world, options);
    let accounting = canvas.accounting();
    assert_eq!(accounting.notes, Vec::<String>::new(), "the tests' device counts");
    let of = |name: &str| {
        let pass = accounting.passes.iter().find(|pass| pass.pass == name);
        pass.and_then(|pass| pass.lights).unwrap_or_default()
    };
    // What compute shaders count stands by their own pass.
    let [lightmap, mut forward, transparent, computed] =
        ["lightmap", "forward", "transparent", "deferred lighting"].map(of);
    let in_compute = options.rendering_path == RenderingPath::DeferredCompute;
    assert_eq!(computed == LightCount::default(), !in_compute);
    if in_compute {
        assert_eq!(forward, LightCount::default(), "no other pass counts");
        forward = computed;
    }
    let counts = [lightmap, forward, transparent];
    // The picture is that of a frame that does not count, and that frame contains no trace of counting.
    let plain = FrameOptions { measure: Measure::TimeAndInvocations, ..options.clone() };
    let uncounted = canvas.draw(world, &plain).0;
    assert!(same_by_another_pipeline(&uncounted, &picture), "counting changes the picture");
    assert!(
        canvas
            .accounting()
            .passes
            .iter()
            .all(|pass| pass.lights.unwrap_or_default() == LightCount::default())
    );
    counts
}

/// A wide wall that faces the viewer is drawn before what it hides, although its bounding sphere reaches farther back.
/// What stands beside the view is left out, although its bounding sphere reaches into it.
#[test]
fn what_a_wide_wall_hides_is_not_lit() {
    let (mut world, _) = wall(glossy());
    lamps(&mut world, 20.0);
    let options = FrameOptions {
        rendering_path: RenderingPath::Forward,
        ..counting(LightLists::Clusters, Shading::Phong)
    };
    let [_, alone, _] = counted(&mut world, &options);
    for x in -1..=1 {
        let place = Transform::from_xyz(f64::from(x), 0.2, -2.0);
        world.spawn((Mesh::from(shapes::uv_sphere(0.4, 16, 8)), glossy(), place));
    }
    let [_, with_balls, _] = counted(&mut world, &options);
    assert!(alone.tested > 0);
    assert_eq!((with_balls.tested, with_balls.contributing), (alone.tested, alone.contributing));

    // To the right of the view, along it.
    let beside = Transform::from_xyz(12.0, 0.0, 0.0).looking_at(DVec3::new(13.0, 0.0, 0.0), DVec3::Y);
    let beside = beside.with_rotation(beside.rotation * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
    world.spawn((Mesh::from(shapes::plane(20.0, 20.0, 1, 1)), glossy(), beside));
    let (_, report) = Canvas::new(WIDTH, HEIGHT).draw(&mut world, &linear());
    assert_eq!((report.statistics.objects, report.statistics.objects_outside), (4, 1));
}

/// Returns the smallest and largest number of contributions, given the rounding of f32.
fn contributing<'a>(reflected: impl IntoIterator<Item = &'a f64> + Clone) -> [u64; 2] {
    [1.0 + ROUNDING, 1.0 - ROUNDING]
        .map(|factor| reflected.clone().into_iter().filter(|light| **light > LEAST * factor).count() as u64)
}

/// Fails unless a count is that of the twin and the test is meaningful: many contribute and many do not, and
/// rounding leaves few undecided.
fn check(name: &str, count: LightCount, tested: u64, reflected: &[Vec<f64>]) {
    let [least, most] = contributing(reflected.iter().flatten());
    assert_eq!(count.tested, tested, "{name}");
    assert!(
        (least..=most).contains(&count.contributing),
        "{name}: {count:?} is not within {least} to {most}"
    );
    assert!(most - least <= tested / 200 && least > tested / 50 && most < tested - tested / 50, "{name}");
}

#[test]
fn every_light_of_brute_force_and_of_objects_lists() {
    for material in [glossy(), Material::matt(Vec3::splat(0.6))] {
        let (mut world, _) = wall(material);
        let lights = lamps(&mut world, 3.0);
        let reflected =
            reflected_by_pixel(&mut world, WIDTH as usize, HEIGHT as usize, TwinOptions::default());
        assert_eq!(
            reflected.iter().map(Vec::len).sum::<usize>() as u64,
            PIXELS * lights,
            "the wall fills the frame"
        );
        for lists in [LightLists::Everything, LightLists::Objects] {
            let [lightmapped, forward, blended] = counted(&mut world, &counting(lists, Shading::Phong));
            check(&format!("{lists:?}"), forward, PIXELS * lights, &reflected);
            assert_eq!([lightmapped, blended], [LightCount::default(); 2]);
        }
    }
}

#[test]
fn lists_of_objects_count_what_is_in_them() {
    let (mut world, _) = wall(glossy());
    let lights = lamps(&mut world, 3.0);
    // Too far away to reach the wall, and therefore not in its list.
    for x in [-9.0, 0.0, 9.0] {
        world.spawn((Light::point(Vec3::ONE).with_range(2.0), Transform::from_xyz(x, 0.0, 3.0)));
    }
    let options = |lists| counting(lists, Shading::Phong);
    let tested = |counts: [LightCount; 3]| counts[1].tested;
    assert_eq!(tested(counted(&mut world, &options(LightLists::Objects))), PIXELS * lights);
    assert_eq!(tested(counted(&mut world, &options(LightLists::Everything))), PIXELS * (lights + 3));
}

/// The pixels of the G-buffer count the same in fragments and in compute shaders.
#[test]
fn compute_shaders_count_what_fragments_count() {
    for lists in [LightLists::Clusters, LightLists::Objects] {
        let (mut world, wall) = wall(glossy());
        lamps(&mut world, 2.0);
        let by = |rendering_path| FrameOptions { rendering_path, ..counting(lists, Shading::Phong) };
        let [_, fragments, _] = counted(&mut world, &by(RenderingPath::Deferred));
        assert!(fragments.tested > PIXELS && fragments.contributing > PIXELS / 20, "{fragments:?}");
        let [_, computed, _] = counted(&mut world, &by(RenderingPath::DeferredCompute));
        assert_eq!(computed.tested, fragments.tested, "{lists:?}");
        let apart = computed.contributing.abs_diff(fragments.contributing);
        assert!(apart <= fragments.contributing / 1000, "{lists:?}: {computed:?}, {fragments:?}");
        world.despawn(wall);
    }
}

#[test]
fn clusters_count_the_entries_of_their_lists() {
    // With ranges that reach all of the wall, each list has every light, and an odd number of inverse-square
    // lights.
    for range in [60.0, 1.4] {
        let (mut world, _) = wall(glossy());
        let lights = lamps(&mut world, range);
        world.spawn((Light::point(Vec3::splat(0.1)).with_range(range), Transform::from_xyz(0.3, 0.0, 1.0)));
        let lights = lights + 1;
        let reflected =
            reflected_by_pixel(&mut world, WIDTH as usize, HEIGHT as usize, TwinOptions::default());
        let [_, forward, _] = counted(&mut world, &counting(LightLists::Clusters, Shading::Phong));
        if range > 10.0 {
            check("clusters that have all", forward, PIXELS * lights, &reflected);
        } else {
            // Every contributing light has to be in a list; lights in no list are not tested.
            let [least, most] = contributing(reflected.iter().flatten());
            println!(
                "short ranges: {forward:?}, the twin has {least} to {most} of at most {}",
                PIXELS * lights
            );
            assert!((least..=most).contains(&forward.contributing));
            assert!(forward.tested >= least && forward.tested < PIXELS * lights, "{forward:?}");
        }
    }
    // Empty lists: what the loops read there is not one of their lights.
    let (mut world, _) = wall(glossy());
    for x in 0..4 {
        let behind = Transform::from_xyz(f64::from(x), 0.0, 9.0);
        world.spawn((Light::point(Vec3::ONE).with_range(1.0), behind));
        let cone = SpotCone::Exponent { cutoff: 0.6, exponent: 8.0 };
        world.spawn((Light::spot(Vec3::ONE, cone).with_range(1.0), behind));
    }
    let counts = counted(&mut world, &counting(LightLists::Clusters, Shading::Phong));
    assert_eq!(counts, [LightCount::default(); 3]);
}

#[test]
fn vertices_count_for_flat_and_gouraud_shading() {
    // No two triangles share a vertex, so each corner is evaluated once.
    let sphere = shapes::uv_sphere(1.5, 24, 12);
    let corners: Vec<usize> = sphere.indices.iter().map(|index| *index as usize).collect();
    let soup = TriangleMesh {
        positions: corners.iter().map(|corner| sphere.positions[*corner]).collect(),
        normals: corners.iter().map(|corner| sphere.normals[*corner]).collect(),
        indices: (0..corners.len() as u32).collect(),
        ..TriangleMesh::default()
    };
    for shading in [Shading::Flat, Shading::Gouraud] {
        let (mut world, wall) = wall(glossy());
        let lights = lamps(&mut world, 9.0);
        world.despawn(wall);
        world.spawn((Mesh::from(soup.clone()), glossy(), Transform::IDENTITY));
        let options = TwinOptions { shading: Some(shading), ..TwinOptions::default() };
        let reflected = reflected_by_corner(&mut world, options);
        assert_eq!(reflected.len(), corners.len());
        let [_, forward, _] = counted(&mut world, &counting(LightLists::Auto, shading));
        check(shading.name(), forward, corners.len() as u64 * lights, &reflected);
    }
}

#[test]
fn what_is_hidden_when_it_is_drawn_is_not_tested_and_passes_are_told_apart() {
    let (mut world, wall) = wall(glossy());
    let lights = lamps(&mut world, 30.0);
    let options = counting(LightLists::Everything, Shading::Phong);
    // A pane that covers the whole wall and is drawn before it.
    let front = pane(&mut world, 20.0, 1.0, glossy());
    assert_eq!(counted(&mut world, &options)[1].tested, PIXELS * lights);
    // When it is blended, both are visible.
    let glass = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..glossy() };
    world.entity_mut(front).insert(glass);
    let [_, forward, blended] = counted(&mut world, &options);
    assert_eq!([forward.tested, blended.tested], [PIXELS * lights; 2]);
    // With a lightmap the wall is in a separate pass.
    let image = LightmapImage {
        name: "map".to_owned(),
        width: 2,
        height: 2,
        texels: vec![Vec3::splat(0.5); 4],
        encoding: LightmapEncoding::default(),
    };
    world.entity_mut(wall).insert(Lightmap { image: image.into() });
    let [lightmapped, forward, blended] = counted(&mut world, &options);
    assert_eq!([lightmapped.tested, forward.tested, blended.tested], [PIXELS * lights, 0, PIXELS * lights]);
}

#[test]
fn of_baked_lights_the_highlight_contributes() {
    for lists in [LightLists::Objects, LightLists::Clusters] {
        let (mut world, wall) = wall(glossy());
        let image = LightmapImage {
            name: "map".to_owned(),
            width: 2,
            height: 2,
            texels: vec![Vec3::ZERO; 4],
            encoding: LightmapEncoding::default(),
        };
        world.entity_mut(wall).insert(Lightmap { image: image.into() });
        lamps(&mut world, 60.0);
        let mut lights = world.query::<&mut Light>();
        lights.iter_mut(&mut world).for_each(|mut light| light.bake = BakeMode::Static);
        let reflected =
            reflected_by_pixel(&mut world, WIDTH as usize, HEIGHT as usize, TwinOptions::default());
        let [lightmapped, ..] = counted(&mut world, &counting(lists, Shading::Phong));
        check(&format!("baked, {lists:?}"), lightmapped, PIXELS * 7, &reflected);
        // If they were not baked, more would contribute.
        lights.iter_mut(&mut world).for_each(|mut light| light.bake = BakeMode::Dynamic);
        let [dynamic, ..] = counted(&mut world, &counting(lists, Shading::Phong));
        assert!(dynamic.contributing > lightmapped.contributing + PIXELS / 10, "{dynamic:?}");
    }
}

#[test]
fn polygon_lights_are_one_light_each() {
    let (mut world, _) = wall(glossy());
    let lamp = Transform::from_xyz(0.0, 2.6, 1.0).looking_at(DVec3::new(0.0, 2.6, 0.0), DVec3::NEG_Y);
    let panel = Mesh::from(shapes::plane(0.6, 0.6, 1, 1));
    world.spawn((panel, Material::emissive(Vec3::splat(0.4)), EmissiveLight, lamp));
    let reflected = reflected_by_pixel(&mut world, WIDTH as usize, HEIGHT as usize, TwinOptions::default());
    let [_, forward, _] = counted(&mut world, &counting(LightLists::Objects, Shading::Phong));
    // The lamp itself may be visible, and is not lit by its own light.
    let seen = reflected.iter().map(Vec::len).sum::<usize>() as u64;
    check("polygon", forward, seen, &reflected);
}

#[test]
fn light_in_shadow_is_tested_and_does_not_contribute() {
    let (mut world, _) = wall(Material::matt(Vec3::splat(0.6)));
    let lamp = Light { shadow: true, ..Light::directional(Vec3::splat(0.5)) };
    let lamp = world.spawn((lamp, Transform::from_xyz(0.0, 0.0, 9.0))).id();
    let options = counting(LightLists::Auto, Shading::Phong);
    let lit = counted(&mut world, &options)[1];
    assert_eq!(lit, LightCount { tested: PIXELS, contributing: PIXELS });
    // A pane behind the camera that covers the whole wall.
    let screen = pane(&mut world, 30.0, 7.0, Material::matt(Vec3::ONE));
    let dark = counted(&mut world, &options)[1];
    assert_eq!(dark, LightCount { tested: PIXELS, contributing: 0 });
    world.despawn(screen);
    // The same for a light that is only just too weak; the wall reflects .6 of it.
    for (strength, contributing) in [(1.001, PIXELS), (0.999, 0)] {
        let color = Vec3::splat((LEAST / 0.6 * strength) as f32);
        world.entity_mut(lamp).insert(Light { shadow: false, ..Light::directional(color) });
        assert_eq!(counted(&mut world, &options)[1], LightCount { tested: PIXELS, contributing });
        // The exposure matters too.
        let twice = FrameOptions { exposure: Some(2.0), ..options.clone() };
        assert_eq!(counted(&mut world, &twice)[1].contributing, PIXELS);
    }
}
