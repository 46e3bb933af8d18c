//! Study of the precision of f32 frames in cases that are hard for arithmetic, compared with rays in f64; of
//! the equations with every operation rounded to f16 or f32; and of frames stored in fewer bits.

use std::time::Instant;

use glam::DVec3;
use half::f16;
use lumbre_optics::{decode_srgb, encode_srgb};
use lumbre_render::FrameOptions;

use crate::findings::{listed, milliseconds, percent, rounded};
use crate::frame::Frame;
use crate::frames::draw_frames;
use crate::measured::Measured;
use crate::picture::Picture;
use crate::rounded_lighting::{FORMATS, rounded_lighting};
use crate::rounds::{Repeated, milliseconds_since, repeated};
use crate::scene_file::SceneFile;
use crate::scenes::{Sheet, sheet};
use crate::traced::lighting_of;
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Spread, Study};

/// The cases with their names.
const CASES: [(&str, Sheet); 7] = [
    ("plain", Sheet::PLAIN),
    ("exponent 50000", Sheet { shininess: 50_000.0, ..Sheet::PLAIN }),
    ("lamp at 2 cm", Sheet { height: 0.02, ..Sheet::PLAIN }),
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
const LOST: &str = "pixels without a number, %";

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    let mut measured = Measured { study: study(), ..Measured::default() };
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
    let traced = repeated(CASES.len(), conditions.repetitions(), |place, [from, _]| {
        conditions.tell(0.5 + 0.5 * from)?;
        let begun = Instant::now();
        let exact = lighting_of(conditions, &scenes[place])?;
        Ok((milliseconds_since(begun), exact))
    })?;
    for ((name, _), ((scene, frame), Repeated { times, made: exact })) in
        CASES.iter().zip(scenes.iter().zip(&drawn).zip(traced))
    {
        let reference = measured.keep_reference(&format!("f64 {name}"), exact.clone());
        let size = conditions.size_text();
        let point = |series: &str, time, command: String| Point {
            series: series.into(),
            label: (*name).into(),
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
            (F32, frame.picture.clone(), draw),
            (F16, in_halves(&frame.picture), conditions.again("precision")),
            (EIGHT, in_bytes(&frame.picture), conditions.again("precision")),
        ];
        for (series, picture, command) in kept {
            let mut point = point(series, frame.spread(), command);
            point.counts = frame.counts();
            measured.add_picture(point, picture, &reference, ErrorOver::Picture)?;
        }
        for format in FORMATS {
            let mut world = scene.open(conditions.aspect())?;
            let Some(rounded) = rounded_lighting(&mut world, conditions.size, format) else { continue };
            // The equations are evaluated and rounded on the CPU, so there is no time of a device.
            let mut point = point(format.name, None, conditions.again("precision"));
            point.figures.insert(LOST.into(), 100.0 * rounded.lost);
            measured.add_picture(point, rounded.picture, &reference, ErrorOver::Picture)?;
        }
        measured.add_picture(point(F64, Spread::of(&times), trace), exact, &reference, ErrorOver::Picture)?;
    }
    measured.study.findings = findings(&measured.study);
    Ok(measured)
}

fn study() -> Study {
    Study {
        name: "precision".into(),
        title: "f32 on the device, compared with f64".into(),
        question: "A sheet that fills the frame is lit in ways that are hard for arithmetic. What do frames in 32 bits lose, and what is lost by storing them in 16 or eight? What would plain equations lose in 16 and in 32 bits, and what would 64 bits cost, by tracing rays?".into(),
        reference: "the same lighting equation at the same pixels, traced in f64".into(),
        plots: vec![Plot {
            title: "Error over time".into(),
            across: Quantity::Milliseconds,
            up: Quantity::Error,
            front: true,
            ..Plot::default()
        }],
        notes: vec![
            "The equations in f16 and f32 are rounded after every operation, without the renderer's measures for hard cases; positions are relative to the eye. Pixels for which the format has no finite number are black."
                .into(),
        ],
        ..Study::default()
    }
}

fn each_channel(picture: &Picture, kept: impl Fn(f64) -> f64) -> Picture {
    let radiance = picture.radiance.iter().map(|pixel| DVec3::from(pixel.to_array().map(&kept))).collect();
    Picture { width: picture.width, radiance }
}

fn in_halves(picture: &Picture) -> Picture {
    each_channel(picture, |value| f64::from(f16::from_f64(value)))
}

/// Rounds to eight bits in sRGB encoding, as for a screen, without a tone curve.
fn in_bytes(picture: &Picture) -> Picture {
    each_channel(picture, |value| decode_srgb((255.0 * encode_srgb(value.clamp(0.0, 1.0))).round() / 255.0))
}

/// Reports what plain equations lose in f16, and in f32 compared with the device's frames.
fn of_equations(study: &Study) -> Vec<String> {
    let error = |point: &Point| point.error.map_or(0.0, |error| error.relative_rmse);
    let [short, long] = FORMATS.map(|format| study.of_series(format.name).collect::<Vec<_>>());
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
