//! Looks reference points up in a baked world and measures the error. Not a bake.

#![allow(dead_code, reason = "every test and example uses its own part of this module")]

use std::path::{Path, PathBuf};

use bevy_ecs::world::World;
use glam::{DVec2, DVec3, Vec3};
use lumbre_scene::{GlobalTransform, Lightmap, LightmapImage, Mesh};

/// A folder of measured data beside the checkout; `None`, loudly, where it is missing.
pub fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join(path);
    if found.exists() {
        return Some(found);
    }
    eprintln!("SKIPPED: {} is missing; nothing was compared", found.display());
    None
}

/// Form factor from an element below to a square of a side in a parallel plane at a height, by its four corners (the element lies under the point
/// (x, z) measured from the square's middle).
pub fn to_square(x: f64, z: f64, side: f64, height: f64) -> f64 {
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / height, b / height);
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * std::f64::consts::PI)
    };
    let h = 0.5 * side;
    corner(h - x, h - z) + corner(h + x, h - z) + corner(h - x, h + z) + corner(h + x, h + z)
}

/// A point of a surface and its converged irradiance, W/m²; NaN where a channel is unknown.
#[derive(Clone, Copy, Debug)]
pub struct ReferencePoint {
    pub position: DVec3,
    pub normal: DVec3,
    pub irradiance: DVec3,
}

pub fn read_reference(path: &Path) -> Vec<ReferencePoint> {
    let text = std::fs::read_to_string(path).expect("the reference file is readable text");
    let rows = text.lines().skip(1).map(|line| {
        let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect();
        ReferencePoint {
            position: DVec3::new(v[0], v[1], v[2]),
            normal: DVec3::new(v[3], v[4], v[5]),
            irradiance: DVec3::new(v[6], v[7], v[8]),
        }
    });
    rows.collect()
}

/// Errors relative to the mean irradiance, all channels together.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    pub points: usize,
    pub missed: usize,
    pub mean: f64,
    pub median: f64,
    pub p95: f64,
    pub rmse: f64,
    pub bias: f64,
    /// The points of the largest errors: position, found, expected.
    pub worst: Vec<(DVec3, DVec3, DVec3)>,
}

impl std::fmt::Display for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let percent = |x: f64| format!("{:.2} %", 100.0 * x);
        write!(
            f,
            "{} points ({} missed), mean E {:.4}: median {}, p95 {}, RMSE {}, bias {}",
            self.points,
            self.missed,
            self.mean,
            percent(self.median),
            percent(self.p95),
            percent(self.rmse),
            percent(self.bias)
        )
    }
}

/// Looks every point up in the world's lightmaps, bilinearly.
pub fn compare(world: &mut World, points: &[ReferencePoint]) -> Comparison {
    let surfaces = lightmapped(world);
    let mut pairs = Vec::new();
    let (mut missed, mut sum, mut count) = (0, 0.0, 0.0);
    for point in points {
        let Some(found) = look_up(&surfaces, point) else {
            missed += 1;
            continue;
        };
        for channel in 0..3 {
            if point.irradiance[channel].is_finite() {
                sum += point.irradiance[channel];
                count += 1.0;
            }
        }
        pairs.push((point.position, found, point.irradiance));
    }
    let mean = sum / count;
    let mut errors = Vec::new();
    let mut bias = 0.0;
    for (_, found, expected) in &pairs {
        for channel in 0..3 {
            if expected[channel].is_finite() {
                let error = (found[channel] - expected[channel]) / mean;
                errors.push(error.abs());
                bias += error;
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    let error_of = |(_, found, expected): &(DVec3, DVec3, DVec3)| {
        (0..3)
            .filter(|&c| expected[c].is_finite())
            .map(|c| (found[c] - expected[c]).abs())
            .fold(0.0, f64::max)
    };
    pairs.sort_by(|a, b| error_of(b).total_cmp(&error_of(a)));
    pairs.truncate(12);
    Comparison {
        points: points.len() - missed,
        missed,
        mean,
        median: errors[errors.len() / 2],
        p95: errors[errors.len() * 95 / 100],
        rmse: (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt(),
        bias: bias / errors.len() as f64,
        worst: pairs,
    }
}

/// World triangles with their lightmap coordinates.
pub type Surface = (Vec<([DVec3; 3], [DVec2; 3])>, std::sync::Arc<LightmapImage>);

pub fn lightmapped(world: &mut World) -> Vec<Surface> {
    let mut query = world.query::<(&Mesh, &Lightmap, &GlobalTransform)>();
    let surfaces = query.iter(world).map(|(mesh, lightmap, transform)| {
        let triangles = mesh
            .0
            .triangles()
            .map(|t| {
                let corners =
                    t.map(|v| transform.0.transform_point3(mesh.0.positions[v as usize].as_dvec3()));
                (corners, t.map(|v| mesh.0.uv1[v as usize].as_dvec2()))
            })
            .collect();
        (triangles, lightmap.image.clone())
    });
    surfaces.collect()
}

/// Irradiance by the map at a point, bilinearly; `None` where no triangle passes through it.
pub fn look_up(surfaces: &[Surface], point: &ReferencePoint) -> Option<DVec3> {
    let mut best: Option<(f64, DVec3)> = None;
    for (triangles, image) in surfaces {
        for ([a, b, c], [ta, tb, tc]) in triangles {
            let cross = (*b - *a).cross(*c - *a);
            let Some(normal) = cross.try_normalize() else { continue };
            if normal.dot(point.normal) < 0.99 {
                continue;
            }
            let d = point.position - *a;
            let size = cross.length();
            let u = d.cross(*c - *a).dot(normal) / size;
            let v = (*b - *a).cross(d).dot(normal) / size;
            let outside = (-u).max(-v).max(u + v - 1.0).max(0.0) * size.sqrt();
            let distance = d.dot(normal).abs().max(outside);
            if distance < 1e-3 * size.sqrt() && best.is_none_or(|(least, _)| distance < least) {
                let uv = *ta + (*tb - *ta) * u + (*tc - *ta) * v;
                best = Some((distance, bilinear(image, uv)));
            }
        }
    }
    best.map(|(_, value)| value * std::f64::consts::PI)
}

/// As a GPU samples it, clamped at the border.
pub fn bilinear(image: &LightmapImage, uv: DVec2) -> DVec3 {
    let at = uv * DVec2::new(f64::from(image.width), f64::from(image.height)) - 0.5;
    let low = at.floor();
    let f = at - low;
    let read = |dx: f64, dy: f64| {
        let x = (low.x + dx).clamp(0.0, f64::from(image.width - 1)) as usize;
        let y = (low.y + dy).clamp(0.0, f64::from(image.height - 1)) as usize;
        image.texels[y * image.width as usize + x].as_dvec3()
    };
    let top = read(0.0, 0.0).lerp(read(1.0, 0.0), f.x);
    let bottom = read(0.0, 1.0).lerp(read(1.0, 1.0), f.x);
    top.lerp(bottom, f.y)
}

/// Every texel of every map, by name.
pub fn maps(world: &mut World) -> Vec<(String, std::sync::Arc<LightmapImage>)> {
    let mut query = world.query::<&Lightmap>();
    let mut found: Vec<_> =
        query.iter(world).map(|lightmap| (lightmap.image.name.clone(), lightmap.image.clone())).collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found.dedup_by(|a, b| a.0 == b.0);
    found
}

/// The bits of all maps.
pub fn bits(world: &mut World) -> Vec<u32> {
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    maps(world).iter().flat_map(|(_, image)| image.texels.iter().flat_map(move |&t| bits(t))).collect()
}
