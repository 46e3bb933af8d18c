//! Study of the frames of every camera compared with the ray tree: how large their errors are, and which
//! change would reduce them most. The ray tree is averaged over each pixel, because a reference of one ray per
//! pixel would show the same jagged edges as a frame, and count smooth ones as an error. Interreflected light is studied in `light_transport`.

use bevy_ecs::prelude::*;
use lumbre_optics::{Light, LightKind, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, FrameSettings, Name, SceneSettings};
use lumbre_trace::{TraceOptions, relative_error};

use super::over_scenes_made;
use crate::command_line::quoted;
use crate::findings::{milliseconds, percent};
use crate::frame::Frame;
use crate::frames::draw_frames;
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::mirror_and_glass;
use crate::traced::{ray_tree, traced_world};
use crate::{Conditions, CostError, ErrorOf, ErrorOver, Plot, Point, Quantity, Study};

/// Largest number of cameras of a file that are measured.
const MAX_CAMERAS: usize = 16;
const FEW_CAMERAS: usize = 1;
/// Rays per pixel of the reference.
const SAMPLES: u32 = 16;
/// Seconds for the frames of one camera.
const SECONDS: f64 = 4.0;

/// A frame with its own settings, or with more or fewer effects.
struct Change {
    name: &'static str,
    /// The arguments of `lumbre render` for it.
    arguments: &'static str,
    apply: fn(&mut World, &mut FrameOptions),
}

const AS_IT_IS: &str = "as it is";
const EVERYTHING: &str = "all of these";
const WITHOUT: &str = "without mirrors and glass";

const CHANGES: &[Change] = &[
    Change { name: AS_IT_IS, arguments: "", apply: |_, _| {} },
    Change {
        name: "Phong shading",
        arguments: " --shading phong",
        apply: |_, options| options.shading = Some(Shading::Phong),
    },
    Change {
        name: "a shadow of every lamp",
        arguments: " --every-shadow",
        apply: |world, _| every_lamp_casts(world),
    },
    Change {
        name: "the finest shadow maps",
        arguments: " --shadow-resolution 4",
        apply: |world, _| frame_settings(world, |frame| frame.shadow_resolution = 4.0),
    },
    Change {
        name: "four samples per pixel",
        arguments: " --msaa",
        apply: |_, options| options.multisample = Some(true),
    },
    Change {
        name: "mirrors four deep",
        arguments: " --mirror-depth 4",
        apply: |_, options| options.mirror_depth = 4,
    },
    Change {
        name: EVERYTHING,
        arguments: " --every-shadow --shadow-resolution 4 --shading phong --mirror-depth 4 --msaa",
        apply: |world, options| {
            every_lamp_casts(world);
            frame_settings(world, |frame| frame.shadow_resolution = 4.0);
            (options.shading, options.mirror_depth) = (Some(Shading::Phong), 4);
            options.multisample = Some(true);
        },
    },
    Change {
        name: WITHOUT,
        arguments: " --mirror-depth 0 --no-refraction",
        apply: |_, options| (options.mirror_depth, options.refraction) = (0, false),
    },
];

fn every_lamp_casts(world: &mut World) {
    let mut lights = world.query::<&mut Light>();
    let lamps = lights.iter_mut(world).filter(|light| light.kind != LightKind::Ambient);
    lamps.for_each(|mut light| light.shadow = true);
}

fn frame_settings(world: &mut World, change: fn(&mut FrameSettings)) {
    change(&mut world.get_resource_or_insert_with(SceneSettings::default).frame);
}

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    over_scenes_made(conditions, study(), ("mirror-and-glass", mirror_and_glass), |scene, told, measured| {
        of_scene(conditions, scene, told, measured)
    })
}

fn study() -> Study {
    Study {
        name: "tour".into(),
        title: "Tour of the cameras".into(),
        question: "How large are the errors of the frames of a scene's cameras compared with the ray tree, which has shadows, mirrors and glass? Which single change would reduce each error most, and at what cost?".into(),
        reference: format!("the documents' ray tree, the mean of {SAMPLES} rays per pixel"),
        plots: vec![Plot {
            title: "Error over time".into(),
            across: Quantity::Milliseconds,
            up: Quantity::Error,
            front: true,
            ..Plot::default()
        }],
        ..Study::default()
    }
}

/// Returns the cameras of a scene with their names, or with their numbers if they have none.
fn cameras(world: &mut World) -> Vec<(Entity, String)> {
    let mut found: Vec<_> = world
        .query_filtered::<(Entity, Option<&Name>), With<Camera>>()
        .iter(world)
        .map(|(entity, name)| (entity, name.map(ToString::to_string)))
        .collect();
    found.sort_by_key(|(entity, _)| entity.index_u32());
    let named = |(place, (entity, name)): (usize, (Entity, Option<String>))| {
        (entity, name.unwrap_or_else(|| format!("camera {place}")))
    };
    found.into_iter().enumerate().map(named).collect()
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let all = cameras(&mut scene.open(conditions.aspect())?);
    let stops: Vec<String> = all.into_iter().map(|(_, name)| name).collect();
    let most = conditions.unless_quick(MAX_CAMERAS, FEW_CAMERAS).min(stops.len());
    if most < stops.len() {
        measured.study.notes.push(format!(
            "{} has {} cameras, of which the first {most} were measured.",
            scene.name,
            stops.len()
        ));
    }
    let mut best = vec![0; CHANGES.len()];
    for (place, stop) in stops.iter().take(most).enumerate() {
        let part = |share: f64| before + (after - before) * (place as f64 + share) / most as f64;
        let first = measured.study.points.len();
        of_camera(conditions, scene, (place, stop), [part(0.0), part(1.0)], measured)?;
        let points = &measured.study.points[first..];
        let (told, winner) = findings(stop, points);
        winner.into_iter().for_each(|winner| best[winner] += 1);
        measured.study.findings.extend(told);
    }
    let most_often = (1..CHANGES.len()).max_by_key(|change| best[*change]).filter(|change| best[*change] > 0);
    if let Some(change) = most_often {
        measured.study.findings.push(format!(
            "The single change that helps most at most cameras ({} of {most}): {}.",
            best[change], CHANGES[change].name
        ));
    }
    Ok(())
}

/// Measures the frames of one camera.
fn of_camera(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    (place, stop): (usize, &str),
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let opened = || -> Result<(World, Option<Entity>), CostError> {
        let mut world = scene.open(conditions.aspect())?;
        let camera = cameras(&mut world).get(place).map(|(entity, _)| *entity);
        Ok((world, camera))
    };
    let (mut world, camera) = opened()?;
    let mut exact = |samples| {
        let options = TraceOptions { camera, samples: Some(samples), ..ray_tree(conditions) };
        traced_world(conditions, &mut world, &options).map(|(picture, _)| picture)
    };
    let (exact, rough) = (exact(SAMPLES)?, exact(SAMPLES / 4)?);
    // Were the samples random, the variance of the difference would be three times that of the mean of all
    // samples. Evenly spread ones are better than that.
    let differ = relative_error(&exact.radiance, &rough.radiance);
    let uncertainty = differ / f64::sqrt(3.0);
    let reference = measured.keep_reference(&format!("{} {stop} by rays", scene.name), exact);
    let middle = before + 0.3 * (after - before);
    conditions.tell(middle)?;
    let mut frames = Vec::new();
    for change in CHANGES {
        let (mut world, camera) = opened()?;
        let mut options = FrameOptions { camera, ..FrameOptions::default() };
        (change.apply)(&mut world, &mut options);
        frames.push(Frame::new(world, options).sharing("tour"));
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [middle, after])?;
    for (change, frame) in CHANGES.iter().zip(&drawn) {
        let point = Point {
            series: scene.series(conditions, stop),
            label: change.name.to_owned(),
            milliseconds: frame.spread(),
            error: Some(ErrorOf { uncertainty, ..ErrorOf::default() }),
            counts: frame.counts(),
            command: conditions
                .drawing(scene.in_commands(), &format!(" --camera {}{}", quoted(stop), change.arguments)),
            ..Point::default()
        };
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    Ok(())
}

/// Returns the finding about one camera, whose points are in the order of [`CHANGES`], and the single change
/// that reduces the error most.
fn findings(stop: &str, points: &[Point]) -> (Vec<String>, Option<usize>) {
    let error = |place: usize| points.get(place)?.error.map(|error| error.relative_rmse);
    let time = |place: usize| points.get(place)?.milliseconds;
    let (Some(now), Some(everything)) = (error(0), points.iter().position(|point| point.label == EVERYTHING))
    else {
        return (Vec::new(), None);
    };
    let uncertain = points.first().and_then(|point| point.error).map_or(0.0, |error| error.uncertainty);
    let single = (1..everything).filter_map(|place| Some((place, error(place)?)));
    let best = single
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, left)| *left < (0.99 * now).min(now - uncertain));
    let price = |place: usize| match (time(0), time(place)) {
        (Some(now), Some(then)) => format!(" ({} instead of {})", milliseconds(&then), milliseconds(&now)),
        _ => String::new(),
    };
    let mut said = format!("{stop}: the frame has an error of {} (± {})", percent(now), percent(uncertain));
    match best {
        Some((place, left)) => {
            said += &format!(
                "; the single change that reduces it most is \"{}\", which leaves {}{}",
                CHANGES[place].name,
                percent(left),
                price(place)
            );
        }
        None => said += "; no single change reduces it by more than a hundredth or the uncertainty",
    }
    if let Some(left) = error(everything) {
        said += &format!("; all changes together leave {}", percent(left));
    }
    let without = points.iter().position(|point| point.label == WITHOUT);
    if let Some(bare) = without.and_then(error).filter(|bare| *bare > 1.01 * now) {
        said += &format!("; without mirrors and glass it would be {}", percent(bare));
    }
    (vec![said + "."], best.map(|(place, _)| place))
}
