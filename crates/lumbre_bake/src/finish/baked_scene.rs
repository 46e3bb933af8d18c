//! What a bake has made, as plain data: maps, meshes with the coordinates to read them by, probes. Not how they get
//! into a World: that is `apply`.

use std::collections::HashSet;
use std::f32::consts::PI;
use std::sync::Arc;

use bevy_ecs::prelude::Component;
use glam::Vec3;
use lumbre_mesh::TriangleMesh;
use lumbre_scene::{
    IrradianceVolume, LightmapEncoding, LightmapImage, MaterialTextures, SeparateLight, Transform,
};

use super::pages::Pages;
use super::separate_light::Separate;
use crate::scene::{LightmapLayout, SceneObject, textures_of};
use crate::{BakeReport, Samples};

/// What a bake has made of a [`StaticScene`](crate::StaticScene).
#[derive(Debug)]
#[non_exhaustive]
pub struct BakedScene {
    /// One per object of the scene, in its order; none where there was nothing to bake.
    pub objects: Vec<BakedObject>,
    /// The maps that objects show.
    pub maps: Vec<BakedMap>,
    /// The light for what moves, and its place, if it was called for.
    pub volume: Option<(Transform, IrradianceVolume)>,
    /// What was done, what it cost and how good it is.
    pub report: BakeReport,
    /// For [`Bake::former`](crate::Bake::former) of the next time, if they were asked for and there was something to
    /// keep.
    pub samples: Option<Samples>,
}

/// An object with its light.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BakedObject {
    /// One per primitive: its mesh with `uv1`, which is the mesh as it was where that could hold the map.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// One per primitive: its textures, which read other coordinates than before where the lightmap needed theirs.
    pub textures: Vec<Option<MaterialTextures>>,
    /// Index of its map.
    pub map: usize,
}

/// A lightmap.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BakedMap {
    /// E/π, row by row, 0 where nothing is known.
    pub image: Arc<LightmapImage>,
    /// How far each texel may be off.
    pub errors: TexelErrors,
    /// The map's light in two, with [`BakeOptions::separate_light`](crate::BakeOptions::separate_light).
    pub separate: Option<SeparateLight>,
}

/// How far each texel of an entity's [`Lightmap`](lumbre_scene::Lightmap) may be off: one standard error in the map's
/// own unit (E/π, mean of the channels), row by row; NaN where the map shows no surface. Against a converged bake of
/// the same map at least 95 % of the texels are within two.
#[derive(Component, Clone, Debug)]
pub struct TexelErrors(pub Arc<[f32]>);

/// What was found of the texels of all maps.
pub(crate) struct FilledTexels<'a> {
    /// W/m²; NaN where nothing is known.
    pub irradiance: &'a [Vec3],
    /// Squared errors.
    pub variances: &'a [f32],
    pub separate: Option<&'a Separate>,
}

/// Every object with its map, of its own or on a page.
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
        let light = |of: &[Vec3]| pages.compose(index, layout, |texel| shown(of[texel]), Vec3::ZERO);
        let errors = pages.compose(index, layout, |texel| error(texels.variances[texel]), f32::NAN);
        texels.map(&format!("atlas-{}", index + 1), size, light, errors, &mut names)
    });
    let mut maps: Vec<BakedMap> = on_pages.collect();
    let mut baked = Vec::with_capacity(objects.len());
    for (index, object) in objects.iter().enumerate() {
        let map = &layout.maps[index];
        let place = pages.places[index];
        if place.is_none() {
            let own = map.first..map.first + (map.width * map.height) as usize;
            let light = |of: &[Vec3]| of[own.clone()].iter().map(|&light| shown(light)).collect();
            let errors = texels.variances[own.clone()].iter().map(|&variance| error(variance)).collect();
            maps.push(texels.map(&object.name, (map.width, map.height), light, errors, &mut names));
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
                .map(|(part, &moved)| textures_of(part, moved))
                .collect(),
            map: place.map_or(maps.len() - 1, |place| place.page),
        });
    }
    (baked, maps)
}

impl FilledTexels<'_> {
    fn map(
        &self,
        name: &str,
        (width, height): (u32, u32),
        light: impl Fn(&[Vec3]) -> Vec<Vec3>,
        errors: Vec<f32>,
        names: &mut HashSet<String>,
    ) -> BakedMap {
        let stem = unused(name, names);
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

/// E/π of an irradiance, 0 where it is not known.
fn shown(irradiance: Vec3) -> Vec3 {
    if irradiance.is_finite() { irradiance / PI } else { Vec3::ZERO }
}

/// The error of E/π from the squared one of the irradiance.
fn error(variance: f32) -> f32 {
    variance.sqrt() / PI
}

/// The beginning of a file name that every system takes, used once.
fn unused(object: &str, taken: &mut HashSet<String>) -> String {
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
