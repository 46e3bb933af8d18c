//! Measures the memory that a bake of many patches uses: `peak_memory TRIANGLES_ALONG_A_WALL MAP_SIZE [--memory BYTES]
//! [--final] [--glowing] [--apart]`; with `--glowing` every triangle of the walls emits light, with `--apart` there are gaps
//! between them, so that each of them is a patch.
//!
//! It reports the stages as they begin and prints, as JSON, the estimate, the peak memory of the process
//! (VmHWM on Linux) before and after the bake, and the patches.

use std::error::Error;
use std::io::Write;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::world::World;
use glam::{Vec2, Vec3};
use lumbre_bake::{Bake, BakeOptions, Density, Quality};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{Material, Surface};
use lumbre_scene::{Mesh, StaticObject};

fn main() -> Result<(), Box<dyn Error>> {
    let (mut numbers, mut glow, mut is_apart) = (Vec::new(), 0.0, false);
    let mut options =
        BakeOptions { quality: Quality::Draft, error: 0.5, threads: Some(2), ..BakeOptions::default() };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--memory" => options.memory = Some(arguments.next().ok_or("--memory needs bytes")?.parse()?),
            "--final" => options.quality = Quality::Final,
            "--glowing" => glow = 0.1,
            "--apart" => is_apart = true,
            _ => numbers.push(argument.parse::<u32>()?),
        }
    }
    let [along, side] = numbers[..] else { return Err("give triangles along a wall and a map size".into()) };
    options.density = Density::MapSize(side);
    let mut world = World::new();
    let mut walls = Material::matt(Vec3::splat(0.6));
    walls.front.emission = Vec3::splat(glow);
    let room = if is_apart { apart(&room(along)) } else { room(along) };
    world.spawn((Mesh(Arc::new(room)), walls, StaticObject));
    let lamp = Surface { emission: Vec3::splat(10.0), ..Surface::default() };
    let mut panel = TriangleMesh::default();
    wall(&mut panel, 1, Vec3::new(-0.3, 0.9, -0.3), [Vec3::X * 0.6, Vec3::Z * 0.6], Vec2::ZERO, 1.0);
    world.spawn((Mesh(Arc::new(panel)), Material { front: lamp, ..Material::default() }, StaticObject));
    let before = peak()?;
    let begun = Instant::now();
    let mut shown = None;
    let report = Bake::new(&options)
        .progress(|progress| {
            if shown != Some(progress.stage) {
                eprintln!("{:8.1} s: {}", begun.elapsed().as_secs_f64(), progress.stage);
                shown = Some(progress.stage);
            }
            ControlFlow::Continue(())
        })
        .run(&mut world)?;
    eprint!("{report}");
    writeln!(
        std::io::stdout(),
        "{{\"estimate\":{},\"before\":{before},\"after\":{},\"patches\":{},\"form_factors\":{},\"texels\":{},\"seconds\":{:.1}}}",
        report.memory_bytes,
        peak()?,
        report.patches,
        report.form_factors,
        report.texels,
        report.seconds
    )?;
    Ok(())
}

/// A cube seen from inside whose walls consist of `2 n²` triangles each, with lightmap coordinates in a 3 x 2 grid.
fn room(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let walls = [
        (-Vec3::ONE, [x, y]),
        (Vec3::new(-1.0, -1.0, 1.0), [y, x]),
        (-Vec3::ONE, [y, z]),
        (Vec3::new(1.0, -1.0, -1.0), [z, y]),
        (-Vec3::ONE, [z, x]),
        (Vec3::new(-1.0, 1.0, -1.0), [x, z]),
    ];
    for (index, (origin, edges)) in walls.into_iter().enumerate() {
        let cell = Vec2::new((index % 3) as f32, (index / 3) as f32) / 3.0;
        wall(&mut mesh, n, origin, edges, cell + 0.02, 0.29);
    }
    mesh
}

/// Adds a parallelogram of `2 n²` triangles; its front is the side from which the turn from edge `a` to edge `b` is
/// counter-clockwise.
fn wall(mesh: &mut TriangleMesh, n: u32, origin: Vec3, [a, b]: [Vec3; 2], uv: Vec2, uv_side: f32) {
    let first = mesh.positions.len() as u32;
    for row in 0..=n {
        for column in 0..=n {
            let (s, t) = (column as f32 / n as f32, row as f32 / n as f32);
            mesh.positions.push(origin + a * s + b * t);
            mesh.uv1.push(uv + Vec2::new(s, t) * uv_side);
        }
    }
    for row in 0..n {
        for column in 0..n {
            let p = first + row * (n + 1) + column;
            mesh.indices.extend([p, p + 1, p + n + 2, p, p + n + 2, p + n + 1]);
        }
    }
}

/// The same triangles, each a little smaller and with vertices of its own.
fn apart(mesh: &TriangleMesh) -> TriangleMesh {
    let mut smaller = TriangleMesh::default();
    for corners in mesh.indices.chunks_exact(3) {
        let corners = corners.iter().map(|&corner| corner as usize);
        let middle = corners.clone().map(|corner| mesh.positions[corner]).sum::<Vec3>() / 3.0;
        for corner in corners {
            smaller.indices.push(smaller.positions.len() as u32);
            smaller.positions.push(mesh.positions[corner].lerp(middle, 0.01));
            smaller.uv1.push(mesh.uv1[corner]);
        }
    }
    smaller
}

/// The peak resident memory of this process in bytes.
fn peak() -> Result<u64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).ok_or("no VmHWM")?;
    let kibibytes: u64 = line.split_whitespace().nth(1).ok_or("no number")?.parse()?;
    Ok(kibibytes * 1024)
}
