//! Study of reflection models compared with Phong's: how far their highlights differ over exponents and
//! angles of incidence, and what they cost.

use glam::{DVec3, Vec3};
use lumbre_optics::{Lobe, ReflectionModel, Surface, SurfaceSample, specular_reflection};
use lumbre_render::FrameOptions;

use crate::findings::{factor, percent};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::{Ball, ball};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

const EXPONENTS: &[f32] = &[4.0, 16.0, 64.0, 256.0];
const FEW_EXPONENTS: &[f32] = &[8.0, 64.0];
const EXPONENT: &str = "exponent";
/// Returns what is measured: each model with the documents' bare lobe, and Blinn's with an energy-conserving
/// one.
fn variants() -> Vec<Variant> {
    let bare = |&model| Variant { model, lobe: Lobe::Bare };
    let conserving = Variant { model: ReflectionModel::Blinn, lobe: Lobe::EnergyConserving };
    // Phong's is the first: all others are compared with it.
    ReflectionModel::ALL.iter().map(bare).chain([conserving]).collect()
}

/// A reflection model, and how its specular coefficient is interpreted.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Variant {
    model: ReflectionModel,
    lobe: Lobe,
}

/// Angles between light and normal, in degrees.
const INCIDENCES: [f64; 4] = [0.0, 30.0, 60.0, 80.0];
/// Subdivision depth, fine enough to hide the facets.
const DEPTH: u32 = 6;
const SECONDS: f64 = 8.0;

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let mut measured = Measured { study: study(), ..Measured::default() };
    if !conditions.files.is_empty() {
        measured.study.notes.push("The scene files were not used: this study always measures a ball.".into());
    }
    let exponents = conditions.unless_quick(EXPONENTS, FEW_EXPONENTS);
    let variants = variants();
    let mut frames = Vec::new();
    let mut scenes: Vec<Vec<SceneFile>> = Vec::new();
    for &shininess in exponents {
        let made = |lobe: Lobe, name: String| {
            let asked = Ball { depth: DEPTH, shininess, reflection: ReflectionModel::Phong, lobe };
            SceneFile::made(conditions, &name, ball(asked))
        };
        let bare = made(Lobe::Bare, format!("ball-exponent-{shininess}"))?;
        let conserving = made(Lobe::EnergyConserving, format!("ball-exponent-{shininess}-energy-keeping"))?;
        let of =
            |variant: &Variant| if variant.lobe == Lobe::Bare { bare.clone() } else { conserving.clone() };
        let own: Vec<SceneFile> = variants.iter().map(of).collect();
        for (variant, scene) in variants.iter().zip(&own) {
            let options = FrameOptions { reflection: Some(variant.model), ..FrameOptions::default() };
            frames.push(Frame::new(scene.open(conditions.aspect())?, options).sharing(name_of(*variant)));
        }
        scenes.push(own);
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [0.0, 1.0])?;
    for ((scenes, &shininess), drawn) in scenes.iter().zip(exponents).zip(drawn.chunks(variants.len())) {
        let reference =
            measured.keep_reference(&format!("Phong exponent {shininess}"), drawn[0].picture.clone());
        for ((&variant, scene), frame) in variants.iter().zip(scenes).zip(drawn) {
            let point = point(conditions, scene, variant, shininess, frame);
            measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
        }
    }
    measured.study.findings = findings(&measured.study, &drawn);
    Ok(measured)
}

fn study() -> Study {
    Study {
        name: "reflection".into(),
        title: "Reflection models compared with Phong's".into(),
        question: "Blinn's half vector with Phong's exponent, with four times that exponent, with a matched exponent or with an energy-conserving lobe, and the microfacets of Torrance and Sparrow: how much do their highlights differ from Phong's, and do they cost more, as document [M] says of Blinn's?".into(),
        reference: "the same ball under Phong's model with the same exponent".into(),
        plots: vec![
            Plot {
                title: "Difference from Phong's highlight".into(),
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

fn name_of(variant: Variant) -> &'static str {
    match variant.model {
        _ if variant.lobe == Lobe::EnergyConserving => "Blinn, energy-keeping",
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
    variant: Variant,
    shininess: f32,
    frame: &DrawnFrame,
) -> Point {
    let over_incidences = INCIDENCES.iter().map(|degrees| {
        let apart = lobes_apart(variant, shininess, degrees.to_radians());
        (format!("off at {degrees}°, %"), 100.0 * apart)
    });
    Point {
        series: name_of(variant).into(),
        label: format!("exponent {shininess}"),
        parameters: [(EXPONENT.to_owned(), f64::from(shininess))].into(),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        figures: over_incidences.collect(),
        command: conditions.drawing(scene.in_commands(), &format!(" --reflection {}", variant.model.name())),
        ..Point::default()
    }
}

/// Returns the root mean square difference of a model's highlight from Phong's, divided by that of Phong's,
/// over the viewing directions above a surface, in f64.
fn lobes_apart(variant: Variant, shininess: f32, incidence: f64) -> f64 {
    const STEPS: u32 = 90;
    let surface = Surface { specular: Vec3::ONE, shininess, ..Surface::default() };
    let bare = SurfaceSample::from(&surface);
    let own = SurfaceSample { lobe: variant.lobe, ..bare };
    let light = DVec3::new(incidence.sin(), incidence.cos(), 0.0);
    let (mut squares, mut of_phong) = (0.0, 0.0);
    for row in 0..STEPS {
        let elevation = (f64::from(row) + 0.5) / f64::from(STEPS) * std::f64::consts::FRAC_PI_2;
        for column in 0..2 * STEPS {
            let around = (f64::from(column) + 0.5) / f64::from(STEPS) * std::f64::consts::PI;
            let (sine, cosine) = elevation.sin_cos();
            let viewer = DVec3::new(sine * around.cos(), cosine, sine * around.sin());
            let highlight = |model, surface| specular_reflection(model, surface, DVec3::Y, light, viewer).x;
            let phong = highlight(ReflectionModel::Phong, &bare);
            // The sine is proportional to the solid angle of a step of elevation.
            squares += sine * (highlight(variant.model, &own) - phong).powi(2);
            of_phong += sine * phong.powi(2);
        }
    }
    (squares / of_phong.max(f64::MIN_POSITIVE)).sqrt()
}

fn findings(study: &Study, drawn: &[DrawnFrame]) -> Vec<String> {
    let variants = variants();
    let mut costs = Vec::new();
    let mut nearest: Option<(&str, f64)> = None;
    for (place, &variant) in variants.iter().enumerate().skip(1) {
        let name = name_of(variant);
        // Pairs of times from the same round, for all exponents.
        let pairs = drawn.chunks(variants.len()).flat_map(|all| all[place].times.iter().zip(&all[0].times));
        let ratios: Vec<f64> = pairs.map(|(time, of_phong)| time / of_phong.max(1e-9)).collect();
        if let Some(ratio) = Spread::of_median(&ratios) {
            costs.push(format!("{name} takes {} of Phong's time", factor(&ratio)));
        }
        let errors = study.of_series(name).filter_map(|point| point.error);
        let largest = errors.map(|error| error.relative_rmse).fold(0.0, f64::max);
        if nearest.is_none_or(|(_, least)| largest < least) {
            nearest = Some((name, largest));
        }
    }
    let mut findings = vec![format!("{}.", costs.join("; "))];
    if let Some((name, error)) = nearest {
        findings.push(format!(
            "The model closest to Phong's pictures over all exponents is {name}, with an error of {} at most.",
            percent(error)
        ));
    }
    findings
}
