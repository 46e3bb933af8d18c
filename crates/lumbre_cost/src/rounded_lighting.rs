//! The lighting equation with every operation rounded to a number format: the result of plain shader
//! arithmetic for a flat sheet. This is not the arithmetic of the renderer, which avoids the hard cases, nor
//! that of the tracer, which uses f64 throughout.

use bevy_ecs::prelude::*;
use glam::DVec3;
use half::f16;
use lumbre_optics::{Light, LightKind, MINIMUM_COSINE_DIFFERENCE, MINIMUM_DISTANCE, Material, SpotCosines};
use lumbre_scene::{Camera, GlobalTransform, Mesh, Projection, SceneSettings};

use crate::picture::Picture;

/// A number format, defined by how it rounds exact results.
///
/// Sums, products, quotients and roots of numbers of at most 24 bits, computed in f64 and then rounded, are
/// exactly what the format itself would give: with 53 bits, rounding twice equals rounding once (Figueroa,
/// "When is double rounding innocuous?", 1995).
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// Its name.
    pub name: &'static str,
    /// Number of bits of its significand.
    pub bits: u32,
    round: fn(f64) -> f64,
}

/// The formats from the shortest to the longest.
pub const FORMATS: [Format; 3] = [
    Format { name: "f16 equations", bits: 11, round: |value| f64::from(f16::from_f64(value)) },
    Format { name: "f32 equations", bits: 24, round: |value| f64::from(value as f32) },
    Format { name: "f64 equations", bits: 53, round: |value| value },
];

/// A picture in few bits, and the fraction of its pixels for which the format has no finite number. These pixels are
/// black.
#[derive(Clone, Debug)]
pub struct Rounded {
    /// The radiance of each pixel.
    pub picture: Picture,
    /// The fraction of pixels without a finite number.
    pub lost: f64,
}

/// The inputs of the lighting equation for a sheet in its own plane y = 0 under one light, relative to the
/// eye as in a frame.
struct Equation {
    normal: DVec3,
    /// Position of a lamp, or direction towards a distant light.
    light: DVec3,
    is_distant: bool,
    color: DVec3,
    /// The cone of a spotlight about the unit axis along which it shines.
    cone: Option<(SpotCosines, DVec3)>,
    /// Reflection coefficients for ambient, diffuse and specular light.
    surface: [DVec3; 3],
    ambient: DVec3,
    shininess: f64,
}

/// Returns the light that a sheet reflects at the centre of every pixel; `None` if the World is not a sheet
/// under one light with a camera.
pub fn rounded_lighting(world: &mut World, size: (u32, u32), format: Format) -> Option<Rounded> {
    let mut cameras = world.query::<(&Camera, &GlobalTransform)>();
    let (camera, seen_from) = cameras.iter(world).next()?;
    let Projection::Perspective { vertical_fov, .. } = camera.projection else { return None };
    let (eye, axes) = (seen_from.translation(), seen_from.0.matrix3);
    let mut sheets = world.query::<(&Mesh, &Material, &GlobalTransform)>();
    let (_, material, sheet) = sheets.iter(world).next()?;
    let (normal, middle) = (sheet.0.matrix3.y_axis.try_normalize()?, sheet.translation() - eye);
    let front = material.front;
    let mut lights = world.query::<(&Light, &GlobalTransform)>();
    let (light, place) = lights.iter(world).next()?;
    let is_distant = light.kind == LightKind::Directional;
    let to_light = if is_distant { place.0.matrix3.z_axis } else { place.translation() - eye };
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let equation = Equation {
        normal,
        light: to_light,
        is_distant,
        color: light.diffuse.as_dvec3(),
        cone: light.spot.map(|cone| (cone.cosines(), place.forward())),
        surface: [front.ambient, front.diffuse, front.specular].map(|color| color.as_dvec3()),
        ambient: settings.ambient.as_dvec3(),
        shininess: f64::from(front.shininess),
    };
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let half = (0.5 * vertical_fov).tan();
    let mut lost = 0;
    let mut radiance = Vec::new();
    for row in 0..size.1 {
        for column in 0..size.0 {
            let x = (2.0 * (f64::from(column) + 0.5) / width - 1.0) * half * width / height;
            let y = (1.0 - 2.0 * (f64::from(row) + 0.5) / height) * half;
            let towards = axes.x_axis * x + axes.y_axis * y - axes.z_axis;
            // The intersection of the ray with the sheet is computed exactly, since it is the rasterizer's
            // task.
            let point = towards * (middle.dot(normal) / towards.dot(normal));
            let pixel = Arithmetic(format.round).shade(&equation, point);
            lost += u32::from(!pixel.is_finite());
            radiance.push(if pixel.is_finite() { pixel } else { DVec3::ZERO });
        }
    }
    let lost = f64::from(lost) / radiance.len().max(1) as f64;
    Some(Rounded { picture: Picture { width: size.0 as usize, radiance }, lost })
}

/// Arithmetic in a number format.
struct Arithmetic(fn(f64) -> f64);

impl Arithmetic {
    fn each(&self, value: DVec3) -> DVec3 {
        value.map(self.0)
    }

    fn dot(&self, a: DVec3, b: DVec3) -> f64 {
        let product = self.each(a * b);
        (self.0)((self.0)(product.x + product.y) + product.z)
    }

    fn unit(&self, vector: DVec3) -> DVec3 {
        let length = (self.0)(self.dot(vector, vector).sqrt());
        self.each(vector / length)
    }

    /// Returns the factor of a smooth cone: the square of a function that is linear in the cosine.
    fn spot(&self, cone: SpotCosines, axis: DVec3, light: DVec3) -> f64 {
        let round = self.0;
        let (outer, inner) = (round(cone.outer), round(cone.inner_or_exponent));
        let width = round(inner - outer).max(round(MINIMUM_COSINE_DIFFERENCE));
        let cosine = -self.dot(self.each(axis), light);
        let angular = round(round(cosine - outer) / width).clamp(0.0, 1.0);
        round(angular * angular)
    }

    /// Returns ambient, diffuse and Phong's specular light by the documents' equation: E = k_a A + f (k_d L
    /// n·l + k_s L (r·v)ⁿ).
    fn shade(&self, equation: &Equation, point: DVec3) -> DVec3 {
        let round = self.0;
        let (point, normal) = (self.each(point), self.each(equation.normal));
        let [ambient, diffuse, specular] = equation.surface.map(|color| self.each(color));
        let color = self.each(equation.color);
        let given = self.each(equation.light);
        let to_light = if equation.is_distant { given } else { self.each(given - point) };
        let squared = self.dot(to_light, to_light);
        let attenuation = match equation.is_distant {
            true => 1.0,
            false => round(1.0 / squared.max(round(MINIMUM_DISTANCE * MINIMUM_DISTANCE))),
        };
        let light = self.unit(to_light);
        let viewer = self.unit(-point);
        let along = self.dot(normal, light).max(0.0);
        let doubled = round(2.0 * along);
        let reflected = self.each(self.each(doubled * normal) - light);
        let cosine = self.dot(reflected, viewer).clamp(0.0, 1.0);
        let lobe = if along > 0.0 { round(cosine.powf(round(equation.shininess))) } else { 0.0 };
        let of_diffuse = self.each(self.each(diffuse * color) * along);
        let of_specular = self.each(self.each(specular * color) * lobe);
        let inside = equation.cone.map_or(1.0, |(cone, axis)| self.spot(cone, axis, light));
        let weight = round(attenuation * inside);
        let of_light = self.each(self.each(of_diffuse + of_specular) * weight);
        self.each(self.each(ambient * self.each(equation.ambient)) + of_light)
    }
}

#[cfg(test)]
mod tests {
    use lumbre_optics::SpotCone;
    use lumbre_scene::update_transforms;
    use lumbre_trace::{Integrator, TraceOptions, relative_error, trace};

    use super::*;
    use crate::scenes::{Sheet, sheet};

    const SIZE: (u32, u32) = (32, 20);

    fn error(asked: Sheet, format: Format) -> (f64, f64) {
        let mut world = sheet(asked);
        update_transforms(&mut world);
        let options = TraceOptions {
            size: SIZE,
            integrator: Integrator::Whitted,
            depth: Some(0),
            shadows: false,
            ..TraceOptions::default()
        };
        let go_on = |_| std::ops::ControlFlow::Continue(());
        let (exact, _) = trace(&mut world, &options, &go_on).expect("a sheet is traced");
        let rounded = rounded_lighting(&mut world, SIZE, format).expect("it is a sheet");
        (relative_error(&exact.radiance, &rounded.picture.radiance), rounded.lost)
    }

    /// Without rounding, the result is that of the tracer, which is independent code.
    #[test]
    fn unrounded_it_is_the_traced_sheet() {
        for asked in [
            Sheet::PLAIN,
            Sheet { height: 0.02, ..Sheet::PLAIN },
            Sheet { grazing: Some(0.01), ..Sheet::PLAIN },
            Sheet { scale: 5e-4, ..Sheet::PLAIN },
            Sheet { scale: 5e4, ..Sheet::PLAIN },
            Sheet { brightness: 1e6, ..Sheet::PLAIN },
            Sheet { cone: Some(SpotCone::Smooth { inner: 0.4, outer: 0.6 }), ..Sheet::PLAIN },
        ] {
            let (error, lost) = error(asked, FORMATS[2]);
            // Colours and meshes of the scene are f32.
            assert!(error < 1e-6 && lost == 0.0, "{asked:?}: {error}, {lost}");
        }
    }

    #[test]
    fn fewer_bits_lose_more_and_large_scenes_have_no_number() {
        let [(short, none), (long, _), _] = FORMATS.map(|format| error(Sheet::PLAIN, format));
        // Eleven bits, 24 bits, and a dozen operations.
        assert!((1e-4..2e-2).contains(&short) && none == 0.0, "{short}");
        assert!((1e-9..2e-6).contains(&long), "{long}");
        let (_, lost) = error(Sheet { scale: 5e4, ..Sheet::PLAIN }, FORMATS[0]);
        assert!(lost > 0.9, "{lost}: a square of a hundred kilometres is beyond f16");
        let (_, lost) = error(Sheet { brightness: 1e6, ..Sheet::PLAIN }, FORMATS[0]);
        assert!(lost > 0.1, "{lost}: light of a million is beyond f16");
        // All that a narrow cone lights lies between two cosines that differ by 0.005, ten steps of f16.
        let far = Sheet { height: 8.0, ..Sheet::PLAIN };
        let narrow = Sheet { cone: Some(SpotCone::Smooth { inner: 0.0, outer: 0.1 }), ..far };
        let [(of_narrow, _), (of_all, _)] = [narrow, far].map(|asked| error(asked, FORMATS[0]));
        assert!(of_narrow > 3.0 * of_all, "{of_narrow} in the cone, {of_all} without one");
    }
}
