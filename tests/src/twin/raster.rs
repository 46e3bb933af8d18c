//! The twin's rasterizer: exactly at pixel centres, with the nearest surface visible.

use bevy_ecs::prelude::*;
use glam::{DMat3, DVec2, DVec3};
use lumbre_optics::Light;
use lumbre_scene::{Camera, GlobalTransform, Projection, SceneSettings, update_transforms};

use rayon::prelude::*;

use super::scene::{Object, Scene, Vertex, collect};
use super::shading::{PixelWeights, ShadedTriangle};
use super::volume::Volume;
use super::{TwinFrame, TwinOptions};

/// Draws `world` from its first camera.
///
/// # Panics
/// If that is not a perspective camera.
pub fn draw(world: &mut World, width: usize, height: usize, options: TwinOptions) -> TwinFrame {
    let view = View::new(world, width, height, options);
    let (surface, uncertain) = view.surfaces();
    let shade = |at: usize, (object, triangle): (usize, usize)| -> Option<DVec3> {
        let (object, triangle) = (&view.objects[object], &view.objects[object].triangles[triangle]);
        let seen = SeenTriangle::new(&view.lens, triangle)?;
        let (x, y) = (at % width, at / width);
        let shaded = ShadedTriangle::new(&view.scene, object, triangle, seen.front);
        // The neighbours within the two-by-two block in which fine derivatives are taken.
        let (left, top) = (x & !1, y & !1);
        let pixel = PixelWeights {
            center: seen.weights(center(x, y)),
            across: [left, left + 1].map(|x| seen.weights(center(x, y))),
            down: [top, top + 1].map(|y| seen.weights(center(x, y))),
        };
        Some(shaded.at(&pixel))
    };
    let mut color = vec![view.scene.settings.shown_background().as_dvec3(); width * height];
    color.par_iter_mut().zip(surface.par_iter()).enumerate().for_each(|(at, (color, surface))| {
        if let Some(lit) = surface.and_then(|surface| shade(at, surface)) {
            *color = lit;
        }
    });
    TwinFrame { width, height, color, surface, uncertain }
}

/// Returns how much lighter each pixel becomes because the tests' device moves the corners of triangles
/// ([`TwinOptions::subpixel_bits`]), up to `most`, where its display clamps: what a frame of that device differs by
/// from a picture of a program that does not.
///
/// # Panics
/// As [`draw`].
pub fn by_moved_corners(
    world: &mut World,
    width: usize,
    height: usize,
    options: TwinOptions,
    most: f64,
) -> Vec<DVec3> {
    if options.subpixel_bits.is_none() {
        return vec![DVec3::ZERO; width * height];
    }
    let exact = draw(world, width, height, TwinOptions { subpixel_bits: None, ..options });
    let moved = draw(world, width, height, options);
    let most = DVec3::splat(most);
    moved.color.iter().zip(&exact.color).map(|(moved, exact)| moved.min(most) - exact.min(most)).collect()
}

/// Returns how much every light except ambient ones reflects towards `world`'s first camera, per pixel: the
/// brightest channel of each light, and nothing where there is no surface. For surfaces without textures, under
/// Phong shading.
///
/// # Panics
/// As [`draw`].
pub fn reflected_by_pixel(
    world: &mut World,
    width: usize,
    height: usize,
    options: TwinOptions,
) -> Vec<Vec<f64>> {
    let view = View::new(world, width, height, options);
    let of_pixel = |(at, surface): (usize, &Option<(usize, usize)>)| -> Option<Vec<f64>> {
        let (object, triangle) = (*surface)?;
        let (object, triangle) = (&view.objects[object], &view.objects[object].triangles[triangle]);
        let seen = SeenTriangle::new(&view.lens, triangle)?;
        let weights = seen.weights(center(at % width, at / width));
        Some(ShadedTriangle::new(&view.scene, object, triangle, seen.front).reflected(weights))
    };
    view.surfaces().0.iter().enumerate().map(|pixel| of_pixel(pixel).unwrap_or_default()).collect()
}

/// Returns the same per corner of every triangle, visible or not, where flat and Gouraud shading evaluate lights.
/// Each triangle shows its front.
///
/// # Panics
/// As [`draw`].
pub fn reflected_by_corner(world: &mut World, options: TwinOptions) -> Vec<Vec<f64>> {
    let view = View::new(world, 1, 1, options);
    let triangles =
        view.objects.iter().flat_map(|object| object.triangles.iter().map(move |of| (object, of)));
    triangles
        .flat_map(|(object, triangle)| {
            ShadedTriangle::new(&view.scene, object, triangle, true).reflected_at_corners()
        })
        .collect()
}

/// A world as its first camera sees it.
struct View {
    scene: Scene,
    objects: Vec<Object>,
    lens: Lens,
}

impl View {
    fn new(world: &mut World, width: usize, height: usize, options: TwinOptions) -> Self {
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
        let flat_rule = options.flat_rule.unwrap_or(settings.flat_rule);
        let specular_antialiasing = options.specular_antialiasing.unwrap_or(settings.specular_antialiasing);
        let objects = collect(world, &settings, &options);
        let polygons = objects.iter().flat_map(Object::polygons).collect();
        let volume = Volume::of(world);
        let scene =
            Scene { settings, flat_rule, specular_antialiasing, lights, polygons, volume, eye, basis };
        let lens = Lens {
            focal: 1.0 / (0.5 * vertical_fov).tan(),
            near,
            size: DVec2::new(width as f64, height as f64),
            to_view: basis.transpose(),
            eye,
            subpixel_bits: options.subpixel_bits,
        };
        Self { scene, objects, lens }
    }

    /// Returns the object and triangle that each pixel shows, and whether that triangle may have been drawn
    /// elsewhere.
    fn surfaces(&self) -> (Vec<Option<(usize, usize)>>, Vec<bool>) {
        let (width, height) = (self.lens.size.x as usize, self.lens.size.y as usize);
        let mut surface = vec![None; width * height];
        let mut uncertain = vec![false; width * height];
        let mut nearest = vec![f64::INFINITY; width * height];
        for (index, object) in self.objects.iter().enumerate() {
            for (number, triangle) in object.triangles.iter().enumerate() {
                let Some(seen) = SeenTriangle::new(&self.lens, triangle) else { continue };
                if !seen.front && !object.material.double_sided {
                    continue;
                }
                let low = seen.pixel[0].min(seen.pixel[1]).min(seen.pixel[2]).floor().max(DVec2::ZERO);
                let high = seen.pixel[0].max(seen.pixel[1]).max(seen.pixel[2]).ceil();
                for y in low.y as usize..(high.y as usize).min(height) {
                    for x in low.x as usize..(high.x as usize).min(width) {
                        let Some(depth) = seen.depth_inside(center(x, y)) else { continue };
                        let at = y * width + x;
                        if depth < nearest[at] {
                            nearest[at] = depth;
                            surface[at] = Some((index, number));
                            uncertain[at] = seen.uncertain;
                        }
                    }
                }
            }
        }
        (surface, uncertain)
    }
}

fn center(x: usize, y: usize) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}

/// The parameters of the camera.
struct Lens {
    focal: f64,
    near: f64,
    /// Size of the frame in pixels.
    size: DVec2,
    to_view: DMat3,
    eye: DVec3,
    /// See [`TwinOptions::subpixel_bits`].
    subpixel_bits: Option<u32>,
}

impl Lens {
    /// Returns the place to which a rasterizer moves a vertex, in pixels, and whether rounding in f32 could have it
    /// moved to another one.
    fn moved(&self, pixel: DVec2) -> (DVec2, bool) {
        let Some(bits) = self.subpixel_bits else { return (pixel, false) };
        // The projection and the viewport transform take three roundings, of values up to the frame's size.
        let rounding = self.size * 1.5 * f64::from(f32::EPSILON);
        let steps = f64::from(1_u32 << bits);
        let moved = (pixel * steps).round() / steps;
        let from_middle = 0.5 / steps - (moved - pixel).abs();
        (moved, from_middle.cmplt(rounding).any())
    }
}

/// A triangle projected into the frame.
struct SeenTriangle {
    /// Corners in pixels, with y pointing down.
    pixel: [DVec2; 3],
    /// Distances along the view axis, in metres.
    depth: [f64; 3],
    /// Twice the signed area in pixels.
    area: f64,
    front: bool,
    /// Whether a rasterizer may move a corner to another place than `pixel` says.
    uncertain: bool,
}

impl SeenTriangle {
    /// Returns `None` for a triangle without area, and for one that crosses the near plane, which the tests' scenes
    /// do not have.
    fn new(lens: &Lens, triangle: &[Vertex; 3]) -> Option<Self> {
        let view = triangle.each_ref().map(|vertex| lens.to_view * (vertex.point - lens.eye));
        if view.iter().any(|v| -v.z < lens.near) {
            return None;
        }
        let aspect = lens.size.x / lens.size.y;
        let moved = view.map(|v| {
            let (x, y) = (lens.focal * v.x / (aspect * -v.z), lens.focal * v.y / -v.z);
            lens.moved(DVec2::new((x + 1.0) * 0.5, (1.0 - y) * 0.5) * lens.size)
        });
        let (pixel, uncertain) =
            (moved.map(|(pixel, _)| pixel), moved.iter().any(|(_, uncertain)| *uncertain));
        let area = (pixel[1] - pixel[0]).perp_dot(pixel[2] - pixel[0]);
        // With y pointing down, counter-clockwise in the world is a negative area here.
        let depth = view.map(|v| -v.z);
        (area != 0.0).then_some(Self { pixel, depth, area, front: area < 0.0, uncertain })
    }

    /// Returns the screen-space weights, each divided by its corner's distance, for perspective-correct
    /// interpolation.
    fn weighted(&self, center: DVec2) -> [f64; 3] {
        let edge =
            |a: usize, b: usize| (self.pixel[b] - self.pixel[a]).perp_dot(center - self.pixel[a]) / self.area;
        let screen = [edge(1, 2), edge(2, 0), edge(0, 1)];
        [0, 1, 2].map(|i| screen[i] / self.depth[i])
    }

    fn depth_inside(&self, center: DVec2) -> Option<f64> {
        let weighted = self.weighted(center);
        weighted.iter().all(|weight| *weight >= 0.0).then(|| 1.0 / weighted.iter().sum::<f64>())
    }

    /// Returns the perspective-correct weights of the corners, also outside the triangle.
    fn weights(&self, center: DVec2) -> [f64; 3] {
        let weighted = self.weighted(center);
        let sum: f64 = weighted.iter().sum();
        weighted.map(|weight| weight / sum)
    }
}
