//! Study of reflection models compared with Phong's: how far their highlights differ over exponents and
//! angles of incidence, and what they cost.

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_optics::{Lobe, ReflectionModel, Surface, SurfaceSample, specular_reflection};
use lumbre_render::FrameOptions;

use crate::findings::{factor, percent};
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::{Ball, Highlight, ball, highlight};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

const EXPONENTS: &[f32] = &[4.0, 16.0, 64.0, 256.0];
const FEW_EXPONENTS: &[f32] = &[8.0, 64.0];
const EXPONENT: &str = "exponent";
/// Returns what is measured: each model with the documents' bare lobe, and Phong's and Blinn's with an
/// energy-conserving one.
fn variants() -> Vec<Variant> {
    let bare = |&model| Variant { model, lobe: Lobe::Bare };
    let conserving = [ReflectionModel::Phong, ReflectionModel::Blinn]
        .map(|model| Variant { model, lobe: Lobe::EnergyConserving });
    ReflectionModel::ALL.iter().map(bare).chain(conserving).collect()
}

/// A reflection model, and how its specular coefficient is interpreted.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Variant {
    model: ReflectionModel,
    lobe: Lobe,
}

impl Variant {
    /// Returns what it is compared with: Phong's model with the same lobe.
    fn reference(self) -> Self {
        Self { model: ReflectionModel::Phong, ..self }
    }
}

/// Angles between light and normal in degrees for which the lobes themselves are compared.
const INCIDENCES: [f64; 4] = [0.0, 30.0, 60.0, 80.0];
/// Angles between light and normal in degrees at which a sheet is drawn.
const TILTS: &[f64] = &[10.0, 20.0, 40.0, 60.0, 70.0, 80.0];
const FEW_TILTS: &[f64] = &[10.0, 60.0];
const INCIDENCE: &str = "angle of incidence, degrees";
/// Exponent of the sheet's highlight.
const EXPONENT_OF_SHEET: f32 = 64.0;
/// Subdivision depth, fine enough to hide the facets.
const DEPTH: u32 = 6;
/// Seconds for all frames of a full report.
const SECONDS: f64 = 14.0;

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let mut measured = Measured::of(study());
    if !conditions.files.is_empty() {
        measured
            .study
            .notes
            .push("The scene files were not used: this study always measures a ball and a sheet.".into());
    }
    let exponents = conditions.unless_quick(EXPONENTS, FEW_EXPONENTS).iter().map(|&shininess| Subject {
        made: |shininess, _, lobe| {
            ball(Ball { depth: DEPTH, shininess, reflection: ReflectionModel::Phong, lobe })
        },
        name: format!("ball-exponent-{shininess}"),
        label: format!("exponent {shininess}"),
        parameter: (EXPONENT, f64::from(shininess)),
        shininess,
        incidences: &INCIDENCES,
    });
    let exponents: Vec<Subject> = exponents.collect();
    let drawn = of_subjects(conditions, &exponents, [0.0, 0.6], &mut measured)?;
    let incidences = conditions.unless_quick(TILTS, FEW_TILTS).iter().map(|degrees| Subject {
        made: |shininess, degrees, lobe| {
            highlight(Highlight { incidence: degrees.to_radians(), shininess, lobe })
        },
        name: format!("highlight-at-{degrees}"),
        label: format!("incidence {degrees}°"),
        parameter: (INCIDENCE, *degrees),
        shininess: EXPONENT_OF_SHEET,
        incidences: std::slice::from_ref(degrees),
    });
    let incidences: Vec<Subject> = incidences.collect();
    of_subjects(conditions, &incidences, [0.6, 1.0], &mut measured)?;
    measured.study.findings = findings(&measured.study, &drawn);
    Ok(measured)
}

/// A scene that is drawn under every model.
struct Subject {
    /// Creates it from an exponent, an angle of incidence in degrees and a lobe.
    made: fn(f32, f64, Lobe) -> World,
    /// The name of its file.
    name: String,
    /// The label of its points.
    label: String,
    /// What is varied, with its value.
    parameter: (&'static str, f64),
    shininess: f32,
    /// Angles of incidence in degrees for which the lobes themselves are compared.
    incidences: &'static [f64],
}

/// Draws every subject under every model, and adds their points.
fn of_subjects(
    conditions: &Conditions<'_>,
    subjects: &[Subject],
    told: [f64; 2],
    measured: &mut Measured,
) -> Result<Vec<DrawnFrame>, CostError> {
    let variants = variants();
    let mut frames = Vec::new();
    let mut scenes: Vec<Vec<SceneFile>> = Vec::new();
    for subject in subjects {
        let made = |lobe: Lobe, name: &str| {
            SceneFile::made(conditions, name, (subject.made)(subject.shininess, subject.parameter.1, lobe))
        };
        let bare = made(Lobe::Bare, &subject.name)?;
        let conserving = made(Lobe::EnergyConserving, &format!("{}-energy-keeping", subject.name))?;
        let of =
            |variant: &Variant| if variant.lobe == Lobe::Bare { bare.clone() } else { conserving.clone() };
        let own: Vec<SceneFile> = variants.iter().map(of).collect();
        for (variant, scene) in variants.iter().zip(&own) {
            let options = FrameOptions { reflection: Some(variant.model), ..FrameOptions::default() };
            frames.push(Frame::new(scene.open(conditions.aspect())?, options).sharing(name_of(*variant)));
        }
        scenes.push(own);
    }
    let drawn = draw_frames(conditions, frames, SECONDS * (told[1] - told[0]), told)?;
    for ((scenes, subject), drawn) in scenes.iter().zip(subjects).zip(drawn.chunks(variants.len())) {
        for lobe in [Lobe::Bare, Lobe::EnergyConserving] {
            let of_lobe = || variants.iter().zip(scenes).zip(drawn).filter(|((v, _), _)| v.lobe == lobe);
            let phong = of_lobe().find(|((variant, _), _)| **variant == variant.reference());
            let Some(((phong, _), frame)) = phong else { continue };
            let name = format!("{} {}", name_of(*phong), subject.label);
            let reference = measured.keep_reference(&name, frame.picture.clone());
            for ((&variant, scene), frame) in of_lobe() {
                let point = point(conditions, scene, variant, subject, frame);
                measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
            }
        }
    }
    Ok(drawn)
}

fn study() -> Study {
    Study {
        name: "reflection".into(),
        title: "Reflection models compared with Phong's".into(),
        question: "Blinn's half vector with Phong's exponent, with four times that exponent, with a matched exponent or with an energy-conserving lobe, and the microfacets of Torrance and Sparrow: how much do their highlights differ from Phong's, and do they cost more, as document [M] says of Blinn's model with Fresnel's term and geometric attenuation, which is that of Torrance and Sparrow here?".into(),
        reference: "the same ball or sheet under Phong's model with the same exponent and light; for energy-keeping lobes, whose exponent of Phong is a quarter of the half vector's, under energy-keeping Phong".into(),
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
            Plot {
                title: "Difference from Phong's highlight on a sheet, over incidence".into(),
                across: Quantity::Parameter(INCIDENCE.into()),
                up: Quantity::Error,
                joined: true,
                ..Plot::default()
            },
            Plot {
                title: "Error over time, with a front for each incidence".into(),
                across: Quantity::Milliseconds,
                up: Quantity::Error,
                varied: Some(INCIDENCE.into()),
                front: true,
                ..Plot::default()
            },
        ],
        ..Study::default()
    }
}

fn name_of(variant: Variant) -> &'static str {
    match variant.model {
        ReflectionModel::Phong if variant.lobe == Lobe::EnergyConserving => "Phong, energy-keeping",
        ReflectionModel::Phong => "Phong",
        _ if variant.lobe == Lobe::EnergyConserving => "Blinn, energy-keeping",
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
    subject: &Subject,
    frame: &DrawnFrame,
) -> Point {
    let over_incidences = subject.incidences.iter().map(|degrees| {
        let apart = lobes_apart(variant, subject.shininess, degrees.to_radians());
        let name = match subject.incidences.len() {
            1 => "off over all directions, %".to_owned(),
            _ => format!("off at {degrees}°, %"),
        };
        (name, 100.0 * apart)
    });
    Point {
        series: name_of(variant).into(),
        label: subject.label.clone(),
        parameters: [(subject.parameter.0.to_owned(), subject.parameter.1)].into(),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        figures: over_incidences.collect(),
        command: conditions.drawing(scene.in_commands(), &format!(" --reflection {}", variant.model.name())),
        ..Point::default()
    }
}

/// Returns the root mean square difference of a model's highlight from Phong's with the same lobe, divided by
/// that of Phong's, over the viewing directions above a surface, in f64.
fn lobes_apart(variant: Variant, shininess: f32, incidence: f64) -> f64 {
    const STEPS: u32 = 90;
    let surface = Surface { specular: Vec3::ONE, shininess, ..Surface::default() };
    let surface = SurfaceSample { lobe: variant.lobe, ..SurfaceSample::from(&surface) };
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
            // The sine is proportional to the solid angle of a step of elevation.
            squares += sine * (highlight(variant.model) - phong).powi(2);
            of_phong += sine * phong.powi(2);
        }
    }
    (squares / of_phong.max(f64::MIN_POSITIVE)).sqrt()
}

/// Returns the errors of a model's points that vary a parameter, with its values.
fn errors_over<'a>(
    study: &'a Study,
    series: &'a str,
    parameter: &'a str,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let value = move |point: &Point| Some((*point.parameters.get(parameter)?, point.error?.relative_rmse));
    study.of_series(series).filter_map(value)
}

/// Reports how far each model's highlight on a sheet is from Phong's, from the steepest light to the lowest.
fn of_incidences(study: &Study) -> Option<String> {
    let compared = variants().into_iter().filter(|variant| *variant != variant.reference());
    let told = compared.filter_map(|variant| {
        let errors: Vec<(f64, f64)> = errors_over(study, name_of(variant), INCIDENCE).collect();
        let ((_, first), (_, last)) = (errors.first()?, errors.last()?);
        let (at, most) = errors.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let against = if variant.lobe == Lobe::Bare { "" } else { ", against energy-keeping Phong," };
        Some(format!(
            "{}{against} from {} to {} (at most {}, at {at}°)",
            name_of(variant),
            percent(*first),
            percent(*last),
            percent(*most)
        ))
    });
    let told: Vec<String> = told.collect();
    let mut angles = errors_over(study, name_of(variants()[0]), INCIDENCE).map(|(angle, _)| angle);
    let (first, last) = (angles.next()?, angles.last()?);
    Some(format!(
        "Errors of highlights of exponent {EXPONENT_OF_SHEET} on a sheet, from {first}° of incidence to {last}°: {}.",
        told.join("; ")
    ))
}

fn findings(study: &Study, drawn: &[DrawnFrame]) -> Vec<String> {
    let variants = variants();
    let mut costs = Vec::new();
    let mut nearest: Option<(&str, f64)> = None;
    for (place, &variant) in variants.iter().enumerate() {
        let phong = variants.iter().position(|other| *other == variant.reference()).unwrap_or(place);
        if phong == place {
            continue;
        }
        let name = name_of(variant);
        // Pairs of times from the same round, for all exponents.
        let pairs =
            drawn.chunks(variants.len()).flat_map(|all| all[place].times.iter().zip(&all[phong].times));
        let ratios: Vec<f64> = pairs.map(|(time, of_phong)| time / of_phong.max(1e-9)).collect();
        if let Some(ratio) = Spread::of_median(&ratios) {
            let of =
                if variant.lobe == Lobe::Bare { "Phong's time" } else { "the time of Phong with this lobe" };
            costs.push(format!("{name} takes {} of {of}", factor(&ratio)));
        }
        let largest = errors_over(study, name, EXPONENT).map(|(_, error)| error).fold(0.0, f64::max);
        if variant.lobe == Lobe::Bare && nearest.is_none_or(|(_, least)| largest < least) {
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
    findings.extend(of_incidences(study));
    findings
}
