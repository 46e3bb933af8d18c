//! Helpers of tests and examples: irradiance at reference points, read from the lightmaps of a baked world and compared
//! with the expected one, and the bits of all maps. The bakes themselves are in the tests.

#![allow(dead_code, reason = "each test and example uses only a part of this module")]

pub mod shapes;

use std::path::{Path, PathBuf};

use bevy_ecs::world::World;
use glam::{DVec2, DVec3, Vec3};
use lumbre_scene::{GlobalTransform, Lightmap, LightmapImage, Mesh};

/// Returns the path of a file or folder of measured data beside the checkout, or `None`, with a message, if it is
/// missing.
pub fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join(path);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is missing; nothing was compared", path.display());
    None
}

/// The form factor from a horizontal surface element to a horizontal square `height` above it: the sum of the form
/// factors of the four rectangles into which the vertical through the element cuts the square. The element lies at (x,
/// z) relative to the square's centre.
pub fn to_square(x: f64, z: f64, side: f64, height: f64) -> f64 {
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / height, b / height);
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * std::f64::consts::PI)
    };
    let h = 0.5 * side;
    corner(h - x, h - z) + corner(h + x, h - z) + corner(h - x, h + z) + corner(h + x, h + z)
}

/// A point on a surface with its converged irradiance in W/m²; a channel that is unknown is NaN.
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

/// Statistics of the errors at reference points. The errors are relative to the mean irradiance of all points; each
/// known channel of a point counts as one value.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// The number of points that lie on a lightmapped surface.
    pub points: usize,
    /// The number of points that lie on none.
    pub missed: usize,
    /// Mean expected irradiance, W/m².
    pub mean: f64,
    pub median: f64,
    pub p95: f64,
    pub rmse: f64,
    pub bias: f64,
    /// The twelve points with the largest errors, the worst first: position, irradiance in the map, expected
    /// irradiance.
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

/// Compares the irradiance that the world's lightmaps show at the points, filtered bilinearly, with the expected one.
pub fn compare(world: &mut World, points: &[ReferencePoint]) -> Comparison {
    let surfaces = lightmapped(world);
    let mut pairs = Vec::new();
    let (mut missed, mut sum, mut count) = (0, 0.0, 0.0);
    for point in points {
        let Some(irradiance) = look_up(&surfaces, point) else {
            missed += 1;
            continue;
        };
        for channel in 0..3 {
            if point.irradiance[channel].is_finite() {
                sum += point.irradiance[channel];
                count += 1.0;
            }
        }
        pairs.push((point.position, irradiance, point.irradiance));
    }
    let mean = sum / count;
    let mut errors = Vec::new();
    let mut bias = 0.0;
    for (_, irradiance, expected) in &pairs {
        for channel in 0..3 {
            if expected[channel].is_finite() {
                let error = (irradiance[channel] - expected[channel]) / mean;
                errors.push(error.abs());
                bias += error;
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    let error_of = |(_, irradiance, expected): &(DVec3, DVec3, DVec3)| {
        (0..3)
            .filter(|&c| expected[c].is_finite())
            .map(|c| (irradiance[c] - expected[c]).abs())
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

/// The triangles of an object in world space with their lightmap coordinates, and its lightmap.
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

/// Returns the irradiance that the lightmaps show at a point, or `None` if no lightmapped triangle passes through it.
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

/// Samples a lightmap as a GPU does, with bilinear filtering and clamping at the border.
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

/// Returns the world's lightmaps, sorted by name. A map that several objects share is listed once.
pub fn maps(world: &mut World) -> Vec<(String, std::sync::Arc<LightmapImage>)> {
    let mut query = world.query::<&Lightmap>();
    let mut maps: Vec<_> =
        query.iter(world).map(|lightmap| (lightmap.image.name.clone(), lightmap.image.clone())).collect();
    maps.sort_by(|a, b| a.0.cmp(&b.0));
    maps.dedup_by(|a, b| a.0 == b.0);
    maps
}

/// Returns the bits of all channels of all texels of all maps, so that two bakes can be compared exactly.
pub fn bits(world: &mut World) -> Vec<u32> {
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    maps(world).iter().flat_map(|(_, image)| image.texels.iter().flat_map(move |&t| bits(t))).collect()
}
