//! Tests of whole pictures apart from their radiance: auxiliary pictures that sum to the picture, samples
//! distributed by noise, and pictures that are continued with the same bits.

mod support;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::Mutex;
use std::time::Duration;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Fog, FogMode, Light, Material};
use lumbre_scene::{Mesh, Name, Quadric, QuadricShape, SceneSettings, Transform};
use lumbre_trace::{
    Aov, AovValues, CheckpointError, Continuation, Ended, Integrator, Picture, TraceError, TraceOptions,
    TraceReport, Tracer,
};

use support::*;

/// Two lamps, an emissive panel, a glass ball, a mirror, an alpha-blended pane, fog, ambient light and a sky,
/// above a floor.
fn room() -> World {
    let mut world = World::new();
    let fog = Fog { mode: FogMode::Linear { start: 1.0, end: 20.0 }, color: Vec3::new(0.1, 0.2, 0.3) };
    world.insert_resource(SceneSettings {
        ambient: Vec3::splat(0.05),
        background: Vec3::new(0.2, 0.3, 0.4),
        sky: Vec3::splat(0.1),
        fog: Some(fog),
        ..SceneSettings::default()
    });
    let floor = Transform::from_xyz(0.0, -1.0, 0.0);
    exact(&mut world, Quadric::new(QuadricShape::Plane), Material::matt(Vec3::new(0.6, 0.5, 0.4)), floor);
    let ball = exact(&mut world, Quadric::sphere(0.6), glass(1.5), Transform::IDENTITY);
    world.entity_mut(ball).insert(fresnel());
    let thin = shapes::cuboid(Vec3::new(2.0, 2.0, 0.1), 1);
    world.spawn((Mesh(Arc::new(thin)), mirror(0.8), Transform::from_xyz(0.0, 0.0, -2.0)));
    let pane = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..Material::matt(Vec3::splat(0.4)) };
    let upright = Transform::from_xyz(0.8, 0.0, 1.0).looking_at(DVec3::new(0.8, -1.0, 1.0), DVec3::Z);
    world.spawn((Mesh(Arc::new(shapes::plane(0.5, 0.5, 1, 1))), pane, upright));
    let panel = Mesh(Arc::new(shapes::cuboid(Vec3::new(0.5, 0.1, 0.5), 1)));
    world.spawn((Name::new("panel"), panel, glowing(3.0, 0.2), Transform::from_xyz(-1.5, 1.5, 0.0)));
    let mut left = Light::point(Vec3::new(6.0, 5.0, 4.0));
    left.ambient = Vec3::splat(0.3);
    world.spawn((Name::new("left"), left, Transform::from_xyz(-1.5, 2.5, 1.0)));
    let right = Light { radius: 0.1, ..Light::point(Vec3::new(1.0, 2.0, 6.0)) };
    world.spawn((Name::new("right"), right, Transform::from_xyz(1.5, 2.5, 1.0)));
    camera(&mut world, DVec3::new(0.3, 1.0, 3.5), DVec3::ZERO, 1.0);
    world
}

/// Returns the pixels of an auxiliary picture.
fn colors<'p>(picture: &'p Picture, name: &str) -> &'p [DVec3] {
    let found = picture.aovs.iter().find(|found| found.aov.to_string() == name);
    match found.map(|found| &found.values) {
        Some(AovValues::Colors(values) | AovValues::Directions(values)) => values,
        _ => panic!(
            "{name} is not among {:?}",
            picture.aovs.iter().map(|found| &found.aov).collect::<Vec<_>>()
        ),
    }
}

fn asked(names: &[&str]) -> Vec<Aov> {
    names.iter().map(|name| Aov::from_name(name).expect("there is such a picture")).collect()
}

/// Returns the largest difference between a picture and the sum of others, relative to the brightest channel.
fn apart(whole: &[DVec3], parts: &[&[DVec3]]) -> f64 {
    let brightest = whole.iter().fold(0.0_f64, |brightest, pixel| brightest.max(pixel.max_element()));
    let sums = (0..whole.len()).map(|at| parts.iter().map(|part| part[at]).sum::<DVec3>());
    let difference = whole.iter().zip(sums).map(|(whole, sum)| (*whole - sum).abs().max_element());
    difference.fold(0.0, f64::max) / brightest
}

#[test]
fn parts_of_light_sum_up_to_the_picture() {
    let names = ["left", "right", "panel", "background", "ambient"];
    for integrator in [Integrator::Whitted, Integrator::Path] {
        let names = &names[..if integrator == Integrator::Whitted { 5 } else { 4 }];
        let aovs = asked(&["direct", "bounced", "light:*", "direct:*", "indirect:*"]);
        let base = TraceOptions {
            integrator,
            samples: Some(8),
            filter: lumbre_trace::Filter::Mitchell,
            ..options(40)
        };
        let (plain, _) = draw(&mut room(), &base);
        let (picture, _) = draw(&mut room(), &TraceOptions { aovs, ..base });
        assert_eq!(plain.radiance, picture.radiance, "auxiliary pictures change nothing");
        let of_sources = |kind: &str| {
            names.iter().map(|name| colors(&picture, &format!("{kind}:{name}"))).collect::<Vec<_>>()
        };
        let (direct, indirect) = (colors(&picture, "direct"), colors(&picture, "indirect"));
        for (whole, parts) in [
            (&picture.radiance[..], vec![direct, indirect]),
            (direct, of_sources("direct")),
            (indirect, of_sources("indirect")),
            (&picture.radiance, of_sources("light")),
        ] {
            // The rounding errors of as many additions as there are terms.
            let apart = apart(whole, &parts);
            assert!(apart < 1e-12, "{integrator:?}: {apart:e}");
        }
        for name in names.iter().filter(|name| **name != "ambient") {
            let light: f64 = colors(&picture, &format!("light:{name}")).iter().map(|p| p.element_sum()).sum();
            assert!(light > 0.0, "{integrator:?}: {name} is dark");
        }
    }
}

#[test]
fn a_light_alone_is_the_picture_without_the_others() {
    // The ray tree evaluates every lamp independently, so that a lamp's part equals, to within rounding, the
    // picture of a World without the others.
    let aovs = asked(&["light:left"]);
    let (picture, _) = draw(&mut room(), &TraceOptions { aovs, samples: Some(4), ..options(40) });
    let mut world = room();
    world.insert_resource(SceneSettings {
        ambient: Vec3::ZERO,
        background: Vec3::ZERO,
        sky: Vec3::ZERO,
        fog: Some(Fog { mode: FogMode::Linear { start: 1.0, end: 20.0 }, color: Vec3::ZERO }),
        ..SceneSettings::default()
    });
    let mut named = world.query::<(Entity, &Name)>();
    let others: Vec<Entity> = named
        .iter(&world)
        .filter(|(_, name)| ["right"].contains(&name.as_str()))
        .map(|(entity, _)| entity)
        .collect();
    others.into_iter().for_each(|entity| assert!(world.despawn(entity)));
    let mut panels = world.query::<(&Name, &mut Material)>();
    for (_, mut material) in panels.iter_mut(&mut world).filter(|(name, _)| name.as_str() == "panel") {
        material.front.emission = Vec3::ZERO;
    }
    let (alone, _) = draw(&mut world, &TraceOptions { samples: Some(4), ..options(40) });
    let found = apart(&alone.radiance, &[colors(&picture, "light:left")]);
    assert!(found < 1e-12, "{found:e}");
}

#[test]
fn direct_light_of_paths_is_all_that_one_reflection_brings() {
    // A path of depth d has d turns, and samples the lights at its last surface too: at depth 0 it finds the light
    // that one surface reflects, except that of the sky and of the fog in mirrors, which are never sampled as lights.
    let direct_of = |options: &TraceOptions, world: &mut World| {
        let aovs = asked(&["direct"]);
        let (picture, _) = draw(world, &TraceOptions { aovs, ..options.clone() });
        (colors(&picture, "direct").to_vec(), picture.radiance)
    };
    let sum = |pixels: &[DVec3]| pixels.iter().map(|pixel| pixel.element_sum()).sum::<f64>();
    let [of_depth_0, of_depth_1, of_depth_2] =
        [0, 1, 2].map(|depth| TraceOptions { depth: Some(depth), ..paths(32, 16) });
    let mut without_sky = room();
    let mut settings = without_sky.resource_mut::<SceneSettings>();
    (settings.sky, settings.fog) = (Vec3::ZERO, None);
    let (direct, picture) = direct_of(&of_depth_0, &mut without_sky);
    assert!(apart(&picture, &[&direct]) < 1e-12, "a path without turns finds direct light only");
    let (with_weights, _) = direct_of(&paths(32, 16), &mut without_sky);
    // Where a path ends, samples of emissive surfaces are not weighted against the path's own way to them: a
    // different estimate of the same light.
    let relative = sum(&direct) / sum(&with_weights) - 1.0;
    println!("direct light of paths of depth 0 over that of all paths: {:+.2} %", 100.0 * relative);
    assert!(relative.abs() < 0.02, "{relative}");
    // From depth 1 on, all of it is found, that of sky and fog too, and by the same samples: no depth changes it.
    let (direct, picture) = direct_of(&of_depth_1, &mut room());
    let (deeper, _) = direct_of(&of_depth_2, &mut room());
    let (whole, all) = direct_of(&paths(32, 16), &mut room());
    assert!(apart(&whole, &[&direct]) < 1e-12 && apart(&whole, &[&deeper]) < 1e-12);
    assert!(sum(&direct) < 0.999 * sum(&picture), "paths of depth 1 find light of two reflections");
    assert!(sum(&whole) < 0.95 * sum(&all));
}

#[test]
fn what_is_seen_first_is_what_the_scene_says() {
    let aovs = asked(&["albedo", "normal", "depth", "rays"]);
    let mut world = room();
    look_from(&mut world, DVec3::new(0.0, 4.0, 0.01), DVec3::new(0.0, -1.0, 0.01), 0.1);
    let (picture, report) = draw(&mut world, &TraceOptions { aovs, ..options(9) });
    let numbers = |name: &str| match picture.aovs.iter().find(|found| found.aov.to_string() == name) {
        Some(found) => match &found.values {
            AovValues::Numbers(values) => values.clone(),
            other => panic!("{other:?}"),
        },
        None => panic!("{name} is not there"),
    };
    // The top of the ball is 3.4 m below the eye.
    let middle = 4 * 9 + 4;
    assert!((numbers("depth")[middle] - 3.4).abs() < 1e-3, "{}", numbers("depth")[middle]);
    // Seen a centimetre off the ball's centre, with a radius of 60 centimetres.
    let normal = DVec3::new(0.0, (1.0 - 1.0 / 3600.0_f64).sqrt(), 1.0 / 60.0);
    assert!((colors(&picture, "normal")[middle] - normal).length() < 1e-6);
    assert_eq!(colors(&picture, "albedo")[middle], DVec3::ZERO);
    assert_eq!(numbers("rays").iter().sum::<f64>() as u64, report.rays);
    let mut world = room();
    look_from(&mut world, DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 4.0, 0.0), 0.1);
    let (up, _) = draw(&mut world, &TraceOptions { aovs: asked(&["albedo", "depth"]), ..options(2) });
    assert!(up.aovs.iter().any(|found| found.values == AovValues::Numbers(vec![f64::INFINITY; 4])));
    let mut world = room();
    look_from(&mut world, DVec3::new(3.0, 4.0, 0.0), DVec3::new(3.0, -1.0, 0.0), 0.1);
    let (floor, _) = draw(&mut world, &TraceOptions { aovs: asked(&["albedo"]), ..paths(3, 4) });
    let off = colors(&floor, "albedo")[4] - DVec3::new(0.6, 0.5, 0.4);
    assert!(off.abs().max_element() < 1e-6, "{off}");
}

#[test]
fn a_source_that_is_not_there_is_named_with_those_that_are() {
    let options = TraceOptions { aovs: asked(&["light:middle"]), ..options(2) };
    let found = Tracer::new(&mut room(), &options).map(|_| ());
    let Err(TraceError::NoSuchSource { name, known }) = found else { panic!("{found:?}") };
    assert_eq!(name, "middle");
    assert_eq!(known, r#""ambient", "background", "left", "panel", "right""#);
}

/// Traces a picture, interrupts it after `after` calls of the listener, and returns the last checkpoint.
fn interrupted(options: &TraceOptions, from: Option<&[u8]>, after: usize) -> (TraceReport, Vec<u8>) {
    let kept = Mutex::new(Vec::new());
    let told = Mutex::new(0);
    let tracer = Tracer::new(&mut room(), options).expect("the room can be traced");
    let keep = |bytes: &[u8]| *kept.lock().expect("nobody panics") = bytes.to_vec();
    let continuation = Continuation {
        from,
        keep: Some(&keep),
        interval: Duration::from_secs(3600),
        ..Continuation::default()
    };
    let (_, report) = tracer
        .continued(&continuation, &|_| {
            let mut told = told.lock().expect("nobody panics");
            *told += 1;
            if *told > after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .expect("it can be traced");
    let kept = kept.into_inner().expect("nobody panics");
    (report, kept)
}

fn continued(options: &TraceOptions, from: &[u8]) -> Result<(Picture, TraceReport), TraceError> {
    let continuation = Continuation { from: Some(from), ..Continuation::default() };
    Tracer::new(&mut room(), options)?.continued(&continuation, &|_| ControlFlow::Continue(()))
}

#[test]
fn a_picture_that_is_continued_has_the_bits_of_one_that_never_stopped() {
    for sample_by_noise in [false, true] {
        let options = TraceOptions {
            aovs: asked(&["direct", "light:left"]),
            threads: Some(2),
            sample_by_noise,
            ..paths(40, 64)
        };
        let (whole, report) = draw(&mut room(), &options);
        // There are nine tiles per round: the picture is interrupted within the first round, within a later
        // one, and after the samples were distributed by noise.
        let mut kept: Option<Vec<u8>> = None;
        for after in [4, 31, 50] {
            let (report, bytes) = interrupted(&options, kept.as_deref(), after);
            assert_eq!(report.ended, Ended::Interrupted);
            kept = Some(bytes);
        }
        let kept = kept.expect("it was interrupted");
        let (end, of_end) = continued(&options, &kept).expect("it goes on");
        assert_eq!(whole, end);
        assert_eq!((report.samples, report.rays), (of_end.samples, of_end.rays));
        // More samples of the same picture can be added too.
        let more = TraceOptions { samples: Some(96), ..options.clone() };
        assert_eq!(draw(&mut room(), &more).0, continued(&more, &kept).expect("it goes on").0);
    }
}

#[test]
fn samples_of_something_else_are_refused() {
    let options = paths(40, 64);
    let (_, kept) = interrupted(&options, None, 30);
    let refused = |options: &TraceOptions, bytes: &[u8]| match continued(options, bytes) {
        Err(TraceError::Checkpoint(error)) => error,
        other => panic!("{:?}", other.map(|(_, report)| report)),
    };
    assert_eq!(refused(&paths(41, 64), &kept), CheckpointError::Options);
    assert_eq!(refused(&TraceOptions { shadows: false, ..options.clone() }, &kept), CheckpointError::Options);
    let aovs = asked(&["direct"]);
    assert_eq!(refused(&TraceOptions { aovs, ..options.clone() }, &kept), CheckpointError::Options);
    assert_eq!(refused(&options, b"glTF and so on"), CheckpointError::NotSamples);
    assert_eq!(refused(&options, &[]), CheckpointError::NotSamples);
    for end in [9, 100, 139, 200, kept.len() - 1] {
        assert!(matches!(
            refused(&options, &kept[..end]),
            CheckpointError::Damaged | CheckpointError::Version
        ));
    }
    for at in [150, 1000, kept.len() - 1] {
        let mut bytes = kept.clone();
        bytes[at] ^= 1;
        assert_eq!(refused(&options, &bytes), CheckpointError::Damaged);
    }
    let mut bytes = kept.clone();
    bytes[9] ^= 1;
    assert_eq!(refused(&options, &bytes), CheckpointError::Version);
    // Another scene: one lamp is slightly brighter, or one ball slightly larger.
    let change = |change: &dyn Fn(&mut World)| {
        let mut world = room();
        change(&mut world);
        let continuation = Continuation { from: Some(&kept), ..Continuation::default() };
        let tracer = Tracer::new(&mut world, &options).expect("the room can be traced");
        tracer.continued(&continuation, &|_| ControlFlow::Continue(())).map(|_| ())
    };
    assert_eq!(change(&|_| {}), Ok(()));
    let scene = Err(TraceError::Checkpoint(CheckpointError::Scene));
    let brighter = |world: &mut World| {
        let mut lights = world.query::<&mut Light>();
        lights.iter_mut(world).for_each(|mut light| light.diffuse *= 1.0 + f32::EPSILON);
    };
    assert_eq!(change(&brighter), scene);
    let larger = |world: &mut World| {
        let mut balls = world.query::<&mut Quadric>();
        for mut ball in balls.iter_mut(world).filter(|ball| matches!(ball.shape, QuadricShape::Sphere { .. }))
        {
            *ball = Quadric::sphere(0.61);
        }
    };
    assert_eq!(change(&larger), scene);
}

#[test]
fn samples_by_noise_are_true_and_so_is_their_stated_error() {
    // A corner of the picture is noisy; most of it is not. The lamps have no size: light that the ball focuses is too
    // rare for the few samples by which noise is estimated.
    let room = || {
        let mut world = room();
        world.query::<&mut Light>().iter_mut(&mut world).for_each(|mut light| light.radius = 0.0);
        world
    };
    let (reference, _) = draw(&mut room(), &paths(32, 8192));
    let options = |samples, sample_by_noise| TraceOptions { sample_by_noise, ..paths(32, samples) };
    let off = |picture: &Picture| {
        let squares =
            picture.radiance.iter().zip(&reference.radiance).map(|(a, b)| (*a - *b).length_squared());
        let mean: f64 =
            reference.radiance.iter().map(|pixel| pixel.element_sum()).sum::<f64>() / (3.0 * 1024.0);
        (squares.sum::<f64>() / (3.0 * 1024.0)).sqrt() / mean
    };
    let (even, of_even) = draw(&mut room(), &options(256, false));
    let (by_noise, of_noise) = draw(&mut room(), &options(256, true));
    let [stated_even, stated] =
        [&of_even, &of_noise].map(|report| report.standard_error.expect("it is stated"));
    let (off_even, found) = (off(&even), off(&by_noise));
    println!("evenly: stated {stated_even:.4}, found {off_even:.4}, {} rays", of_even.rays);
    println!(
        "by noise: stated {stated:.4}, found {found:.4}, {} rays, samples {:?}",
        of_noise.rays, of_noise.samples
    );
    // The same number of samples on average, with longer paths among them, and a smaller error.
    let more = of_noise.rays as f64 / of_even.rays as f64;
    assert!((0.9..1.3).contains(&more), "{more} times the rays");
    assert!(of_noise.samples[0] < 200 && of_noise.samples[1] > 300, "{:?}", of_noise.samples);
    assert!(found < 0.95 * off_even, "{found} for {off_even}");
    // The reported error is the measured one, within the uncertainty of a thousand pixels of which few are
    // noisy.
    assert!((0.7..1.4).contains(&(found / stated)), "{found} stated as {stated}");
    // No bias: the mean over all pixels differs by no more than its own standard error allows.
    let bias = |picture: &Picture| {
        let sum = |pixels: &[DVec3]| pixels.iter().map(|pixel| pixel.element_sum()).sum::<f64>();
        sum(&picture.radiance) / sum(&reference.radiance) - 1.0
    };
    let of_mean = stated / 32.0;
    println!("bias {:+.2e}, standard error of it {of_mean:.1e}", bias(&by_noise));
    assert!(bias(&by_noise).abs() < 5.0 * of_mean);
}

/// Returns the root mean square difference of two pictures.
fn rms(a: &Picture, b: &Picture) -> f64 {
    let squares = a.radiance.iter().zip(&b.radiance).map(|(a, b)| (*a - *b).length_squared());
    (squares.sum::<f64>() / (3.0 * a.radiance.len() as f64)).sqrt()
}

#[test]
fn adaptive_samples_have_a_smaller_error_at_edges_for_the_same_rays() {
    // Glowing boxes, turned so that no edge follows the pixels, before a dark background: all error is at edges.
    let scene = || {
        let mut world = World::new();
        for number in 0..4 {
            let turned = glam::DQuat::from_rotation_z(0.3 + 0.4 * f64::from(number));
            let place = Transform::from_xyz(f64::from(number) - 1.5, 0.1, 0.0).with_rotation(turned);
            let mesh = Mesh(Arc::new(shapes::cuboid(Vec3::splat(0.5), 1)));
            world.spawn((mesh, glowing(0.2 + 0.2 * number as f32, 0.0), place));
        }
        camera(&mut world, DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 0.7);
        world
    };
    let evenly = |samples: u32| TraceOptions { samples: Some(samples), ..options(64) };
    let (reference, _) = draw(&mut scene(), &TraceOptions { seed: 99, ..evenly(4096) });
    let (mut adaptive_error, mut even_error) = (0.0, 0.0);
    for seed in 0..4 {
        let asked = TraceOptions { adaptive: Some(0.02), seed, ..evenly(64) };
        let (adaptive, report) = draw(&mut scene(), &asked);
        let per_pixel = (report.rays as f64 / (64.0 * 64.0)).ceil();
        assert!(report.samples == [16, 64] && per_pixel < 32.0, "{:?}, {per_pixel} rays", report.samples);
        // At least as many rays.
        let (even, even_report) = draw(&mut scene(), &TraceOptions { seed, ..evenly(per_pixel as u32) });
        assert!(even_report.rays >= report.rays);
        adaptive_error += rms(&adaptive, &reference).powi(2);
        even_error += rms(&even, &reference).powi(2);
    }
    println!(
        "adaptive: {:.2} of the error of evenly distributed samples",
        (adaptive_error / even_error).sqrt()
    );
    // Without the second pass the error would be that of 16 samples, which is larger.
    assert!(adaptive_error < 0.7 * even_error, "{adaptive_error:e} for {even_error:e}");
}

#[test]
fn pictures_that_end_at_an_error_are_unbiased_within_a_tenth_of_it() {
    // A picture may end when it happens to look less noisy than it is, which could favour dark ones.
    let mut world = World::new();
    exact(
        &mut world,
        Quadric::new(QuadricShape::Plane),
        Material::matt(Vec3::splat(0.6)),
        Transform::IDENTITY,
    );
    let panel = Mesh(Arc::new(shapes::cuboid(Vec3::new(0.6, 0.02, 0.6), 1)));
    world.spawn((panel, glowing(5.0, 0.2), Transform::from_xyz(0.4, 1.2, 0.0)));
    let ball = Transform::from_xyz(-0.5, 0.5, 0.0);
    exact(
        &mut world,
        Quadric::sphere(0.5),
        Material { mirror: Vec3::splat(0.4), ..Material::matt(Vec3::splat(0.3)) },
        ball,
    );
    furnace(&mut world, 0.02);
    camera(&mut world, DVec3::new(0.0, 1.0, 3.0), DVec3::new(0.0, 0.4, 0.0), 0.6);
    let side = 6;
    let mean = |picture: &Picture| {
        picture.radiance.iter().map(|pixel| pixel.element_sum()).sum::<f64>()
            / (3.0 * picture.radiance.len() as f64)
    };
    // The mean of pictures with different seeds, and its standard error.
    let mut over = |seeds: std::ops::Range<u32>, asked: TraceOptions| {
        let count = f64::from(seeds.end - seeds.start);
        let means: Vec<f64> =
            seeds.map(|seed| mean(&draw(&mut world, &TraceOptions { seed, ..asked.clone() }).0)).collect();
        let middle = means.iter().sum::<f64>() / count;
        let squares: f64 = means.iter().map(|own| (own - middle).powi(2)).sum();
        (middle, (squares / (count * (count - 1.0))).sqrt())
    };
    let (truth, uncertain) = over(1000..1016, paths(side, 1024));
    let error = 0.15;
    let (found, own) = over(1..301, TraceOptions { error: Some(error), ..paths(side, 1 << 14) });
    let (bias, sigma) = ((found - truth) / truth, own.hypot(uncertain) / truth);
    println!("--error {error}: bias {:.3} % ± {:.3} %", 100.0 * bias, 100.0 * sigma);
    assert!(sigma < 0.05 * error, "the test sees nothing: {sigma}");
    assert!(bias.abs() < 0.1 * error + 2.0 * sigma, "{error}: {bias} ± {sigma}");
}
