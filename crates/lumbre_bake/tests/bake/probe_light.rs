//! The light that a small ball receives from the probes at random places, against the tests' own path tracer. The scene
//! has two rooms joined by a doorway, one of them lit, with a wall between them that is thinner than a cell of the
//! grid.

#![allow(clippy::print_stdout, reason = "the errors are the result that a reader of the output wants")]

use std::f64::consts::PI;
use std::fmt;

use glam::DVec3;
use lumbre_bake::{Bake, BakeOptions, Density, Probes, Quality};
use lumbre_scene::{GlobalTransform, IrradianceVolume, VolumePlace};

use crate::held_out::path_tracer::{Effort, Irradiance, PathTracer};
use crate::held_out::random::Random;
use crate::held_out::scenes;

/// The number of random places in each volume.
const PLACES: usize = 150;

/// Errors of E/π relative to its mean over the same places.
struct Errors {
    mean: f64,
    median: f64,
    p95: f64,
    rmse: f64,
    bias: f64,
}

impl Errors {
    /// Computes the errors from pairs of the probes' value and the true one.
    fn of(pairs: &[(DVec3, DVec3)]) -> Self {
        let count = pairs.len() as f64;
        let mean = pairs.iter().map(|(_, truth)| truth.element_sum() / 3.0).sum::<f64>() / count;
        let error = |(got, truth): &(DVec3, DVec3)| ((*got - *truth).length_squared() / 3.0).sqrt() / mean;
        let mut errors: Vec<f64> = pairs.iter().map(error).collect();
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors[(share * (count - 1.0)) as usize];
        let difference = pairs.iter().map(|(got, truth)| (*got - *truth).element_sum() / 3.0).sum::<f64>();
        let rmse = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        Self { mean, median: at(0.5), p95: at(0.95), rmse, bias: difference / count / mean }
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mean, median, p95, rmse, bias } = self;
        let [median, p95, rmse, bias] = [median, p95, rmse, bias].map(|share| 100.0 * share);
        write!(
            formatter,
            "mean {mean:.3}, median {median:.1} %, 95 % {p95:.1} %, RMSE {rmse:.1} %, bias {bias:+.1} %"
        )
    }
}

/// Random places between two corners at which a ball of this radius fits.
fn places(tracer: &PathTracer, [low, high]: [DVec3; 2], radius: f64, random: &mut Random) -> Vec<DVec3> {
    let mut places = Vec::new();
    while places.len() < PLACES {
        let place = low + (high - low) * DVec3::new(random.uniform(), random.uniform(), random.uniform());
        let is_open = (0..64).all(|_| {
            let hit = tracer.scene.closest(place, direction(random));
            hit.is_some_and(|hit| hit.distance > radius)
        });
        if is_open {
            places.push(place);
        }
    }
    places
}

fn direction(random: &mut Random) -> DVec3 {
    loop {
        let point = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * 2.0 - 1.0;
        if (0.01..1.0).contains(&point.length_squared()) {
            return point.normalize();
        }
    }
}

/// The probes of a baked scene, and the path tracer of the same scene.
struct ProbeTest {
    tracer: PathTracer,
    volume: IrradianceVolume,
    place: VolumePlace,
    random: Random,
}

/// The directions of the ball's surface that are tested.
#[derive(Clone, Copy, PartialEq)]
enum Sides {
    Any,
    /// The six directions for which a probe stores a value.
    AlongAxes,
}

impl ProbeTest {
    fn new(spacing: Option<f64>, quality: Quality) -> Self {
        let mut world = scenes::rooms(0, 1.0);
        let tracer = PathTracer::new(&mut world);
        let options = BakeOptions {
            density: Density::TexelsPerMeter(8.0),
            error: 0.02,
            probes: Probes::Always,
            probe_spacing: spacing,
            quality,
            ..BakeOptions::default()
        };
        let report = Bake::new(&options).run(&mut world).expect("the scene bakes");
        println!("{:?}", report.probes);
        let mut volumes = world.query::<(&IrradianceVolume, &GlobalTransform)>();
        let (volume, transform) = volumes.single(&world).expect("there is one volume");
        assert_eq!(volume.validate(), Ok(()));
        assert_eq!(volume.inside.iter().filter(|inside| **inside).count(), report.probes.inside);
        let place = IrradianceVolume::place(volume.resolution, Some(transform)).expect("it can be used");
        Self { tracer, volume: volume.clone(), place, random: Random::new(5) }
    }

    /// Measures the errors at random places between two corners that are at least `radius` away from all surfaces. The
    /// second result is without the marks of probes inside of solids.
    fn errors(&mut self, [low, high]: [DVec3; 2], radius: f64, sides: Sides) -> [Errors; 2] {
        let places: Vec<_> = places(&self.tracer, [low, high], radius, &mut self.random)
            .into_iter()
            .map(|place| {
                let normal = direction(&mut self.random);
                let axis = (normal / normal.abs().max_element()).trunc();
                (place, if sides == Sides::AlongAxes { axis } else { normal })
            })
            .collect();
        let truth = self.tracer.at(&places, Effort::fixed(8, 16), 3);
        let unmarked = IrradianceVolume { inside: Vec::new(), ..self.volume.clone() };
        [&self.volume, &unmarked].map(|volume| {
            let light = |(&(point, normal), truth): (&(DVec3, DVec3), &Irradiance)| {
                (volume.light(&self.place, point, normal), truth.value / PI)
            };
            Errors::of(&places.iter().zip(&truth).map(light).collect::<Vec<_>>())
        })
    }
}

/// The corners of the part of the rooms between two x coordinates.
fn between(west: f64, east: f64) -> [DVec3; 2] {
    [DVec3::new(west, 0.0, 0.0), DVec3::new(east, 2.6, 3.6)]
}

#[test]
fn a_ball_in_two_rooms() {
    let mut probe_test = ProbeTest::new(None, Quality::Final);
    let [lit_axes, lit, dark_axes, dark] = [
        ("lit room, sides along the axes", between(-4.0, 0.0), Sides::AlongAxes),
        ("lit room, any side", between(-4.0, 0.0), Sides::Any),
        ("dark room, sides along the axes", between(0.15, 4.15), Sides::AlongAxes),
        ("dark room, any side", between(0.15, 4.15), Sides::Any),
    ]
    .map(|(name, corners, sides)| {
        let [found, _] = probe_test.errors(corners, 0.2, sides);
        println!("{name}: {found}");
        found
    });
    // Between probes a quarter of a metre apart, the light of a room is nearly linear.
    assert!(lit_axes.median < 0.02 && lit_axes.p95 < 0.08 && lit_axes.bias.abs() < 0.02, "{lit_axes}");
    assert!(dark_axes.median < 0.08 && dark_axes.p95 < 0.25 && dark_axes.bias.abs() < 0.04, "{dark_axes}");
    // Six values per probe cannot represent a side that is tilted towards a lamp, or away from it, any better.
    assert!(lit.median < 0.12 && lit.rmse < 0.45 && lit.bias.abs() < 0.06, "{lit}");
    assert!(dark.median < 0.14 && dark.rmse < 0.45 && dark.bias.abs() < 0.06, "{dark}");
}

#[test]
fn beside_a_wall_between_light_and_dark() {
    // The wall is 15 cm thick; directly behind it, no light arrives directly from the lit room.
    let behind_wall = between(0.15, 0.28);
    // With cells of 27 cm no probe is inside the wall, with cells of 15 cm some are.
    let [mut coarse, mut fine] = [None, Some(0.15)].map(|spacing| ProbeTest::new(spacing, Quality::Draft));
    let [through, _] = coarse.errors(behind_wall, 0.01, Sides::AlongAxes);
    let [marked, unmarked] = fine.errors(behind_wall, 0.01, Sides::AlongAxes);
    println!("beside the wall, cells of 27 cm: {through}");
    println!("beside the wall, cells of 15 cm: {marked}");
    println!("beside the wall, cells of 15 cm, without marks: {unmarked}");
    assert!(marked.bias.abs() < 0.1 && marked.p95 < 0.8, "{marked}");
    // Negative control: the same probes without the marks of those inside the wall.
    assert!(unmarked.bias > 0.2, "{unmarked}");
    // The bound that the documentation states for walls without a probe inside.
    assert!(through.bias < 0.5, "{through}");
}
