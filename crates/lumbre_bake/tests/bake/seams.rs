//! Seams: both sides of a smooth border between charts show the same light, while corners, walls and all other texels
//! remain unchanged.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use crate::common;
use crate::scene_parts::{grey, run};
use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DVec3, Vec2, Vec3};
use lumbre_bake::{BakeOptions, Density, Quality, TexelErrors};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{BakeMode, Light, Material};
use lumbre_scene::{Lightmap, Mesh, Name, StaticObject, Transform};

/// Adds a rectangle of the floor that looks up and covers a rectangle of the map.
fn add_quad(mesh: &mut TriangleMesh, x: [f32; 2], z: [f32; 2], u: [f32; 2], v: [f32; 2]) {
    let base = mesh.positions.len() as u32;
    for [i, k] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
        mesh.positions.push(Vec3::new(x[i], 0.0, z[k]));
        mesh.uv1.push(Vec2::new(u[i], v[k]));
    }
    mesh.indices.extend([0, 2, 1, 0, 3, 2].map(|index| base + index));
}

/// A floor of 4 by 2 m that is cut at x = 0: the left chart has 34 by 34 texels, the right one 10 by 10.
fn cut_floor() -> Mesh {
    let mut mesh = TriangleMesh::default();
    let texel = |from: f32, to: f32| [from / 48.0, to / 48.0];
    add_quad(&mut mesh, [-2.0, 0.0], [-1.0, 1.0], texel(0.5, 33.5), texel(0.5, 33.5));
    add_quad(&mut mesh, [0.0, 2.0], [-1.0, 1.0], texel(36.5, 45.5), texel(0.5, 9.5));
    Mesh(Arc::new(mesh))
}

fn draft_of_48_texels() -> BakeOptions {
    BakeOptions { density: Density::MapSize(48), quality: Quality::Draft, ..BakeOptions::default() }
}

/// The irradiance that a range of an entity's triangles shows at a point, by a look-up that is independent of the
/// baker.
fn read(world: &World, entity: Entity, triangles: Range<usize>, point: DVec3) -> Option<f64> {
    let mesh = &world.get::<Mesh>(entity)?.0;
    let map = &world.get::<Lightmap>(entity)?.image;
    let place = world.get::<lumbre_scene::GlobalTransform>(entity)?.0;
    for triangle in mesh.triangles().skip(triangles.start).take(triangles.len()) {
        let [a, b, c] = triangle.map(|v| place.transform_point3(mesh.positions[v as usize].as_dvec3()));
        let (normal, d) = ((b - a).cross(c - a), point - a);
        let (u, v) = (
            d.cross(c - a).dot(normal) / normal.length_squared(),
            (b - a).cross(d).dot(normal) / normal.length_squared(),
        );
        let distance = d.dot(normal.normalize()).abs();
        if u > -1e-6 && v > -1e-6 && u + v < 1.0 + 1e-6 && distance < 1e-5 {
            let [ta, tb, tc] = triangle.map(|v| mesh.uv1[v as usize].as_dvec2());
            return Some(common::bilinear(map, ta + (tb - ta) * u + (tc - ta) * v).x * PI);
        }
    }
    None
}

/// The RMS difference between the two sides of a border, relative to their mean.
fn jump(pairs: &[(f64, f64)]) -> f64 {
    let mean = pairs.iter().map(|(a, b)| 0.5 * (a + b)).sum::<f64>() / pairs.len() as f64;
    (pairs.iter().map(|(a, b)| (a - b).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt() / mean
}

/// Points of the border x = 0 of the floor.
fn border() -> impl Iterator<Item = DVec3> {
    (0..400).map(|i| DVec3::new(0.0, 0.0, (f64::from(i) + 0.5) / 200.0 - 1.0))
}

#[test]
fn charts_of_different_density_meet() {
    let baked = [false, true].map(|seams| {
        let mut world = World::new();
        let floor = world.spawn((cut_floor(), grey(0.0, 0.0), StaticObject)).id();
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        world.spawn((light, Transform::from_xyz(0.1, 0.35, 0.2)));
        let report = run(&mut world, &BakeOptions { seams, ..draft_of_48_texels() });
        let pairs: Vec<_> = border()
            .map(|p| (read(&world, floor, 0..2, p).unwrap(), read(&world, floor, 2..4, p).unwrap()))
            .collect();
        // E = π L_d cos θ / d².
        let light = DVec3::new(0.1, 0.35, 0.2);
        let exact = |p: DVec3| PI * light.y / (light - p).length().powi(3);
        let squares: f64 = border()
            .zip(&pairs)
            .map(|(p, (a, b))| (a - exact(p)).powi(2) + (b - exact(p)).powi(2))
            .sum::<f64>();
        (report, jump(&pairs), (squares / 800.0).sqrt())
    });
    let [(without, open, off_before), (with, closed, off_after)] = &baked;
    println!("jump {open:.4} -> {closed:.4}, off {off_before:.4} -> {off_after:.4}; {:?}", with.seams);
    assert!(
        without.seams.edges == 0 && without.skipped.iter().any(|line| line.contains("seams: switched off"))
    );
    assert_eq!(with.seams.edges, 1);
    assert!(*open > 0.05 && *closed < 0.2 * open, "{open} {closed}");
    // The coarse side adapts to the fine one, so that the two together are nearer to the truth.
    assert!(off_after < off_before, "{off_before} {off_after}");
    assert!(with.seams.jump_after < 0.2 * with.seams.jump_before, "{:?}", with.seams);
}

#[test]
fn the_seams_of_a_sphere_of_many_charts_are_closed() {
    let baked = [false, true].map(|seams| {
        let mut world = World::new();
        let ball = Mesh(Arc::new(shapes::tetrahedral_sphere(0.5, 4, false)));
        let ball = world.spawn((Name::new("ball"), ball, grey(0.6, 0.0), StaticObject)).id();
        let mut lamp = shapes::cuboid(Vec3::new(2.0, 0.1, 2.0), 1);
        lamp.uv1.clear();
        let above = Transform::from_xyz(0.3, 1.2, 0.1);
        world.spawn((Name::new("lamp"), Mesh(Arc::new(lamp)), grey(0.5, 3.0), StaticObject, above));
        let report = run(&mut world, &BakeOptions { seams, ..draft_of_48_texels() });
        let errors = world.get::<TexelErrors>(ball).unwrap().0.clone();
        (report, common::maps(&mut world), errors)
    });
    let [(_, before, stated_before), (report, after, stated_after)] = &baked;
    println!("{:?}", report.seams);
    assert!(report.seams.edges > 20, "{:?}", report.seams);
    assert!(report.seams.jump_after < 0.3 * report.seams.jump_before, "{:?}", report.seams);
    // The lamp's edges are real corners, so that none of its texels changes.
    let map = |maps: &[(String, Arc<lumbre_scene::LightmapImage>)], name: &str| {
        maps.iter().find(|(map_name, _)| map_name.starts_with(name)).expect("it was baked").1.texels.clone()
    };
    assert_eq!(map(before, "lamp"), map(after, "lamp"));
    // The stated error of a changed texel is the previous one and the change, added by their squares; that of all
    // others remains the same.
    let mut moved = 0;
    for ((before, after), (stated, now)) in
        map(before, "ball").iter().zip(map(after, "ball")).zip(stated_before.iter().zip(&**stated_after))
    {
        let squared = f64::from((after - *before).length_squared()) / 3.0;
        let expected = (f64::from(*stated).powi(2) + squared).sqrt();
        assert_eq!(stated.is_nan(), now.is_nan());
        // The change is the difference of two numbers that are rounded themselves.
        let rounding = f64::from(before.max_element().max(after.max_element())) * 0.5f64.powi(23);
        let within = 1e-6 * expected + 2.0 * rounding;
        assert!(stated.is_nan() || (f64::from(*now) - expected).abs() < within, "{now} {expected}");
        moved += usize::from(squared > 0.0 && !stated.is_nan());
    }
    assert!(moved > 100, "{moved}");
}

#[test]
fn seams_between_abutting_objects_are_closed() {
    // A long tile and two short ones along its side, which make T-junctions.
    let tile = |x: [f32; 2], z: [f32; 2]| {
        let mut mesh = TriangleMesh::default();
        add_quad(&mut mesh, x, z, [0.0, 1.0], [0.0, 1.0]);
        mesh.uv1.clear();
        Mesh(Arc::new(mesh))
    };
    let baked = [false, true].map(|seams| {
        let mut world = World::new();
        let long = world.spawn((tile([-2.0, 0.0], [-1.0, 1.0]), grey(0.5, 0.0), StaticObject)).id();
        let short = [[-1.0, 0.3], [0.3, 1.0]]
            .map(|z| world.spawn((tile([0.0, 0.7], z), grey(0.5, 0.0), StaticObject)).id());
        let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        world.spawn((light, Transform::from_xyz(-0.1, 0.2, 0.1)));
        let density = Density::TexelsPerMeter(9.0);
        let report = run(&mut world, &BakeOptions { seams, density, ..draft_of_48_texels() });
        let pairs: Vec<_> = border()
            .map(|p| {
                let other = short.iter().find_map(|&tile| read(&world, tile, 0..2, p));
                (read(&world, long, 0..2, p).unwrap(), other.unwrap())
            })
            .collect();
        (report, jump(&pairs))
    });
    println!("{} -> {}; {:?}", baked[0].1, baked[1].1, baked[1].0.seams);
    // The long tile has a seam with each short one, and these have one with each other.
    assert_eq!(baked[1].0.seams.edges, 3);
    assert!(baked[0].1 > 0.02 && baked[1].1 < 0.25 * baked[0].1, "{} {}", baked[0].1, baked[1].1);
}

#[test]
fn a_corner_is_not_a_seam() {
    let room = common::shapes::room(Vec3::splat(2.0));
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(room)), grey(0.5, 0.0), StaticObject));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((light, Transform::from_xyz(0.5, 0.5, 0.2)));
    let report = run(&mut world, &draft_of_48_texels());
    assert_eq!(report.seams, lumbre_bake::SeamReport::default());
    assert!(report.skipped.iter().any(|line| line.contains("seams: no two borders")), "{:?}", report.skipped);
}

/// A wall stands on the floor's cut, with a light on one side only.
#[test]
fn a_wall_on_the_seam_keeps_the_sides_apart() {
    let mut world = World::new();
    let floor = world.spawn((cut_floor(), grey(0.5, 0.0), StaticObject)).id();
    let wall = TriangleMesh {
        positions: [[0.0, -1.0], [0.0, 1.0], [4.0, 1.0], [4.0, -1.0]]
            .map(|[y, z]| Vec3::new(0.0, y, z))
            .to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    };
    let wall_material = Material { double_sided: true, ..grey(0.5, 0.0) };
    world.spawn((Mesh(Arc::new(wall)), wall_material, StaticObject));
    let light = Light { bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
    world.spawn((light, Transform::from_xyz(-0.5, 0.5, 0.1)));
    let report = run(&mut world, &draft_of_48_texels());
    assert_eq!(report.seams.edges, 0);
    for point in border() {
        assert!(read(&world, floor, 0..2, point).unwrap() > 0.1);
        assert_eq!(read(&world, floor, 2..4, point), Some(0.0));
    }
}

#[test]
fn a_sharp_shadow_across_the_seam_stays_sharp() {
    // A roof covers z < 0.05 under light from straight above: E = 1 beside it and 0 under it.
    let baked = [false, true].map(|seams| {
        let mut world = World::new();
        let floor = world.spawn((cut_floor(), grey(0.0, 0.0), StaticObject)).id();
        let mut roof = TriangleMesh::default();
        add_quad(&mut roof, [-3.0, 3.0], [-2.0, 0.05], [0.0, 1.0], [0.0, 1.0]);
        world.spawn((Mesh(Arc::new(roof)), grey(0.0, 0.0), StaticObject, Transform::from_xyz(0.0, 1.0, 0.0)));
        let sun = Light { bake: BakeMode::Static, ..Light::directional(Vec3::splat(1.0 / PI as f32)) };
        world.spawn((sun, Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::X)));
        let report = run(&mut world, &draft_of_48_texels());
        let report =
            if seams { report } else { run(&mut world, &BakeOptions { seams, ..draft_of_48_texels() }) };
        let image = world.get::<Lightmap>(floor).unwrap().image.clone();
        let errors = world.get::<TexelErrors>(floor).unwrap().0.clone();
        let exact = |p: DVec3| f64::from(u8::from(p.z > 0.05));
        let mean_error = border()
            .map(|p| {
                let sides = [0..2, 2..4].map(|t| (read(&world, floor, t, p).unwrap() - exact(p)).abs());
                sides[0] + sides[1]
            })
            .sum::<f64>()
            / 800.0;
        (report, image, errors, mean_error)
    });
    let [(_, before, errors, off_before), (report, after, _, off_after)] = &baked;
    println!("off {off_before:.4} -> {off_after:.4}; {:?}", report.seams);
    assert_eq!(report.seams.edges, 1);
    assert!(report.seams.jump_after <= report.seams.jump_before);
    // Closing the seam does not blur: the two sides are as near to the step as before.
    assert!(*off_after <= off_before * 1.05, "{off_before} {off_after}");
    for (index, (a, b)) in before.texels.iter().zip(&after.texels).enumerate() {
        let (x, y) = (index % 48, index / 48);
        // Only texels near the step at the border may change. In the left chart, columns 32 and 33 reach the border and
        // the step lies in row 17.8; in the right one, columns 36 and 37 and row 5.2. The border's column is half
        // outside of its chart and is extrapolated from up to two texels around.
        let near = ((32..35).contains(&x) && (15..=20).contains(&y))
            || ((36..38).contains(&x) && (3..=7).contains(&y));
        let moved = f64::from((*a - *b).abs().max_element()) * PI;
        // Texels in full light differ by the rounding of their sums and may change by as much.
        assert!(near || moved < 1e-5, "({x}, {y}) moved by {moved}, stated error {}", errors[index]);
    }
}

/// A lit floor of several objects and a ball.
fn scene(scale: f32) -> World {
    let mut world = World::new();
    let mut floor = cut_floor().0.as_ref().clone();
    floor.positions.iter_mut().for_each(|p| *p *= scale);
    world.spawn((Name::new("floor"), Mesh(Arc::new(floor)), grey(0.5, 0.0), StaticObject));
    let at = |x: f32, y: f32, z: f32| {
        Transform::from_xyz(f64::from(x * scale), f64::from(y * scale), f64::from(z * scale))
    };
    let ball = Mesh(Arc::new(shapes::tetrahedral_sphere(0.25 * scale, 3, false)));
    world.spawn((Name::new("ball"), ball, grey(0.5, 0.0), StaticObject, at(0.5, 0.5, 0.25)));
    let lamp = Mesh(Arc::new(shapes::cuboid(Vec3::new(0.5, 0.125, 0.5) * scale, 1)));
    world.spawn((Name::new("lamp"), lamp, grey(0.25, 5.0), StaticObject, at(-0.25, 1.0, 0.0)));
    world
}

#[test]
fn the_same_bits_on_any_threads_and_at_any_scale_of_two() {
    let options = draft_of_48_texels();
    let baked: Vec<_> = [(1.0, 1), (1.0, 2), (1.0, 8), (1.0 / 128.0, 2), (1024.0, 2)]
        .map(|(scale, threads)| {
            let mut world = scene(scale);
            let report = run(&mut world, &BakeOptions { threads: Some(threads), ..options });
            assert!(report.seams.edges > 5 && report.seams.mean_change > 0.0, "{:?}", report.seams);
            (common::bits(&mut world), report.seams)
        })
        .into();
    for other in &baked[1..] {
        assert_eq!(baked[0], *other);
    }
}
