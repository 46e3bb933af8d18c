//! The twin's shading, per polygon, per vertex or per pixel, with the f64 equations of `lumbre_optics`.

use super::scene::{Object, Scene, Vertex};
use super::texture::{sample, sample_lightmap, transform};
use glam::{DVec2, DVec3, DVec4};
use lumbre_optics::{
    Contribution, FlatRule, LightKind, LightSample, Lobe, ReflectionModel, Shading, SurfaceSample,
    add_emission, apply_fog, evaluate_light, facing_normal, filtered_lobe, fog_weight, light_contribution,
    lobe_widening, map_normal, occlusion, polygon_light_contribution, safe_normalize, transformed_tangent,
    viewer_direction,
};

/// Perspective-correct weights of a triangle's corners at a pixel and at the ends of its two fine derivatives.
pub(super) struct PixelWeights {
    pub center: [f64; 3],
    pub across: [[f64; 3]; 2],
    pub down: [[f64; 3]; 2],
}

/// The light that an occlusion texture affects, and the light that it does not.
#[derive(Clone, Copy)]
struct Lit {
    ambient: DVec3,
    direct: DVec3,
    /// Irradiance/π of the lights in its lightmap.
    highlighted: DVec3,
}

/// A triangle with what is computed once for it.
pub(super) struct ShadedTriangle<'a> {
    scene: &'a Scene,
    object: &'a Object,
    triangle: &'a [Vertex; 3],
    front: bool,
    /// Colours of the vertices (Gouraud) or of the face (flat, three times the same).
    colors: Option<[Lit; 3]>,
}

impl<'a> ShadedTriangle<'a> {
    pub(super) fn new(scene: &'a Scene, object: &'a Object, triangle: &'a [Vertex; 3], front: bool) -> Self {
        let mut shaded = Self { scene, object, triangle, front, colors: None };
        let [a, b, c] = triangle.each_ref().map(|vertex| vertex.point);
        shaded.colors = match object.shading {
            // The twin always uses Phong shading here, which is the reference for shading by need.
            Shading::Phong | Shading::Auto { .. } => None,
            Shading::Gouraud => Some(triangle.each_ref().map(|v| shaded.lit_at_vertex(v.point, v.normal))),
            Shading::Flat => {
                let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO);
                let last = &triangle[if object.mirrored { 1 } else { 2 }];
                let (point, normal) = match scene.flat_rule {
                    FlatRule::Centroid => ((a + b + c) / 3.0, normal),
                    FlatRule::FirstVertex => (triangle[0].point, triangle[0].normal),
                    FlatRule::LastVertex => (last.point, last.normal),
                };
                Some([shaded.lit_at_vertex(point, normal); 3])
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
        let uv =
            |set: u32| -> DVec2 { (0..3).map(|i| vertices[i].uv[usize::from(set != 0)] * weights[i]).sum() };
        let lit = match self.colors {
            Some(colors) => Lit {
                ambient: mix(colors.map(|lit| lit.ambient)),
                direct: mix(colors.map(|lit| lit.direct)),
                highlighted: mix(colors.map(|lit| lit.highlighted)),
            },
            None => {
                let normal = |weights: [f64; 3]| -> DVec3 {
                    safe_normalize((0..3).map(|i| vertices[i].normal * weights[i]).sum())
                };
                let change = |[from, to]: [[f64; 3]; 2]| (normal(to) - normal(from)).length_squared();
                let widening = match self.scene.specular_antialiasing {
                    true => lobe_widening(change(pixel.across), change(pixel.down)),
                    false => 0.0,
                };
                let mapped = self.object.normal_map.as_ref().map(|map| {
                    let texel = sample(&map.texture, uv(map.texture.tex_coord)).truncate();
                    let [u, v] = transform(&map.texture);
                    let tangent: DVec4 = (0..3)
                        .map(|i| {
                            transformed_tangent(u, v, vertices[i].tangent, vertices[i].normal) * weights[i]
                        })
                        .sum();
                    let smooth: DVec3 = (0..3).map(|i| vertices[i].normal * weights[i]).sum();
                    map_normal(texel, f64::from(map.scale), tangent, smooth)
                });
                self.lit(point, self.facing(mapped.unwrap_or_else(|| normal(weights))), widening)
            }
        };
        let unoccluded = self.object.occlusion.as_ref().map_or(1.0, |map| {
            occlusion(sample(&map.texture, uv(map.texture.tex_coord)).x, f64::from(map.strength))
        });
        let mut color = lit.direct + lit.ambient * unoccluded;
        if let Some(lightmap) = &self.object.lightmap {
            let baked = sample_lightmap(lightmap, uv(1)) * unoccluded;
            let surface = SurfaceSample::new(&self.object.material, self.lit_as_front());
            color += surface.diffuse * baked;
            color += self.metal(&surface) * (baked - lit.highlighted).max(DVec3::ZERO);
        }
        match &self.scene.settings.fog {
            Some(fog) => {
                let distance = (self.scene.eye - point).dot(self.scene.basis.z_axis);
                apply_fog(fog_weight(&fog.mode, distance), color, fog.color.as_dvec3())
            }
            None => color,
        }
    }

    /// Back faces are only lit as such if two-sided lighting is on.
    fn lit_as_front(&self) -> bool {
        self.front || !(self.object.material.double_sided && self.scene.settings.two_sided)
    }

    /// Returns a normal of the front, turned to the side that is lit.
    fn facing(&self, normal: DVec3) -> DVec3 {
        facing_normal(normal, self.lit_as_front())
    }

    /// The diffuse reflectance that stands for the highlight of a metal.
    fn metal(&self, surface: &SurfaceSample) -> DVec3 {
        if self.object.material.reflects_as_metal() { surface.reflectance_as_metal() } else { DVec3::ZERO }
    }

    /// The light at a vertex, or of a polygon. A lightmap is that of the front, so that the lights in it are the front's
    /// on both sides.
    fn lit_at_vertex(&self, point: DVec3, normal: DVec3) -> Lit {
        let lit = self.lit(point, self.facing(normal), 0.0);
        Lit { highlighted: self.lit(point, normal, 0.0).highlighted, ..lit }
    }

    /// `widening` is that of the highlight, 0 for none.
    fn lit(&self, point: DVec3, normal: DVec3, widening: f64) -> Lit {
        let scene = self.scene;
        let front = self.lit_as_front();
        let side = self.object.material.surface(front);
        let mut surface = SurfaceSample::new(&self.object.material, front);
        if widening > 0.0 {
            let energy_conserving = surface.lobe == Lobe::EnergyConserving;
            let of_half_vector = energy_conserving
                || matches!(
                    self.object.reflection,
                    ReflectionModel::Blinn | ReflectionModel::TorranceSparrow
                );
            let lobe = filtered_lobe(surface.shininess, if of_half_vector { 1.0 } else { 4.0 }, widening);
            surface.shininess = lobe.shininess;
            surface.peak = if energy_conserving { 1.0 } else { lobe.peak };
        }
        let viewer = viewer_direction(scene.settings.local_viewer, scene.eye, scene.basis.z_axis, point);
        let mapped = self.object.lightmap.is_some();
        let mut sum = Contribution::ZERO;
        if let Some(volume) = scene.volume.as_ref().filter(|_| !mapped) {
            let unfiltered = SurfaceSample::new(&self.object.material, front);
            sum.ambient += (surface.diffuse + self.metal(&unfiltered)) * volume.light(point, normal);
        } else if !mapped {
            sum.ambient +=
                surface.ambient * (scene.settings.ambient.as_dvec3() + scene.settings.sky.as_dvec3());
        }
        let mut highlighted = DVec3::ZERO;
        for (_, added, in_lightmap) in self.contributions(surface, point, normal, viewer) {
            sum = sum + added;
            highlighted += in_lightmap;
        }
        let ambient = sum.ambient;
        let direct = Contribution { ambient: DVec3::ZERO, ..sum };
        Lit { ambient, direct: add_emission(direct.total(), side.emission.as_dvec3()), highlighted }
    }

    /// Returns what each light adds at a point, and whether frames evaluate it there, which they do not for ambient
    /// lights and lights that are off; third, its irradiance/π, if a lightmap holds the light.
    fn contributions(
        &self,
        surface: SurfaceSample,
        point: DVec3,
        normal: DVec3,
        viewer: DVec3,
    ) -> impl Iterator<Item = (bool, Contribution, DVec3)> {
        let (scene, reflection) = (self.scene, self.object.reflection);
        let mapped = self.object.lightmap.is_some();
        let white = SurfaceSample { diffuse: DVec3::ONE, ..surface };
        let of_lights = scene.lights.iter().map(move |(light, position, axis)| {
            let sample: LightSample = evaluate_light(light, *position, *axis, point);
            let mut added = light_contribution(reflection, surface, &sample, normal, viewer);
            if (mapped || scene.volume.is_some()) && light.kind == LightKind::Ambient {
                added = Contribution::ZERO;
            }
            let mut highlighted = DVec3::ZERO;
            if mapped && light.bake == lumbre_optics::BakeMode::Static {
                added.diffuse = DVec3::ZERO;
                highlighted = light_contribution(reflection, white, &sample, normal, viewer).diffuse;
            }
            (light.enabled && light.kind != LightKind::Ambient, added, highlighted)
        });
        let polygons = scene.polygons.iter().filter(|polygon| polygon.emitter != self.object.index);
        let of_polygons = polygons.map(move |polygon| {
            let light = &polygon.light;
            let mut added = polygon_light_contribution(reflection, surface, light, point, normal, viewer);
            let mut highlighted = DVec3::ZERO;
            if mapped && polygon.baked {
                added.diffuse = DVec3::ZERO;
                highlighted =
                    polygon_light_contribution(reflection, white, light, point, normal, viewer).diffuse;
            }
            (true, added, highlighted)
        });
        of_lights.chain(of_polygons)
    }

    /// Returns the brightest channel of what each evaluated light adds at a pixel; for surfaces without textures,
    /// under Phong shading.
    pub(super) fn reflected(&self, weights: [f64; 3]) -> Vec<f64> {
        let mix = |of: &dyn Fn(&Vertex) -> DVec3| -> DVec3 {
            (0..3).map(|i| of(&self.triangle[i]) * weights[i]).sum()
        };
        let normal = safe_normalize(mix(&|vertex| vertex.normal));
        self.reflected_at(mix(&|vertex| vertex.point), normal)
    }

    /// Returns the same at its corners, where flat and Gouraud shading evaluate it.
    pub(super) fn reflected_at_corners(&self) -> [Vec<f64>; 3] {
        let corners = self.triangle.each_ref().map(|vertex| vertex.point);
        let [a, b, c] = corners;
        match self.object.shading {
            Shading::Flat => {
                let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::ZERO);
                let at = self.reflected_at((a + b + c) / 3.0, normal);
                [at.clone(), at.clone(), at]
            }
            _ => self.triangle.each_ref().map(|vertex| self.reflected_at(vertex.point, vertex.normal)),
        }
    }

    fn reflected_at(&self, point: DVec3, normal: DVec3) -> Vec<f64> {
        let scene = self.scene;
        let surface = SurfaceSample::new(&self.object.material, self.lit_as_front());
        let viewer = viewer_direction(scene.settings.local_viewer, scene.eye, scene.basis.z_axis, point);
        self.contributions(surface, point, self.facing(normal), viewer)
            .filter(|(evaluated, ..)| *evaluated)
            .map(|(_, added, _)| added.total().max_element())
            .collect()
    }
}
