//! A picture of a lightmapped world from its camera, by ray casting on the CPU: diffuse colour times the lightmap,
//! without highlights. It is independent of the renderer.

use std::path::Path;

use bevy_ecs::prelude::With;
use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_optics::Material;
use lumbre_scene::{Camera, GlobalTransform, Lightmap, Mesh, Projection, SceneSettings, StaticObject};
use rayon::prelude::*;

use super::path_tracer::hierarchy::Hierarchy;
use super::path_tracer::triangles;
use crate::common::{Surface, bilinear};
use lumbre_trace::flip::Picture;

/// The radiance of the pixels, row by row.
pub struct View {
    pub width: usize,
    pub radiance: Vec<DVec3>,
}

/// The linear value at which the logarithmic average of a picture is shown.
const MIDDLE_GREY: f64 = 0.18;

impl View {
    /// Renders the view of the world's first camera; `None` if there is none or it is not a perspective camera.
    pub fn of(world: &mut World, width: usize, height: usize) -> Option<Self> {
        let scene = Hierarchy::new(triangles(world));
        let objects = lightmapped(world);
        let sky =
            world.get_resource::<SceneSettings>().map_or(DVec3::ZERO, |settings| settings.sky.as_dvec3());
        let (camera, place) = world.query::<(&Camera, &GlobalTransform)>().iter(world).next()?;
        let Projection::Perspective { vertical_fov, .. } = camera.projection else { return None };
        let (place, half) = (place.0, (0.5 * vertical_fov).tan());
        let pixel = |index: usize| {
            let at = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
            let size = DVec2::new(width as f64, height as f64);
            let at = (2.0 * at - size) / size.y * half;
            let direction = place.transform_vector3(DVec3::new(at.x, -at.y, -1.0)).normalize();
            let Some(hit) = scene.closest(place.translation, direction) else { return sky };
            let triangle = &scene.triangles[hit.triangle];
            if triangle.normal.dot(direction) >= 0.0 {
                return DVec3::ZERO;
            }
            let weights = triangle.barycentric(place.translation + direction * hit.distance);
            let [object, index] = triangle.source;
            let light = objects[object].as_ref().map_or(DVec3::ZERO, |(triangles, image)| {
                let (_, [a, b, c]) = triangles[index];
                bilinear(image, a + (b - a) * weights.x + (c - a) * weights.y)
            });
            triangle.reflectance * light + triangle.emission
        };
        Some(Self { width, radiance: (0..width * height).into_par_iter().map(pixel).collect() })
    }

    /// The factor that maps the logarithmic average to middle grey.
    pub fn exposure(&self) -> f64 {
        let lit = || self.radiance.iter().map(|color| color.element_sum() / 3.0).filter(|light| *light > 0.0);
        let logarithm = lit().map(f64::ln).sum::<f64>() / lit().count().max(1) as f64;
        MIDDLE_GREY / logarithm.exp()
    }

    /// The picture with this exposure, clamped and sRGB-encoded (IEC 61966-2-1).
    pub fn exposed(&self, exposure: f64) -> Picture {
        let channel = |v: f64| match (v * exposure).clamp(0.0, 1.0) {
            v if v <= 0.003_130_8 => 12.92 * v,
            v => 1.055 * v.powf(1.0 / 2.4) - 0.055,
        };
        let pixels = self.radiance.iter().map(|color| DVec3::from(color.to_array().map(channel)));
        Picture { width: self.width, pixels: pixels.collect() }
    }
}

/// The lightmap coordinates and lightmaps of all objects, in the order of the path tracer's objects.
fn lightmapped(world: &mut World) -> Vec<Option<Surface>> {
    let mut query =
        world.query_filtered::<(&Mesh, &Material, Option<&Lightmap>, &GlobalTransform), With<StaticObject>>();
    let surface = |(mesh, _, lightmap, _): (&Mesh, &Material, Option<&Lightmap>, &GlobalTransform)| {
        let image = lightmap?.image.clone();
        let at = |vertex: u32| mesh.0.uv1.get(vertex as usize).map_or(DVec2::ZERO, |uv| uv.as_dvec2());
        let triangles = mesh.0.triangles().map(|t| ([DVec3::ZERO; 3], t.map(at))).collect();
        Some((triangles, image))
    };
    query.iter(world).map(surface).collect()
}

pub fn write_png(picture: &Picture, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let bytes = picture.pixels.iter().flat_map(|color| color.to_array().map(|v| (255.0 * v).round() as u8));
    let height = picture.pixels.len() / picture.width;
    let image = image::RgbImage::from_raw(picture.width as u32, height as u32, bytes.collect());
    Ok(image.ok_or("a picture without pixels")?.save(path)?)
}
