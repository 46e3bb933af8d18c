//! `lumbre_trace`'s path tracer against the tests' own, which shares no code with it: the irradiance at random points of
//! small generated rooms, each with light of another kind. Every point is judged by the standard errors of both.

#![allow(clippy::print_stdout, reason = "how far the two are apart is what one wants to see of it")]

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DQuat, DVec2, DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, BakeMode, Light, Material, SpotCone};
use lumbre_scene::{
    Camera, Image, MaterialTextures, Medium, Mesh, Projection, Sampler, SceneSettings, StaticObject,
    TextureReference, Transform, Wrap,
};
use lumbre_trace::{Integrator, TraceOptions, Tracer};
use rayon::prelude::*;

use crate::common::shapes::room;
use crate::held_out::path_tracer::{Effort, Irradiance, PathTracer};
use crate::held_out::random::Random;
use crate::scene_parts::matt;

/// The inner size of a room about the origin, metres.
const ROOM: Vec3 = Vec3::new(4.0, 3.0, 5.0);
/// Points per room.
const POINTS: usize = 16;
/// Samples of each of the four pixels with which the tracer finds the light of a point. Its standard error follows
/// from passes of four samples.
const SAMPLES: u32 = 4096;
/// The other one's batches, and paths along a side of each one's grid.
const BATCHES: usize = 200;
const SIDE: usize = 9;
/// A channel of a point may be this many standard errors off. Of as many normally distributed numbers as are compared
/// here, one is farther off in fewer than one of a thousand runs.
const SIGMAS: f64 = 5.0;
/// Channels that are compared at the most.
const MOST_CHANNELS: usize = 1000;

/// A room, with the places at which its light is compared.
struct Subject {
    name: &'static str,
    build: fn() -> World,
}

const SUBJECTS: [Subject; 6] = [
    Subject { name: "panel", build: lit_by_a_panel },
    Subject { name: "screen", build: lit_by_a_screen },
    Subject { name: "lamps", build: lit_by_lamps },
    Subject { name: "round lamps", build: lit_by_round_lamps },
    Subject { name: "sky and sun", build: lit_by_sky_and_sun },
    Subject { name: "sheets", build: lit_through_sheets },
];

fn spawn(world: &mut World, mesh: lumbre_mesh::TriangleMesh, material: Material, place: Transform) {
    world.spawn((Mesh(Arc::new(mesh)), material, place, StaticObject));
}

fn lamp(world: &mut World, light: Light, at: [f64; 3], towards: [f64; 3]) {
    let place = Transform::from_translation(DVec3::from(at)).looking_at(DVec3::from(towards), DVec3::X);
    world.spawn((Light { bake: BakeMode::Static, ..light }, place));
}

/// A closed room with two tilted blocks that hang in the air.
fn closed() -> World {
    let mut world = World::new();
    let walls = matt(Vec3::new(0.7, 0.55, 0.3), Vec3::ZERO);
    spawn(&mut world, room(ROOM), walls, Transform::IDENTITY);
    hang_blocks(&mut world);
    world
}

fn hang_blocks(world: &mut World) {
    for (size, at, turn) in [
        (Vec3::new(0.9, 1.1, 0.6), DVec3::new(-0.6, -0.5, 0.7), 0.4),
        (Vec3::new(0.5, 0.4, 1.6), DVec3::new(0.8, 0.1, -0.8), 1.1),
    ] {
        let place = Transform::from_translation(at)
            .with_rotation(DQuat::from_rotation_y(turn) * DQuat::from_rotation_x(0.7 * turn));
        spawn(world, shapes::cuboid(size, 1), matt(Vec3::new(0.2, 0.5, 0.8), Vec3::ZERO), place);
    }
}

/// Facing down below the ceiling.
fn below_the_ceiling() -> Transform {
    Transform::from_xyz(0.4, 1.3, 0.3).with_rotation(DQuat::from_rotation_x(PI))
}

fn lit_by_a_panel() -> World {
    let mut world = closed();
    let panel = matt(Vec3::splat(0.5), Vec3::new(9.0, 8.0, 6.0));
    spawn(&mut world, shapes::plane(1.2, 0.8, 3, 2), panel, below_the_ceiling());
    world
}

/// A picture of random colours on a tilted screen, scaled and mirrored by its transform.
fn lit_by_a_screen() -> World {
    let mut world = closed();
    let mut random = Random::new(3);
    let (width, height) = (12, 7);
    let bright = |_| if random.uniform() < 0.3 { (255.0 * random.uniform()) as u8 } else { 20 };
    let rgba = (0..4 * width * height).map(bright).collect();
    let texture = TextureReference {
        sampler: Sampler { wrap_u: Wrap::ClampToEdge, wrap_v: Wrap::ClampToEdge, ..Sampler::default() },
        ..TextureReference::new(Arc::new(Image { name: "screen".into(), width, height, rgba }))
    };
    let textures = MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() };
    let place = Transform::from_xyz(-1.7, 0.2, -0.4)
        .with_rotation(DQuat::from_rotation_z(-1.3))
        .with_scale(DVec3::new(1.3, 1.0, -1.7));
    let mesh = Mesh(Arc::new(shapes::plane(1.0, 1.0, 2, 2)));
    world.spawn((mesh, matt(Vec3::splat(0.1), Vec3::splat(20.0)), textures, place, StaticObject));
    world
}

fn lit_by_lamps() -> World {
    let mut world = closed();
    let color = Vec3::new(1.0, 0.8, 0.6);
    let ranged = |light: Light, range: f32| {
        let attenuation = lumbre_optics::Attenuation { range, ..light.attenuation };
        Light { attenuation, ..light }
    };
    lamp(&mut world, ranged(Light::point(color), 4.0), [1.2, 0.9, 1.4], [0.0; 3]);
    let smooth = SpotCone::Smooth { inner: 0.3, outer: 0.7 };
    lamp(
        &mut world,
        Light { spot: Some(smooth), ..Light::point(2.0 * color) },
        [-1.0, 1.2, -1.5],
        [0.2, -1.0, 0.0],
    );
    let of_opengl = SpotCone::Exponent { cutoff: 0.9, exponent: 3.0 };
    let spot = Light { spot: Some(of_opengl), ..Light::point(Vec3::new(0.3, 0.6, 2.0)) };
    lamp(&mut world, spot, [0.0, 1.3, 2.0], [0.5, -1.5, 0.5]);
    world
}

fn lit_by_round_lamps() -> World {
    let mut world = closed();
    let color = Vec3::new(1.5, 1.0, 0.7);
    lamp(&mut world, Light { radius: 0.3, ..Light::point(color) }, [1.3, 0.8, 1.5], [0.0; 3]);
    lamp(&mut world, Light { radius: 0.1, ..Light::point(color) }, [-1.2, 0.9, -1.8], [0.0; 3]);
    world
}

/// Without a ceiling, with a sail that is lit on both sides.
fn lit_by_sky_and_sun() -> World {
    let mut world = World::new();
    let mut walls = room(ROOM);
    let top = 0.5 * ROOM.y;
    let is_ceiling = |triangle: &[u32]| triangle.iter().all(|&v| walls.positions[v as usize].y > 0.99 * top);
    walls.indices = walls.indices.chunks_exact(3).filter(|t| !is_ceiling(t)).flatten().copied().collect();
    spawn(&mut world, walls, matt(Vec3::new(0.7, 0.55, 0.3), Vec3::ZERO), Transform::IDENTITY);
    hang_blocks(&mut world);
    let sail = Material { double_sided: true, ..matt(Vec3::new(0.8, 0.3, 0.3), Vec3::ZERO) };
    let place = Transform::from_xyz(0.3, 1.0, 0.9).with_rotation(DQuat::from_rotation_z(0.5));
    spawn(&mut world, shapes::plane(1.4, 1.1, 1, 1), sail, place);
    world.insert_resource(SceneSettings { sky: Vec3::new(0.4, 0.6, 1.0), ..SceneSettings::default() });
    let sun = Light { angle: 0.15, ..Light::directional(Vec3::new(3.0, 2.5, 2.0)) };
    lamp(&mut world, sun, [0.0; 3], [0.5, -1.0, 0.3]);
    lamp(&mut world, Light::directional(Vec3::splat(0.5)), [0.0; 3], [-0.4, -1.0, -0.6]);
    world
}

/// A panel and a lamp behind a coloured sheet of glass, a pane that covers in part, and a pane over the panel itself.
fn lit_through_sheets() -> World {
    let mut world = lit_by_a_panel();
    lamp(&mut world, Light::point(Vec3::splat(0.7)), [-1.2, 1.2, 1.8], [0.0; 3]);
    lamp(&mut world, Light { radius: 0.2, ..Light::point(Vec3::splat(0.7)) }, [1.4, 1.1, -1.8], [0.0; 3]);
    let glass = Material { transmission: Vec3::new(0.3, 0.6, 0.5), ..matt(Vec3::splat(0.2), Vec3::ZERO) };
    let place = Transform::from_xyz(0.9, 0.9, -0.2).with_rotation(DQuat::from_rotation_z(0.3));
    let mesh = Mesh(Arc::new(shapes::plane(1.6, 1.9, 1, 1)));
    world.spawn((mesh, glass, Medium { thin: true, ..Medium::default() }, place, StaticObject));
    let pane = |alpha: f32| Material {
        alpha,
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..matt(Vec3::new(0.6, 0.2, 0.4), Vec3::ZERO)
    };
    let tilted = Transform::from_xyz(-0.7, 0.8, 0.9).with_rotation(DQuat::from_rotation_x(0.5));
    spawn(&mut world, shapes::plane(1.5, 1.3, 2, 1), pane(0.6), tilted);
    // Over a part of the panel. In its very plane the other path tracer would not know which of them is on top.
    let over =
        Transform { translation: below_the_ceiling().translation - 2e-3 * DVec3::Y, ..below_the_ceiling() };
    spawn(&mut world, shapes::plane(0.6, 0.8, 1, 2), Material { double_sided: false, ..pane(0.5) }, over);
    world
}

/// Random places on the walls, the floor and the ceiling, if there is one, with their normals.
fn places(number: u64, has_ceiling: bool) -> Vec<(DVec3, DVec3)> {
    let mut random = Random::new(100 + number);
    let half = 0.5 * ROOM.as_dvec3();
    let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::Z, DVec3::NEG_Z, DVec3::NEG_Y];
    let count = if has_ceiling { 6 } else { 5 };
    let place = |index: usize| {
        let normal = sides[index % count];
        let mut coordinate = || random.between(-0.97, 0.97);
        let inside = half * DVec3::new(coordinate(), coordinate(), coordinate());
        (inside * (DVec3::ONE - normal.abs()) - half * normal, normal)
    };
    (0..POINTS).map(place).collect()
}

/// The irradiance of a point as `lumbre_trace` finds it, with its standard error.
fn traced(build: fn() -> World, position: DVec3, normal: DVec3) -> [DVec3; 2] {
    let mut world = build();
    let projection = Projection::Perspective { vertical_fov: 1e-4, aspect: None, near: 1e-6, far: None };
    let eye = Transform::from_translation(position + 2e-3 * normal);
    let up = normal.any_orthonormal_vector();
    world.spawn((Camera { projection, exposure: 1.0 }, eye.looking_at(position, up)));
    let options = TraceOptions {
        integrator: Integrator::Path,
        samples: Some(SAMPLES),
        size: (2, 2),
        threads: Some(1),
        ..TraceOptions::default()
    };
    let tracer = Tracer::new(&mut world, &options).expect("the world can be traced");
    let hit = tracer.first_hit(DVec2::ONE).expect("the eye sees the surface before it");
    assert!(hit.position.distance(position) < 1e-4, "{} instead of {position}", hit.position);
    let (picture, _) = tracer.picture(&|_| ControlFlow::Continue(())).expect("it is traced");
    let errors = picture.standard_error.expect("there are passes enough");
    let pixels = picture.radiance.len() as f64;
    let radiance = picture.radiance.iter().sum::<DVec3>() / pixels;
    let error = errors.iter().map(|error| *error * *error).sum::<DVec3>().map(f64::sqrt) / pixels;
    [radiance * PI / hit.albedo, error * PI / hit.albedo]
}

/// The differences of one scene's channels, in W/m², with their standard errors.
#[derive(Clone, Default)]
struct Differences {
    differences: Vec<f64>,
    errors: Vec<f64>,
    /// The sum of the light of all channels.
    light: f64,
}

impl Differences {
    /// Compares what the tracer found, times a factor, with what the other one did.
    fn of(traced: &[[DVec3; 2]], other: &[Irradiance], factor: f64) -> Self {
        let mut all = Self::default();
        for ([value, error], other) in traced.iter().zip(other) {
            for channel in 0..3 {
                all.differences.push(factor * value[channel] - other.value[channel]);
                // Where no light is scattered, both are as exact as f32 positions.
                let exact = 1e-5 * other.value[channel];
                all.errors.push((factor * error[channel]).hypot(other.error[channel]).hypot(exact));
                all.light += other.value[channel];
            }
        }
        all
    }

    fn worst(&self) -> f64 {
        let sigmas = self.differences.iter().zip(&self.errors).map(|(off, error)| off.abs() / error);
        sigmas.fold(0.0, f64::max)
    }

    /// The sum of the differences in units of its standard error. The channels of a point may be wholly dependent on each
    /// other, for which three times the variance is a bound.
    fn bias(&self) -> f64 {
        let variance: f64 = self.errors.iter().map(|error| error * error).sum();
        self.differences.iter().sum::<f64>() / (3.0 * variance).sqrt()
    }

    fn mean_square(&self) -> f64 {
        let squares = self.differences.iter().zip(&self.errors).map(|(off, error)| (off / error).powi(2));
        squares.sum::<f64>() / self.differences.len() as f64
    }

    fn agree(&self) -> bool {
        self.worst() < SIGMAS && self.bias().abs() < SIGMAS
    }
}

#[test]
fn two_path_tracers_agree_in_every_kind_of_light() {
    let mut of_all = Differences::default();
    for (number, subject) in (0..).zip(&SUBJECTS) {
        let places = places(number, subject.name != "sky and sun");
        let other = PathTracer::new(&mut (subject.build)()).at(&places, Effort::fixed(BATCHES, SIDE), number);
        let traced: Vec<[DVec3; 2]> =
            places.par_iter().map(|(position, normal)| traced(subject.build, *position, *normal)).collect();
        let found = Differences::of(&traced, &other, 1.0);
        let percent = |sum: f64| 100.0 * sum / found.light;
        println!(
            "{}: worst {:.1} sigma, bias {:.2} % ({:.1} sigma), mean square {:.2}, error of a channel {:.2} %",
            subject.name,
            found.worst(),
            percent(found.differences.iter().sum()),
            found.bias(),
            found.mean_square(),
            percent(found.errors.iter().sum()),
        );
        assert!(found.agree(), "{}: {:?}", subject.name, found.differences);
        // Negative control: light that is 3 % off would be found in every scene.
        assert!(!Differences::of(&traced, &other, 1.03).agree(), "{}: the test sees nothing", subject.name);
        of_all.differences.extend(found.differences);
        of_all.errors.extend(found.errors);
    }
    let count = of_all.differences.len();
    assert!((200..MOST_CHANNELS).contains(&count), "{count} channels");
    // The stated errors are true: the squares of differences in their units are 1 on average, of which the channels of
    // 96 points determine the mean to about a seventh.
    let mean_square = of_all.mean_square();
    assert!((0.4..1.7).contains(&mean_square), "{mean_square}");
}

#[test]
fn a_fault_of_one_kind_is_found() {
    // Negative control: the same room to both, but with a pane whose alpha differs by a tenth.
    let panes = || {
        let mut world = lit_through_sheets();
        for mut material in world.query::<&mut Material>().iter_mut(&mut world) {
            if material.alpha_mode == AlphaMode::Blend {
                material.alpha += 0.1;
            }
        }
        world
    };
    let places = places(5, true);
    let other = PathTracer::new(&mut lit_through_sheets()).at(&places, Effort::fixed(BATCHES, SIDE), 5);
    let traced: Vec<[DVec3; 2]> =
        places.par_iter().map(|(position, normal)| traced(panes, *position, *normal)).collect();
    let found = Differences::of(&traced, &other, 1.0);
    println!(
        "panes that are a tenth denser: worst {:.1} sigma, bias {:.1} sigma",
        found.worst(),
        found.bias()
    );
    assert!(!found.agree());
}
