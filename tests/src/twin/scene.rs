//! What the twin draws: the components of a World in world space, f64.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DMat3, DVec2, DVec3};
use lumbre_optics::{FlatRule, Light, Material, ReflectionModel, Shading, safe_normalize};
use lumbre_scene::{GlobalTransform, Hidden, Lightmap, LightmapImage, Mesh, SceneSettings};

use super::TwinOptions;

pub(super) struct Vertex {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
    pub(super) uv1: DVec2,
}

pub(super) struct Scene {
    pub(super) settings: SceneSettings,
    pub(super) reflection: ReflectionModel,
    pub(super) flat_rule: FlatRule,
    pub(super) specular_antialiasing: bool,
    pub(super) lights: Vec<(Light, DVec3, DVec3)>,
    pub(super) eye: DVec3,
    pub(super) basis: DMat3,
}

pub(super) struct Object {
    pub(super) material: Material,
    pub(super) shading: Shading,
    pub(super) lightmap: Option<Arc<LightmapImage>>,
    pub(super) triangles: Vec<[Vertex; 3]>,
    /// Its transform mirrors: the second and third corner of every triangle have changed places.
    pub(super) mirrored: bool,
}

/// The objects that are seen.
pub(super) fn collect(world: &mut World, settings: &SceneSettings, options: &TwinOptions) -> Vec<Object> {
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
            mirrored: place.mirrors(),
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
