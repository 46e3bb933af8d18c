//! Study of flat, Gouraud and Phong shading on a scan at several resolutions, from few triangles to all of
//! them. The study `shading` measures spheres, whose exact surface is known.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use lumbre_optics::Shading;
use lumbre_render::FrameOptions;
use lumbre_scene::{Lightmap, MaterialTextures, Mesh};

use super::over_scenes_made;
use super::shading::{of_one_mesh, series_of};
use crate::clustered_mesh::clustered;
use crate::findings::cheapest_by_error;
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_frames};
use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::scan;
use crate::traced::lighting_of;
use crate::{Conditions, CostError, ErrorOver, Plot, Point, Quantity, Study};

/// Numbers of grid cells along the longest side, the coarsest first; the full scan comes after them.
const CELLS: &[u32] = &[6, 10, 16, 26, 42, 68, 110];
const FEW_CELLS: &[u32] = &[10, 26, 68];
/// Meshes with fewer triangles are not simplified.
const MIN_TRIANGLES: usize = 2_000;
const SECONDS: f64 = 9.0;
const RESOLUTION: &str = "cells along the longest side";

/// Runs the study.
///
/// # Errors
/// [`CostError`].
pub fn run(conditions: &Conditions<'_>) -> Result<Measured, CostError> {
    over_scenes_made(conditions, study(), ("scan", scan), |scene, told, measured| {
        of_scene(conditions, scene, told, measured)
    })
}

fn study() -> Study {
    Study {
        name: "scan".into(),
        title: "Shading a scan at several resolutions".into(),
        question: "A scan has more triangles than its shape requires. Which error does each shading reach with how many of them, and in which time?".into(),
        reference: "the scan with all of its triangles, traced in f64 with the same lighting equation at every pixel; the error includes the change of shape by simplification".into(),
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
                title: "Error over the mesh".into(),
                across: Quantity::Count("triangles".into()),
                up: Quantity::Error,
                joined: true,
                front: true,
                ..Plot::default()
            },
        ],
        ..Study::default()
    }
}

fn of_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    [before, after]: [f64; 2],
    measured: &mut Measured,
) -> Result<(), CostError> {
    let mut whole = scene.open(conditions.aspect())?;
    if largest_mesh(&mut whole) < MIN_TRIANGLES {
        measured.study.notes.push(format!(
            "{}: no mesh without textures has {MIN_TRIANGLES} triangles, so there is no scan to measure.",
            scene.name
        ));
        return Ok(());
    }
    let part = |share: f64| before + share * (after - before);
    let exact = lighting_of(conditions, scene)?;
    let reference = measured.keep_reference(&format!("{} traced", scene.name), exact);
    conditions.tell(part(0.1))?;
    let mut subjects: Vec<(Option<u32>, SceneFile)> = Vec::new();
    let few = conditions.unless_quick(CELLS, FEW_CELLS);
    for &cells in few {
        let mut world = scene.open(conditions.aspect())?;
        make_coarser(&mut world, cells);
        let name = format!("{}-{cells}", scene.name.replace(' ', "-"));
        subjects.push((Some(cells), SceneFile::made(conditions, &name, world)?));
    }
    subjects.push((None, scene.clone()));
    let mut frames = Vec::new();
    for (_, subject) in &subjects {
        for &shading in Shading::ALL {
            let world = subject.open(conditions.aspect())?;
            let options = FrameOptions { shading: Some(shading), shadows: false, ..FrameOptions::default() };
            frames.push(Frame::new(world, options).sharing(shading.name()));
        }
    }
    let drawn = draw_frames(conditions, frames, SECONDS, [part(0.1), after])?;
    let first = measured.study.points.len();
    for ((cells, subject), drawn) in subjects.iter().zip(drawn.chunks(Shading::ALL.len())) {
        for (&shading, frame) in Shading::ALL.iter().zip(drawn) {
            let point = point(conditions, scene, (*cells, subject), shading, frame);
            measured.add_picture(point, frame.picture.clone(), &reference, ErrorOver::Picture)?;
        }
    }
    let points: Vec<&Point> = measured.study.points[first..].iter().collect();
    let mut findings: Vec<String> = cheapest_by_error(&points, "").into_iter().collect();
    let last = |all: &[DrawnFrame]| all.len() - Shading::ALL.len();
    findings.extend(of_one_mesh(&measured.study.points[first + last(&drawn)..], &drawn[last(&drawn)..]));
    measured.study.findings.extend(findings);
    Ok(())
}

fn point(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    (cells, subject): (Option<u32>, &SceneFile),
    shading: Shading,
    frame: &DrawnFrame,
) -> Point {
    Point {
        series: scene.series(conditions, series_of(shading)),
        label: cells.map_or("all triangles".to_owned(), |cells| format!("{cells} cells")),
        parameters: cells.map(|cells| (RESOLUTION.to_owned(), f64::from(cells))).into_iter().collect(),
        milliseconds: frame.spread(),
        counts: frame.counts(),
        command: conditions.drawing(subject.in_commands(), &format!(" --shading {shading} --no-shadows")),
        ..Point::default()
    }
}

/// Meshes whose appearance depends only on their shape.
type Plain = (Without<MaterialTextures>, Without<Lightmap>);

/// Returns the number of triangles of the largest mesh that can be simplified.
fn largest_mesh(world: &mut World) -> usize {
    let mut meshes = world.query_filtered::<&Mesh, Plain>();
    meshes.iter(world).map(|mesh| mesh.0.triangle_count()).max().unwrap_or(0)
}

/// Simplifies the meshes that look like scans. Invalid meshes are left as they are.
fn make_coarser(world: &mut World, cells: u32) {
    let mut meshes = world.query_filtered::<&mut Mesh, Plain>();
    for mut mesh in meshes.iter_mut(world).filter(|mesh| mesh.0.triangle_count() >= MIN_TRIANGLES) {
        if let Ok(coarse) = clustered(&mesh.0, cells) {
            mesh.0 = Arc::new(coarse);
        }
    }
}
