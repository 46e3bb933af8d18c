//! Baked scenes: the frame shows what the baker wrote and agrees with the twin, and the result looks like
//! radiosity.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_bake::{Bake, BakeOptions, Density, Quality};
use lumbre_optics::Material;
use lumbre_render::FrameOptions;
use lumbre_scene::{Lightmap, LightmapImage, PackedFormat, SaveOptions, default_camera, load, save_with};
use lumbre_tests::compare::compare;
use lumbre_tests::shared_files::shared_file;
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const SIZE: usize = 120;

/// f16 lightmaps are rounded to 2^-11 relative, and the texture unit's bilinear weights to 2^-8 of the step between
/// texels (Vulkan's minimum precision): with steps of at most a tenth of the radiance, which is near 1, that is
/// 5e-4 + 4e-4.
const LARGEST: f64 = 2e-3;
const RELATIVE_L2: f64 = 1e-3;

fn baked_cornell_box() -> Option<World> {
    let mut world = World::new();
    lumbre_scene::load(&mut world, &shared_file("models/cornell_box.glb")?).unwrap();
    let options = BakeOptions {
        density: Density::MapSize(64),
        quality: Quality::Draft,
        error: 0.05,
        ..BakeOptions::default()
    };
    Bake::new(&options).run(&mut world).unwrap();
    let camera = default_camera(&mut world, 1.0);
    world.spawn(camera);
    Some(world)
}

#[test]
fn the_baked_cornell_box_shows_its_lightmaps() {
    let Some(mut world) = baked_cornell_box() else { return };
    let (got, report) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
    assert!(report.plan.status("lightmap").unwrap().runs());
    let expected = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default());
    // The lamp's radiance of 100 would dominate the norm.
    let interior: Vec<_> =
        expected.interior(false).into_iter().map(|p| p.filter(|p| p.max_element() < 10.0)).collect();
    let some: Vec<_> = got.iter().copied().map(Some).collect();
    let difference = compare(&some, &interior);
    println!("{difference:?}");
    assert!(difference.pixels > SIZE * SIZE / 2);
    assert!(difference.largest < LARGEST, "{difference:?}");
    assert!(difference.relative_l2 < RELATIVE_L2, "{difference:?}");

    // Negative control: without its lightmaps the box is black except for the lamp.
    let (dark, report) =
        draw(&mut world, SIZE as u32, SIZE as u32, &FrameOptions { lightmaps: false, ..linear() });
    assert!(!report.plan.status("lightmap").unwrap().runs());
    let dark: Vec<_> = dark.into_iter().map(Some).collect();
    assert!(compare(&dark, &interior).relative_l2 > 0.9);
}

/// wgpu-core 30 once skipped binding a lightmap that the previous draw had also bound, if that draw had textures
/// and this one has none.
#[test]
fn a_lightmap_is_shared_by_what_has_textures_and_what_has_none() {
    let mut world = World::new();
    let lightmap = Arc::new(LightmapImage {
        name: "map".to_owned(),
        width: 2,
        height: 2,
        texels: vec![Vec3::new(0.5, 1.0, 0.25); 4],
        encoding: lumbre_scene::LightmapEncoding::default(),
    });
    let white = lumbre_tests::panes::sharp(&lumbre_tests::panes::image(1, &[[255; 4]]));
    for number in 0..6 {
        let mut ball = lumbre_mesh::shapes::uv_sphere(0.3, 24, 12);
        ball.uv1 = vec![glam::Vec2::splat(0.5); ball.positions.len()];
        // From the nearest to the farthest, in the order in which they are drawn.
        let place =
            lumbre_scene::Transform::from_xyz(0.7 * f64::from(number) - 1.75, 0.0, -0.1 * f64::from(number));
        let ball = (lumbre_scene::Mesh::from(ball), Material::matt(Vec3::splat(0.5)), place);
        let mut ball = world.spawn((ball, Lightmap { image: Arc::clone(&lightmap) }));
        if number % 2 == 0 {
            let base_color = Some(white.clone());
            ball.insert(lumbre_scene::MaterialTextures { base_color, ..Default::default() });
        }
        if number == 4 {
            ball.insert(lumbre_optics::Shading::Gouraud);
        }
    }
    world.spawn((lumbre_scene::Camera::default(), lumbre_scene::Transform::from_xyz(0.0, 0.0, 4.0)));
    // A light with a shadow, too faint to be visible; its bind group comes after the lightmap's.
    let faint = lumbre_optics::Light { shadow: true, ..lumbre_optics::Light::point(Vec3::splat(1e-12)) };
    for shadows in [false, true] {
        if shadows {
            world.spawn((faint.clone(), lumbre_scene::Transform::from_xyz(0.0, 3.0, 3.0)));
        }
        let (pixels, _) = draw(&mut world, 240, 60, &linear());
        let lit: Vec<_> = pixels.iter().filter(|pixel| **pixel != DVec3::ZERO).collect();
        assert!(lit.len() > 300, "{}", lit.len());
        let expected = DVec3::new(0.25, 0.5, 0.125);
        let worst = lit.iter().map(|pixel| (**pixel - expected).abs().max_element()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst} beside the lightmap's light");
    }
}

#[test]
fn colour_bleeds_and_nothing_inside_is_black() {
    let Some(mut world) = baked_cornell_box() else { return };
    let (pixels, _) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
    let frame = twin::draw(&mut world, SIZE, SIZE, TwinOptions::default());
    let mut found = world.query::<(&lumbre_scene::Mesh, &lumbre_scene::Primitive)>();
    let names: Vec<String> = found.iter(&world).map(|(_, primitive)| primitive.mesh.to_string()).collect();
    assert!(names.iter().any(|name| name == "large_box"), "{names:?}");
    // The side of the tall box that faces the red wall on the left is redder than it is green, and the floor is
    // greyish and lit.
    let of = |name: &str, left: bool| -> Vec<DVec3> {
        let of_object = |at: usize| frame.surface[at].is_some_and(|(object, _)| names[object] == name);
        let columns: Vec<usize> = (0..SIZE * SIZE).filter(|&at| of_object(at)).map(|at| at % SIZE).collect();
        let (low, high) = (columns.iter().min().unwrap_or(&0), columns.iter().max().unwrap_or(&0));
        let edge = if left { low + (high - low) / 12 } else { high - (high - low) / 12 };
        (0..SIZE * SIZE)
            .filter(|&at| of_object(at) && if left { at % SIZE <= edge } else { at % SIZE >= edge })
            .map(|at| pixels[at])
            .collect()
    };
    let mean = |values: Vec<DVec3>| values.iter().sum::<DVec3>() / values.len().max(1) as f64;
    let left = mean(of("large_box", true));
    assert!(left.x > 2.0 * left.y, "the side towards the red wall is {left}");
    let right = mean(of("small_box", false));
    assert!(right.y > 1.5 * right.x, "the side towards the green wall is {right}");
    let black =
        (0..SIZE * SIZE).filter(|&at| frame.surface[at].is_some() && pixels[at].max_element() < 1e-4).count();
    assert_eq!(black, 0, "{black} pixels of surfaces are black");
}

#[test]
fn static_lights_of_a_baked_level_are_not_counted_twice() {
    use lumbre_optics::{BakeMode, Light};
    use lumbre_scene::{Camera, Mesh, StaticObject, Transform};
    let mut world = World::new();
    let floor = std::sync::Arc::new(lumbre_mesh::shapes::cuboid(glam::Vec3::new(4.0, 0.2, 4.0), 1));
    world.spawn((Mesh(floor), Material::matt(glam::Vec3::splat(0.5)), StaticObject));
    let lamp = Light { bake: BakeMode::Static, ..Light::point(glam::Vec3::splat(4.0)) };
    world.spawn((lamp, Transform::from_xyz(0.0, 2.0, 0.0)));
    world.spawn((
        Camera::default(),
        Transform::from_xyz(0.0, 3.0, 0.01).looking_at(DVec3::ZERO, DVec3::NEG_Z),
    ));
    let center = |world: &mut World| draw(world, 33, 33, &linear()).0[16 * 33 + 16].x;
    let shaded = center(&mut world);
    let options =
        BakeOptions { density: Density::MapSize(64), quality: Quality::Draft, ..BakeOptions::default() };
    Bake::new(&options).run(&mut world).unwrap();
    assert_eq!(world.query::<&Lightmap>().iter(&world).count(), 1);
    let baked = center(&mut world);
    // There is one lamp over a convex floor, so there are no bounces. Baked and shaded light are then equal up to
    // the texels' width (1/8 m at 1.9 m under the lamp, over which the inverse square and the cosine change by less
    // than 1 %) and sampling.
    assert!((baked / shaded - 1.0).abs() < 0.02, "shaded {shaded}, baked {baked}");
}

/// Replaces every texel of every lightmap.
fn change_texels(world: &mut World, change: impl Fn(Vec3) -> Vec3) {
    let mut lightmaps = world.query::<&mut Lightmap>();
    for mut lightmap in lightmaps.iter_mut(world) {
        let texels = lightmap.image.texels.iter().map(|texel| change(*texel)).collect();
        lightmap.image = Arc::new(LightmapImage { texels, ..(*lightmap.image).clone() });
    }
}

#[test]
fn a_room_from_ktx2_differs_from_the_one_from_open_exr_by_the_encoding_and_no_more() {
    let Some(mut world) = baked_cornell_box() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.gltf");
    for format in PackedFormat::ALL {
        save_with(&mut world, &path, &SaveOptions { ktx2: Some(format), ..SaveOptions::default() }).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let packed = path.with_file_name("packed.gltf");
        std::fs::write(&packed, text.replace(".exr", ".ktx2")).unwrap();
        let frame = |path: &std::path::Path, change: &dyn Fn(&mut World)| {
            let mut world = World::new();
            load(&mut world, path).unwrap();
            change(&mut world);
            let (pixels, report) = draw(&mut world, SIZE as u32, SIZE as u32, &linear());
            assert!(report.plan.status("lightmap").unwrap().runs());
            pixels
        };
        let (exr, ktx2) = (frame(&path, &|_| ()), frame(&packed, &|_| ()));
        // A frame is linear in its lightmaps. A frame drawn with the texels' error bounds in place of their light
        // is therefore the bound of every pixel, filtered and reflected as the light is. To the format's bound is
        // added the half float of the other side, 2^-11 or 2^-25, and 1/1000 of both for the bound's own half
        // float.
        let bound = frame(&path, &|world| {
            let halves = |texel: Vec3| (texel / 2048.0).max(Vec3::splat(2f32.powi(-25)));
            change_texels(world, |texel| (format.largest_error(texel) + halves(texel)) * 1.001);
            let mut materials = world.query::<&mut Material>();
            materials.iter_mut(world).for_each(|mut material| material.front.emission = Vec3::ZERO);
        });
        let (mut largest, mut differ) = (0.0f64, 0);
        for ((exr, ktx2), bound) in exr.iter().zip(&ktx2).zip(&bound) {
            // In addition there is the frame's own f32: a few roundings of the pixel.
            let over = ((*exr - *ktx2).abs() / (*bound + exr.abs() * 1e-6 + 1e-12)).max_element();
            assert!(over <= 1.0, "{format:?}: {exr} and {ktx2}, bound {bound}");
            largest = largest.max(over);
            differ += usize::from(exr != ktx2);
        }
        println!("{format:?}: {differ} pixels differ, by {largest:.3} of the bound at most");
        // Negative control: the encoding differs, and the bound is not too wide.
        assert!(differ > SIZE * SIZE / 4 && largest > 0.1, "{format:?}: {differ}, {largest}");
        // An error of one more code of the mantissa would be detected.
        let scaled = frame(&packed, &|world| change_texels(world, |texel| texel * (1.0 + 3.0 / 64.0)));
        let seen = exr.iter().zip(&scaled).zip(&bound);
        assert!(
            seen.filter(|((a, b), bound)| (**a - **b).abs().cmpgt(**bound).any()).count() > SIZE * SIZE / 4
        );
    }
}
