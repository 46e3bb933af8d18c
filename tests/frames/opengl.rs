//! OpenGL's fixed-function pictures in tests/opengl (its README describes how they were drawn): a frame with
//! `--display clamp` equals them, and no longer does when anything in the scene changes.

use std::path::PathBuf;

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_optics::{FlatRule, FogMode, Light, Material, ReflectionModel, SpotCone};
use lumbre_render::{Display, FrameOptions};
use lumbre_scene::{SceneSettings, Transform};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::device::subpixel_bits;
use lumbre_tests::twin::{self, TwinOptions};

use crate::adapter::{draw, linear};

const CASES: &[&str] = &[
    "one_point_light",
    "eight_lights_two_sided",
    "infinite_viewer",
    "fog_linear",
    "fog_exp",
    "fog_exp2",
    "transformed",
    "cutoffs",
    "saturated",
    "last_vertex",
    "exponent_0",
    "one_sided",
];

/// Largest difference per channel inside one surface: one code of eight bits.
pub const LARGEST: f64 = 1.0 / 255.0;
/// Largest mean absolute difference there.
pub const MEAN: f64 = 1e-4;
/// The stricter bounds of the cases here. Both sides are f32; measured 1.1e-5 and 3.9e-6, of which up to 7.6e-6 and
/// 3.8e-6 are the files' rounding to 2^-16. A highlight's power differs most: exponent 128 times the error of a
/// logarithm in f32.
const LARGEST_HERE: f64 = 1e-4;
const MEAN_HERE: f64 = 1e-5;

/// The options with which this renderer draws like OpenGL.
pub fn opengl_options() -> FrameOptions {
    FrameOptions { display: Display::Clamp, ..linear() }
}

/// Returns true if a frame equals OpenGL's within the general bounds.
pub fn equal(difference: &Difference) -> bool {
    difference.largest <= LARGEST && difference.mean <= MEAN
}

struct Reference {
    scene: PathBuf,
    size: (u32, u32),
    /// Colours of pixels whose 3x3 neighbourhood is one surface, or one triangle of a flat one.
    interior: Vec<Option<DVec3>>,
}

fn reference(name: &str) -> Reference {
    let scene = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/opengl")).join(format!("{name}.glb"));
    // Red, green, blue, and in alpha the number of the surface.
    let image = image::open(scene.with_extension("exr")).unwrap().to_rgba32f();
    let (width, height) = image.dimensions();
    let inside = |x: u32, y: u32| {
        let margin = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
        let surface = |x, y| image.get_pixel(x, y).0[3];
        !margin && (x - 1..=x + 1).all(|i| (y - 1..=y + 1).all(|j| surface(i, j) == surface(x, y)))
    };
    let color = |pixel: &image::Rgba<f32>| {
        let [red, green, blue, _] = pixel.0;
        DVec3::new(red.into(), green.into(), blue.into())
    };
    let interior = image.enumerate_pixels().map(|(x, y, pixel)| inside(x, y).then(|| color(pixel))).collect();
    Reference { scene, size: (width, height), interior }
}

impl Reference {
    fn world(&self) -> World {
        let mut world = World::new();
        lumbre_scene::load(&mut world, &self.scene).unwrap();
        world
    }

    fn difference(&self, world: &mut World, options: &FrameOptions) -> Difference {
        let (got, _) = draw(world, self.size.0, self.size.1, options);
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let mut drawn = self.world();
        let moved = twin::by_moved_corners(&mut drawn, width, height, TwinOptions::default(), 1.0);
        let certain = twin::draw(&mut drawn, width, height, TwinOptions::default()).uncertain;
        let interior =
            self.interior.iter().zip(certain).map(|(color, uncertain)| color.filter(|_| !uncertain));
        // Where the display does not clamp, as in one control, the picture is clamped only at the end.
        let got = got.into_iter().map(|color| color.clamp(DVec3::ZERO, DVec3::ONE));
        let got: Vec<_> = got.zip(moved).map(|(color, moved)| Some(color - moved)).collect();
        compare(&got, &interior.collect::<Vec<_>>())
    }
}

#[test]
fn frames_equal_opengl() {
    for name in CASES {
        let reference = reference(name);
        let difference = reference.difference(&mut reference.world(), &opengl_options());
        let Difference { largest, mean, pixels, .. } = difference;
        println!("{name:24} largest {largest:.2e}, mean {mean:.2e} over {pixels} pixels");
        // A third of the frame: the flat case has the most edges.
        assert!(pixels > reference.interior.len() / 3, "{name}: {pixels} pixels are too few to compare");
        assert!(equal(&difference), "{name}: {difference:?}");
        // Where corners are moved, clamped colours of vertices are not those that the twin's are corrected by.
        let largest_here = if subpixel_bits().is_some() { LARGEST } else { LARGEST_HERE };
        assert!(largest <= largest_here && mean <= MEAN_HERE, "{name}: {difference:?}");
    }
}

type Change = fn(&mut World, &mut FrameOptions);

/// Small errors that a renderer could make, each in a case that has to reveal it.
const ERRORS: &[(&str, &str, Change)] = &[
    ("one_point_light", "exponent 2 for 1", |world, _| shininess(world, 1.0)),
    ("one_point_light", "attenuation's linear term", |world, _| {
        each_light(world, |light| light.attenuation.linear += 0.01);
    }),
    ("one_point_light", "a viewer at infinity", |world, _| settings(world).local_viewer = false),
    ("one_point_light", "another reflection model", |_, options| {
        options.reflection = Some(ReflectionModel::Phong);
    }),
    ("infinite_viewer", "exponent 11 for 10", |world, _| shininess(world, 1.0)),
    ("infinite_viewer", "a viewer nearby", |world, _| settings(world).local_viewer = true),
    ("infinite_viewer", "no ambient light of lights", |world, _| {
        each_light(world, |light| light.ambient *= 0.0);
    }),
    ("eight_lights_two_sided", "two lights that change places", swap_two_lights),
    ("eight_lights_two_sided", "backs lit as fronts", |world, _| settings(world).two_sided = false),
    ("eight_lights_two_sided", "the back's exponent 31 for 32", |world, _| {
        each_material(world, |material| {
            if let Some(back) = &mut material.back {
                back.shininess -= 1.0;
            }
        });
    }),
    ("fog_linear", "exponent 31 for 32", |world, _| shininess(world, -1.0)),
    ("fog_linear", "fog that ends farther away", |world, _| {
        settings(world).fog.as_mut().unwrap().mode = FogMode::Linear { start: 2.4, end: 5.6 };
    }),
    ("fog_exp", "thicker fog", |world, _| {
        settings(world).fog.as_mut().unwrap().mode = FogMode::Exponential { density: 0.26 };
    }),
    ("fog_exp2", "another fog", |world, _| {
        settings(world).fog.as_mut().unwrap().mode = FogMode::Exponential { density: 0.22 };
    }),
    ("transformed", "a mirrored mesh that is not", |world, _| {
        for mut place in world.query::<&mut Transform>().iter_mut(world) {
            place.scale = place.scale.abs();
        }
    }),
    ("cutoffs", "spot exponents off by one", |world, _| {
        each_cone(world, |_, exponent| *exponent += 1.0);
    }),
    ("cutoffs", "a cutoff of 90 degrees that is 81", |world, _| {
        each_cone(world, |cutoff, _| {
            if (*cutoff - std::f32::consts::FRAC_PI_2).abs() < 1e-6 {
                *cutoff *= 0.9;
            }
        });
    }),
    ("saturated", "colours clamped after interpolation", |_, options| options.display = Display::Linear),
    ("saturated", "exponents off by one", |world, _| shininess(world, -1.0)),
    ("last_vertex", "the first vertex", |_, options| options.flat_rule = Some(FlatRule::FirstVertex)),
    ("last_vertex", "the centroid", |_, options| options.flat_rule = Some(FlatRule::Centroid)),
    ("exponent_0", "exponent 1 for 0", |world, _| shininess(world, 1.0)),
    ("one_sided", "a light that is off", |world, _| each_light(world, |light| light.enabled = true)),
    ("one_sided", "backs that are drawn", |world, _| {
        each_material(world, |material| material.double_sided = true);
    }),
];

#[test]
fn small_errors_show() {
    let mut unseen = Vec::new();
    for (name, error, change) in ERRORS {
        let reference = reference(name);
        let (mut world, mut options) = (reference.world(), opengl_options());
        change(&mut world, &mut options);
        let difference = reference.difference(&mut world, &options);
        println!("{name:24} {error:40} largest {:.4}, mean {:.1e}", difference.largest, difference.mean);
        if equal(&difference) {
            unseen.push(format!("{name}: {error}: {difference:?}"));
        }
    }
    assert!(unseen.is_empty(), "errors that the criterion lets pass: {unseen:#?}");
}

fn settings(world: &mut World) -> Mut<'_, SceneSettings> {
    world.resource_mut::<SceneSettings>()
}

fn each_light(world: &mut World, change: impl Fn(&mut Light)) {
    world.query::<&mut Light>().iter_mut(world).for_each(|mut light| change(&mut light));
}

fn each_cone(world: &mut World, change: impl Fn(&mut f32, &mut f32)) {
    each_light(world, |light| {
        if let Some(SpotCone::Exponent { cutoff, exponent }) = &mut light.spot {
            change(cutoff, exponent);
        }
    });
}

fn each_material(world: &mut World, change: impl Fn(&mut Material)) {
    world.query::<&mut Material>().iter_mut(world).for_each(|mut material| change(&mut material));
}

fn shininess(world: &mut World, by: f32) {
    each_material(world, |material| material.front.shininess += by);
}

fn swap_two_lights(world: &mut World, _: &mut FrameOptions) {
    let mut lights: Vec<_> =
        world.query_filtered::<&mut Transform, With<Light>>().iter_mut(world).take(2).collect();
    let [first, second] = lights.as_mut_slice() else { panic!("the case has two lights") };
    std::mem::swap(&mut **first, &mut **second);
}
