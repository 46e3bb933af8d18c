//! The twin's shading: once per polygon, per vertex or per pixel, with the f64 equations of `lumbre_optics`.

use glam::{DVec2, DVec3};
use lumbre_optics::{
    Contribution, FlatRule, LightKind, LightSample, ReflectionModel, Shading, SurfaceSample, add_emission,
    apply_fog, evaluate_light, facing_normal, filtered_lobe, fog_weight, light_contribution, lobe_widening,
    polygon_light_contribution, safe_normalize, viewer_direction,
};
use lumbre_scene::LightmapImage;

use super::scene::{Object, Scene, Vertex};

/// Perspective-correct weights of a triangle's corners at a pixel and at the ends of its two fine derivatives.
pub(super) struct PixelWeights {
    pub center: [f64; 3],
    pub across: [[f64; 3]; 2],
    pub down: [[f64; 3]; 2],
}

/// A triangle with what is computed once of it.
pub(super) struct ShadedTriangle<'a> {
    scene: &'a Scene,
    object: &'a Object,
    triangle: &'a [Vertex; 3],
    front: bool,
    /// Of the vertices (Gouraud) or of the face (flat, three times the same).
    colors: Option<[DVec3; 3]>,
}

impl<'a> ShadedTriangle<'a> {
    pub(super) fn new(scene: &'a Scene, object: &'a Object, triangle: &'a [Vertex; 3], front: bool) -> Self {
        let mut shaded = Self { scene, object, triangle, front, colors: None };
        let [a, b, c] = triangle.each_ref().map(|vertex| vertex.point);
        shaded.colors = match object.shading {
            Shading::Phong => None,
            Shading::Gouraud => Some(triangle.each_ref().map(|v| shaded.lit(v.point, v.normal, 0.0))),
            Shading::Flat => {
                let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO);
                let last = &triangle[if object.mirrored { 1 } else { 2 }];
                let (point, normal) = match scene.flat_rule {
                    FlatRule::Centroid => ((a + b + c) / 3.0, normal),
                    FlatRule::FirstVertex => (triangle[0].point, triangle[0].normal),
                    FlatRule::LastVertex => (last.point, last.normal),
                };
                Some([shaded.lit(point, normal, 0.0); 3])
            }
        };
        shaded
    }

    pub(super) fn at(&self, pixel: &PixelWeights) -> DVec3 {
        let weights = pixel.center;
        let mix =
            |values: [DVec3; 3]| values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2];
        let vertices = self.triangle;
        let point = mix(vertices.each_ref().map(|vertex| vertex.point));
        let mut color = match self.colors {
            Some(colors) => mix(colors),
            None => {
                let normal = |weights: [f64; 3]| -> DVec3 {
                    safe_normalize((0..3).map(|i| vertices[i].normal * weights[i]).sum())
                };
                let change = |[from, to]: [[f64; 3]; 2]| (normal(to) - normal(from)).length_squared();
                let widening = match self.scene.specular_antialiasing {
                    true => lobe_widening(change(pixel.across), change(pixel.down)),
                    false => 0.0,
                };
                self.lit(point, normal(weights), widening)
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

    /// `widening` of the highlight: 0 for none.
    fn lit(&self, point: DVec3, normal: DVec3, widening: f64) -> DVec3 {
        let scene = self.scene;
        let front = self.lit_as_front();
        let side = self.object.material.surface(front);
        let mut surface = SurfaceSample::new(&self.object.material, front);
        if widening > 0.0 {
            let of_half_vector =
                matches!(self.object.reflection, ReflectionModel::Blinn | ReflectionModel::TorranceSparrow);
            let lobe = filtered_lobe(surface.shininess, if of_half_vector { 1.0 } else { 4.0 }, widening);
            surface.shininess = lobe.shininess;
            surface.peak = lobe.peak;
        }
        let normal = facing_normal(normal, front);
        let viewer = viewer_direction(scene.settings.local_viewer, scene.eye, scene.basis.z_axis, point);
        let mapped = self.object.lightmap.is_some();
        let mut sum = Contribution::ZERO;
        if !mapped {
            sum.ambient += surface.ambient * scene.settings.ambient.as_dvec3();
        }
        for (light, position, axis) in &scene.lights {
            let sample: LightSample = evaluate_light(light, *position, *axis, point);
            let mut added = light_contribution(self.object.reflection, surface, &sample, normal, viewer);
            if mapped && light.kind == LightKind::Ambient {
                added = Contribution::ZERO;
            }
            if mapped && light.bake == lumbre_optics::BakeMode::Static {
                added.diffuse = DVec3::ZERO;
            }
            sum = sum + added;
        }
        for polygon in scene.polygons.iter().filter(|polygon| polygon.emitter != self.object.index) {
            let light = &polygon.light;
            let mut added =
                polygon_light_contribution(self.object.reflection, surface, light, point, normal, viewer);
            if mapped && polygon.baked {
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
