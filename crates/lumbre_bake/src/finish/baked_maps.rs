//! Objects and maps as plain data: texels of E/π with their errors, on pages where objects share one, and meshes with
//! the coordinates to read them by. Not how they get into a World: that is `apply`.

use std::collections::HashSet;
use std::f32::consts::PI;
use std::sync::Arc;

use bevy_ecs::prelude::Component;
use glam::Vec3;
use lumbre_mesh::TriangleMesh;
use lumbre_scene::{LightmapEncoding, LightmapImage, MaterialTextures, SeparateLight};

use super::pages::Pages;
use super::separate_light::Separate;
use crate::scene::{LightmapLayout, SceneObject, textures_of};

/// An object with its light.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BakedObject {
    /// One per primitive: its mesh with `uv1`. It is the original mesh where its `uv1` can hold the map.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// One per primitive: its textures. They read other coordinates than before where the lightmap needed theirs.
    pub textures: Vec<Option<MaterialTextures>>,
    /// Index of its map in [`BakedScene::maps`](crate::BakedScene::maps).
    pub map: usize,
}

/// A lightmap.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BakedMap {
    /// E/π, row by row, 0 where nothing is known.
    pub image: Arc<LightmapImage>,
    /// The standard error of each texel.
    pub errors: TexelErrors,
    /// The map's direct light and its light by bounces, with
    /// [`BakeOptions::separate_light`](crate::BakeOptions::separate_light).
    pub separate: Option<SeparateLight>,
}

/// One standard error of each texel of an entity's [`Lightmap`](lumbre_scene::Lightmap), in the map's own unit (E/π,
/// mean of the channels), row by row; NaN where the map shows no surface. At least 95 % of the texels are within two
/// standard errors of a converged bake of the same map.
#[derive(Component, Clone, Debug)]
pub struct TexelErrors(pub Arc<[f32]>);

/// The finished texels of all maps.
pub(crate) struct FilledTexels<'a> {
    /// W/m²; NaN where nothing is known.
    pub irradiance: &'a [Vec3],
    /// Squared errors; NaN where a texel shows no surface of its own.
    pub variances: &'a [f32],
    pub separate: Option<&'a Separate>,
}

/// Every object with its map, which is its own or on a page.
pub(crate) fn baked_objects(
    objects: &[SceneObject],
    layout: &LightmapLayout,
    texels: &FilledTexels<'_>,
    pages: &Pages,
) -> (Vec<BakedObject>, Vec<BakedMap>) {
    let mut names = HashSet::new();
    let on_pages = (0..pages.pages.len()).map(|index| {
        let page = &pages.pages[index];
        let size = (page.width, page.height);
        let light =
            |values: &[Vec3]| pages.compose(index, layout, |texel| map_value(values[texel]), Vec3::ZERO);
        let errors = pages.compose(index, layout, |texel| map_error(texels.variances[texel]), f32::NAN);
        texels.baked_map(&format!("atlas-{}", index + 1), size, light, errors, &mut names)
    });
    let mut maps: Vec<BakedMap> = on_pages.collect();
    let mut baked = Vec::with_capacity(objects.len());
    for (index, object) in objects.iter().enumerate() {
        let map = &layout.maps[index];
        let place = pages.places[index];
        if place.is_none() {
            let light =
                |values: &[Vec3]| values[map.places()].iter().map(|&light| map_value(light)).collect();
            let errors = texels.variances[map.places()].iter().map(|&variance| map_error(variance)).collect();
            maps.push(texels.baked_map(&object.name, (map.width, map.height), light, errors, &mut names));
        }
        let mesh = |mesh: &Arc<TriangleMesh>| match place {
            Some(_) => pages.on_page(layout, index, mesh),
            None => Arc::clone(mesh),
        };
        baked.push(BakedObject {
            meshes: map.meshes.iter().map(mesh).collect(),
            textures: object
                .primitives
                .iter()
                .zip(&map.moved)
                .map(|(primitive, &moved)| textures_of(primitive, moved))
                .collect(),
            map: place.map_or(maps.len() - 1, |place| place.page),
        });
    }
    (baked, maps)
}

impl FilledTexels<'_> {
    /// A map from its errors and a function that lays out its light from values per texel of all maps.
    fn baked_map(
        &self,
        name: &str,
        (width, height): (u32, u32),
        light: impl Fn(&[Vec3]) -> Vec<Vec3>,
        errors: Vec<f32>,
        names: &mut HashSet<String>,
    ) -> BakedMap {
        let stem = unused_name(name, names);
        let image = |kind: &str, texels: Vec<Vec3>| {
            let (name, encoding) = (format!("{stem}{kind}.lightmap.exr"), LightmapEncoding::Rgb32Float);
            Arc::new(LightmapImage { name, width, height, texels, encoding })
        };
        let separate = self.separate.map(|separate| SeparateLight {
            direct: image(".direct", light(&separate.direct)),
            bounced: image(".bounced", light(&separate.bounced)),
        });
        BakedMap { image: image("", light(self.irradiance)), errors: TexelErrors(errors.into()), separate }
    }
}

/// The map's value, E/π, of an irradiance; 0 where that is not known.
fn map_value(irradiance: Vec3) -> Vec3 {
    if irradiance.is_finite() { irradiance / PI } else { Vec3::ZERO }
}

/// The standard error of the map's value from the squared error of the irradiance.
fn map_error(variance: f32) -> f32 {
    variance.sqrt() / PI
}

/// The beginning of a file name that is valid on every system, and not taken yet.
fn unused_name(object: &str, taken: &mut HashSet<String>) -> String {
    let plain: String = object
        .chars()
        .take(64)
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' })
        .collect();
    let mut name = plain.clone();
    let mut number = 2;
    while !taken.insert(name.to_lowercase()) {
        name = format!("{plain}.{number}");
        number += 1;
    }
    name
}
