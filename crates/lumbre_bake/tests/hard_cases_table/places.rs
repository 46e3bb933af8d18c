//! Cases about texels partly inside other geometry, patches that share an edge, coincident faces, and degenerate
//! triangles.

use std::f64::consts::{FRAC_1_PI, PI};

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, BakeReport, Quality};
use lumbre_mesh::{TriangleMesh, shapes};

use crate::case::Outcome;
use crate::common::shapes::square;
use crate::scenes::{bad_texels, draft, grey, irradiance, mean_of, point_light, run, spawn, warning, zenith};

crate::cases! {
    "texel centre inside other geometry, or outside its triangle" {
        a_millimetre_from_a_crate, around_a_crate_below_a_texel, inside_a_crate_there_is_no_light, to_the_edge_of_a_slanted_triangle,
        to_the_edge_where_light_falls_off,
    }
    "patches sharing an edge: the gap to 0" {
        squares_a_tenth_apart, squares_a_hundredth_apart, squares_a_thousandth_apart, squares_that_share_an_edge,
        beside_the_shared_edge,
    }
    "coplanar faces, a lamp in the ceiling's plane, duplicate triangles" {
        a_lamp_that_is_the_ceiling_twice, the_lamp_wins_and_it_is_said, a_lamp_within_the_ceilings_plane,
        the_ceiling_beside_that_lamp_gets_none_of_it, a_floor_twice, the_other_floor, the_lit_side_of_a_sheet, the_other_side_of_a_sheet,
    }
    "slivers, zero area, NaN positions, NaN or zero normals" {
        not_a_number_is_named, no_area_is_named, no_texel_is_bad, the_light_beside_them, normals_of_zero_or_nan, slivers,
    }
}

/// Points of the floor along the rim of a square, at a distance outside of it.
fn rim(half: f64, distance: f64) -> impl Iterator<Item = DVec3> {
    (0..200).map(move |i| {
        let along = half * (f64::from(i % 50) / 24.5 - 1.0);
        let out = half + distance;
        let [x, z] = [[out, along], [-out, along], [along, out], [along, -out]][i as usize / 50];
        DVec3::new(x, 0.0, z)
    })
}

/// A baked floor with a black crate on it under a sun at the zenith: up to the crate's rim, the floor is evenly lit.
fn crate_in_the_sun(side: f32) -> World {
    let mut world = World::new();
    spawn(&mut world, "floor", square(2.0, 0.0, true), grey(0.5, 0.0));
    let mut block = shapes::cuboid(Vec3::new(side, 0.4, side), 1);
    // The crate extends below the floor.
    block.positions.iter_mut().for_each(|p| p.y += 0.1);
    spawn(&mut world, "crate", block, grey(0.0, 0.0));
    zenith(&mut world);
    run(&mut world, &draft(64));
    world
}

const RIM: &str = "E of the sun at the zenith, up to a millimetre from what covers the floor: hidden parts count for nothing; f32";

fn a_millimetre_from_a_crate() -> Outcome {
    let mut world = crate_in_the_sun(0.737);
    let points = [1e-3, 5e-3, 0.02, 0.05].into_iter().flat_map(|distance| rim(0.3685, distance));
    let measured = irradiance(&mut world, DVec3::Y, points);
    Outcome::worst(measured.into_iter().map(|e| (1.0, e)), 1e-3, RIM)
}

fn around_a_crate_below_a_texel() -> Outcome {
    let mut world = crate_in_the_sun(0.02);
    let points = [0.02, 0.05].into_iter().flat_map(|distance| rim(0.01, distance));
    let measured = irradiance(&mut world, DVec3::Y, points);
    Outcome::worst(measured.into_iter().map(|e| (1.0, e)), 1e-3, RIM)
}

fn inside_a_crate_there_is_no_light() -> Outcome {
    let mut world = crate_in_the_sun(0.737);
    let points =
        (0..100).map(|i| DVec3::new(f64::from(i % 10 - 5) * 0.05, 0.0, f64::from(i / 10 - 5) * 0.05));
    let measured = irradiance(&mut world, DVec3::Y, points);
    Outcome::worst(
        measured.into_iter().map(|e| (0.0, e)),
        0.0,
        "more than a texel from the rim nothing is lit, and nobody looks",
    )
}

/// Adds a floor that is a single triangle oblique to the texel grid. Returns points along its three sides, on the side
/// or slightly inside.
fn oblique_triangle(world: &mut World) -> impl Iterator<Item = DVec3> + use<> {
    let corners = [Vec3::new(-1.0, 0.0, -0.8), Vec3::new(-0.9, 0.0, 0.9), Vec3::new(1.0, 0.0, 0.31)];
    let floor =
        TriangleMesh { positions: corners.to_vec(), indices: vec![0, 1, 2], ..TriangleMesh::default() };
    spawn(world, "floor", floor, grey(0.5, 0.0));
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let sides = [(a, b, c), (b, c, a), (c, a, b)];
    (0..300).map(move |i| {
        let (from, to, third) = sides[i / 100];
        let on_side = from.lerp(to, (i % 100) as f64 / 99.0);
        on_side.lerp(third, [0.0, 1e-3, 1e-2][i % 3])
    })
}

fn to_the_edge_of_a_slanted_triangle() -> Outcome {
    let mut world = World::new();
    let points = oblique_triangle(&mut world);
    zenith(&mut world);
    run(&mut world, &draft(48));
    let measured = irradiance(&mut world, DVec3::Y, points);
    let why = "texels whose centre is outside show what of them is inside; constant light stays constant to the edge: f32";
    Outcome::worst(measured.into_iter().map(|e| (1.0, e)), 1e-3, why)
}

fn to_the_edge_where_light_falls_off() -> Outcome {
    let mut world = World::new();
    let points: Vec<DVec3> = oblique_triangle(&mut world).collect();
    point_light(&mut world, 1.0, DVec3::Y);
    run(&mut world, &draft(64));
    let measured = irradiance(&mut world, DVec3::Y, points.iter().copied());
    let pairs = points.iter().zip(measured).map(|(p, e)| (PI / (1.0 + p.length_squared()).powf(1.5), e));
    let why = "π cos θ / d² from texels of h = 1/30 m: their middles are moved if a tenth of h off, h/10 |E'| is 0.009, and h²/2 E'' along both axes 0.010";
    Outcome::worst(pairs.collect::<Vec<_>>(), 0.019, why)
}

/// The form factor from a rectangle of width w to a perpendicular rectangle of height h with which it shares an edge of
/// length 1 (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-14).
fn perpendicular(w: f64, h: f64) -> f64 {
    if w == 0.0 {
        return 0.0;
    }
    let (a, b, s) = (w * w, h * h, w * w + h * h);
    let logarithm = ((1.0 + a) * (1.0 + b) / (1.0 + s)).ln()
        + a * (a * (1.0 + s) / ((1.0 + a) * s)).ln()
        + b * (b * (1.0 + s) / ((1.0 + b) * s)).ln();
    (w * (1.0 / w).atan() + h * (1.0 / h).atan() - s.sqrt() * (1.0 / s.sqrt()).atan() + 0.25 * logarithm)
        / (PI * w)
}

/// Bakes a wall of 1 m² that emits 1 W/m² and a floor of 1 m² that begins at a distance `gap` from it. Nothing bounces.
fn corner(gap: f32) -> World {
    let mut world = World::new();
    let floor = TriangleMesh {
        positions: [[gap, 0.0], [gap, 1.0], [1.0 + gap, 1.0], [1.0 + gap, 0.0]]
            .map(|[x, z]| Vec3::new(x, 0.0, z))
            .to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    };
    let wall = TriangleMesh {
        positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[y, z]| Vec3::new(0.0, y, z))
            .to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    };
    spawn(&mut world, "floor", floor, grey(0.0, 0.0));
    spawn(&mut world, "wall", wall, grey(0.0, FRAC_1_PI as f32));
    run(&mut world, &draft(64));
    world
}

/// The mean irradiance of the floor equals the form factor from the floor to the wall.
fn squares(gap: f32) -> Outcome {
    let mut world = corner(gap);
    let steps = 100;
    let middle = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
    let points =
        (0..steps * steps).map(|i| DVec3::new(f64::from(gap) + middle(i % steps), 0.0, middle(i / steps)));
    let measured = irradiance(&mut world, DVec3::Y, points);
    let g = f64::from(gap);
    // The exchange of the floor from 0 to 1 + g with the wall, minus that of its first part of width g. The floor's
    // area is 1, so that this is its form factor.
    let expected = (1.0 + g) * perpendicular(1.0 + g, 1.0) - g * perpendicular(g, 1.0);
    let why =
        "closed form (0.200043776 without a gap); the mean of a map of 1/60 m, cut off at its border: 0.2 %";
    Outcome::number(expected, measured.iter().sum::<f64>() / measured.len() as f64, 2e-3 * expected, why)
}

fn squares_a_tenth_apart() -> Outcome {
    squares(0.1)
}

fn squares_a_hundredth_apart() -> Outcome {
    squares(0.01)
}

fn squares_a_thousandth_apart() -> Outcome {
    squares(0.001)
}

fn squares_that_share_an_edge() -> Outcome {
    squares(0.0)
}

fn beside_the_shared_edge() -> Outcome {
    let mut world = corner(0.0);
    let measured = irradiance(&mut world, DVec3::Y, [DVec3::new(1e-4, 0.0, 0.5)])[0];
    let why = "half of what it sees shines; within the first texel of 1/60 m E falls by 0.5 of its way, 0.8 %, twice";
    Outcome::number(0.5, measured, 8e-3, why)
}

/// Bakes a floor under a square lamp of a given side, with or without a ceiling in the lamp's plane. Returns the mean
/// irradiance of the floor, too.
fn under_a_lamp(side: f32, ceiling: bool) -> (World, BakeReport, f64) {
    let mut world = World::new();
    let floor = spawn(&mut world, "floor", square(2.0, 0.0, true), grey(0.0, 0.0));
    if ceiling {
        spawn(&mut world, "ceiling", square(2.0, 1.0, false), grey(0.0, 0.0));
    }
    spawn(&mut world, "lamp", square(side, 1.0, false), grey(0.0, 1.0));
    let report = run(&mut world, &draft(32));
    let mean = mean_of(&world, floor);
    (world, report, mean)
}

const PLANE: &str = "the floor's light over that without a ceiling: no ray to the lamp ends at the ceiling";

fn a_lamp_that_is_the_ceiling_twice() -> Outcome {
    Outcome::number(1.0, under_a_lamp(2.0, true).2 / under_a_lamp(2.0, false).2, 1e-4, PLANE)
}

fn the_lamp_wins_and_it_is_said() -> Outcome {
    Outcome::text("2 triangles lie exactly on others", warning(&under_a_lamp(2.0, true).1, "lie exactly"))
}

fn a_lamp_within_the_ceilings_plane() -> Outcome {
    Outcome::number(1.0, under_a_lamp(0.5, true).2 / under_a_lamp(0.5, false).2, 1e-4, PLANE)
}

fn the_ceiling_beside_that_lamp_gets_none_of_it() -> Outcome {
    let (mut world, ..) = under_a_lamp(0.5, true);
    let measured = irradiance(&mut world, DVec3::NEG_Y, [0.26, 0.3, 0.6].map(|x| DVec3::new(x, 1.0, 0.1)));
    Outcome::worst(measured.into_iter().map(|e| (0.0, e)), 0.0, "what lies in one plane does not see itself")
}

/// Bakes `count` coincident floors under a reflecting lamp and returns the mean irradiance of each.
fn coincident_floors(count: usize) -> Vec<f64> {
    let mut world = World::new();
    let floors: Vec<_> =
        (0..count).map(|_| spawn(&mut world, "floor", square(2.0, 0.0, true), grey(0.6, 0.0))).collect();
    spawn(&mut world, "lamp", square(1.0, 1.0, false), grey(0.5, 1.0));
    run(&mut world, &draft(32));
    floors.into_iter().map(|floor| mean_of(&world, floor)).collect()
}

fn a_floor_twice() -> Outcome {
    let why =
        "over that of one floor: light meets one of the two, or it would be reflected twice; sampling 1 %";
    Outcome::number(1.0, coincident_floors(2)[0] / coincident_floors(1)[0], 0.01, why)
}

fn the_other_floor() -> Outcome {
    let both = coincident_floors(2);
    let why = "over that of the first: whichever of the two is drawn, it is lit; sampling 1 %";
    Outcome::number(1.0, both[1] / both[0], 0.01, why)
}

/// Bakes a sheet of two coincident faces under a sun at the zenith: one looks up, the other looks down and is split
/// along the other diagonal. Returns the mean irradiance of both.
fn sheet() -> [f64; 2] {
    let mut world = World::new();
    let top = spawn(&mut world, "top", square(2.0, 0.0, true), grey(0.0, 0.0));
    let mut below = square(2.0, 0.0, false);
    below.indices = vec![1, 2, 3, 1, 3, 0];
    let bottom = spawn(&mut world, "bottom", below, grey(0.0, 0.0));
    zenith(&mut world);
    run(&mut world, &draft(24));
    [top, bottom].map(|side| mean_of(&world, side))
}

fn the_lit_side_of_a_sheet() -> Outcome {
    Outcome::number(1.0, sheet()[0], 1e-5, "E of the sun at the zenith; f32")
}

fn the_other_side_of_a_sheet() -> Outcome {
    Outcome::number(0.0, sheet()[1], 0.0, "faces turned opposite ways both stay, and keep their sides apart")
}

/// Bakes a floor under a lamp; if `broken`, the floor has degenerate triangles and invalid normals.
fn bad_floor(broken: bool) -> (World, BakeReport) {
    let mut mesh = square(2.0, 0.0, true);
    if broken {
        mesh.positions.extend([Vec3::NAN, Vec3::new(0.5, 0.0, 0.5), Vec3::new(1e30, f32::INFINITY, 0.0)]);
        mesh.normals = vec![Vec3::ZERO, Vec3::NAN, Vec3::Y, Vec3::NEG_Y, Vec3::Y, Vec3::Y, Vec3::Y];
        mesh.indices.extend([0, 1, 4, 0, 1, 1, 5, 5, 5, 0, 1, 6]);
    }
    let mut world = World::new();
    spawn(&mut world, "bad floor", mesh, grey(0.5, 0.0));
    spawn(&mut world, "lamp", square(2.0, 1.0, false), grey(0.5, 1.0));
    let options = BakeOptions { quality: Quality::Final, ..draft(32) };
    let report = run(&mut world, &options);
    (world, report)
}

fn not_a_number_is_named() -> Outcome {
    Outcome::text("bad floor: 2 triangles with NaN or infinite positions", warning(&bad_floor(true).1, "NaN"))
}

fn no_area_is_named() -> Outcome {
    Outcome::text("bad floor: 2 triangles without area", warning(&bad_floor(true).1, "without area"))
}

fn no_texel_is_bad() -> Outcome {
    Outcome::number(0.0, bad_texels(&mut bad_floor(true).0), 0.0, "texels that are NaN, infinite or negative")
}

fn the_light_beside_them() -> Outcome {
    let points: Vec<_> =
        (0..9).map(|i| DVec3::new(f64::from(i % 3) * 0.6 - 0.6, 0.0, f64::from(i / 3) * 0.6 - 0.6)).collect();
    let [bad, good] =
        [true, false].map(|broken| irradiance(&mut bad_floor(broken).0, DVec3::Y, points.iter().copied()));
    let why = "over that of the floor without them; two layouts of the map, and 1 % was asked for";
    Outcome::worst(bad.iter().zip(&good).map(|(bad, good)| (1.0, bad / good)), 0.02, why)
}

fn normals_of_zero_or_nan() -> Outcome {
    let mut mesh = square(2.0, 0.0, true);
    mesh.normals = vec![Vec3::ZERO, Vec3::NAN, Vec3::splat(f32::INFINITY), Vec3::NEG_Y];
    let mut world = World::new();
    spawn(&mut world, "floor", mesh, grey(0.5, 0.0));
    zenith(&mut world);
    run(&mut world, &draft(24));
    let points =
        (0..25).map(|i| DVec3::new(f64::from(i % 5) * 0.45 - 0.9, 0.0, f64::from(i / 5) * 0.45 - 0.9));
    let measured = irradiance(&mut world, DVec3::Y, points);
    Outcome::worst(
        measured.into_iter().map(|e| (1.0, e)),
        1e-5,
        "zero, NaN, infinite or turned away: the face's own; f32",
    )
}

fn slivers() -> Outcome {
    // Beside the floor, 200 needles that are about 10^4 times as long as wide.
    let mut mesh = square(2.0, 0.0, true);
    let first = mesh.positions.len() as u32;
    for i in 0..200 {
        let z = 1e-4 * i as f32;
        mesh.positions.push(Vec3::new(1.0 + 1e-3 * i as f32, 0.0, z));
        mesh.positions.push(Vec3::new(2.0, 0.0, z + 1e-4));
        mesh.positions.push(Vec3::new(2.0, 0.0, z));
    }
    mesh.indices.extend(first..first + 600);
    let mut world = World::new();
    spawn(&mut world, "floor", mesh, grey(0.5, 0.0));
    spawn(&mut world, "lamp", square(2.0, 1.0, false), grey(0.5, 1.0));
    run(&mut world, &draft(64));
    Outcome::number(
        0.0,
        bad_texels(&mut world),
        0.0,
        "texels that are NaN, infinite or negative, with 200 needles 10^4 times as long as wide",
    )
}
