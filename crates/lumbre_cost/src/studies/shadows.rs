//! Study of shadow maps by resolution and filter, compared with shadow rays in f64: what sharper and softer
//! shadows cost.

use bevy_ecs::world::World;
use lumbre_optics::{Light, LightKind};
use lumbre_render::FrameOptions;
use lumbre_scene::{FrameSettings, SceneSettings, ShadowFilter};
use lumbre_trace::TraceOptions;

use super::over_scenes_made;
use crate::findings::{cheapest_by_error, factor, percent, ratio_of, short};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::lamps_in_pieces::take_to_pieces;
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::fence;
use crate::traced::{ray_tree, traced_world};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Study};

/// Factors on the resolution along each side of a map.
const RESOLUTIONS: &[f32] = &[0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
const FEW_RESOLUTIONS: &[f32] = &[0.25, 1.0, 4.0];
/// Factors for maps that are redrawn in every frame.
const FEW_ANEW: &[f32] = &[1.0, 4.0];
const RESOLUTION: &str = "texels a side, times the usual number";
const WITHOUT: &str = "no shadows";
const ANEW: &str = "soft, all maps drawn anew";
/// Total number of lamps without a size that replace those with a size. The error of the shadows is one step
/// of one of these lamps.
const PIECES: u32 = 256;
const SECONDS: f64 = 9.0;
/// Number of lamps that get a shadow for the study if no lamp of a file asks for one.
const MAX_ADDED_SHADOWS: usize = 3;

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    over_scenes_made(conditions, study(), ("fence", fence), |scene, told, measured| {
        of_scene(conditions, scene, told, measured)
    })
}

fn study() -> Study {
    Study {
        name: "shadows".into(),
        title: "Shadows".into(),
        question: "Shadow maps have more or fewer texels and are read at one texel, at nine, or at as many as the lamp's size requires. How large are their errors compared with rays, and what does each of them cost, if maps are reused and if all of them are redrawn?".into(),
        reference: "the same lighting equation with shadow rays in f64, with many small lamps in place of each lamp that has a size".into(),
        plots: vec![
            Plot {
                title: "Error over time".into(),
                across: Quantity::Milliseconds,
                up: Quantity::Error,
                joined: true,
                front: true,
                ..Plot::default()
            },
            Plot {
                title: "Error over the texels of the maps".into(),
                across: Quantity::Parameter(RESOLUTION.into()),
                up: Quantity::Error,
                series: ShadowFilter::ALL.iter().map(|filter| filter.name().to_owned()).collect(),
                joined: true,
                front: true,
                ..Plot::default()
            },
        ],
        ..Study::default()
    }
}

/// A frame to be measured.
#[derive(Clone, Copy)]
struct Asked {
    settings: FrameSettings,
    shadows: bool,
    /// Whether every lamp moves slightly before each frame, so that no shadow map can be reused.
    moving: bool,
}

fn asked(conditions: &Conditions<'_>) -> Vec<Asked> {
    let resolutions = conditions.unless_quick(RESOLUTIONS, FEW_RESOLUTIONS);
    let usual = Asked { settings: FrameSettings::default(), shadows: true, moving: false };
    let mut all = vec![Asked { shadows: false, ..usual }];
    for &shadow_filter in ShadowFilter::ALL {
        for &shadow_resolution in resolutions {
            let settings = FrameSettings { shadow_filter, shadow_resolution, ..usual.settings };
            all.push(Asked { settings, ..usual });
        }
    }
    for &shadow_resolution in conditions.unless_quick(RESOLUTIONS, FEW_ANEW) {
        let settings = FrameSettings { shadow_resolution, ..usual.settings };
        all.push(Asked { settings, moving: true, ..usual });
    }
    all
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let asking = with_shadows(conditions, scene, measured)?;
    let scene = asking.as_ref().unwrap_or(scene);
    let mut world = scene.open(conditions.aspect())?;
    let lamps = shadowed_lamps(&mut world);
    if lamps == 0 {
        measured.study.notes.push(format!("{} has no lamp that can cast shadows.", scene.name));
        return Ok(());
    }
    let pieces = (PIECES / lamps).clamp(8, 64);
    let soft = take_to_pieces(&mut world, conditions.unless_quick(pieces, pieces.min(32)));
    let (exact, report) =
        traced_world(conditions, &mut world, &TraceOptions { depth: Some(0), ..ray_tree(conditions) })?;
    let reference = measured.keep_reference(&format!("{} by rays", scene.name), exact);
    let middle = before + 0.3 * (after - before);
    conditions.tell(middle)?;

    let all = asked(conditions);
    let mut frames = Vec::new();
    for asked in &all {
        let mut world = scene.open(conditions.aspect())?;
        world.get_resource_or_insert_with(SceneSettings::default).frame = asked.settings;
        let options = FrameOptions { shadows: asked.shadows, ..FrameOptions::default() };
        let frame = Frame::new(world, options).sharing("shadows");
        frames.push(if asked.moving { frame.with_moving_lamps() } else { frame });
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [middle, after])?;
    let first = measured.study.points.len();
    for (asked, frame) in all.iter().zip(&drawn) {
        let point = point(conditions, scene, asked, frame);
        measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
    }
    measured.study.notes.push(format!(
        "The reference of {} took {} rays; {soft} of its {lamps} lamps with shadows have a size.",
        scene.name, report.rays
    ));
    let findings = findings(&scene.name, &all, &measured.study.points[first..], &drawn);
    measured.study.findings.extend(findings);
    Ok(())
}

/// Returns the scene with shadows for its strongest lamps, if none of them asks for a shadow.
fn with_shadows(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    measured: &mut Measured,
) -> Result<Option<SceneFile>, CostError> {
    let mut world = scene.open(conditions.aspect())?;
    if shadowed_lamps(&mut world) > 0 {
        return Ok(None);
    }
    let mut lights = world.query::<&mut Light>();
    let mut found: Vec<_> = lights
        .iter_mut(&mut world)
        .filter(|light| light.enabled && light.kind != LightKind::Ambient)
        .collect();
    found.sort_by(|a, b| b.diffuse.element_sum().total_cmp(&a.diffuse.element_sum()));
    let asking = found.len().min(MAX_ADDED_SHADOWS);
    found.iter_mut().take(MAX_ADDED_SHADOWS).for_each(|light| light.shadow = true);
    if asking == 0 {
        return Ok(None);
    }
    measured.study.notes.push(format!(
        "No lamp in {} asks for a shadow. It was measured with shadows of its {asking} strongest lamps.",
        scene.name
    ));
    SceneFile::made(conditions, &format!("{}-with-shadows", scene.name), world).map(Some)
}

fn shadowed_lamps(world: &mut World) -> u32 {
    let mut lights = world.query::<&Light>();
    lights.iter(world).filter(|light| light.enabled && light.shadow).count() as u32
}

fn point(conditions: &Conditions<'_>, scene: &SceneFile, asked: &Asked, frame: &DrawnFrame) -> Point {
    let FrameSettings { shadow_filter, shadow_resolution, .. } = asked.settings;
    let label = format!("resolution {}", short(f64::from(shadow_resolution)));
    let (series, label) = match (asked.shadows, asked.moving) {
        (false, _) => (WITHOUT, "all light arrives".to_owned()),
        (true, true) => (ANEW, label),
        (true, false) => (shadow_filter.name(), label),
    };
    let arguments = match asked.shadows {
        true => format!("--shadow-filter {} --shadow-resolution {shadow_resolution}", shadow_filter.name()),
        false => "--no-shadows".to_owned(),
    };
    let parameters = asked.shadows.then(|| (RESOLUTION.to_owned(), f64::from(shadow_resolution)));
    Point {
        series: scene.series(conditions, series),
        label,
        parameters: parameters.into_iter().collect(),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        command: match asked.moving {
            true => conditions.again("shadows"),
            false => conditions.drawing(scene.in_commands(), &format!(" {arguments}")),
        },
        ..Point::default()
    }
}

fn findings(scene: &str, all: &[Asked], points: &[Point], drawn: &[DrawnFrame]) -> Vec<String> {
    let mut findings = Vec::new();
    let error = |place: usize| points[place].error.map_or(f64::NAN, |error| error.relative_rmse);
    let still: Vec<&Point> =
        all.iter().zip(points).filter(|(asked, _)| !asked.moving).map(|(_, point)| point).collect();
    let usual = |filter: ShadowFilter, resolution: f32, moving: bool| {
        all.iter().position(|asked| {
            asked.shadows
                && asked.moving == moving
                && asked.settings.shadow_filter == filter
                && asked.settings.shadow_resolution == resolution
        })
    };
    if let Some(soft) = usual(ShadowFilter::Soft, 1.0, false) {
        findings.push(format!(
            "Without shadows, the error of frames of the {scene} is {}; with soft shadows of the default resolution it is {}.",
            percent(error(0)),
            percent(error(soft))
        ));
        for filter in [ShadowFilter::PercentageCloser, ShadowFilter::Hard] {
            let Some(other) = usual(filter, 1.0, false) else { continue };
            let Some(ratio) = ratio_of(&drawn[other].times, &drawn[soft].times) else { continue };
            findings.push(format!(
                "With the filter {}, a frame takes {} times as long as with soft shadows, and its error is {}.",
                filter.name(),
                factor(&ratio),
                percent(error(other))
            ));
        }
    }
    findings.extend(cheapest_by_error(&still, &format!(" of the {scene}")));
    // The cost of drawing the maps themselves, when none is reused.
    let told: Vec<String> = all
        .iter()
        .enumerate()
        .filter(|(_, asked)| asked.moving)
        .filter_map(|(place, asked)| {
            let resolution = asked.settings.shadow_resolution;
            let kept = usual(ShadowFilter::Soft, resolution, false)?;
            let ratio = ratio_of(&drawn[place].times, &drawn[kept].times)?;
            Some(format!("{} at resolution {}", factor(&ratio), short(f64::from(resolution))))
        })
        .collect();
    if !told.is_empty() {
        findings.push(format!(
            "How many times as long a frame takes if all maps are redrawn instead of reused: {}.",
            told.join(", ")
        ));
    }
    findings
}
