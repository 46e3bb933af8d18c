//! The batches of rays that are traced in a scene: coherent camera rays, cosine-distributed rays from the surfaces,
//! and shadow rays.

use glam::Vec3;
use lumbre_rays::{Ray, offset_ray_origin, triangle_extent};

use super::scenes::Scene;

/// Side length of the camera's picture; the other batches have as many rays as it has pixels.
const SIDE: usize = 256;
const RAYS: usize = SIDE * SIDE;

pub struct Batch {
    pub name: &'static str,
    /// Whether any hit is asked for, or the closest.
    pub any: bool,
    pub rays: Vec<Ray>,
}

/// The rays of a pinhole camera of 90 degrees, row by row.
pub fn camera(scene: &Scene) -> Vec<Ray> {
    let [eye, target] = scene.camera;
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let at = |i: usize| (i as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
    (0..SIDE)
        .flat_map(|y| (0..SIDE).map(move |x| (x, y)))
        .map(|(x, y)| Ray::new(eye, (forward + right * at(x) - up * at(y)).normalize()))
        .collect()
}

/// Rays with origins uniform over the surface area and directions cosine-distributed about the normal.
pub fn cosine(scene: &Scene) -> Vec<Ray> {
    let mut random = Random(1);
    surface_points(scene, &mut random)
        .map(|(origin, normal, [x, y])| {
            let (radius, angle) = (x.sqrt(), y * std::f32::consts::TAU);
            let (tangent, bitangent) = normal.any_orthonormal_pair();
            let direction = tangent * (radius * angle.cos())
                + bitangent * (radius * angle.sin())
                + normal * (1.0 - x).max(0.0).sqrt();
            Ray::new(origin, direction)
        })
        .collect()
}

/// Rays from such origins to points on the lamp.
pub fn shadow(scene: &Scene) -> Vec<Ray> {
    let mut random = Random(2);
    let [corner, along, across] = scene.lamp;
    surface_points(scene, &mut random)
        .map(|(origin, _, [x, y])| {
            let target = corner + along * x + across * y;
            Ray::segment(origin, offset_ray_origin(target, Vec3::NEG_Y, target.abs().max_element()))
        })
        .collect()
}

/// Points just off the surfaces, with their normals and two random numbers each.
fn surface_points(scene: &Scene, random: &mut Random) -> impl Iterator<Item = (Vec3, Vec3, [f32; 2])> {
    let mut cumulative = Vec::with_capacity(scene.triangles.len());
    let mut total = 0.0f64;
    for [a, b, c] in &scene.triangles {
        total += f64::from((*b - *a).cross(*c - *a).length());
        cumulative.push(total);
    }
    (0..RAYS).map(move |_| {
        let at = f64::from(random.unit()) * total;
        let index = cumulative.partition_point(|&sum| sum <= at).min(scene.triangles.len() - 1);
        let triangle = &scene.triangles[index];
        let [a, b, c] = *triangle;
        let root = random.unit().sqrt();
        let v = random.unit() * root;
        let position = a * (1.0 - root) + b * (root - v) + c * v;
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
        let origin = offset_ray_origin(position, normal, triangle_extent(triangle));
        (origin, normal, [random.unit(), random.unit()])
    })
}

/// SplitMix64.
struct Random(u64);

impl Random {
    /// A number in [0, 1).
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }
}
