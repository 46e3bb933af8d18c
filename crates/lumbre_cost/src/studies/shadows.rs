//! Shadow maps by their texels and by how they are read, against shadow rays in f64: what sharper edges cost, and what soft ones. Not the maps.

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

/// Texels beside the usual number, along a side of a map.
const RESOLUTIONS: &[f32] = &[0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
const FEW_RESOLUTIONS: &[f32] = &[0.25, 1.0, 4.0];
/// Of maps that are drawn anew.
const FEW_ANEW: &[f32] = &[1.0, 4.0];
const RESOLUTION: &str = "texels a side, times the usual number";
const WITHOUT: &str = "no shadows";
const ANEW: &str = "soft, all maps drawn anew";
/// Lamps without a size that stand for those with one, of all of them together: their shadows end in steps of one of them.
const PIECES: u32 = 256;
const SECONDS: f64 = 9.0;
/// Of a file whose lamps ask for no shadows, so many do for the study.
const MADE_TO_ASK: usize = 3;

/// Measures it.
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
        question: "Shadow maps with more or fewer texels, read at one texel, at nine, or at as many as the lamp's size asks for: how far are they from rays, and what does each cost, where maps are kept and where all of them are drawn anew?".into(),
        reference: "the same lighting equation with shadow rays in f64; a lamp that has a size as many small ones".into(),
        plots: vec![
            Plot {
                title: "Error against time".into(),
                across: Quantity::Milliseconds,
                up: Quantity::Error,
                joined: true,
                front: true,
                ..Plot::default()
            },
            Plot {
                title: "Error against the texels of the maps".into(),
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

/// A frame that is measured.
#[derive(Clone, Copy)]
struct Asked {
    settings: FrameSettings,
    shadows: bool,
    /// Every lamp moves by a hair before each frame, so that no map is as it was.
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
        measured.study.notes.push(format!("{} has no lamp that could cast a shadow.", scene.name));
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
        "The rays of {} took {} of them; {soft} of its {lamps} lamps with shadows have a size.",
        scene.name, report.rays
    ));
    let findings = findings(&scene.name, &all, &measured.study.points[first..], &drawn);
    measured.study.findings.extend(findings);
    Ok(())
}

/// The scene with shadows of its strongest lamps, if none of them asks for one itself.
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
    let asking = found.len().min(MADE_TO_ASK);
    found.iter_mut().take(MADE_TO_ASK).for_each(|light| light.shadow = true);
    if asking == 0 {
        return Ok(None);
    }
    measured.study.notes.push(format!(
        "No lamp of {} asks for a shadow: it was measured with shadows of the {asking} strongest.",
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
            "Without shadows frames of the {scene} are off by {}, with soft ones of the usual resolution by {}.",
            percent(error(0)),
            percent(error(soft))
        ));
        for filter in [ShadowFilter::PercentageCloser, ShadowFilter::Hard] {
            let Some(other) = usual(filter, 1.0, false) else { continue };
            let Some(ratio) = ratio_of(&drawn[other].times, &drawn[soft].times) else { continue };
            findings.push(format!(
                "Read as {} a frame takes {} of the time of soft shadows, and is off by {}.",
                filter.name(),
                factor(&ratio),
                percent(error(other))
            ));
        }
    }
    findings.extend(cheapest_by_error(&still, &format!(" of the {scene}")));
    // What the maps themselves cost, where none is kept.
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
            "Where all maps are drawn anew a frame takes so many times as long as where they are kept: {}.",
            told.join(", ")
        ));
    }
    findings
}
