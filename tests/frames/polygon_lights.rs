//! Emissive polygons as lights: frames compared with the f64 twin and with thousands of point lights, and what
//! remains when they are switched off.

use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{Attenuation, Light, LightKind, Material, ReflectionModel, Shading, SpotCone, Surface};
use lumbre_render::{FrameOptions, explain};
use lumbre_scene::{
    Camera, ChildOf, EmissiveLight, Hidden, Lightmap, LightmapImage, Mesh, SceneSettings, StaticObject,
    Transform,
};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{Canvas, draw, linear};

const SIZE: usize = 144;

/// f32 compared with f64, for radiances up to about 2 here. The form factor is good to 2·10⁻⁶, see lumbre_optics.
/// Highlights add 16 powers with n = 40, each good to 40·4·2⁻²⁴ = 10⁻⁵ relative, of a sum near 0.3, at points whose
/// positions along the lamp are off by a few ulp. Measured: at most 9·10⁻⁶, where a lamp almost touches the floor.
const LARGEST: f64 = 2e-5;
/// The mean of the same errors, a tenth of the largest: measured at most 4·10⁻⁷ on llvmpipe, and 1.2·10⁻⁶ on an NVIDIA
/// H100, whose logarithms and exponentials use more of what WGSL allows.
const RELATIVE_L2: f64 = 2e-6;

fn glowing(radiance: Vec3) -> Material {
    Material {
        front: Surface { emission: radiance, diffuse: Vec3::ZERO, ..Surface::default() },
        ..Material::default()
    }
}

fn shiny(shininess: f32) -> Material {
    let front = Surface {
        diffuse: Vec3::new(0.7, 0.5, 0.4),
        specular: Vec3::splat(0.4),
        shininess,
        ..Surface::default()
    };
    Material { front, ..Material::default() }
}

/// A rectangle of 1.6 m by 0.8 m that faces down, to be placed by a transform.
fn panel() -> Mesh {
    let corner = |x: f32, z: f32| Vec3::new(0.8 * x, 0.0, 0.4 * z);
    Mesh(Arc::new(TriangleMesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![-Vec3::Y; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    }))
}

/// A floor and a ball under a tilted lamp that is visible too. The lamp is the last entity.
fn studio(shininess: f32) -> (World, Entity) {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(shapes::plane(6.0, 6.0, 12, 12))), shiny(shininess)));
    let ball = Mesh(Arc::new(shapes::uv_sphere(0.6, 24, 12)));
    world.spawn((ball, shiny(shininess), Transform::from_xyz(0.5, 0.6, 0.2)));
    let place = Transform::from_xyz(-0.6, 1.7, -0.9).with_rotation(DQuat::from_rotation_x(-0.5));
    let lamp = world.spawn((panel(), glowing(Vec3::new(4.0, 3.5, 3.0)), place, EmissiveLight)).id();
    let eye = Transform::from_xyz(0.3, 1.5, 3.6).looking_at(DVec3::new(0.0, 0.6, 0.0), DVec3::Y);
    world.spawn((Camera::default(), eye));
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.05), ..SceneSettings::default() });
    (world, lamp)
}

fn against_twin(world: &mut World, shading: Shading, model: ReflectionModel) -> Difference {
    let twin_options =
        TwinOptions { shading: Some(shading), reflection: Some(model), ..TwinOptions::default() };
    let expected = twin::draw(world, SIZE, SIZE, twin_options).inside_surfaces(shading == Shading::Flat);
    let options = FrameOptions { shading: Some(shading), reflection: Some(model), ..linear() };
    let (got, report) = draw(world, SIZE as u32, SIZE as u32, &options);
    assert_eq!(report.statistics.lights, 1, "two triangles are one polygon");
    let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
    let least = SIZE * SIZE / if shading == Shading::Flat { 12 } else { 3 };
    assert!(difference.pixels > least, "{} pixels are too few to compare", difference.pixels);
    difference
}

#[test]
fn a_panel_in_every_shading_and_reflection_model_agrees_with_the_twin() {
    for shading in Shading::ALL {
        for model in ReflectionModel::ALL {
            let (mut world, _) = studio(40.0);
            let difference = against_twin(&mut world, *shading, *model);
            println!("{:8} {:16} {difference:?}", shading.name(), model.name());
            let name = format!("{}, {}: {difference:?}", shading.name(), model.name());
            assert!(difference.largest < LARGEST, "{name}");
            assert!(difference.relative_l2 < RELATIVE_L2, "{name}");
        }
    }
}

#[test]
fn triangles_boxes_and_mirrored_lamps_agree_with_the_twin() {
    let mut triangle = (*panel().0).clone();
    triangle.indices.truncate(3);
    let lamps: [(&str, Arc<TriangleMesh>, DVec3, u32); 3] = [
        ("a triangle", Arc::new(triangle), DVec3::ONE, 1),
        ("a box", Arc::new(shapes::cuboid(Vec3::new(0.8, 0.3, 0.4), 1)), DVec3::ONE, 6),
        ("a mirrored panel", panel().0, DVec3::new(-1.0, 1.0, 1.3), 1),
    ];
    for (name, mesh, scale, polygons) in lamps {
        let (mut world, lamp) = studio(40.0);
        world.entity_mut(lamp).insert(Mesh(mesh));
        world.get_mut::<Transform>(lamp).unwrap().scale = scale;
        let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(true);
        let (got, report) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
        assert_eq!(report.statistics.lights, polygons, "{name}");
        let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
        println!("{name:18} {difference:?}");
        assert!(
            difference.largest < LARGEST && difference.relative_l2 < RELATIVE_L2,
            "{name}: {difference:?}"
        );
    }
}

/// Replaces the studio's lamp by a grid of point lights with a cosine distribution: I = L A cos θ' each, a
/// spotlight with exponent 1 and a cutoff of 90 degrees.
fn as_points(world: &mut World, lamp: Entity, columns: u32, rows: u32) {
    let place = world.get::<Transform>(lamp).unwrap().affine();
    let radiance = world.get::<Material>(lamp).unwrap().front.emission;
    let area = 1.6 * 0.8 / f64::from(columns * rows);
    // The factor on k_d is intensity/π.
    let color = radiance * (area / std::f64::consts::PI) as f32;
    let cone = SpotCone::Exponent { cutoff: std::f32::consts::FRAC_PI_2, exponent: 1.0 };
    let down = place.transform_vector3(-DVec3::Y);
    for column in 0..columns {
        for row in 0..rows {
            let at = |index: u32, count: u32| (f64::from(index) + 0.5) / f64::from(count) - 0.5;
            let point =
                place.transform_point3(DVec3::new(1.6 * at(column, columns), 0.0, 0.8 * at(row, rows)));
            let light = Light {
                kind: LightKind::Point,
                attenuation: Attenuation::INVERSE_SQUARE,
                ..Light::spot(color, cone)
            };
            let place = Transform { translation: point, ..Transform::default() };
            world.spawn((light, place.looking_at(point + down, DVec3::X)));
        }
    }
    world.entity_mut(lamp).remove::<EmissiveLight>();
}

#[test]
fn thousands_of_point_lights_come_to_the_same() {
    // Matt, so that the closed form is compared. The lamp is at least half a metre from the floor, and the points
    // are 2.5 cm apart: the midpoint rule is off by (2.5 cm/d)² times a few, 1e-4 at a metre.
    let matt = |world: &mut World| {
        let mut materials = world.query::<&mut Material>();
        materials.iter_mut(world).for_each(|mut material| material.front.specular = Vec3::ZERO);
    };
    let size = 96;
    let (mut world, lamp) = studio(40.0);
    matt(&mut world);
    let (closed, _) = draw(&mut world, size, size, &linear());
    let some = |pixels: &[DVec3]| pixels.iter().copied().map(Some).collect::<Vec<_>>();
    let mut apart = Vec::new();
    for (columns, rows) in [(16, 8), (32, 16), (64, 64)] {
        let (mut world, _) = studio(40.0);
        matt(&mut world);
        as_points(&mut world, lamp, columns, rows);
        let (points, _) = draw(&mut world, size, size, &linear());
        let difference = compare(&some(&closed), &some(&points));
        println!("{columns} x {rows}: {difference:?}");
        apart.push(difference.largest);
    }
    assert!(apart[2] < 5e-4, "{apart:?}");
    // Twice the points along each edge give a quarter of the error.
    assert!(apart[1] < 0.35 * apart[0], "{apart:?}");
}

#[test]
fn sixteen_points_make_the_highlight_of_thousands() {
    let size = 96;
    for shininess in [10.0, 80.0] {
        let (mut world, lamp) = studio(shininess);
        let (few, _) = draw(&mut world, size, size, &linear());
        as_points(&mut world, lamp, 64, 64);
        let (many, _) = draw(&mut world, size, size, &linear());
        let brightest = many.iter().map(|pixel| pixel.x).filter(|x| *x < 3.9).fold(0.0, f64::max);
        let some = |pixels: &[DVec3]| pixels.iter().copied().map(Some).collect::<Vec<_>>();
        let difference = compare(&some(&few), &some(&many));
        println!("n = {shininess}: {difference:?}, brightest {brightest}");
        // lumbre_optics states up to 8 % of the brightest highlight; with the diffuse part added here, 1 % was
        // measured.
        assert!(difference.largest < 0.02 * brightest, "{shininess}: {difference:?} of {brightest}");
    }
}

#[test]
fn a_carried_lamp_lights_where_it_goes_and_a_hidden_one_leaves_nothing_behind() {
    let (mut world, lamp) = studio(40.0);
    let cart = world.spawn(Transform::default()).id();
    world.entity_mut(lamp).insert(ChildOf(cart));
    let mut canvas = Canvas::new(SIZE as u32, SIZE as u32);
    let some = |pixels: Vec<DVec3>| pixels.into_iter().map(Some).collect::<Vec<_>>();
    for x in [0.0, 1.0, -0.7] {
        world.get_mut::<Transform>(cart).unwrap().translation.x = x;
        let (got, _) = canvas.draw(&mut world, &linear());
        let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
        let difference = compare(&some(got), &expected);
        assert!(difference.largest < LARGEST && difference.relative_l2 < RELATIVE_L2, "{x}: {difference:?}");
    }
    let knows_polygons = |world: &mut World| {
        let explained = explain(world, &linear(), 64, 64).unwrap();
        explained.variants.keys().any(|variant| variant.contains("POLYGON_LIGHTS"))
    };
    let lit = canvas.draw(&mut world, &linear()).1.statistics;
    assert!(knows_polygons(&mut world) && lit.lights == 1);
    assert!(explain(&mut world, &linear(), 64, 64).unwrap().to_text().contains("+ polygon lights: 1 mesh"));
    world.entity_mut(lamp).remove::<EmissiveLight>();
    let (dark, report) = canvas.draw(&mut world, &linear());
    assert!(!knows_polygons(&mut world) && report.statistics.lights == 0);
    // What remains is ambient light and the lamp's own glow, which is emission as in the documents.
    let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
    assert!(compare(&some(dark), &expected).largest < LARGEST);
    world.entity_mut(lamp).insert((EmissiveLight, Hidden));
    assert!(!knows_polygons(&mut world));
    assert_eq!(canvas.draw(&mut world, &linear()).1.statistics.lights, 0);
}

#[test]
fn a_lightmap_has_a_static_lamps_diffuse_light_and_the_frame_its_highlight() {
    let white = LightmapImage {
        name: "half".to_owned(),
        width: 1,
        height: 1,
        texels: vec![Vec3::splat(0.5)],
        encoding: lumbre_scene::LightmapEncoding::Rgb32Float,
    };
    for fixed in [true, false] {
        let (mut world, lamp) = studio(40.0);
        let mut meshes = world.query_filtered::<Entity, (With<Mesh>, Without<EmissiveLight>)>();
        let receivers: Vec<Entity> = meshes.iter(&world).collect();
        for entity in receivers {
            let mut mesh = (*world.get::<Mesh>(entity).unwrap().0).clone();
            mesh.uv1 = vec![glam::Vec2::splat(0.5); mesh.positions.len()];
            world
                .entity_mut(entity)
                .insert((Mesh(Arc::new(mesh)), Lightmap { image: Arc::new(white.clone()) }));
        }
        if fixed {
            world.entity_mut(lamp).insert(StaticObject);
        }
        let (got, report) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
        assert_eq!(report.statistics.static_lights, u32::from(fixed));
        let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
        let difference = compare(&got.into_iter().map(Some).collect::<Vec<_>>(), &expected);
        assert!(
            difference.largest < LARGEST && difference.relative_l2 < RELATIVE_L2,
            "{fixed}: {difference:?}"
        );
    }
}

#[test]
fn beside_other_lights_and_behind_the_lamp() {
    let (mut world, lamp) = studio(40.0);
    let place = Transform::from_xyz(2.0, 2.0, 2.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Light::point(Vec3::splat(2.0)), place));
    world.spawn((Light::directional(Vec3::splat(0.2)), place));
    let some = |pixels: Vec<DVec3>| pixels.into_iter().map(Some).collect::<Vec<_>>();
    for angle in [0.0, 0.9, 2.5] {
        world.get_mut::<Transform>(lamp).unwrap().rotation = DQuat::from_rotation_z(angle);
        // Low enough for the lamp's plane to cut the ball and the floor, and for their horizons to cut the lamp.
        world.get_mut::<Transform>(lamp).unwrap().translation = DVec3::new(-0.5, 0.9, 0.1);
        let (got, _) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
        let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default()).inside_surfaces(false);
        let difference = compare(&some(got), &expected);
        println!("{angle}: {difference:?}");
        assert!(
            difference.largest < LARGEST && difference.relative_l2 < RELATIVE_L2,
            "{angle}: {difference:?}"
        );
    }
}

#[test]
fn touching_lamps_far_lamps_and_slivers_stay_finite() {
    // The probe in `draw` looks for NaN and infinities; none of these may add light to the background either.
    for (height, scale) in
        [(0.0, 1.0), (1e-6, 1.0), (1e-3, 1.0), (0.6, 1e-6), (0.6, 1e4), (1e5, 1.0), (1.2, 0.0)]
    {
        let (mut world, lamp) = studio(1e5);
        let mut place = world.get_mut::<Transform>(lamp).unwrap();
        place.translation = DVec3::new(0.0, height, 0.0);
        place.rotation = DQuat::IDENTITY;
        place.scale = DVec3::new(1.0, 1.0, scale);
        let (pixels, _) = draw(&mut world, 64, 64, &linear());
        assert!(pixels.iter().all(|pixel| pixel.min_element() >= 0.0), "{height} {scale}");
    }
}

#[test]
fn what_a_polygon_costs_beside_a_point_light() {
    // Times are printed and not asserted, as other programs may be running.
    let seconds = |polygon: bool, specular: f32, count: u32| {
        let (mut world, lamp) = studio(40.0);
        let mut materials = world.query::<&mut Material>();
        materials
            .iter_mut(&mut world)
            .for_each(|mut material| material.front.specular = Vec3::splat(specular));
        let place = *world.get::<Transform>(lamp).unwrap();
        if !polygon {
            world.entity_mut(lamp).remove::<EmissiveLight>();
        }
        for index in 0..count {
            let translation = DVec3::new(0.01 * f64::from(index), 1.9, 0.0);
            let place = Transform { translation, ..place };
            match polygon {
                true => world.spawn((panel(), glowing(Vec3::ONE), place, EmissiveLight)),
                false => world.spawn((Light::point(Vec3::ONE), place)),
            };
        }
        let options = linear();
        let mut canvas = Canvas::new(256, 256);
        canvas.draw(&mut world, &options);
        let mut times: Vec<f64> = (0..5)
            .map(|_| {
                let start = Instant::now();
                canvas.draw(&mut world, &options);
                start.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        times[1]
    };
    for (name, specular) in [("matt", 0.0), ("shiny", 0.4)] {
        let of = |polygon| (seconds(polygon, specular, 33) - seconds(polygon, specular, 1)) / 32.0;
        let (polygon, point) = (of(true), of(false));
        println!(
            "{name}: a polygon {:.3} ms, a point light {:.3} ms, ratio {:.1}",
            1e3 * polygon,
            1e3 * point,
            polygon / point
        );
    }
}
