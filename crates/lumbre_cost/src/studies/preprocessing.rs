//! Study of interreflected light, which is computed before the game: what it costs a frame, how long a bake
//! takes, and how long it takes again after something in the level has moved. The relation between a bake's
//! time and its error is studied in `bake`.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, Samples, baked_meshes};
use lumbre_optics::Material;
use lumbre_render::FrameOptions;
use lumbre_scene::{ChildOf, EmissiveLight, GlobalTransform, Mesh, Name, SceneSettings, Transform};

use super::bake::{ERROR, QUICK_ERROR, quick_reference_seconds, reference_time, texels_of_room};
use super::over_scenes;
use crate::bake_once::keep_bake;
use crate::baked::{
    Baked, bake_arguments, bake_direct_light, bake_options, bake_world, few_bakes, maps_of, nothing_to_bake,
    picture_of_maps, texel_error,
};
use crate::bounce_by_bounce::{BounceByBounce, not_followed};
use crate::converged_bake::{converged, converged_bake};
use crate::findings::{error_of, factor, listed, milliseconds, percent, ratio_of, rounded, times_of};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames, draw_picture};
use crate::measured::Measured;
use crate::picture::Picture;
use crate::rounds::{Repeated, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::{Air, two_rooms};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

const SECONDS: f64 = 4.0;
/// Distance by which an object moves, as a fraction of its longest side.
const STEP: f64 = 0.1;
const FRAME: &str = "frame";
const BAKE: &str = "bake after a change";
const BEFORE: &str = "baked before, ms";
const BOUNCES: &str = "bounces in the lightmaps";
/// How many bounces lightmaps have, one after the other.
const COUNTS: &[u32] = &[0, 1, 2, 3, 4, 8];
const FEW_COUNTS: &[u32] = &[0, 1, 2];
/// Rays from a texel by which light bounces.
const RAYS: usize = 256;
const FEW_RAYS: usize = 64;

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    over_scenes(conditions, study(conditions), ("room", Air::Clear), |scene, told, measured| {
        of_scene(conditions, scene, told, measured)
    })
}

fn study(conditions: &Conditions<'_>) -> Study {
    let plot = |title: &str, series: &[&str]| Plot {
        title: title.into(),
        across: Quantity::Milliseconds,
        up: Quantity::Error,
        series: series.iter().map(|name| (*name).to_owned()).collect(),
        front: true,
        ..Plot::default()
    };
    // With several files, series have the names of their scenes.
    let plots = match conditions.files.len() > 1 {
        true => vec![plot("Error over time", &[])],
        false => vec![
            plot("Frames: error over time", &[FRAME]),
            Plot {
                across: Quantity::Figure(BEFORE.into()),
                ..plot("Bounces in the lightmaps: error over the time of the bake", &[FRAME])
            },
            plot("Bakes after a change: error over time", &[BAKE]),
        ],
    };
    Study {
        name: "preprocessing".into(),
        title: "Interreflected light, baked before the game".into(),
        question: "Interreflected light is baked once and read in every frame. What does it cost a frame, how long does the bake take, what does each bounce take and bring, and how long does it take again when something has moved?".into(),
        reference: "for frames, the frame with the lightmaps of a converged bake; for bakes after a change, a converged bake of the changed level, whose own noise is subtracted".into(),
        plots,
        ..Study::default()
    }
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    if let Some(why) = nothing_to_bake(conditions, scene)? {
        measured.study.notes.push(why);
        return Ok(());
    }
    let part = |share: f64| before + share * (after - before);
    let few = few_bakes(conditions, scene)?;
    let has_few = few.is_some();
    measured.study.notes.extend(few.map(|why| {
        format!(
            "{why} After a change it bakes once, for an error of {} instead of {}.",
            percent(QUICK_ERROR),
            percent(ERROR)
        )
    }));
    let options = BakeOptions {
        error: conditions.unless_quick(ERROR, QUICK_ERROR),
        ..bake_options(conditions, scene, texels_of_room(conditions))?
    };
    // The converged bake does not depend on the requested error.
    let options_of_truth = converged(conditions, &options, reference_time(conditions, has_few));
    let (mut baked, samples) =
        bake_world(conditions, scene.open(conditions.aspect())?, &options, None, [part(0.0), part(0.1)])?;
    keep_bake(conditions, scene, &options, &mut baked);
    let truth = converged_bake(conditions, scene, &options_of_truth, [part(0.1), part(0.3)])?;
    let truth = truth.picture.clone();
    let first = measured.study.points.len();
    let bounced = by_bounces(conditions, scene, &options, [part(0.3), part(0.35)], measured)?;
    let shares = bounced.iter().map(|bounced| bounced.share).collect::<Vec<_>>();
    let drawn =
        frames(conditions, scene, (baked, bounced), &options, truth, [part(0.35), part(0.5)], measured)?;
    let points = &measured.study.points[first..];
    let mut findings = findings_of_frames(&scene.name, points, &drawn);
    findings.extend(finding_of_bounces(&scene.name, points, &drawn, &shares));
    measured.study.findings.extend(findings);
    match conditions.files.is_empty() {
        true => {
            // In a single room hardly any light stays the same, whatever moves.
            let rooms = SceneFile::made(conditions, "two-rooms", two_rooms())?;
            let options = options_of(conditions, &rooms, 2.0)?;
            after_a_change(conditions, &rooms, &options, None, [part(0.5), part(1.0)], measured)
        }
        false if has_few => {
            after_a_change(conditions, scene, &options, Some(samples), [part(0.5), part(1.0)], measured)
        }
        false => {
            let options = options_of(conditions, scene, 1.0)?;
            after_a_change(conditions, scene, &options, None, [part(0.5), part(1.0)], measured)
        }
    }
}

/// Returns the options of bakes before and after a change, for a level that is this many times as large as one room.
/// With a larger error there would hardly be any rays that reusing a former bake could save.
fn options_of(conditions: &Conditions<'_>, scene: &SceneFile, rooms: f64) -> Result<BakeOptions, CostError> {
    let texels = rooms * conditions.unless_quick(4_000.0, 700.0);
    Ok(BakeOptions { error: ERROR, ..bake_options(conditions, scene, texels)? })
}

/// Moves an object of a scene, and bakes the scene from scratch and by reusing a former bake. Where each bake takes
/// seconds, `known` are the samples of a former bake with these options, if it left any, and each bake is made once.
fn after_a_change(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &BakeOptions,
    known: Option<Option<Samples>>,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let part = |share: f64| before + share * (after - before);
    let open = || scene.open(conditions.aspect());
    let Some(moved) = moved(&mut open()?) else {
        let note = format!("Nothing in {} could be moved: everything shines or moves already.", scene.name);
        measured.study.notes.push(note);
        return Ok(());
    };
    let has_few = known.is_some();
    let samples = match known {
        Some(samples) => samples,
        None => bake_world(conditions, open()?, options, None, [part(0.0), part(0.1)])?.1,
    };
    let Some(samples) = samples else {
        measured
            .study
            .notes
            .push(format!("The bake of {} left no samples that could be reused.", scene.name));
        return Ok(());
    };
    let changed = || -> Result<World, CostError> {
        let mut world = open()?;
        self::moved(&mut world);
        Ok(world)
    };
    let first = measured.study.points.len();
    let time = conditions.reference_time(8.0, quick_reference_seconds(has_few));
    let options_of_truth = converged(conditions, options, time);
    let (mut truth, _) = bake_world(conditions, changed()?, &options_of_truth, None, [part(0.1), part(0.4)])?;
    let drawn = draw_picture(conditions, &mut truth.world, &FrameOptions::default())?;
    let reference = measured.keep_reference(&format!("{} changed, converged", scene.name), drawn);
    let truth = maps_of(&mut truth.world);
    let reference_maps =
        measured.keep_reference(&format!("{} changed, converged maps", scene.name), picture_of_maps(&truth));
    let formers = [None, Some(&samples)];
    let repetitions = if has_few { 1 } else { conditions.repetitions() };
    let done = repeated(formers.len(), repetitions, |place, [from, to]| {
        let told = [from, to].map(|share| part(0.4 + 0.6 * share));
        let (baked, _) = bake_world(conditions, changed()?, options, formers[place], told)?;
        Ok((1e3 * baked.report.seconds, baked))
    })?;
    let whole_for = done.last().and_then(|of_change| of_change.made.report.rebake.as_ref());
    if let Some(why) = whole_for.map(|rebake| &rebake.whole).filter(|why| !why.is_empty()) {
        measured.study.notes.push(format!("No samples of {} were reused: {why}.", scene.name));
    }
    let labels = [format!("whole, {moved} moved"), format!("what {moved} changed")];
    for (Repeated { times, made: mut baked }, label) in done.into_iter().zip(labels) {
        let maps = maps_of(&mut baked.world);
        let error = texel_error(&maps, &truth);
        let frame = draw_picture(conditions, &mut baked.world, &FrameOptions::default())?;
        let point = Point {
            series: scene.series(conditions, BAKE),
            label,
            milliseconds: Spread::of(&times),
            error,
            counts: [
                ("rays".to_owned(), baked.report.rays as f64),
                ("texels".to_owned(), baked.report.texels as f64),
            ]
            .into(),
            command: conditions.again("preprocessing"),
            ..Point::default()
        };
        measured.add_maps(point, (frame, &reference), (picture_of_maps(&maps), &reference_maps))?;
    }
    let finding = finding_of_change(&scene.name, &moved, &measured.study.points[first..]);
    measured.study.findings.extend(finding);
    Ok(())
}

/// A scene whose lightmaps have the direct light and some bounces.
struct Bounced {
    world: World,
    bounces: u32,
    /// Milliseconds until they had them.
    before: f64,
    /// The light of the last bounce as a share of all light so far.
    share: f64,
}

/// Bakes direct light, and adds bounces one by one. Nothing if the scene's bounces cannot be followed so.
fn by_bounces(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &BakeOptions,
    told: [f64; 2],
    measured: &mut Measured,
) -> Result<Vec<Bounced>, CostError> {
    if let Some(why) = not_followed(&mut scene.open(conditions.aspect())?) {
        measured.study.notes.push(format!("There are no single bounces of {}: {why}.", scene.name));
        return Ok(Vec::new());
    }
    let Baked { world: mut direct, report } = bake_direct_light(conditions, scene, options, told)?;
    let mut light = BounceByBounce::new(&mut direct, conditions.unless_quick(RAYS, FEW_RAYS));
    measured.study.notes.push(format!(
        "Single bounces: the baker leaves out all of them, and then {} rays from each of the {} texels that show a surface gather one bounce after the other; textures reflect by their mean, and backs of surfaces reflect nothing. With lightmaps without a number of bounces, the baker has solved for all of them.",
        light.rays(),
        light.texels()
    ));
    let mut before = 1e3 * report.seconds;
    let (mut bounces, mut bounced) = (0, Vec::new());
    for &count in conditions.unless_quick(COUNTS, FEW_COUNTS) {
        if bounces == 0 && count > 0 {
            before += light.cast_ms;
        }
        while bounces < count {
            before += light.bounce();
            bounces += 1;
        }
        let mut world = scene.open(conditions.aspect())?;
        light.show(&mut direct, &mut world);
        let share = if count > 0 { light.share_of_last() } else { 1.0 };
        bounced.push(Bounced { world, bounces, before, share });
    }
    Ok(bounced)
}

/// Measures frames: with lamps only, with the constant ambient light that comes closest to the reference, with
/// lightmaps, and with lightmaps that have some bounces only.
fn frames(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    (baked, bounced): (Baked, Vec<Bounced>),
    options: &BakeOptions,
    truth: Picture,
    told: [f64; 2],
    measured: &mut Measured,
) -> Result<Vec<DrawnFrame>, CostError> {
    let draw = FrameOptions::default();
    let with_ambient = |ambient: Vec3| -> Result<World, CostError> {
        let mut world = scene.open(conditions.aspect())?;
        world.get_resource_or_insert_with(SceneSettings::default).ambient = ambient;
        Ok(world)
    };
    let alone = draw_picture(conditions, &mut with_ambient(Vec3::ZERO)?, &draw)?;
    let under_one = draw_picture(conditions, &mut with_ambient(Vec3::ONE)?, &draw)?;
    let ambient = best_ambient(&alone, &under_one, &truth);
    let bake_time = 1e3 * baked.report.seconds;
    let of_bounces: Vec<(u32, f64)> = bounced.iter().map(|one| (one.bounces, one.before)).collect();
    let worlds = [with_ambient(Vec3::ZERO)?, with_ambient(ambient)?, baked.world];
    let worlds = worlds.into_iter().chain(bounced.into_iter().map(|one| one.world));
    let frames = worlds.map(|world| Frame::new(world, draw.clone()).sharing("preprocessing")).collect();
    let drawn = draw_frames(conditions, frames, SECONDS, told)?;
    let reference = measured.keep_reference(&format!("{} converged", scene.name), truth);
    let labels = ["by lamps alone", "with the best ambient light", "with lightmaps"];
    for (label, frame) in labels.into_iter().zip(&drawn) {
        let has_lightmaps = label == labels[2];
        let command = match has_lightmaps {
            true => format!(
                "lumbre bake {} -o baked.glb {} && {}",
                scene.in_commands(),
                bake_arguments(options),
                conditions.drawing("baked.glb", "")
            ),
            false if label == labels[0] => conditions.drawing(scene.in_commands(), ""),
            // `lumbre render` has no option for ambient light.
            false => conditions.again("preprocessing"),
        };
        let mut point = Point {
            series: scene.series(conditions, FRAME),
            label: label.to_owned(),
            milliseconds: frame.spread(),
            counts: frame.counts(),
            command,
            ..Point::default()
        };
        if has_lightmaps {
            point.figures.insert(BEFORE.to_owned(), bake_time);
        }
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    for ((bounces, before), frame) in of_bounces.into_iter().zip(&drawn[labels.len()..]) {
        let point = Point {
            series: scene.series(conditions, FRAME),
            label: format!("with lightmaps of {}", counted_bounces(bounces)),
            parameters: [(BOUNCES.to_owned(), f64::from(bounces))].into(),
            milliseconds: frame.spread(),
            counts: frame.counts(),
            figures: [(BEFORE.to_owned(), before)].into(),
            command: conditions.again("preprocessing"),
            ..Point::default()
        };
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    Ok(drawn)
}

/// "1 bounce", "2 bounces".
fn counted_bounces(count: u32) -> String {
    format!("{count} {}", if count == 1 { "bounce" } else { "bounces" })
}

/// Returns the ambient light, per channel, with which the frame comes closest to the reference. Light is
/// linear, so this is a least-squares fit of one number, from a frame without ambient light and one with
/// ambient light of 1.
fn best_ambient(alone: &Picture, under_one: &Picture, reference: &Picture) -> Vec3 {
    let (mut products, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for ((alone, lit), wanted) in alone.radiance.iter().zip(&under_one.radiance).zip(&reference.radiance) {
        let by_one = *lit - *alone;
        products += by_one * (*wanted - *alone);
        squares += by_one * by_one;
    }
    (products / squares.max(DVec3::splat(f64::MIN_POSITIVE))).max(DVec3::ZERO).as_vec3()
}

/// Moves the smallest static object that does not shine along x by a fraction of its longest side, and
/// returns its name, or `None` if there is none.
fn moved(world: &mut World) -> Option<String> {
    let baked = baked_meshes(world);
    let mut objects = world.query_filtered::<(Entity, &Mesh, &GlobalTransform, &Material), (With<Transform>, Without<EmissiveLight>)>();
    let side = |mesh: &Mesh, place: &GlobalTransform| {
        let corners = mesh.0.positions.iter().map(|point| place.0.transform_point3(point.as_dvec3()));
        let (low, high) = corners
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
        (high - low).max_element()
    };
    let candidates = objects
        .iter(world)
        .filter(|(entity, .., material)| baked.contains(entity) && material.front.emission == Vec3::ZERO)
        .map(|(entity, mesh, place, _)| (entity, side(mesh, place)))
        .filter(|(_, side)| side.is_finite() && *side > 0.0);
    let (entity, side) = candidates.min_by(|a, b| a.1.total_cmp(&b.1))?;
    world.get_mut::<Transform>(entity)?.translation.x += STEP * side;
    // The name of a primitive is that of its node.
    let above = |entity: &Entity| world.get::<ChildOf>(*entity).map(ChildOf::parent);
    let named = |entity: Entity| world.get::<Name>(entity).map(|name| name.as_str().to_owned());
    let name = std::iter::successors(Some(entity), above).filter_map(named).find(|name| !name.is_empty());
    Some(name.unwrap_or_else(|| "an object without a name".to_owned()))
}

fn findings_of_frames(scene: &str, points: &[Point], drawn: &[DrawnFrame]) -> Vec<String> {
    let [alone, ambient, lightmaps, ..] = points else { return Vec::new() };
    let errors = [alone, ambient, lightmaps]
        .map(|point| point.error.map_or_else(String::new, |error| error_of(&error)));
    let mut findings = vec![format!(
        "Without interreflected light, the error of frames of the {scene} is {}; with the best constant ambient light it is {}, with lightmaps {}.",
        errors[0], errors[1], errors[2]
    )];
    if let Some((alone, lit)) = drawn.first().zip(drawn.get(2))
        && let Some(ratio) = ratio_of(&lit.times, &alone.times)
        && let (Some(time), Some(bake)) = (&lightmaps.milliseconds, lightmaps.figures.get(BEFORE))
    {
        let [before, after] =
            [alone, lit].map(|frame| rounded(f64::from(frame.statistics.lights_per_object)));
        let lights = match before == after {
            true => format!("as many lights in its list as without them, {after}"),
            false => format!("{after} lights in its list instead of {before}"),
        };
        findings.push(format!(
            "With lightmaps a frame takes {} times as long as without them, and an object in view has {lights}, on average. Baking the lightmaps takes {} s once, as long as {} such frames ({}).",
            factor(&ratio),
            rounded(1e-3 * bake),
            rounded(bake / time.median.max(1e-9)),
            milliseconds(time)
        ));
    }
    findings
}

/// Says what each bounce leaves of the error, how long it took, and whether frames take longer with it. `shares` are
/// the parts of all light so far that the last bounce of each point brings.
fn finding_of_bounces(scene: &str, points: &[Point], drawn: &[DrawnFrame], shares: &[f64]) -> Option<String> {
    let all = points.iter().position(|point| point.label == "with lightmaps")?;
    let (own, frames) = (points.get(all + 1..)?, drawn.get(all + 1..)?);
    let (none, most) = (own.first()?, own.last()?);
    let before = |point: &Point| point.figures.get(BEFORE).map(|before| format!("{} ms", rounded(*before)));
    let told: Vec<String> = own
        .iter()
        .zip(shares)
        .filter_map(|(point, share)| {
            let bounces = *point.parameters.get(BOUNCES)? as u32;
            let brings = match bounces {
                0 => String::new(),
                _ => format!(", the last of which is {} of the light", percent(*share)),
            };
            let error = error_of(&point.error?);
            Some(format!("{} {error} (baked in {}{brings})", counted_bounces(bounces), before(point)?))
        })
        .collect();
    let told: Vec<&str> = told.iter().map(String::as_str).collect();
    let ratio = ratio_of(&frames.last()?.times, &frames.first()?.times)?;
    Some(format!(
        "Errors of the {scene}'s frames by the number of bounces in the lightmaps: {}; with all of them {} (baked in {}). A frame with {} takes {} times as long as with {}: {}, and {}.",
        listed(&told, "and"),
        error_of(&points[all].error?),
        before(&points[all])?,
        counted_bounces(*most.parameters.get(BOUNCES)? as u32),
        factor(&ratio),
        counted_bounces(*none.parameters.get(BOUNCES)? as u32),
        milliseconds(&most.milliseconds?),
        milliseconds(&none.milliseconds?)
    ))
}

fn finding_of_change(scene: &str, moved: &str, points: &[Point]) -> Option<String> {
    let [all, changed] = points else { return None };
    let rays = |point: &Point| point.counts.get("rays").copied().unwrap_or(0.0);
    let error =
        |point: &Point| point.error.map_or_else(|| "an unknown error".to_owned(), |error| error_of(&error));
    Some(format!(
        "After \"{moved}\" in the {scene} has moved, baking only what has changed takes {}, compared with a full bake, and {} of its rays. The error is {}, that of the full bake {}.",
        times_of(&changed.milliseconds?, &all.milliseconds?),
        rounded(rays(changed) / rays(all).max(1.0)),
        error(changed),
        error(all)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_ambient_light_is_found_per_channel() {
        let picture = |radiance: Vec<DVec3>| Picture { width: radiance.len(), radiance };
        let alone: Vec<DVec3> = (0..8).map(|i| DVec3::new(0.1 * f64::from(i), 0.3, 0.0)).collect();
        let albedo: Vec<DVec3> = (0..8).map(|i| DVec3::new(0.5, 0.1 + 0.1 * f64::from(i), 0.0)).collect();
        let under = |ambient: DVec3| -> Vec<DVec3> {
            alone.iter().zip(&albedo).map(|(a, b)| *a + *b * ambient).collect()
        };
        let planted = DVec3::new(0.25, 0.0625, 9.0);
        let found =
            best_ambient(&picture(alone.clone()), &picture(under(DVec3::ONE)), &picture(under(planted)));
        // A channel in which nothing is reflected remains 0.
        assert!((found.as_dvec3() - DVec3::new(0.25, 0.0625, 0.0)).length() < 1e-6, "{found}");
    }
}
