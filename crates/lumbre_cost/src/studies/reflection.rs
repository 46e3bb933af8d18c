//! Reflection models beside Phong's: how far their highlights are from his over exponents and angles of incidence, and what they cost.

use glam::{DVec3, Vec3};
use lumbre_optics::{ReflectionModel, Surface, SurfaceSample, specular_reflection};
use lumbre_render::FrameOptions;

use crate::findings::{is_above_one, percent, rounded};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::{Ball, ball};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

const EXPONENTS: &[f32] = &[4.0, 16.0, 64.0, 256.0];
const FEW_EXPONENTS: &[f32] = &[8.0, 64.0];
const EXPONENT: &str = "exponent";
/// Angles between light and normal, in degrees.
const INCIDENCES: [f64; 4] = [0.0, 30.0, 60.0, 80.0];
/// Fine enough for its facets not to be seen.
const DEPTH: u32 = 6;
const SECONDS: f64 = 16.0;

/// Measures it.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let mut measured = Measured { study: study(), ..Measured::default() };
    if !conditions.files.is_empty() {
        measured.study.notes.push("The given files were not looked at: this study is of one ball.".into());
    }
    let exponents = conditions.unless_quick(EXPONENTS, FEW_EXPONENTS);
    let mut frames = Vec::new();
    let mut scenes = Vec::new();
    for &shininess in exponents {
        let asked = Ball { depth: DEPTH, shininess, reflection: ReflectionModel::Phong };
        let scene = SceneFile::made(conditions, &format!("ball-exponent-{shininess}"), ball(asked))?;
        for &model in ReflectionModel::ALL {
            let options = FrameOptions { reflection: Some(model), ..FrameOptions::default() };
            frames.push(Frame::new(scene.open(conditions.aspect())?, options).sharing(model.name()));
        }
        scenes.push(scene);
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [0.0, 1.0])?;
    let models = ReflectionModel::ALL.len();
    for ((scene, &shininess), drawn) in scenes.iter().zip(exponents).zip(drawn.chunks(models)) {
        let reference =
            measured.keep_reference(&format!("Phong exponent {shininess}"), drawn[0].picture.clone());
        for (&model, frame) in ReflectionModel::ALL.iter().zip(drawn) {
            let point = point(conditions, scene, model, shininess, frame);
            measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
        }
    }
    measured.study.findings = findings(&measured.study, &drawn);
    Ok(measured)
}

fn study() -> Study {
    Study {
        name: "reflection".into(),
        title: "Reflection models beside Phong's".into(),
        question: "Blinn's half vector with the exponent as it is, with four times it, fitted to it, and Torrance and Sparrow's facets: how far are their highlights from Phong's, and do they cost more, as document [M] says of Blinn's?".into(),
        reference: "the same ball under Phong's model with the same exponent".into(),
        plots: vec![
            Plot {
                title: "How far from Phong's highlight".into(),
                across: Quantity::Parameter(EXPONENT.into()),
                up: Quantity::Error,
                joined: true,
                ..Plot::default()
            },
            Plot {
                title: "Time".into(),
                across: Quantity::Parameter(EXPONENT.into()),
                up: Quantity::Milliseconds,
                joined: true,
                ..Plot::default()
            },
        ],
        ..Study::default()
    }
}

fn name_of(model: ReflectionModel) -> &'static str {
    match model {
        ReflectionModel::Phong => "Phong",
        ReflectionModel::Blinn => "Blinn, n",
        ReflectionModel::Blinn4n => "Blinn, 4n",
        ReflectionModel::BlinnMatched => "Blinn, fitted",
        ReflectionModel::TorranceSparrow => "Torrance-Sparrow",
    }
}

fn point(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    model: ReflectionModel,
    shininess: f32,
    frame: &DrawnFrame,
) -> Point {
    let over_incidences = INCIDENCES.iter().map(|degrees| {
        let apart = lobes_apart(model, shininess, degrees.to_radians());
        (format!("off at {degrees}°, %"), 100.0 * apart)
    });
    Point {
        series: name_of(model).into(),
        label: format!("exponent {shininess}"),
        parameters: [(EXPONENT.to_owned(), f64::from(shininess))].into(),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        figures: over_incidences.collect(),
        command: format!(
            "lumbre render {} -o frame.exr --reflection {} --size {} --frames 20 --timings times.json",
            scene.in_commands(),
            model.name(),
            conditions.size_text()
        ),
        ..Point::default()
    }
}

/// Root mean square difference of a model's highlight from Phong's over that of Phong's, over the directions of view above a surface, in f64.
fn lobes_apart(model: ReflectionModel, shininess: f32, incidence: f64) -> f64 {
    const STEPS: u32 = 90;
    let surface = Surface { specular: Vec3::ONE, shininess, ..Surface::default() };
    let surface = SurfaceSample::from(&surface);
    let light = DVec3::new(incidence.sin(), incidence.cos(), 0.0);
    let (mut squares, mut of_phong) = (0.0, 0.0);
    for row in 0..STEPS {
        let elevation = (f64::from(row) + 0.5) / f64::from(STEPS) * std::f64::consts::FRAC_PI_2;
        for column in 0..2 * STEPS {
            let around = (f64::from(column) + 0.5) / f64::from(STEPS) * std::f64::consts::PI;
            let (sine, cosine) = elevation.sin_cos();
            let viewer = DVec3::new(sine * around.cos(), cosine, sine * around.sin());
            let highlight = |model| specular_reflection(model, &surface, DVec3::Y, light, viewer).x;
            let phong = highlight(ReflectionModel::Phong);
            // The sine is the share of the hemisphere that a step of elevation has.
            squares += sine * (highlight(model) - phong).powi(2);
            of_phong += sine * phong.powi(2);
        }
    }
    (squares / of_phong.max(f64::MIN_POSITIVE)).sqrt()
}

fn findings(study: &Study, drawn: &[DrawnFrame]) -> Vec<String> {
    let models = ReflectionModel::ALL;
    let mut costs = Vec::new();
    let mut nearest: Option<(&str, f64)> = None;
    for (place, &model) in models.iter().enumerate().skip(1) {
        // Over all exponents: pairs of the same rounds.
        let pairs = drawn.chunks(models.len()).flat_map(|all| all[place].times.iter().zip(&all[0].times));
        let ratios: Vec<f64> = pairs.map(|(time, of_phong)| time / of_phong.max(1e-9)).collect();
        if let Some(ratio) = Spread::of_median(&ratios) {
            let range = format!("{} to {}", rounded(ratio.lower), rounded(ratio.upper));
            costs.push(match is_above_one(&ratio) {
                Some(_) => {
                    format!("{} takes {} of Phong's time ({range})", name_of(model), rounded(ratio.median))
                }
                None => format!("{} is not told apart from Phong ({range} of its time)", name_of(model)),
            });
        }
        let errors = study.of_series(name_of(model)).filter_map(|point| point.error);
        let largest = errors.map(|error| error.relative_rmse).fold(0.0, f64::max);
        if nearest.is_none_or(|(_, least)| largest < least) {
            nearest = Some((name_of(model), largest));
        }
    }
    let mut findings = vec![format!("{}.", costs.join("; "))];
    if let Some((name, error)) = nearest {
        findings.push(format!(
            "The nearest to Phong's pictures over all exponents is {name}, {} off at most.",
            percent(error)
        ));
    }
    findings
}
