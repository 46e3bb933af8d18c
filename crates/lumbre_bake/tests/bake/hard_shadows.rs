//! Shadows of lights without size against closed forms. The mean over a floor's map must be the flux that reaches the
//! floor past the occluders. Texels that a shadow's edge crosses are partly lit, and the mean is as exact as these
//! parts.

use std::f64::consts::FRAC_1_PI;
use std::sync::Arc;

use crate::scene_parts::black_sheet;
use bevy_ecs::entity::Entity;
use bevy_ecs::world::World;
use glam::{DVec3, Vec2, Vec3};
use lumbre_bake::{Bake, BakeOptions, Density};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light};
use lumbre_scene::{Lightmap, Mesh, StaticObject, Transform};

/// A horizontal square that looks up and fills its lightmap completely.
fn square(half: f32, at: Vec3) -> Mesh {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    Mesh(Arc::new(TriangleMesh {
        positions: corners.map(|[x, z]| at + Vec3::new(x, 0.0, z) * half).to_vec(),
        uv1: corners.map(|[x, z]| Vec2::new(x, z) * 0.5 + 0.5).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    }))
}

/// A floor of two by two metres about the origin.
fn floor(world: &mut World) -> Entity {
    world.spawn((square(1.0, Vec3::ZERO), black_sheet(), StaticObject)).id()
}

/// Bakes with 32 by 32 texels and returns the floor's mean irradiance, W/m².
fn mean(world: &mut World, floor: Entity) -> f64 {
    mean_of(world, floor, 32)
}

/// Bakes with `side` by `side` texels and returns the floor's mean irradiance, W/m².
fn mean_of(world: &mut World, floor: Entity, side: u32) -> f64 {
    let options = BakeOptions { density: Density::MapSize(side), ..BakeOptions::default() };
    Bake::new(&options).run(world).expect("the scene bakes");
    let map = &world.get::<Lightmap>(floor).expect("it was baked").image;
    let texels = map.texels.iter().map(|texel| f64::from(texel.y));
    texels.sum::<f64>() / (f64::from(map.width) * f64::from(map.height)) / FRAC_1_PI
}

/// A point light of 1 W/sr, or a directional light that gives 1 W/m² to a surface perpendicular to it.
fn unit(light: fn(Vec3) -> Light) -> Light {
    Light { bake: BakeMode::Static, ..light(Vec3::splat(FRAC_1_PI as f32)) }
}

/// The solid angle of a rectangle with sides x and z from a point at `height` above one of its corners.
fn of_corner(x: f64, z: f64, height: f64) -> f64 {
    (x * z / (height * (x * x + z * z + height * height).sqrt())).atan()
}

/// The solid angle of a square with half side `half` about (x, z) from a point at `height` above the origin.
fn solid_angle(half: f64, [x, z]: [f64; 2], height: f64) -> f64 {
    let [x0, x1, z0, z1] = [x - half, x + half, z - half, z + half];
    let corner = |x, z| of_corner(x, z, height);
    corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0)
}

#[test]
fn the_flux_of_a_point_light_is_its_unoccluded_solid_angle() {
    for height in [1.0, 1.5] {
        let mut world = World::new();
        let floor = floor(&mut world);
        world.spawn((unit(Light::point), Transform::from_xyz(0.0, height, 0.0)));
        let open = mean(&mut world, floor);
        // The floor's area is 4 m². Each texel of 1/16 m is evaluated at four points, with an error of second order:
        // (1/16)²/24 of the curvature of E, which is -6 E at most and has either sign.
        let whole = solid_angle(1.0, [0.0; 2], height) / 4.0;
        assert!((open / whole - 1.0).abs() < 2e-4, "{height}: {open} {whole}");
        let plates = [[0.21, -0.13], [-0.34, 0.3], [-0.05, 0.42]];
        let mut hidden = 0.0;
        for [x, z] in plates {
            world.spawn((square(0.11, Vec3::new(x as f32, 0.4, z as f32)), black_sheet(), StaticObject));
            hidden += solid_angle(0.11, [x, z], height - 0.4) / 4.0;
        }
        let found = mean(&mut world, floor);
        println!("{height}: {open:.6} of {whole:.6}; {found:.6} of {:.6}", whole - hidden);
        assert!((open - found - hidden).abs() < 2e-4 * whole, "{height}: {} {hidden}", open - found);
    }
}

#[test]
fn the_flux_of_a_light_far_closer_than_the_size_of_a_texel_is_exact() {
    // Half of the light of such a lamp falls on a few texels of 6 cm.
    for height in [0.3, 0.1, 0.03, 0.01, 0.002, 1e-4] {
        for at in [[0.013, -0.021], [0.0, 0.0], [0.03, 0.031], [-0.4, 0.5]] {
            let mut world = World::new();
            let floor = floor(&mut world);
            world.spawn((unit(Light::point), Transform::from_xyz(at[0], height, at[1])));
            let found = mean(&mut world, floor);
            let expected = solid_angle(1.0, at.map(|x| -x), height) / 4.0;
            println!("{height} m over {at:?}: {:+.4} %", 100.0 * (found / expected - 1.0));
            // From a distance of 4 texels on, texels are evaluated at points instead of by their solid angle, which
            // leaves this error.
            assert!((found / expected - 1.0).abs() < 3e-4, "{height} m over {at:?}: {found} {expected}");
        }
    }
}

#[test]
fn shadows_of_a_directional_light_have_the_area_of_the_occluders() {
    let mut world = World::new();
    let floor = floor(&mut world);
    let sun = Transform::from_xyz(0.4, 1.0, 0.3).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((unit(Light::directional), sun));
    let cosine = DVec3::new(0.4, 1.0, 0.3).normalize().y;
    let open = mean(&mut world, floor);
    assert!((open / cosine - 1.0).abs() < 1e-6, "{open} {cosine}");
    // The shadows of horizontal plates on a horizontal floor are as large as the plates.
    let halves = [0.2f32, 0.07, 0.13];
    for (half, [x, z]) in halves.into_iter().zip([[0.21, -0.13], [-0.34, 0.3], [-0.05, 0.62]]) {
        world.spawn((square(half, Vec3::new(x, 0.37, z)), black_sheet(), StaticObject));
    }
    let hidden: f64 = halves.iter().map(|half| f64::from(half * half)).sum();
    let found = mean(&mut world, floor);
    println!("{found:.7} of {:.7}", cosine * (1.0 - hidden));
    assert!((found / (cosine * (1.0 - hidden)) - 1.0).abs() < 2e-4, "{found}");
}

#[test]
fn few_plates_are_clipped_exactly_and_many_are_left_to_rays() {
    let mut world = World::new();
    let floor = floor(&mut world);
    world.spawn((unit(Light::point), Transform::from_xyz(0.0, 1.2, 0.0)));
    let mut expected = solid_angle(1.0, [0.0; 2], 1.2) / 4.0;
    // The shadows of the 24 by 24 plates (1152 triangles) are twice as large as the plates; they do not overlap and lie
    // on the floor.
    for place in 0..24 * 24 {
        let [x, z] = [place % 24, place / 24].map(|cell| (f64::from(cell) - 11.5) * 0.041);
        world.spawn((square(0.012, Vec3::new(x as f32, 0.6, z as f32)), black_sheet(), StaticObject));
        expected -= solid_angle(0.012, [x, z], 0.6) / 4.0;
    }
    // A tile of 8 by 8 texels has the shadows of 36 plates for texels of 1/16 m, and of 144 for texels of 1/8 m.
    for side in [32, 16] {
        let found = mean_of(&mut world, floor, side);
        println!("{side}: {found:.6} of {expected:.6}");
        // Edges of shadows cross every texel: 64 rays leave an error of some 3 % of a texel, 2e-3 for the mean of 256
        // texels; the limit is two and a half sigma. Texels on the diagonal between the floor's two triangles are
        // evaluated at points.
        assert!((found / expected - 1.0).abs() < 5e-3, "{side}: {found} {expected}");
    }
}

/// Adds a light at a position.
fn add_light(world: &mut World, light: Light, [x, y, z]: [f64; 3]) {
    world.spawn((light, Transform::from_xyz(x, y, z)));
}

#[test]
fn a_partly_hidden_lamp_nearer_than_the_size_of_a_texel() {
    // Half to a fifth of a texel above the floor, with a plate below it: nearly all of the light falls on a few texels.
    for at in [[0.0, 0.03, 0.0], [0.31, 0.02, -0.34], [0.345, 0.012, -0.345]] {
        let mut world = World::new();
        let floor = floor(&mut world);
        add_light(&mut world, unit(Light::point), at);
        world.spawn((
            square(0.004, Vec3::new(at[0] as f32 + 0.003, at[1] as f32 * 0.5, at[2] as f32)),
            black_sheet(),
            StaticObject,
        ));
        let height = at[1];
        let whole = solid_angle(1.0, [-at[0], -at[2]], height) / 4.0;
        let hidden = solid_angle(0.004, [0.003, 0.0], 0.5 * height) / 4.0;
        let found = mean(&mut world, floor);
        println!("{at:?}: {found:.4} of {:.4}", whole - hidden);
        // The result depends on the rays of few texels: 64 at least in each, with the lamp's peak among them.
        assert!((found / (whole - hidden) - 1.0).abs() < 0.1, "{at:?}: {found} {}", whole - hidden);
    }
}

#[test]
fn a_range_shorter_than_the_distance_to_the_centre_of_a_tile() {
    // Texels are 1/4 m wide and tiles 2 m: the light's range is less than a tile.
    let mut world = World::new();
    let floor = world.spawn((square(4.0, Vec3::ZERO), black_sheet(), StaticObject)).id();
    let mut light = unit(Light::point);
    light.attenuation.range = 0.6;
    add_light(&mut world, light, [1.15, 0.3, 1.2]);
    let found = 64.0 * mean(&mut world, floor);
    // The numerical integral of E = h / d³ (1 - (d / range)⁴) over the lit disc.
    let (height, range, steps) = (0.3f64, 0.6f64, 100_000);
    let reach = (range * range - height * height).sqrt();
    let expected: f64 = (0..steps)
        .map(|step| {
            let radius = reach * (f64::from(step) + 0.5) / f64::from(steps);
            let d = radius.hypot(height);
            2.0 * std::f64::consts::PI * radius * height / d.powi(3) * (1.0 - (d / range).powi(4))
        })
        .sum::<f64>()
        * reach
        / f64::from(steps);
    println!("{found:.4} of {expected:.4}");
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
}

#[test]
fn a_cone_with_a_sharp_edge() {
    // A spot light straight above with a cutoff of 20° and I = 1 inside of its cone: the flux is 2 π (1 - cos 20°).
    let mut world = World::new();
    let floor = floor(&mut world);
    let cutoff = 20f64.to_radians();
    let cone = lumbre_optics::SpotCone::Exponent { cutoff: cutoff as f32, exponent: 0.0 };
    let place = Transform::from_xyz(0.05, 1.0, 0.02).looking_at(DVec3::new(0.05, 0.0, 0.02), DVec3::X);
    world.spawn((Light { spot: Some(cone), ..unit(Light::point) }, place));
    let open = 4.0 * mean(&mut world, floor);
    let expected = 2.0 * std::f64::consts::PI * (1.0 - cutoff.cos());
    world.spawn((square(0.05, Vec3::new(0.1, 0.5, 0.0)), black_sheet(), StaticObject));
    let hidden = solid_angle(0.05, [0.05, -0.02], 0.5);
    let found = 4.0 * mean(&mut world, floor);
    println!("{open:.5} of {expected:.5}; {found:.5} of {:.5}", expected - hidden);
    // The cone's edge crosses some forty texels with eight samples each. Half a sample in each, at random, is 1 % of
    // the light; the limit is two sigma.
    assert!(
        (open / expected - 1.0).abs() < 0.02 && (found - expected + hidden).abs() < 0.02 * expected,
        "{open} {found}"
    );
}

#[test]
fn a_strip_thinner_than_a_texel_is_lit() {
    // A strip 2 mm wide, such as the edge of a board, with a plate between a part of it and the light.
    let mut world = World::new();
    let board = world
        .spawn((
            Mesh(Arc::new(TriangleMesh {
                positions: [[-1.0, 0.0], [-1.0, 0.002], [1.0, 0.002], [1.0, 0.0]]
                    .map(|[x, z]| Vec3::new(x, 0.0, z))
                    .to_vec(),
                uv1: [[0.0, 0.0], [0.0, 0.002], [1.0, 0.002], [1.0, 0.0]].map(Vec2::from).to_vec(),
                indices: vec![0, 1, 2, 0, 2, 3],
                ..TriangleMesh::default()
            })),
            black_sheet(),
            StaticObject,
        ))
        .id();
    add_light(&mut world, unit(Light::point), [0.0, 1.0, 0.0]);
    world.spawn((square(0.02, Vec3::new(0.1, 0.5, 0.0)), black_sheet(), StaticObject));
    mean(&mut world, board);
    let map = &world.get::<Lightmap>(board).expect("it was baked").image;
    // The irradiance lies between 2^-3/2 and 1, and below that in the plate's shadow, which is 8 cm wide; a texel is 6
    // cm.
    let row: Vec<f64> = map.texels[..32].iter().map(|texel| f64::from(texel.y) / FRAC_1_PI).collect();
    assert!(row.iter().all(|light| (0.3..1.001).contains(light)), "{row:?}");
    assert!(row[19] < 0.6 && row[16] > 0.9 && row[22] > 0.75, "{row:?}");
}

/// Only point lights have a radius: that of a directional light must not soften its shadows.
#[test]
fn the_radius_of_a_directional_light_is_ignored() {
    let mut world = World::new();
    let floor = floor(&mut world);
    let sun = Light { radius: 1e6, ..unit(Light::directional) };
    world.spawn((sun, Transform::from_xyz(0.0, 1.0, 0.0).looking_at(DVec3::ZERO, DVec3::X)));
    world.spawn((square(0.3, Vec3::Y * 0.4), black_sheet(), StaticObject));
    let found = mean(&mut world, floor);
    assert!((found - 0.91).abs() < 1e-3, "{found}");
}
