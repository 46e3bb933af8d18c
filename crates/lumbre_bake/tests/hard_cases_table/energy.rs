//! Cases in which energy must be conserved: reflectance near and above 1, pooled form factors, tiny lamps, long sums,
//! encodings.

use std::f64::consts::PI;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, BakeReport, Quality};
use lumbre_mesh::shapes;
use lumbre_scene::{LightmapEncoding, LightmapImage, PackedFormat, Supercompression, lightmap_to_ktx2};

use crate::case::Outcome;
use crate::common::shapes::{room, square};
use crate::scenes::{differing_values, draft, grey, irradiance, mean_of, run, spawn, warning, zenith};

crate::cases! {
    "rho towards 1, rho above 1 in the file" {
        above_one_is_named, above_one_is_999_thousandths, below_zero_is_named, a_furnace_of_99_hundredths, a_furnace_of_999_thousandths,
        the_residual_over_one_less_rho,
    }
    "row sums of Monte Carlo form factors above 1; reciprocity lost" {
        a_furnace_with_a_partition, lamps_that_change_places, energy_cut_off,
    }
    "tiny bright emitters (fireflies)" {
        a_lamp_of_a_millimetre, no_texel_stands_out, their_energy_is_all_there,
    }
    "sums over 10^8 samples, light ratios of 10^8; RGB9E5 saturates at 65408" {
        the_mean_of_four_million_texels, the_same_in_f32, the_brightest_rgb9e5, the_brightest_b10g11r11, saturation_is_counted,
        its_error_is_told,
    }
}

/// Bakes a closed box whose walls emit a radiance of 1 and have the given reflectance (a furnace test). Returns the
/// mean irradiance, too.
fn furnace(reflectance: f32) -> (World, BakeReport, f64) {
    let mut world = World::new();
    let walls = spawn(&mut world, "walls", room(Vec3::new(2.0, 1.0, 1.5)), grey(reflectance, 1.0));
    let report = run(&mut world, &draft(32));
    let mean = mean_of(&world, walls);
    (world, report, mean)
}

fn above_one_is_named() -> Outcome {
    let words = "walls: diffuse reflectance [3, 3, 3] is above 0.999 and was clamped to it";
    Outcome::text(words, warning(&furnace(3.0).1, "reflectance"))
}

fn above_one_is_999_thousandths() -> Outcome {
    let (mut above, mut clamped) = (furnace(3.0).0, furnace(0.999).0);
    Outcome::number(
        0.0,
        differing_values(&mut above, &mut clamped),
        0.0,
        "texels that differ in a bit from those of rho = 0.999",
    )
}

fn below_zero_is_named() -> Outcome {
    Outcome::text("is negative or not a number and counts as 0", warning(&furnace(-0.5).1, "reflectance"))
}

fn a_furnace_of_99_hundredths() -> Outcome {
    let expected = PI / (1.0 - f64::from(0.99f32));
    let why = "π L / (1 - ρ): a row sum that is off by x gives ρ x / (1 - ρ), so that 1 % says rows are right to 1e-4";
    Outcome::number(expected, furnace(0.99).2, 0.01 * expected, why)
}

fn a_furnace_of_999_thousandths() -> Outcome {
    let expected = PI / (1.0 - f64::from(0.999f32));
    let why = "π L / (1 - ρ): a row sum that is off by x gives ρ x / (1 - ρ), so that 10 % says rows are right to 1e-4";
    Outcome::number(expected, furnace(0.999).2, 0.1 * expected, why)
}

fn the_residual_over_one_less_rho() -> Outcome {
    let report = furnace(0.999).1;
    let why = "times the residual is the bound that is reported on the solution's error: 1 / (1 - ρ), ρ = 0.999 in f32";
    Outcome::number(1000.0, report.residual_bound / report.residual, 0.1, why)
}

/// A room with a free-standing partition in its middle: most patches see about half of the others.
fn partitioned_furnace() -> World {
    let mut world = World::new();
    spawn(&mut world, "walls", room(Vec3::new(2.0, 1.0, 1.5)), grey(0.9, 1.0));
    spawn(&mut world, "partition", shapes::cuboid(Vec3::new(0.1, 0.6, 1.2), 1), grey(0.9, 1.0));
    world
}

fn a_furnace_with_a_partition() -> Outcome {
    let mut world = partitioned_furnace();
    run(&mut world, &BakeOptions { quality: Quality::Final, ..draft(48) });
    let points: Vec<DVec3> = (0..200)
        .map(|i| DVec3::new(f64::from(i % 20) * 0.09 - 0.92, 0.5, f64::from(i / 20) * 0.14 - 0.66))
        .collect();
    let measured = irradiance(&mut world, DVec3::NEG_Y, points);
    let expected = PI / (1.0 - f64::from(0.9f32));
    let why = "π L / (1 - ρ) at 200 points of the ceiling, the farthest: pooled pairs, scaled alike for both, until each row sums to what it sees; 1 % asked for, four times that";
    Outcome::worst(measured.into_iter().map(|e| (expected, e)), 0.04 * expected, why)
}

/// The light (irradiance times area) that a black square receives from an emissive one: two shelves in a reflecting
/// room. Each shelf is given by its side and its x coordinate.
fn light_between(from: (f32, f32), to: (f32, f32)) -> f64 {
    let mut world = World::new();
    spawn(&mut world, "walls", room(Vec3::new(2.0, 1.6, 2.0)), grey(0.7, 0.0));
    let shelf = |(side, x): (f32, f32), up: bool| {
        let mut mesh = square(side, 0.0, up);
        mesh.positions.iter_mut().for_each(|p| *p += Vec3::new(x, if up { -0.4 } else { 0.3 }, 0.1));
        mesh
    };
    // The shelf with the smaller x is the lower one and looks up, the other one looks down: they see each other and the
    // room.
    let up = from.1 < to.1;
    spawn(&mut world, "lamp", shelf(from, up), grey(0.0, 1.0));
    let receiver = spawn(&mut world, "receiver", shelf(to, !up), grey(0.0, 0.0));
    run(&mut world, &BakeOptions { quality: Quality::Final, error: 0.005, ..draft(32) });
    mean_of(&world, receiver) * f64::from(to.0 * to.0)
}

fn lamps_that_change_places() -> Outcome {
    let (small, large) = ((0.3, -0.4), (0.8, 0.4));
    let (to_large, to_small) = (light_between(small, large), light_between(large, small));
    let why = "power from a small lamp to a large square over that from as bright a large lamp to the small square, with all bounces: A_i F_ij = A_j F_ji; 0.5 % twice, and the maps' borders";
    Outcome::number(1.0, to_large / to_small, 0.03, why)
}

fn energy_cut_off() -> Outcome {
    let report = run(&mut partitioned_furnace(), &draft(48));
    let why = "share of the exchange that was cut so that no row exceeds 1, as reported";
    Outcome::number(0.0, report.energy_lost, 2e-3, why)
}

/// A baked room of 2 m with a lamp of 1 mm, whose radiance is millions of times that of the walls.
fn room_with_a_tiny_lamp(reflectance: f32) -> World {
    let mut world = World::new();
    spawn(&mut world, "walls", room(Vec3::splat(2.0)), grey(reflectance, 0.0));
    let mut lamp = shapes::cuboid(Vec3::splat(1e-3), 1);
    lamp.positions.iter_mut().for_each(|p| *p += Vec3::new(0.1, 0.2, -0.15));
    spawn(&mut world, "lamp", lamp, grey(0.0, 1e6));
    run(&mut world, &BakeOptions { quality: Quality::Final, ..draft(64) });
    world
}

fn a_lamp_of_a_millimetre() -> Outcome {
    let (side, radiance) = (1e-3f64, 1e6f64);
    let mut world = World::new();
    spawn(&mut world, "floor", square(1.6, 0.0, true), grey(0.5, 0.0));
    spawn(&mut world, "lamp", square(side as f32, 1.0, false), grey(0.0, radiance as f32));
    run(&mut world, &draft(64));
    let points: Vec<DVec3> = (0..169)
        .map(|i| DVec3::new(0.1 * f64::from(i % 13 - 6) + 0.013, 0.0, 0.1 * f64::from(i / 13 - 6) + 0.021))
        .collect();
    let measured = irradiance(&mut world, DVec3::Y, points.iter().copied());
    let power = radiance * side * side;
    let pairs = points.iter().zip(measured).map(|(p, e)| (power / (1.0 + p.length_squared()).powi(2), e));
    let why = "L A cos⁴ / h²; found by asking for it, not by chance; between texels of 1/40 m h²/8 |E''|: 0.1 % along both axes";
    Outcome::worst(pairs.collect::<Vec<_>>(), 2e-3 * power, why)
}

/// Irradiance at rows of a grid over each of the six faces of the 2 m cube.
fn over_the_walls(world: &mut World) -> Vec<Vec<f64>> {
    let at = |i: i32| f64::from(2 * i + 1) / 20.0 - 1.0;
    let mut rows = Vec::new();
    for (axis, right, up) in
        [(DVec3::X, DVec3::Y, DVec3::Z), (DVec3::Y, DVec3::Z, DVec3::X), (DVec3::Z, DVec3::X, DVec3::Y)]
    {
        for sign in [-1.0, 1.0] {
            let axis = axis * sign;
            for row in 0..20 {
                rows.push(irradiance(world, -axis, (0..20).map(|i| axis + right * at(i) + up * at(row))));
            }
        }
    }
    rows
}

fn no_texel_stands_out() -> Outcome {
    let rows = over_the_walls(&mut room_with_a_tiny_lamp(0.5));
    let pairs = rows
        .iter()
        .flat_map(|row| row.windows(3).map(|three| (1.0, three[1] / (0.5 * (three[0] + three[2])))));
    let why = "E at a point over the mean of its neighbours 1/10 m away: what is smooth bends by (1/10)² / 2 |E''| / E, at most 4 %; a firefly would stand out by its brightness";
    Outcome::worst(pairs.collect::<Vec<_>>(), 0.05, why)
}

fn their_energy_is_all_there() -> Outcome {
    let rows = over_the_walls(&mut room_with_a_tiny_lamp(0.5));
    let count: usize = rows.iter().map(Vec::len).sum();
    let mean = rows.iter().flatten().sum::<f64>() / count as f64;
    // The emitted and the absorbed power are equal.
    let expected = PI * 1e6 * 6.0 * 1e-6 / (24.0 * 0.5);
    let why = "emitted power over what 24 m² absorb: no sample is clamped, so none of it is lost; 1 % asked for, and a grid of 20 points";
    Outcome::number(expected, mean, 0.015 * expected, why)
}

/// Bakes a floor of 2¹¹ x 2¹¹ texels in the sun.
fn a_large_floor() -> (World, BakeReport) {
    let mut world = World::new();
    spawn(&mut world, "floor", square(2.0, 0.0, true), grey(0.0, 0.0));
    zenith(&mut world);
    let report = run(&mut world, &draft(2064));
    (world, report)
}

fn the_mean_of_four_million_texels() -> Outcome {
    let (_, report) = a_large_floor();
    assert!(report.coverage * report.texels as f64 > 4.1e6, "{report:?}");
    let why = "summed in f64: what is left is the f32 of each texel, 2^-24, and of 1/π in the light; so are power, patches and the rays' count";
    Outcome::number(1.0, report.mean_irradiance[0], 3e-7, why)
}

fn the_same_in_f32() -> Outcome {
    // Negative control: sum as many values in f32.
    let texel = std::f32::consts::FRAC_1_PI;
    let count = 1 << 24;
    let sum = (0..count).fold(0.0f32, |sum, _| sum + texel);
    let why = "negative control: a sum in f32 of four times as many equal texels, over their number, loses so much of the light: of the last of them each is rounded to 1/2 or to 0";
    Outcome::number(0.005, 1.0 - f64::from(sum) / (f64::from(texel) * f64::from(count)), 0.004, why)
}

/// Encodes a map of four texels, one of which is far above the largest value of the formats. Returns the map, the red
/// channel of that texel as encoded, and the reported error.
fn bright(format: PackedFormat) -> (LightmapImage, f64, lumbre_scene::EncodingError) {
    let texels = vec![Vec3::splat(1e6), Vec3::splat(3.0), Vec3::splat(1.0), Vec3::splat(0.1)];
    let image = LightmapImage {
        name: "bright".into(),
        width: 2,
        height: 2,
        texels,
        encoding: LightmapEncoding::Rgb32Float,
    };
    let (bytes, error) = lightmap_to_ktx2(&image, format, Supercompression::None).expect("it can be written");
    // The file ends with its only level of 16 bytes, whose first texel is the bright one.
    let word: [u8; 4] = bytes[bytes.len() - 16..bytes.len() - 12].try_into().expect("four bytes");
    let word = u32::from_le_bytes(word);
    let red = match format {
        PackedFormat::Rgb9E5 => f64::from(word & 0x1ff) * 2f64.powi((word >> 27) as i32 - 24),
        PackedFormat::B10G11R11 => {
            (1.0 + f64::from(word & 0x3f) / 64.0) * 2f64.powi((word >> 6 & 0x1f) as i32 - 15)
        }
    };
    (image, red, error)
}

fn the_brightest_rgb9e5() -> Outcome {
    Outcome::number(
        65408.0,
        bright(PackedFormat::Rgb9E5).1,
        0.0,
        "511/512 x 2^16, decoded by its definition: the largest, never an overflow",
    )
}

fn the_brightest_b10g11r11() -> Outcome {
    Outcome::number(
        65024.0,
        bright(PackedFormat::B10G11R11).1,
        0.0,
        "(1 + 63/64) x 2^15, decoded by its definition, and never infinity",
    )
}

fn saturation_is_counted() -> Outcome {
    Outcome::number(
        1.0,
        bright(PackedFormat::Rgb9E5).2.saturated as f64,
        0.0,
        "texels that were cut off, in the report of the file",
    )
}

fn its_error_is_told() -> Outcome {
    let (image, red, error) = bright(PackedFormat::Rgb9E5);
    let mean = image.texels.iter().map(|texel| f64::from(texel.x)).sum::<f64>() / 4.0;
    let why = "largest error over the mean, as reported: what was cut off";
    Outcome::number((1e6 - red) / mean, error.largest, 1e-3, why)
}
