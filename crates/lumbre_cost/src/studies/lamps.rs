//! Study of many lamps: evaluating all of them in every fragment, finding them by lists per object or by
//! clusters, and ending them where their light is too weak to be seen.

use lumbre_render::{FrameOptions, LightLists, RenderingPath};

use crate::findings::{cheapest_by_error, counted, factor, listed, percent, ratio_of, short, times_of};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::fronts::pareto_front;
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::{BallsAndLamps, balls_and_lamps};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// The ways to find lamps, with their names.
const LISTS: [(LightLists, &str); 3] = [
    (LightLists::Everything, "every lamp everywhere"),
    (LightLists::Objects, "lists of objects"),
    (LightLists::Clusters, "clusters"),
];
const MANY: &[u32] = &[1, 4, 16, 64, 256, 1024];
const FEW: &[u32] = &[1, 16, 128];
/// The fraction of white at which the lamps of the first part end.
const USUAL: f32 = 0.1;
const THRESHOLDS: &[f32] = &[0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002];
const FEW_THRESHOLDS: &[f32] = &[0.1, 0.01];
/// Width and height of the pictures of a full report relative to those of other studies.
const PART: f64 = 2.0 / 3.0;
/// With more lamps than this, drawing a frame takes longer than compiling its shaders.
const SHARING: u32 = 64;
const LAMPS: &str = "lamps";
const IN_CLUSTER: &str = "lamps in a cluster's list";
const THRESHOLD: &str = "threshold, % of white";
/// Sides in pixels of the smallest tiles that have lists.
const TILES: &[u32] = &[32, 64, 128, 256];
const FEW_TILES: &[u32] = &[32, 128];
const TILE: &str = "pixels along a tile";
const SIZED: &str = "clusters by size";
const ENDING: &str = "lamps that end, by clusters";
/// Seconds for the frames of each part in a full report.
const SECONDS: f64 = 8.0;
/// Relative RMSE of f32 if a thousand lamps are added in another order: a thousand times half a unit in the
/// last place.
const ROUNDING: f64 = 6e-5;

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let mut measured = Measured::of(study());
    if !conditions.files.is_empty() {
        of_files(conditions, &mut measured)?;
        return Ok(measured);
    }
    // With a thousand lamps in every pixel, a frame of full size would take a second.
    let part = conditions.unless_quick(PART, 1.0);
    let size = [conditions.size.0, conditions.size.1].map(|side| ((f64::from(side) * part) as u32).max(8));
    let conditions = &Conditions { size: (size[0], size[1]), ..*conditions };
    let times = by_number(conditions, &mut measured)?;
    measured.study.findings.extend(findings_by_number(&measured.study, &times));
    by_tile(conditions, &mut measured)?;
    by_threshold(conditions, &mut measured)?;
    Ok(measured)
}

fn study() -> Study {
    let lists = || LISTS.map(|(_, name)| name.to_owned()).to_vec();
    Study {
        name: "lamps".into(),
        title: "Many lamps".into(),
        question: "Balls on a floor are drawn under more and more lamps that each reach three metres. What does it cost to evaluate every lamp everywhere, and what does it cost to find the relevant ones first? And where may the light of a lamp end?".into(),
        reference: "the same frame with every lamp evaluated everywhere; for lamps that end, the frame with lamps that do not end".into(),
        plots: vec![
            Plot {
                title: "Time over the number of lamps".into(),
                across: Quantity::Parameter(LAMPS.into()),
                up: Quantity::Milliseconds,
                series: lists(),
                joined: true,
                ..Plot::default()
            },
            Plot {
                title: "Time over the size of clusters".into(),
                across: Quantity::Parameter(TILE.into()),
                up: Quantity::Milliseconds,
                series: vec![SIZED.into()],
                joined: true,
                ..Plot::default()
            },
            Plot {
                title: "Where lamps end: error over time".into(),
                across: Quantity::Milliseconds,
                up: Quantity::Error,
                series: vec![ENDING.into()],
                joined: true,
                front: true,
                ..Plot::default()
            },
        ],
        ..Study::default()
    }
}

/// Returns the options of a frame that finds lamps in this way. The rendering path is the same on every
/// machine, since the lists are what is compared.
fn found_by(light_lists: LightLists) -> FrameOptions {
    FrameOptions { light_lists, rendering_path: RenderingPath::Forward, ..FrameOptions::default() }
}

/// Frames by number of lamps, one for each kind of list.
type TimesByNumber = Vec<(u32, Vec<DrawnFrame>)>;

fn by_number(conditions: &Conditions<'_>, measured: &mut Measured) -> Result<TimesByNumber, CostError> {
    let numbers = conditions.unless_quick(MANY, FEW);
    let mut frames = Vec::new();
    for &lamps in numbers {
        let asked = BallsAndLamps { lamps, threshold: USUAL, seed: conditions.seed };
        let scene = SceneFile::made(conditions, &format!("lamps-{lamps}"), balls_and_lamps(asked))?;
        for (light_lists, name) in LISTS {
            let options = found_by(light_lists);
            let frame = Frame::new(scene.open(conditions.aspect())?, options);
            frames.push(if lamps <= SHARING { frame.sharing(name) } else { frame });
        }
    }
    let mut drawn = draw_frames(conditions, frames, SECONDS, [0.0, 0.5])?.into_iter();
    let mut found = Vec::new();
    for &lamps in numbers {
        let three: Vec<DrawnFrame> = drawn.by_ref().take(LISTS.len()).collect();
        let reference = measured.keep_reference(&everywhere(lamps), three[0].picture.clone());
        for ((_, series), frame) in LISTS.iter().zip(&three) {
            let point = point(conditions, frame, series, lamps);
            measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
        }
        found.push((lamps, three));
    }
    Ok(found)
}

fn point(conditions: &Conditions<'_>, frame: &DrawnFrame, series: &str, lamps: u32) -> Point {
    let lists = frame.statistics.light_lists;
    let mut counts = frame.counts();
    counts.insert("lamps in an object's list".into(), f64::from(frame.statistics.lights_per_object));
    if lists.clustered {
        let clusters: f64 = lists.clusters.iter().map(|count| f64::from(*count)).product();
        counts.insert(IN_CLUSTER.into(), lists.entries as f64 / clusters.max(1.0));
    }
    Point {
        series: series.to_owned(),
        label: format!("{lamps} {}", if lamps == 1 { "lamp" } else { "lamps" }),
        parameters: [(LAMPS.to_owned(), f64::from(lamps))].into(),
        milliseconds: frame.spread(),
        counts,
        command: conditions.again("lamps"),
        ..Point::default()
    }
}

fn findings_by_number(study: &Study, times: &TimesByNumber) -> Vec<String> {
    // Neighbouring numbers of lamps with the same winners are reported together.
    let mut stretches: Vec<(u32, u32, Vec<&str>)> = Vec::new();
    for (lamps, _) in times {
        let winners = cheapest_with(study, *lamps);
        match stretches.last_mut().filter(|(.., last)| *last == winners) {
            Some((_, to, _)) => *to = *lamps,
            None => stretches.push((*lamps, *lamps, winners)),
        }
    }
    let told = stretches.iter().map(|(from, to, winners)| {
        let range = if from == to { format!("with {from}") } else { format!("with {from} to {to}") };
        match &winners[..] {
            [only] => format!("{range} {only}"),
            several => format!("{range} the times do not decide between {}", listed(several, "and")),
        }
    });
    let mut findings =
        vec![format!("The cheapest way to find lamps: {}.", told.collect::<Vec<_>>().join("; "))];
    if let Some((lamps, three)) = times.last()
        && let [everything, objects, clusters] = &three[..]
        && let (Some(all), Some(by_object)) =
            (ratio_of(&everything.times, &clusters.times), ratio_of(&objects.times, &clusters.times))
    {
        findings.push(format!(
            "With {lamps} lamps, evaluating every lamp everywhere takes {} times as long as with clusters; with lists of objects it takes {} times as long.",
            factor(&all),
            factor(&by_object)
        ));
        if let (Some([_, fragments]), Some([few, contributing])) =
            (everything.invocations, clusters.light_evaluations)
        {
            findings.push(format!(
                "Evaluated everywhere, these lamps are evaluated {} times in a frame ({fragments} fragments); with clusters, {} times, of which {} contribute more than 1/255.",
                counted(fragments as f64 * f64::from(*lamps)),
                counted(few as f64),
                percent(contributing as f64 / (few as f64).max(1.0))
            ));
        }
    }
    let largest = study
        .points
        .iter()
        .filter_map(|point| point.error)
        .map(|error| error.relative_rmse)
        .fold(0.0, f64::max);
    findings.push(match largest <= ROUNDING {
        true => format!("The lists leave out nothing visible: the pictures differ by {} at most.", percent(largest)),
        false => format!(
            "The lists do not give the same picture: the pictures differ by up to {}, while rounding explains {} at most.",
            percent(largest),
            percent(ROUNDING)
        ),
    });
    findings
}

/// Returns the kinds of lists that are the cheapest with this many lamps, in the order of [`LISTS`]: one if
/// the times decide, several if they do not.
fn cheapest_with(study: &Study, lamps: u32) -> Vec<&str> {
    let is_list = |series: &str| LISTS.iter().any(|(_, name)| *name == series);
    let here = study.points.iter().filter(|point| is_list(&point.series));
    let here = here.filter(|point| point.parameters.get(LAMPS) == Some(&f64::from(lamps)));
    let timed: Vec<(&str, Spread)> =
        here.filter_map(|point| Some((point.series.as_str(), point.milliseconds?))).collect();
    let first = timed.iter().min_by(|a, b| a.1.median.total_cmp(&b.1.median));
    let is_level = |time: &Spread| first.is_some_and(|(_, least)| !least.is_below(time));
    timed.iter().filter(|(_, time)| is_level(time)).map(|(series, _)| *series).collect()
}

/// Measures the largest number of lamps with clusters of several sizes. Small clusters have short lists, but
/// there are many of them.
fn by_tile(conditions: &Conditions<'_>, measured: &mut Measured) -> Result<(), CostError> {
    let lamps = conditions.unless_quick(MANY, FEW).last().copied().unwrap_or(1);
    let tiles = conditions.unless_quick(TILES, FEW_TILES);
    let asked = BallsAndLamps { lamps, threshold: USUAL, seed: conditions.seed };
    let scene = SceneFile::made(conditions, &format!("lamps-{lamps}"), balls_and_lamps(asked))?;
    let mut frames = Vec::new();
    for &finest_cluster_tile in tiles {
        let options = FrameOptions { finest_cluster_tile, ..found_by(LightLists::Clusters) };
        let frame = Frame::new(scene.open(conditions.aspect())?, options);
        frames.push(frame.sharing(SIZED));
    }
    let drawn = draw_frames(conditions, frames, 0.3 * SECONDS, [0.5, 0.65])?;
    let reference = measured.file_name(&everywhere(lamps));
    let first = measured.study.points.len();
    for (&tile, frame) in tiles.iter().zip(&drawn) {
        let mut sized = Point {
            label: format!("{lamps} lamps, tiles of {tile} pixels"),
            ..point(conditions, frame, SIZED, lamps)
        };
        sized.parameters.insert(TILE.into(), f64::from(tile));
        measured.add_picture(sized, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    let in_list = |point: &Point| point.counts.get(IN_CLUSTER).copied().map_or_else(String::new, counted);
    let points = &measured.study.points[first..];
    if let (Some(fine), Some(coarse)) = (points.first(), points.last())
        && let (Some(finest), Some(coarsest)) = (drawn.first(), drawn.last())
        && let Some(ratio) = ratio_of(&coarsest.times, &finest.times)
    {
        let finding = format!(
            "With {lamps} lamps, tiles of {} pixels instead of {} lengthen the list of a cluster from {} lamps to {}; a frame takes {} times as long.",
            tiles[tiles.len() - 1],
            tiles[0],
            in_list(fine),
            in_list(coarse),
            factor(&ratio)
        );
        measured.study.findings.push(finding);
    }
    Ok(())
}

/// Returns the label of the frame that evaluates this many lamps everywhere.
fn everywhere(lamps: u32) -> String {
    format!("{lamps} everywhere")
}

fn by_threshold(conditions: &Conditions<'_>, measured: &mut Measured) -> Result<(), CostError> {
    let lamps = conditions.unless_quick(256, 64);
    let thresholds = conditions.unless_quick(THRESHOLDS, FEW_THRESHOLDS);
    let mut frames = Vec::new();
    for threshold in [0.0].iter().chain(thresholds) {
        let asked = BallsAndLamps { lamps, threshold: *threshold, seed: conditions.seed };
        let name = match *threshold {
            0.0 => format!("lamps-{lamps}-endless"),
            threshold => format!("lamps-{lamps}-to-{}", (threshold * 1000.0).round()),
        };
        let scene = SceneFile::made(conditions, &name, balls_and_lamps(asked))?;
        let light_lists = if *threshold == 0.0 { LightLists::Everything } else { LightLists::Clusters };
        let options = found_by(light_lists);
        let frame = Frame::new(scene.open(conditions.aspect())?, options);
        frames.push(if lamps <= SHARING {
            frame.sharing(if *threshold == 0.0 { "endless" } else { ENDING })
        } else {
            frame
        });
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [0.65, 1.0])?;
    let [endless, ending @ ..] = &drawn[..] else { return Ok(()) };
    let reference = measured.keep_reference(&format!("{lamps} endless lamps"), endless.picture.clone());
    let whole = Point {
        label: format!("{lamps} lamps without an end"),
        ..point(conditions, endless, "lamps without an end", lamps)
    };
    measured.add_picture(whole, endless.picture.clone(), &reference, ErrorOver::Picture)?;
    let before = measured.study.points.len();
    for (threshold, frame) in thresholds.iter().zip(ending) {
        let share = 100.0 * f64::from(*threshold);
        let mut ended =
            Point { label: format!("at {} %", short(share)), ..point(conditions, frame, ENDING, lamps) };
        ended.parameters.insert(THRESHOLD.into(), share);
        measured.add_picture(ended, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    let points = &measured.study.points[before..];
    let told: Vec<String> = pareto_front(points)
        .iter()
        .filter_map(|point| {
            let (time, all, error) = (point.milliseconds?, endless.spread()?, point.error?);
            Some(format!(
                "{}: {}, {} of error",
                point.label,
                times_of(&time, &all),
                percent(error.relative_rmse)
            ))
        })
        .collect();
    measured.study.findings.push(format!(
        "{lamps} lamps that end where they contribute a small fraction of white, compared with lamps that do not end: {}.",
        told.join("; ")
    ));
    Ok(())
}

/// Measures the lamps of the files that were passed with every kind of list.
fn of_files(conditions: &Conditions<'_>, measured: &mut Measured) -> Result<(), CostError> {
    measured.study.question =
        "What do frames cost if the lamps of each scene are evaluated everywhere, found by lists of objects, or found by clusters?".into();
    measured.study.plots.truncate(1);
    measured.study.plots[0] = Plot {
        title: "Time over the number of lamps".into(),
        across: Quantity::Parameter(LAMPS.into()),
        up: Quantity::Milliseconds,
        ..Plot::default()
    };
    let scenes = SceneFile::given(conditions)?;
    let mut frames = Vec::new();
    for scene in &scenes {
        for (light_lists, _) in LISTS {
            let options = found_by(light_lists);
            frames.push(Frame::new(scene.open(conditions.aspect())?, options));
        }
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [0.0, 1.0])?;
    for (scene, three) in scenes.iter().zip(drawn.chunks(LISTS.len())) {
        let before = measured.study.points.len();
        let reference =
            measured.keep_reference(&format!("{} everywhere", scene.name), three[0].picture.clone());
        for ((_, series), frame) in LISTS.iter().zip(three) {
            let lamps = frame.statistics.lights;
            let own = Point { label: scene.name.clone(), ..point(conditions, frame, series, lamps) };
            measured.add_picture(own, frame.picture.clone(), &reference, ErrorOver::Picture)?;
        }
        let points: Vec<&Point> = measured.study.points[before..].iter().collect();
        let largest = points
            .iter()
            .filter_map(|point| point.error)
            .map(|error| error.relative_rmse)
            .fold(0.0, f64::max);
        // The errors are rounding errors, so only the times are compared.
        let even: Vec<Point> = points
            .iter()
            .map(|point| Point {
                error: point.error.map(|error| crate::ErrorOf { relative_rmse: largest, ..error }),
                ..(*point).clone()
            })
            .collect();
        let even: Vec<&Point> = even.iter().collect();
        measured.study.findings.extend(cheapest_by_error(&even, &format!(" in {}", scene.name)));
    }
    Ok(())
}
