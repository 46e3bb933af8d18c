//! The surface at a ray's hit point: position, normals, and material coefficients with all textures applied.
//! Light is not evaluated.

use glam::{DVec3, DVec4};
use lumbre_optics::{
    AlphaMode, SurfaceSample, facing_normal, map_normal, occlusion, safe_normalize, shininess_from_roughness,
    transformed_tangent, try_normalize,
};

use crate::geometry::{Hit, Place, RayOrigin, SpaceRay};
use crate::scene::{Object, Scene, sample_color, sample_lightmap, sample_linear};

/// A hit point on a surface, seen along a ray.
#[derive(Clone, Debug)]
pub(crate) struct SurfacePoint {
    pub object: usize,
    /// Position in the tracer's space, metres.
    pub position: DVec3,
    /// Metres along the ray.
    pub distance: f64,
    /// Unit geometric normal, on the side that the ray comes from.
    pub geometric: DVec3,
    /// Unit shading normal: interpolated, normal-mapped, and flipped according to the scene's two-sided rule.
    pub normal: DVec3,
    /// Whether the ray hits the front.
    pub front: bool,
    pub surface: SurfaceSample,
    pub emission: DVec3,
    /// Opacity of an alpha-blended surface, 0 to 1; 1 for all others.
    pub coverage: f64,
    /// The light of the lightmap.
    pub baked: Option<BakedLight>,
    /// The light of the irradiance volume that lights an object without a lightmap: k_d E/π, and the same for what
    /// stands for a metal's highlight.
    pub from_volume: Option<DVec3>,
    /// Largest coordinate of the surface that was hit, to which rounding errors are relative.
    pub extent: f64,
    /// Index of the triangle in the scene; `None` on exact surfaces.
    pub triangle: Option<u32>,
}

/// What a surface reflects of the light in its lightmap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BakedLight {
    /// E/π, weakened by an occlusion texture.
    pub arriving: DVec3,
    /// The diffuse reflectance that stands for a metal's highlight.
    pub metal: DVec3,
}

/// Largest difference, relative to the distance, between the f64 hit and the f32 hit of the hierarchy up to
/// which the former is trusted. Grazing rays differ more. The offset of the ray's origin comes on top.
const TRUSTED: f64 = 1e-3;

impl SurfacePoint {
    /// Evaluates the surface where a ray hits it.
    pub fn new(scene: &Scene, ray: &SpaceRay, hit: &Hit) -> Self {
        let candidate = &hit.candidate;
        let object = &scene.objects[candidate.object];
        match candidate.place {
            Place::Triangle { triangle, weights } => Self::in_triangle(object, ray, hit, triangle, weights),
            Place::Exact { point, normal } => Self::on_exact_surface(object, ray, hit, point, normal),
        }
    }

    fn in_triangle(object: &Object, ray: &SpaceRay, hit: &Hit, triangle: u32, found: [f64; 2]) -> Self {
        let first = 3 * triangle as usize;
        let corners = object.corners([0, 1, 2].map(|next| object.shape.indices[first + next]));
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        let face = try_normalize(cross).unwrap_or(-ray.direction);
        // The hierarchy's corners are f32. The point is computed again in f64, so that long chains of mirrors
        // keep their digits.
        let (distance, found) = refined(ray, corners, cross, hit.distance).unwrap_or((hit.distance, found));
        let (vertices, weights) = object.vertices(triangle, found);
        let position = a * weights[0] + b * weights[1] + c * weights[2];
        let extent = corners.iter().fold(0.0_f64, |largest, corner| largest.max(corner.abs().max_element()));

        let front = hit.candidate.front;
        let lit_as_front = front || !backs_are_lit(object);
        let shape = &object.shape;
        let smooth: DVec3 = (0..3)
            .map(|corner| {
                let own = shape.normals.get(vertices[corner]).map_or(DVec3::ZERO, |normal| normal.as_dvec3());
                safe_normalize(object.normals * own) * weights[corner]
            })
            .sum();
        let mapped = object.textures.normal.as_ref().map(|map| {
            let uv = object.coordinates(map.texture.tex_coord, vertices, weights);
            let texel = sample_linear(&map.texture, uv).truncate();
            let [u, v] = map.texture.transform().map(|row| row.as_dvec3());
            let tangent: DVec4 = (0..3)
                .map(|corner| {
                    let own = shape.tangents.get(vertices[corner]).map_or(DVec4::ZERO, |own| own.as_dvec4());
                    let side = if (own.w < 0.0) != object.mirrored { -1.0 } else { 1.0 };
                    let along = safe_normalize(object.place.matrix3 * own.truncate()).extend(side);
                    let normal =
                        shape.normals.get(vertices[corner]).map_or(DVec3::ZERO, |own| own.as_dvec3());
                    transformed_tangent(u, v, along, safe_normalize(object.normals * normal))
                        * weights[corner]
                })
                .sum();
            map_normal(texel, f64::from(map.scale), tangent, smooth)
        });
        let normal = mapped.filter(|normal| *normal != DVec3::ZERO);
        let normal = normal.or_else(|| try_normalize(smooth)).unwrap_or(face);

        let mut tint = DVec4::ONE;
        if let Some(texture) = &object.textures.base_color {
            tint = sample_color(texture, object.coordinates(texture.tex_coord, vertices, weights));
        }
        if !shape.colors.is_empty() {
            let vertex = |corner: usize| shape.colors[vertices[corner]].as_dvec4() * weights[corner];
            tint *= (0..3).map(vertex).sum::<DVec4>();
        }
        let mut surface = SurfaceSample::new(&object.material, lit_as_front);
        if let Some(mapped) = &object.textures.metallic_roughness {
            let uv = object.coordinates(mapped.texture.tex_coord, vertices, weights);
            let texel = sample_linear(&mapped.texture, uv);
            let metallic = f64::from(mapped.metallic) * texel.z;
            let base = mapped.base_color.as_dvec3();
            surface.ambient = base;
            surface.diffuse = base * (1.0 - metallic);
            surface.specular = mapped.dielectric.as_dvec3().lerp(base * tint.truncate(), metallic);
            surface.shininess =
                f64::from(shininess_from_roughness((f64::from(mapped.roughness) * texel.y) as f32));
        }
        surface.ambient *= tint.truncate();
        surface.diffuse *= tint.truncate();
        let unoccluded = object.textures.occlusion.as_ref().map_or(1.0, |map| {
            let uv = object.coordinates(map.texture.tex_coord, vertices, weights);
            occlusion(sample_linear(&map.texture, uv).x, f64::from(map.strength))
        });
        surface.ambient *= unoccluded;
        let mut emission = object.material.surface(lit_as_front).emission.as_dvec3();
        if let Some(texture) = &object.textures.emissive {
            let uv = object.coordinates(texture.tex_coord, vertices, weights);
            emission *= sample_color(texture, uv).truncate();
        }
        let metal = match object.takes_baked_light() {
            false => DVec3::ZERO,
            // The base colour of a metal is its k_s; a metallic-roughness texture has modulated it already.
            true if object.textures.metallic_roughness.is_some() => reflectance_as_metal(object, &surface),
            true => {
                let specular = surface.specular * tint.truncate();
                reflectance_as_metal(object, &SurfaceSample { specular, ..surface })
            }
        };
        let baked = object.lightmap.as_ref().map(|image| {
            let uv = object.coordinates(1, vertices, weights);
            BakedLight { arriving: sample_lightmap(image, uv) * unoccluded, metal }
        });
        let normal = facing_normal(normal, lit_as_front);
        let from_volume = object.volume_light(position, normal, (surface.diffuse + metal) * unoccluded);
        Self {
            object: hit.candidate.object,
            position,
            distance,
            geometric: towards(face, ray),
            normal,
            front,
            surface,
            emission,
            coverage: coverage(object, f64::from(object.material.alpha) * tint.w),
            baked,
            from_volume,
            extent,
            triangle: hit.triangle,
        }
    }

    fn on_exact_surface(object: &Object, ray: &SpaceRay, hit: &Hit, position: DVec3, normal: DVec3) -> Self {
        let front = hit.candidate.front;
        let lit_as_front = front || !backs_are_lit(object);
        let surface = SurfaceSample::new(&object.material, lit_as_front);
        let lit_normal = facing_normal(normal, lit_as_front);
        Self {
            object: hit.candidate.object,
            position,
            distance: hit.distance,
            geometric: towards(normal, ray),
            normal: lit_normal,
            front,
            surface,
            emission: object.material.surface(lit_as_front).emission.as_dvec3(),
            coverage: coverage(object, f64::from(object.material.alpha)),
            baked: None,
            from_volume: object.volume_light(
                position,
                lit_normal,
                surface.diffuse + reflectance_as_metal(object, &surface),
            ),
            // The point is as uncertain as the coordinates of the ray's origin.
            extent: position.abs().max(ray.origin.abs()).max_element(),
            triangle: None,
        }
    }

    /// Returns the origin of the rays that leave the point.
    pub fn ray_origin(&self) -> RayOrigin {
        RayOrigin::new(self.position, self.geometric, self.extent)
    }

    /// Returns the normal for mirroring and refraction: the shading normal, or the geometric one where the
    /// viewer is behind the shading normal.
    pub fn optical_normal(&self, viewer: DVec3) -> DVec3 {
        let facing = if self.normal.dot(self.geometric) < 0.0 { -self.normal } else { self.normal };
        if facing.dot(viewer) > 0.0 { facing } else { self.geometric }
    }
}

/// Returns the diffuse reflectance that stands for the highlight of an object's surface.
fn reflectance_as_metal(object: &Object, surface: &SurfaceSample) -> DVec3 {
    if object.material.reflects_as_metal() { surface.reflectance_as_metal() } else { DVec3::ZERO }
}

/// Returns true if a back face is lit with its own normal: under the scene's two-sided rule, and always
/// inside glass.
fn backs_are_lit(object: &Object) -> bool {
    (object.material.double_sided && object.two_sided) || object.is_solid()
}

fn coverage(object: &Object, alpha: f64) -> f64 {
    if object.material.alpha_mode == AlphaMode::Blend { alpha.clamp(0.0, 1.0) } else { 1.0 }
}

fn towards(normal: DVec3, ray: &SpaceRay) -> DVec3 {
    if normal.dot(ray.direction) > 0.0 { -normal } else { normal }
}

/// Intersects a ray with a triangle's plane in f64. Returns the distance and the weights of the second and
/// third corner, or `None` where the ray is so grazing that the distance cannot be trusted.
fn refined(ray: &SpaceRay, [a, b, c]: [DVec3; 3], cross: DVec3, near: f64) -> Option<(f64, [f64; 2])> {
    let along = ray.direction.dot(cross);
    let distance = (a - ray.origin).dot(cross) / along;
    let set_off = ray.set_off() * cross.length() / along.abs();
    let fits = (distance - near).abs() <= TRUSTED * near.max(1e-6) + set_off && distance > 0.0;
    if !fits {
        return None;
    }
    let offset = ray.at(distance) - a;
    let area = cross.length_squared();
    let second = offset.cross(c - a).dot(cross) / area;
    let third = (b - a).cross(offset).dot(cross) / area;
    let (second, third) = (second.clamp(0.0, 1.0), third.clamp(0.0, 1.0));
    // Rounding may put the point beyond the edge; this moves it onto the edge.
    let sum = (second + third).max(1.0);
    (second.is_finite() && third.is_finite()).then_some((distance, [second / sum, third / sum]))
}
