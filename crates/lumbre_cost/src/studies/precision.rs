//! Study of the precision of f32 frames in cases that are hard for arithmetic, compared with rays in f64; of
//! the equations with every operation rounded to f16 or f32; and of frames stored in fewer bits.

use std::time::Instant;

use glam::DVec3;
use half::f16;
use lumbre_optics::{SpotCone, decode_srgb, encode_srgb};
use lumbre_render::FrameOptions;

use crate::findings::{listed, milliseconds, percent, rounded};
use crate::frame::Frame;
use crate::frames::draw_frames;
use crate::measured::Measured;
use crate::picture::Picture;
use crate::rounded_lighting::{FORMATS, Rounded, rounded_lighting};
use crate::rounds::{Repeated, milliseconds_since, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::{Sheet, sheet};
use crate::traced::{lighting_options, traced};
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// The cases with their names.
const CASES: [(&str, Sheet); 9] = [
    ("plain", Sheet::PLAIN),
    ("exponent 50000", Sheet { shininess: 50_000.0, ..Sheet::PLAIN }),
    ("lamp at 2 cm", Sheet { height: 0.02, ..Sheet::PLAIN }),
    ("lamp a million times as bright", Sheet { brightness: 1e6, ..Sheet::PLAIN }),
    (
        "narrow spotlight",
        Sheet { height: 8.0, cone: Some(SpotCone::Smooth { inner: 0.0, outer: 0.1 }), ..Sheet::PLAIN },
    ),
    ("light at 0.1°", Sheet { grazing: Some(0.001_745_329), ..Sheet::PLAIN }),
    ("10000 km away", Sheet { far: 1e7, ..Sheet::PLAIN }),
    ("a millimetre large", Sheet { scale: 5e-4, ..Sheet::PLAIN }),
    ("100 km large", Sheet { scale: 5e4, ..Sheet::PLAIN }),
];
const SECONDS: f64 = 4.0;
const F32: &str = "f32 frame";
const F16: &str = "the frame kept in f16";
const EIGHT: &str = "the frame kept in eight bits";
const F64: &str = "f64 rays";
const BITS: &str = "bits of the significand";
const LOST: &str = "pixels without a number, %";

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
            .push("The scene files were not used: this study always measures a sheet.".into());
    }
    let mut frames = Vec::new();
    let mut scenes = Vec::new();
    for (name, asked) in CASES {
        let scene =
            SceneFile::made(conditions, &format!("sheet-{}", name.replace([' ', '°'], "-")), sheet(asked))?;
        frames.push(Frame::new(scene.open(conditions.aspect())?, FrameOptions::default()).sharing("sheet"));
        scenes.push(scene);
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [0.0, 0.5])?;
    let rays = repeated(CASES.len(), conditions.repetitions(), |place, [from, _]| {
        conditions.tell(0.5 + 0.3 * from)?;
        let begun = Instant::now();
        let traced = traced(conditions, &scenes[place], &lighting_options(conditions))?;
        Ok((milliseconds_since(begun), traced))
    })?;
    let equations = repeated(CASES.len() * FORMATS.len(), conditions.repetitions(), |place, [from, _]| {
        conditions.tell(0.8 + 0.2 * from)?;
        let mut world = scenes[place / FORMATS.len()].open(conditions.aspect())?;
        let begun = Instant::now();
        let rounded = rounded_lighting(&mut world, conditions.size, FORMATS[place % FORMATS.len()]);
        Ok((milliseconds_since(begun), rounded))
    })?;
    let pixels = f64::from(conditions.size.0) * f64::from(conditions.size.1);
    for (((name, _), equations), ((scene, frame), Repeated { times, made: (exact, report) })) in
        CASES.iter().zip(equations.chunks(FORMATS.len())).zip(scenes.iter().zip(&drawn).zip(rays))
    {
        let reference = measured.keep_reference(&format!("f64 {name}"), exact.clone());
        let size = conditions.size_text();
        let point = |series: &str, bits: u32, time, command: String| Point {
            series: series.into(),
            label: (*name).into(),
            parameters: [(BITS.to_owned(), f64::from(bits))].into(),
            milliseconds: time,
            command,
            ..Point::default()
        };
        let draw = conditions.drawing(scene.in_commands(), "");
        let trace = format!(
            "lumbre trace {} -o picture.exr --size {size} --depth 0 --no-shadows",
            scene.in_commands()
        );
        // No command stores a frame in fewer bits.
        let kept = [
            (F32, 24, Rounded { picture: frame.picture.clone(), lost: 0.0 }, draw),
            (F16, 11, in_halves(&frame.picture), conditions.again("precision")),
            (
                EIGHT,
                8,
                Rounded { picture: in_bytes(&frame.picture), lost: 0.0 },
                conditions.again("precision"),
            ),
        ];
        for (series, bits, Rounded { picture, lost }, command) in kept {
            let mut point = point(series, bits, frame.spread(), command);
            point.counts = frame.counts();
            point.figures.insert(LOST.into(), 100.0 * lost);
            measured.add_picture(point, picture, &reference, ErrorOver::Picture)?;
        }
        for (format, Repeated { times, made: rounded }) in FORMATS.iter().zip(equations) {
            let Some(Rounded { picture, lost }) = rounded else { continue };
            let mut point = point(format.name, format.bits, Spread::of(times), conditions.again("precision"));
            point.figures.insert(LOST.into(), 100.0 * lost);
            // There is one light, which every pixel evaluates.
            point.counts.insert("light evaluations".into(), pixels);
            measured.add_picture(point, picture.clone(), &reference, ErrorOver::Picture)?;
        }
        let mut point = point(F64, 53, Spread::of(&times), trace);
        point.counts.insert("rays".into(), report.rays as f64);
        measured.add_picture(point, exact, &reference, ErrorOver::Picture)?;
    }
    measured.study.findings = findings(&measured.study);
    Ok(measured)
}

fn study() -> Study {
    Study {
        name: "precision".into(),
        title: "f32 on the device, compared with f64".into(),
        question: "A sheet that fills the frame is lit in ways that are hard for arithmetic. What do frames in 32 bits lose, and what is lost by storing them in 16 or eight? What would plain equations lose in 16 and in 32 bits, and what would 64 bits cost, by tracing rays?".into(),
        reference: "the same lighting equation at the same pixels, traced in f64, which is therefore without error; equations in f64 are other code, and show how far the two agree".into(),
        plots: vec![
            Plot {
                title: "Error over time, with a front for each case".into(),
                across: Quantity::Milliseconds,
                up: Quantity::Error,
                series: [F32, F16, EIGHT, F64].map(str::to_owned).into(),
                front: true,
                ..Plot::default()
            },
            Plot {
                title: "Error over the bits of a number".into(),
                across: Quantity::Parameter(BITS.into()),
                up: Quantity::Error,
                ..Plot::default()
            },
        ],
        notes: vec![
            "The equations in f16, f32 and f64 are rounded after every operation, without the renderer's measures for hard cases; positions are relative to the eye. Pixels for which the format has no finite number are black. Their times are those of one CPU thread that computes in f64 and rounds: they say what this costs here, and not what a device with such numbers would take."
                .into(),
        ],
        ..Study::default()
    }
}

fn each_channel(picture: &Picture, kept: impl Fn(f64) -> f64) -> Picture {
    let radiance = picture.radiance.iter().map(|pixel| DVec3::from(pixel.to_array().map(&kept))).collect();
    Picture { width: picture.width, radiance }
}

/// Rounds to half floats. Pixels that are beyond their range are black.
fn in_halves(picture: &Picture) -> Rounded {
    let mut kept = each_channel(picture, |value| f64::from(f16::from_f64(value)));
    let beyond = kept.radiance.iter_mut().filter(|pixel| !pixel.is_finite());
    let lost = beyond.map(|pixel| *pixel = DVec3::ZERO).count();
    Rounded { lost: lost as f64 / kept.radiance.len().max(1) as f64, picture: kept }
}

/// Rounds to eight bits in sRGB encoding, as for a screen, without a tone curve.
fn in_bytes(picture: &Picture) -> Picture {
    each_channel(picture, |value| decode_srgb((255.0 * encode_srgb(value.clamp(0.0, 1.0))).round() / 255.0))
}

/// Reports what plain equations lose in f16, and in f32 compared with the device's frames.
fn of_equations(study: &Study) -> Vec<String> {
    let error = |point: &Point| point.error.map_or(0.0, |error| error.relative_rmse);
    let [short, long, exact] = FORMATS.map(|format| study.of_series(format.name).collect::<Vec<_>>());
    let mut findings = Vec::new();
    if let Some(plain) = short.iter().find(|point| point.label == CASES[0].0) {
        let is_lost = |point: &&&Point| point.figures.get(LOST).is_some_and(|lost| *lost > 0.0);
        let lost: Vec<&str> = short.iter().filter(is_lost).map(|point| point.label.as_str()).collect();
        let none = if lost.is_empty() { "none".into() } else { listed(&lost, "and") };
        findings.push(format!(
            "The error of the equations in f16 is {} in the easy case; cases with pixels for which f16 has no finite number: {none}.",
            percent(error(plain))
        ));
    }
    if let Some(most) = exact.iter().max_by(|a, b| error(a).total_cmp(&error(b))) {
        findings.push(format!(
            "The equations in f64 agree with the traced reference within {} in every case (\"{}\" is the farthest off).",
            percent(error(most)),
            most.label
        ));
    }
    // The case in which the device's frame is better than plain f32 by the largest factor shows what avoiding
    // the hard cases gains.
    let gained = long.iter().filter_map(|point| {
        let frame = study.of_series(F32).find(|frame| frame.label == point.label)?;
        Some((point, frame, error(point) / error(frame).max(1e-12)))
    });
    if let Some((plain, frame, gain)) =
        gained.max_by(|a, b| a.2.total_cmp(&b.2)).filter(|(.., gain)| *gain > 1.0)
    {
        findings.push(format!(
            "The case in which the frame is better than plain equations in f32 by the largest factor is \"{}\": the error of the equations is {}, that of the frame {}, a factor of {}.",
            plain.label,
            percent(error(plain)),
            percent(error(frame)),
            rounded(gain)
        ));
    }
    findings
}

fn findings(study: &Study) -> Vec<String> {
    let error = |point: &&Point| point.error.map_or(0.0, |error| error.relative_rmse);
    let mut findings = Vec::new();
    let hardest = study.of_series(F32).max_by(|a, b| error(a).total_cmp(&error(b)));
    let plain = study.of_series(F32).find(|point| point.label == CASES[0].0);
    if let (Some(hardest), Some(plain)) = (hardest, plain) {
        findings.push(format!(
            "The f32 frame with the largest error is \"{}\", with {}; that of \"{}\" is {}.",
            hardest.label,
            percent(error(&hardest)),
            plain.label,
            percent(error(&plain))
        ));
    }
    findings.extend(of_equations(study));
    let bytes: Vec<(&Point, f64)> = study.of_series(EIGHT).map(|point| (point, error(&point))).collect();
    let worse: Vec<&str> = study
        .of_series(F32)
        .zip(&bytes)
        .filter(|(frame, (_, kept))| error(frame) > 0.5 * kept)
        .map(|(frame, _)| frame.label.as_str())
        .collect();
    findings.push(match worse.is_empty() {
        true => "In every case storing in eight bits loses more than twice as much as f32.".to_owned(),
        false => {
            format!(
                "Cases in which f32 loses at least half as much as storing in eight bits: {}.",
                listed(&worse, "and")
            )
        }
    });
    let times = study.of_series(F32).zip(study.of_series(F64));
    let pairs: Vec<(Spread, Spread)> =
        times.filter_map(|(frame, rays)| Some((frame.milliseconds?, rays.milliseconds?))).collect();
    let factors: Vec<f64> = pairs.iter().map(|(frame, rays)| rays.median / frame.median).collect();
    let apart = pairs.iter().filter(|(frame, rays)| frame.is_below(rays)).count();
    if let (Some(factor), Some((frame, _))) = (Spread::of(&factors), pairs.first()) {
        findings.push(format!(
            "Rays in f64 take distinguishably longer than the frame in {apart} of {} cases: {} times as long in the median ({} to {}; a frame takes {}).",
            pairs.len(),
            rounded(factor.median),
            rounded(factor.lower),
            rounded(factor.upper),
            milliseconds(frame)
        ));
    }
    findings
}
