//! The f64 twin of a frame: the same scene rasterized and shaded on the CPU with `lumbre_optics`, pixel centres exactly, no
//! multisampling, no textures but lightmaps, no transparency. It shares no code with the renderer but the components.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DMat3, DVec2, DVec3};
use lumbre_optics::{
    Contribution, Light, LightKind, LightSample, Material, ReflectionModel, Shading, SurfaceSample,
    add_emission, apply_fog, evaluate_light, facing_normal, fog_weight, light_contribution, safe_normalize,
    viewer_direction,
};
use lumbre_scene::{
    Camera, GlobalTransform, Hidden, Lightmap, LightmapImage, Mesh, Projection, SceneSettings,
    update_transforms,
};

/// A frame of the twin.
pub struct TwinFrame {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Radiance, top row first; the background where no surface is.
    pub color: Vec<DVec3>,
    /// What each pixel shows: object and triangle, or `None` for the background.
    pub surface: Vec<Option<(usize, usize)>>,
}

/// Choices of the twin, as the renderer's.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwinOptions {
    /// Instead of each object's own.
    pub shading: Option<Shading>,
    /// Instead of the scene's.
    pub reflection: Option<ReflectionModel>,
}

struct Vertex {
    point: DVec3,
    normal: DVec3,
    uv1: DVec2,
}

struct Scene {
    settings: SceneSettings,
    reflection: ReflectionModel,
    lights: Vec<(Light, DVec3, DVec3)>,
    eye: DVec3,
    basis: DMat3,
}

struct Object {
    material: Material,
    shading: Shading,
    lightmap: Option<Arc<LightmapImage>>,
    triangles: Vec<[Vertex; 3]>,
}

/// Draws `world` from its first camera.
///
/// # Panics
/// Without a perspective camera: the tests' scenes have one.
pub fn draw(world: &mut World, width: usize, height: usize, options: TwinOptions) -> TwinFrame {
    update_transforms(world);
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let mut cameras = world.query::<(&Camera, &GlobalTransform)>();
    let (camera, place) = cameras.iter(world).next().expect("the scene has a camera");
    let Projection::Perspective { vertical_fov, near, .. } = camera.projection else {
        panic!("the twin knows perspective cameras only")
    };
    let (eye, axes) = (place.translation(), place.0.matrix3);
    let backward = axes.z_axis.normalize();
    let right = axes.y_axis.cross(backward).normalize();
    let basis = DMat3::from_cols(right, backward.cross(right), backward);
    let mut lights = world.query::<(&Light, &GlobalTransform)>();
    let lights =
        lights.iter(world).map(|(light, at)| (light.clone(), at.translation(), at.forward())).collect();
    let reflection = options.reflection.unwrap_or(settings.reflection);
    let scene = Scene { settings, reflection, lights, eye, basis };
    let objects = collect(world, &settings, options);

    let mut frame = TwinFrame {
        width,
        height,
        color: vec![settings.background.as_dvec3(); width * height],
        surface: vec![None; width * height],
    };
    let mut nearest = vec![f64::INFINITY; width * height];
    let focal = 1.0 / (0.5 * vertical_fov).tan();
    let aspect = width as f64 / height as f64;
    for (index, object) in objects.iter().enumerate() {
        for (number, triangle) in object.triangles.iter().enumerate() {
            // View space, then pixels; a triangle that crosses the near plane is left out: the tests' scenes have none.
            let view = triangle.each_ref().map(|vertex| basis.transpose() * (vertex.point - eye));
            if view.iter().any(|v| -v.z < near) {
                continue;
            }
            let pixel = view.map(|v| {
                let x = focal * v.x / (aspect * -v.z);
                let y = focal * v.y / -v.z;
                DVec2::new((x + 1.0) * 0.5 * width as f64, (1.0 - y) * 0.5 * height as f64)
            });
            let area = (pixel[1] - pixel[0]).perp_dot(pixel[2] - pixel[0]);
            // Pixel rows run down, so that counter-clockwise in the world is negative here.
            let front = area < 0.0;
            if area == 0.0 || !front && !object.material.double_sided {
                continue;
            }
            let shaded = ShadedTriangle::new(&scene, object, triangle, front);
            let low = pixel[0].min(pixel[1]).min(pixel[2]).floor().max(DVec2::ZERO);
            let high = pixel[0].max(pixel[1]).max(pixel[2]).ceil();
            for y in low.y as usize..(high.y as usize).min(height) {
                for x in low.x as usize..(high.x as usize).min(width) {
                    let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let edge = |a: usize, b: usize| (pixel[b] - pixel[a]).perp_dot(center - pixel[a]) / area;
                    let screen = [edge(1, 2), edge(2, 0), edge(0, 1)];
                    if screen.iter().any(|weight| *weight < 0.0) {
                        continue;
                    }
                    // Perspective-correct weights: divide by the distance along the view axis.
                    let weighted = [0, 1, 2].map(|i| screen[i] / -view[i].z);
                    let sum: f64 = weighted.iter().sum();
                    let depth = 1.0 / sum;
                    let at = y * width + x;
                    if depth < nearest[at] {
                        nearest[at] = depth;
                        frame.surface[at] = Some((index, number));
                        frame.color[at] = shaded.at(weighted.map(|weight| weight / sum));
                    }
                }
            }
        }
    }
    frame
}

impl TwinFrame {
    /// The pixels whose whole 3x3 neighbourhood shows one surface, or for flat shading one triangle: there no rounding of
    /// coverage can show another.
    pub fn interior(&self, one_triangle: bool) -> Vec<Option<DVec3>> {
        let key = |x: usize, y: usize| {
            self.surface[y * self.width + x]
                .map(|(object, triangle)| (object, if one_triangle { triangle } else { 0 }))
        };
        let inside = |x: usize, y: usize| {
            if x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height {
                return false;
            }
            (x - 1..=x + 1).all(|i| (y - 1..=y + 1).all(|j| key(i, j) == key(x, y)))
        };
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| inside(x, y).then(|| self.color[y * self.width + x]))
            .collect()
    }
}

impl TwinFrame {
    /// As [`interior`](Self::interior), without the background: that agrees too easily to be counted.
    pub fn inside_surfaces(&self, one_triangle: bool) -> Vec<Option<DVec3>> {
        let interior = self.interior(one_triangle);
        interior
            .iter()
            .zip(&self.surface)
            .map(|(color, surface)| color.filter(|_| surface.is_some()))
            .collect()
    }
}

fn collect(world: &mut World, settings: &SceneSettings, options: TwinOptions) -> Vec<Object> {
    let mut query = world.query_filtered::<(
        &Mesh,
        &Material,
        &GlobalTransform,
        Option<&Shading>,
        Option<&Lightmap>,
    ), Without<Hidden>>();
    let object = |(mesh, material, place, shading, lightmap): (
        &Mesh,
        &Material,
        &GlobalTransform,
        Option<&Shading>,
        Option<&Lightmap>,
    )| {
        // Of unit size, so that what counts as no normal does not depend on the scale.
        let normals = place.normal_matrix();
        let largest = normals.to_cols_array().iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let normals = if largest > 0.0 { normals * (1.0 / largest) } else { normals };
        let vertex = |index: u32| {
            let index = index as usize;
            let normal = mesh.0.normals.get(index).map_or(DVec3::ZERO, |normal| normal.as_dvec3());
            Vertex {
                point: place.0.transform_point3(mesh.0.positions[index].as_dvec3()),
                normal: safe_normalize(normals * normal),
                uv1: mesh.0.uv1.get(index).map_or(DVec2::ZERO, |uv| uv.as_dvec2()),
            }
        };
        Object {
            material: material.clone(),
            shading: options.shading.or(shading.copied()).unwrap_or(settings.shading),
            lightmap: lightmap.map(|lightmap| Arc::clone(&lightmap.image)),
            triangles: mesh
                .0
                .triangles()
                .map(|triangle| {
                    // A mirrored triangle winds the other way; its front stays its front.
                    let [a, b, c] = triangle.map(vertex);
                    if place.mirrors() { [a, c, b] } else { [a, b, c] }
                })
                .collect(),
        }
    };
    query.iter(world).map(object).collect()
}

/// A triangle with what is computed once of it.
struct ShadedTriangle<'a> {
    scene: &'a Scene,
    object: &'a Object,
    triangle: &'a [Vertex; 3],
    front: bool,
    /// Of the vertices (Gouraud) or of the face (flat, three times the same).
    colors: Option<[DVec3; 3]>,
}

impl<'a> ShadedTriangle<'a> {
    fn new(scene: &'a Scene, object: &'a Object, triangle: &'a [Vertex; 3], front: bool) -> Self {
        let mut shaded = Self { scene, object, triangle, front, colors: None };
        let [a, b, c] = triangle.each_ref().map(|vertex| vertex.point);
        shaded.colors = match object.shading {
            Shading::Phong => None,
            Shading::Gouraud => Some(triangle.each_ref().map(|v| shaded.lit(v.point, v.normal))),
            Shading::Flat => {
                let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO);
                Some([shaded.lit((a + b + c) / 3.0, normal); 3])
            }
        };
        shaded
    }

    fn at(&self, weights: [f64; 3]) -> DVec3 {
        let mix =
            |values: [DVec3; 3]| values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2];
        let vertices = self.triangle;
        let point = mix(vertices.each_ref().map(|vertex| vertex.point));
        let mut color = match self.colors {
            Some(colors) => mix(colors),
            None => {
                let normal = mix(vertices.each_ref().map(|vertex| vertex.normal));
                self.lit(point, safe_normalize(normal))
            }
        };
        if let Some(lightmap) = &self.object.lightmap {
            let uv = (0..3).map(|i| vertices[i].uv1 * weights[i]).sum();
            let baked = sample_bilinear(lightmap, uv);
            color += self.object.material.surface(self.lit_as_front()).diffuse.as_dvec3() * baked;
        }
        match &self.scene.settings.fog {
            Some(fog) => {
                let distance = (self.scene.eye - point).dot(self.scene.basis.z_axis);
                apply_fog(fog_weight(&fog.mode, distance), color, fog.color.as_dvec3())
            }
            None => color,
        }
    }

    /// Back faces are lit as such only where two-sided lighting is on.
    fn lit_as_front(&self) -> bool {
        self.front || !(self.object.material.double_sided && self.scene.settings.two_sided)
    }

    fn lit(&self, point: DVec3, normal: DVec3) -> DVec3 {
        let scene = self.scene;
        let front = self.lit_as_front();
        let side = self.object.material.surface(front);
        let surface = SurfaceSample::new(&self.object.material, front);
        let normal = facing_normal(normal, front);
        let viewer = viewer_direction(scene.settings.local_viewer, scene.eye, scene.basis.z_axis, point);
        let mapped = self.object.lightmap.is_some();
        let mut sum = Contribution::ZERO;
        if !mapped {
            sum.ambient += surface.ambient * scene.settings.ambient.as_dvec3();
        }
        for (light, position, axis) in &scene.lights {
            let sample: LightSample = evaluate_light(light, *position, *axis, point);
            let mut added = light_contribution(scene.reflection, surface, &sample, normal, viewer);
            if mapped && light.kind == LightKind::Ambient {
                added = Contribution::ZERO;
            }
            if mapped && light.bake == lumbre_optics::BakeMode::Static {
                added.diffuse = DVec3::ZERO;
            }
            sum = sum + added;
        }
        add_emission(sum.total(), side.emission.as_dvec3())
    }
}

/// Bilinear, clamped to the edge.
fn sample_bilinear(image: &LightmapImage, uv: DVec2) -> DVec3 {
    let (width, height) = (image.width as i64, image.height as i64);
    let at = uv * DVec2::new(width as f64, height as f64) - 0.5;
    let (corner, part) = (at.floor(), at - at.floor());
    let texel = |dx: i64, dy: i64| {
        let x = (corner.x as i64 + dx).clamp(0, width - 1);
        let y = (corner.y as i64 + dy).clamp(0, height - 1);
        image.texels[(y * width + x) as usize].as_dvec3()
    };
    texel(0, 0).lerp(texel(1, 0), part.x).lerp(texel(0, 1).lerp(texel(1, 1), part.x), part.y)
}
