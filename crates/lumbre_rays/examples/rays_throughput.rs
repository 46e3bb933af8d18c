//! Throughput of one thread: cosine-distributed rays from random surface points, closest hit and any hit.
//!
//! `cargo run --release -p lumbre_rays --example rays_throughput [model.glb ...]`
//! Without arguments: the models of a `shared/models` folder beside the checkout, if there is one, and a hall of boxes.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use glam::{Mat4, Quat, Vec3};
use lumbre_rays::{Bvh, Ray, offset_ray_origin, triangle_extent};

const RAYS: usize = 1 << 18;

fn main() -> Result<(), Box<dyn Error>> {
    let mut models: Vec<String> = std::env::args().skip(1).collect();
    if models.is_empty() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/models");
        for name in ["stanford-bunny.glb", "cornell_box.glb"] {
            let path = folder.join(name);
            if path.exists() {
                models.push(path.display().to_string());
            } else {
                eprintln!("skipped: {} is not there", path.display());
            }
        }
    }
    measure("hall of boxes", &hall());
    for model in models {
        let name = Path::new(&model).file_name().map(|name| name.to_string_lossy().into_owned());
        measure(&name.unwrap_or_default(), &load(&model)?);
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "the figures are what this program is for")]
fn measure(name: &str, triangles: &[[Vec3; 3]]) {
    let start = Instant::now();
    let bvh = Bvh::build(triangles);
    let build = start.elapsed().as_secs_f64();
    let rays = surface_rays(triangles);
    let (closest, hits) = rate(&rays, |ray| bvh.closest_hit(ray).is_some());
    let (any, blocked) = rate(&rays, |ray| bvh.any_hit(ray));
    assert_eq!(hits, blocked, "closest and any hit disagree");
    println!(
        "{name}: {} triangles, built in {:.1} ms; closest {:.2}, any {:.2} Mrays/s; {:.1} % hit",
        triangles.len(),
        build * 1e3,
        closest / 1e6,
        any / 1e6,
        100.0 * hits as f64 / RAYS as f64
    );
}

/// Rays per second and hits. The best of nine runs of each short batch counts, so that a busy machine's
/// interruptions do not.
fn rate(rays: &[Ray], hit: impl Fn(&Ray) -> bool) -> (f64, usize) {
    let (mut seconds, mut hits) = (0.0, 0);
    for batch in rays.chunks(1 << 13) {
        let mut best = f64::INFINITY;
        let mut count = 0;
        for _ in 0..9 {
            let start = Instant::now();
            count = batch.iter().filter(|ray| hit(ray)).count();
            best = best.min(start.elapsed().as_secs_f64());
        }
        seconds += best;
        hits += count;
    }
    (rays.len() as f64 / seconds, hits)
}

/// Origins uniform over the area, directions by the cosine about the normal.
fn surface_rays(triangles: &[[Vec3; 3]]) -> Vec<Ray> {
    let mut cumulative = Vec::with_capacity(triangles.len());
    let mut total = 0.0f64;
    for [a, b, c] in triangles {
        total += f64::from((*b - *a).cross(*c - *a).length());
        cumulative.push(total);
    }
    let mut state = 0x1234_5678_9abc_def0u64;
    let mut random = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    };
    (0..RAYS)
        .map(|_| {
            let at = f64::from(random()) * total;
            let index = cumulative.partition_point(|&sum| sum <= at).min(triangles.len() - 1);
            let triangle = &triangles[index];
            let [a, b, c] = *triangle;
            let root = random().sqrt();
            let v = random() * root;
            let position = a * (1.0 - root) + b * (root - v) + c * v;
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
            let (radius, angle) = (random().sqrt(), random() * std::f32::consts::TAU);
            let (tangent, bitangent) = normal.any_orthonormal_pair();
            let direction = tangent * (radius * angle.cos())
                + bitangent * (radius * angle.sin())
                + normal * (1.0 - radius * radius).max(0.0).sqrt();
            Ray::new(offset_ray_origin(position, normal, triangle_extent(triangle)), direction)
        })
        .collect()
}

/// A room seen from inside with ten boxes in it: 132 triangles.
fn hall() -> Vec<[Vec3; 3]> {
    let mut triangles = cuboid(Mat4::from_scale(Vec3::new(20.0, 5.0, 10.0)), true);
    for i in 0..10 {
        let i = i as f32;
        let place = Vec3::new(i * 3.6 - 16.0, -4.0, (i * 2.4).sin() * 6.0);
        let place = Mat4::from_scale_rotation_translation(Vec3::ONE, Quat::from_rotation_y(i), place);
        triangles.extend(cuboid(place, false));
    }
    triangles
}

fn cuboid(place: Mat4, inward: bool) -> Vec<[Vec3; 3]> {
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        place.transform_point3(Vec3::new(sign(0), sign(1), sign(2)))
    };
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|[a, b, c]| if inward { [a, c, b] } else { [a, b, c] })
        .map(|triangle| triangle.map(corner))
        .collect()
}

fn load(path: &str) -> Result<Vec<[Vec3; 3]>, Box<dyn Error>> {
    let (document, buffers, _) = gltf::import(path)?;
    let mut triangles = Vec::new();
    let mut pending: Vec<_> = document
        .scenes()
        .flat_map(|scene| scene.nodes().collect::<Vec<_>>())
        .map(|node| (node, Mat4::IDENTITY))
        .collect();
    while let Some((node, parent)) = pending.pop() {
        let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        pending.extend(node.children().map(|child| (child, place)));
        for primitive in node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
            let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| &data[..]));
            let positions: Vec<Vec3> = reader
                .read_positions()
                .ok_or("a primitive without positions")?
                .map(|position| place.transform_point3(Vec3::from(position)))
                .collect();
            let indices: Vec<u32> = match reader.read_indices() {
                Some(indices) => indices.into_u32().collect(),
                None => (0..positions.len() as u32).collect(),
            };
            triangles.extend(
                indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|index| positions[index as usize])),
            );
        }
    }
    Ok(triangles)
}
