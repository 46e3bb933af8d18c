//! What the twin draws: the components of a world, in world space and f64.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DMat3, DVec2, DVec3, DVec4};
use lumbre_mesh::{TextureCoordinateSet, TriangleMesh};
use lumbre_optics::{FlatRule, Light, Material, PolygonLight, ReflectionModel, Shading, safe_normalize};
use lumbre_scene::{
    EmissiveLight, GlobalTransform, Hidden, Lightmap, LightmapImage, MaterialTextures, Mesh, NormalTexture,
    OcclusionTexture, SceneSettings, StaticObject,
};

use super::TwinOptions;
use super::volume::Volume;

pub(super) struct Vertex {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
    /// Direction in world space, and its handedness there.
    pub(super) tangent: DVec4,
    pub(super) uv: [DVec2; 2],
}

pub(super) struct Scene {
    pub(super) settings: SceneSettings,
    pub(super) flat_rule: FlatRule,
    pub(super) specular_antialiasing: bool,
    pub(super) lights: Vec<(Light, DVec3, DVec3)>,
    pub(super) polygons: Vec<Polygon>,
    pub(super) volume: Option<Volume>,
    pub(super) eye: DVec3,
    pub(super) basis: DMat3,
}

/// A triangle or parallelogram of an emissive object that lights others.
pub(super) struct Polygon {
    pub(super) light: PolygonLight,
    /// Index of the object whose triangle it is.
    pub(super) emitter: usize,
    /// Whether a lightmap contains its diffuse light.
    pub(super) baked: bool,
}

pub(super) struct Object {
    pub(super) index: usize,
    pub(super) material: Material,
    pub(super) shading: Shading,
    pub(super) reflection: ReflectionModel,
    pub(super) lightmap: Option<Arc<LightmapImage>>,
    pub(super) normal_map: Option<NormalTexture>,
    pub(super) occlusion: Option<OcclusionTexture>,
    pub(super) triangles: Vec<[Vertex; 3]>,
    /// Whether its transform mirrors it, in which case the second and third corner of every triangle are swapped.
    pub(super) mirrored: bool,
    /// If its faces light others, whether they are baked.
    pub(super) emissive_light: Option<bool>,
}

impl Object {
    /// Returns its faces as lights, without textures. Two consecutive triangles make one polygon if they are halves
    /// of a parallelogram, as in the tests' lamps.
    pub(super) fn polygons(&self) -> Vec<Polygon> {
        let Some(baked) = self.emissive_light else { return Vec::new() };
        let [front, back] = EmissiveLight::radiance(&self.material).map(|color| color.as_dvec3());
        let mut polygons = Vec::new();
        let mut triangles = self.triangles.iter().map(|t| t.each_ref().map(|v| v.point)).peekable();
        while let Some([a, b, c]) = triangles.next() {
            let light =
                PolygonLight { corner: a, edge_u: b - a, edge_v: c - a, triangle: true, radiance: front };
            let whole = [[a, b, c], [b, c, a], [c, a, b]].into_iter().find_map(|[a, b, c]| {
                let (edge_u, edge_v) = (b - a, c - a);
                let fourth = |p: &DVec3| (*p - (b + c - a)).length() < 1e-6 * (c - b).length();
                let next = triangles.peek()?;
                let fits = next.contains(&b) && next.contains(&c) && next.iter().any(fourth);
                fits.then_some(PolygonLight { corner: a, edge_u, edge_v, triangle: false, ..light })
            });
            if whole.is_some() {
                triangles.next();
            }
            let light = whole.unwrap_or(light);
            for light in [light, PolygonLight { radiance: back, ..light.turned() }] {
                if light.radiance != DVec3::ZERO {
                    polygons.push(Polygon { light, emitter: self.index, baked });
                }
            }
        }
        polygons
    }
}

type Choices<'a> = (Option<&'a Shading>, Option<&'a ReflectionModel>);
type Found<'a> = (&'a Mesh, &'a Material, &'a GlobalTransform, Choices<'a>, Maps<'a>, (bool, bool));
type Maps<'a> = (Option<&'a Lightmap>, Option<&'a MaterialTextures>);

/// Returns the visible objects.
pub(super) fn collect(world: &mut World, settings: &SceneSettings, options: &TwinOptions) -> Vec<Object> {
    let mut query = world.query_filtered::<(
        &Mesh,
        &Material,
        &GlobalTransform,
        (Option<&Shading>, Option<&ReflectionModel>),
        (Option<&Lightmap>, Option<&MaterialTextures>),
        (Has<EmissiveLight>, Has<StaticObject>),
    ), Without<Hidden>>();
    let object = |(index, found): (usize, Found<'_>)| {
        let (mesh, material, place, (shading, reflection), (lightmap, textures), (shines, fixed)) = found;
        let (normal_map, occlusion) =
            textures.map_or((None, None), |textures| (textures.normal.clone(), textures.occlusion.clone()));
        let mesh = with_tangents(&mesh.0, normal_map.as_ref());
        // Scaled to unit size, so that the threshold for a missing normal does not depend on the scale.
        let normals = place.normal_matrix();
        let largest = normals.to_cols_array().iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let normals = if largest > 0.0 { normals * (1.0 / largest) } else { normals };
        let vertex = |index: u32| {
            let index = index as usize;
            let normal = mesh.normals.get(index).map_or(DVec3::ZERO, |normal| normal.as_dvec3());
            let tangent = mesh.tangents.get(index).map_or(DVec4::ZERO, |tangent| tangent.as_dvec4());
            let direction = safe_normalize(place.0.matrix3 * tangent.truncate());
            let side = if tangent.w < 0.0 { -1.0 } else { 1.0 };
            let uv = [&mesh.uv0, &mesh.uv1];
            Vertex {
                point: place.0.transform_point3(mesh.positions[index].as_dvec3()),
                tangent: direction.extend(if place.mirrors() { -side } else { side }),
                normal: safe_normalize(normals * normal),
                uv: uv.map(|list| list.get(index).map_or(DVec2::ZERO, |uv| uv.as_dvec2())),
            }
        };
        Object {
            index,
            emissive_light: shines.then_some(fixed),
            material: material.clone(),
            shading: options.shading.or(shading.copied()).unwrap_or(settings.shading),
            reflection: options.reflection.or(reflection.copied()).unwrap_or(settings.reflection),
            mirrored: place.mirrors(),
            lightmap: lightmap.map(|lightmap| Arc::clone(&lightmap.image)),
            normal_map,
            occlusion,
            triangles: mesh
                .triangles()
                .map(|triangle| {
                    // A mirrored triangle has the opposite winding; its front stays its front.
                    let [a, b, c] = triangle.map(vertex);
                    if place.mirrors() { [a, c, b] } else { [a, b, c] }
                })
                .collect(),
        }
    };
    query.iter(world).enumerate().map(object).collect()
}

/// Returns the mesh with the tangents that its normal map needs.
fn with_tangents(mesh: &Arc<TriangleMesh>, map: Option<&NormalTexture>) -> Arc<TriangleMesh> {
    let Some(map) = map.filter(|_| mesh.tangents.is_empty()) else { return Arc::clone(mesh) };
    let set = match map.texture.tex_coord {
        0 => TextureCoordinateSet::First,
        _ => TextureCoordinateSet::Second,
    };
    mesh.with_tangents(set).map_or_else(|_| Arc::clone(mesh), Arc::new)
}
