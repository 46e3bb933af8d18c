//! The first visible surface: through one point of the picture, and for all pixels as auxiliary pictures.
//! Light is not evaluated.

use glam::{DVec2, DVec3};

use crate::coplanar::nearest_layers;
use crate::geometry::Candidate;
use crate::surface_point::SurfacePoint;
use crate::tiles::for_every_pixel;
use crate::view::{View, pixel_middle};

/// The surface that is visible through a point of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHit {
    /// The name of the object.
    pub object: String,
    /// Position in the world, metres.
    pub position: DVec3,
    /// Unit shading normal.
    pub normal: DVec3,
    /// Distance in metres along the camera's viewing axis.
    pub depth: f64,
    /// k_d with its textures, linear RGB.
    pub albedo: DVec3,
    /// Emission of the surface, radiance.
    pub emission: DVec3,
}

impl FirstHit {
    /// Finds the surface through a point in pixels from the upper left corner; `None` where the background is
    /// visible.
    pub(crate) fn through(view: &View, place: DVec2) -> Option<Self> {
        let point = first_point(view, place)?;
        Some(Self {
            object: view.scene.objects[point.object].name.clone(),
            position: point.position + view.scene.origin,
            normal: point.normal,
            depth: view.camera.depth(point.position),
            albedo: point.surface.diffuse,
            emission: point.emission,
        })
    }
}

/// The first visible surfaces of all pixels.
#[derive(Clone, Debug)]
pub(crate) struct FirstHits {
    /// k_d and unit shading normal, averaged over samples; samples of the background count as 0.
    pub albedo: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    /// Metres along the viewing axis through the pixel's centre; infinite where the background is visible.
    pub depths: Vec<f64>,
}

/// Largest number of samples per pixel, which is enough for smooth edges.
const MAX_SAMPLES: u32 = 16;

impl FirstHits {
    /// Takes the same sample positions as the picture's own first pass.
    pub fn of(view: &View) -> Self {
        let samples = view.options.samples.unwrap_or(MAX_SAMPLES).min(MAX_SAMPLES);
        let (width, height) = view.size();
        let pixel = |x: usize, y: usize| {
            let (mut albedo, mut normal, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for index in 0..samples {
                let (_, place, sign) = view.sample_place((x, y), 0, index);
                weight += sign;
                if let Some(point) = first_point(view, place) {
                    albedo += point.surface.diffuse * sign;
                    normal += point.normal * sign;
                }
            }
            let middle = first_point(view, pixel_middle(x, y));
            let depth = middle.map_or(f64::INFINITY, |point| view.camera.depth(point.position));
            // Samples whose signs cancel give no estimate of the pixel.
            let mean = |sum: DVec3| if weight.abs() > 1e-6 { sum / weight } else { DVec3::ZERO };
            (mean(albedo), mean(normal), depth)
        };
        let count = width * height;
        let (mut albedo, mut normals) = (vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]);
        let mut depths = vec![f64::INFINITY; count];
        for (square, values) in for_every_pixel((width, height), pixel, || false, |_| {}) {
            for ((x, y), found) in square.pixels().zip(values.into_iter().flatten()) {
                let at = y * width + x;
                (albedo[at], normals[at], depths[at]) = found;
            }
        }
        Self { albedo, normals, depths }
    }
}

fn first_point(view: &View, place: DVec2) -> Option<SurfacePoint> {
    let (camera, scene) = (view.camera.through(place), &view.scene);
    let seen = |candidate: &Candidate| scene.is_seen(candidate);
    nearest_layers(scene, &camera.ray, camera.farthest, seen).map(|layers| layers.top.point)
}
