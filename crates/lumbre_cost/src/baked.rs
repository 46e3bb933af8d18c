//! Bakes scenes for studies, and compares the texels of two bakes.

use std::ops::ControlFlow;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_bake::{
    Bake, BakeOptions, BakeReport, Density, Probes, Progress, Samples, TexelErrors, baked_area, baked_meshes,
    has_light_to_bake,
};
use lumbre_optics::Material;
use lumbre_scene::{Lightmap, LightmapImage, MaterialTextures, Mesh};

use crate::converged::Maps;
use crate::picture::Picture;
use crate::scene_file::SceneFile;
use crate::{Conditions, CostError, ErrorOf};

/// A World with its lightmaps, and the report of the bake.
pub struct Baked {
    /// The World.
    pub world: World,
    /// The report of the bake.
    pub report: BakeReport,
}

/// Returns the options that the bakes of a study share: a density that gives about `texels` texels in all,
/// and no probes.
///
/// # Errors
/// [`CostError::Load`].
pub fn bake_options(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    texels: f64,
) -> Result<BakeOptions, CostError> {
    let mut world = scene.open(conditions.aspect())?;
    let area = baked_area(&mut world);
    // Two digits are accurate enough, and keep the command line short.
    let exact = (texels / area.max(1e-12)).sqrt();
    let unit = 10f64.powf(exact.log10().floor() - 1.0);
    let density = Density::TexelsPerMeter((exact / unit).round() * unit);
    Ok(BakeOptions { density, probes: Probes::Never, resolution_error: false, ..BakeOptions::default() })
}

/// Returns the arguments of `lumbre bake` for these options.
pub fn bake_arguments(options: &BakeOptions) -> String {
    let density = match options.density {
        Density::TexelsPerMeter(density) => format!(" --texels-per-meter {}", (density * 1e6).round() / 1e6),
        Density::MapSize(side) => format!(" --map-size {side}"),
        Density::Automatic => String::new(),
    };
    let patches = options.patch_texels.map_or_else(String::new, |texels| format!(" --patch-texels {texels}"));
    let probes = match options.probes {
        Probes::Never => " --probes never",
        Probes::Always => " --probes always",
        _ => "",
    };
    // In an atlas, which the command line packs by default, maps are read at slightly different places.
    format!(
        "--error {}{density}{patches}{probes} --no-resolution-error --no-reuse --atlas-size 0",
        options.error
    )
}

/// Returns a sentence that says why a scene cannot be baked, or `None` if it can.
///
/// # Errors
/// [`CostError::Load`].
pub fn nothing_to_bake(conditions: &Conditions<'_>, scene: &SceneFile) -> Result<Option<String>, CostError> {
    Ok(nothing_to_bake_in(&mut scene.open(conditions.aspect())?, &scene.name))
}

/// Returns a sentence that says why a World of this name cannot be baked, or `None` if it can.
pub fn nothing_to_bake_in(world: &mut World, name: &str) -> Option<String> {
    match (baked_area(world) > 0.0, has_light_to_bake(world)) {
        (true, true) => None,
        (false, _) => {
            Some(format!("Everything in {name} moves, is hidden or is unlit, so there is nothing to bake."))
        }
        (_, false) => Some(format!(
            "{name} has no baked lights, no emission and no sky, so its lightmaps would be black."
        )),
    }
}

/// Static triangles from which on a quick report bakes less often. Each of them has a texel at least, so that a bake of many takes seconds, however few texels are asked for.
const MANY_TRIANGLES: usize = 5_000;

/// Returns whether a quick report makes fewer bakes of a scene, because each of them takes seconds, and a sentence for
/// the page that says so.
///
/// # Errors
/// [`CostError::Load`].
pub fn few_bakes(conditions: &Conditions<'_>, scene: &SceneFile) -> Result<Option<String>, CostError> {
    if !conditions.quick || conditions.files.is_empty() {
        return Ok(None);
    }
    let mut world = scene.open(conditions.aspect())?;
    let baked = baked_meshes(&mut world);
    let mut objects = world.query::<(Entity, &Mesh)>();
    let static_objects = objects.iter(&world).filter(|(entity, _)| baked.contains(entity));
    let triangles = static_objects.map(|(_, mesh)| mesh.0.triangle_count()).sum::<usize>();
    Ok((triangles > MANY_TRIANGLES).then(|| {
        format!(
            "{} has {triangles} static triangles, so that each bake takes seconds. This quick report makes fewer of them than a full one.",
            scene.name
        )
    }))
}

/// Bakes a scene. `told` are the fractions of the study that are done before and after.
///
/// # Errors
/// [`CostError::Bake`], [`CostError::Load`], [`CostError::Interrupted`].
pub fn bake_scene(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &BakeOptions,
    told: [f64; 2],
) -> Result<Baked, CostError> {
    let mut world = scene.open(conditions.aspect())?;
    let report = Bake::new(options).progress(telling(conditions, told)).run(&mut world)?;
    Ok(Baked { world, report })
}

/// Bakes a World, reusing the samples of a former bake where possible, and returns the samples for the next
/// bake.
///
/// # Errors
/// [`CostError::Bake`], [`CostError::Interrupted`].
pub fn bake_world(
    conditions: &Conditions<'_>,
    mut world: World,
    options: &BakeOptions,
    former: Option<&Samples>,
    told: [f64; 2],
) -> Result<(Baked, Option<Samples>), CostError> {
    let mut samples = None;
    let bake = Bake::new(options).former(former).keep_samples(&mut samples);
    let report = bake.progress(telling(conditions, told)).run(&mut world)?;
    Ok((Baked { world, report }, samples))
}

/// Bakes a scene whose surfaces reflect nothing while it is baked. A lightmap holds the light that arrives, so that
/// each surface still gets its direct light.
///
/// # Errors
/// [`CostError::Bake`], [`CostError::Load`], [`CostError::Interrupted`].
pub fn bake_direct_light(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &BakeOptions,
    told: [f64; 2],
) -> Result<Baked, CostError> {
    let mut world = scene.open(conditions.aspect())?;
    let mut materials = world.query::<(Entity, &mut Material)>();
    let mut own: Vec<(Entity, Material)> = Vec::new();
    for (entity, mut material) in materials.iter_mut(&mut world) {
        own.push((entity, material.clone()));
        let material = &mut *material;
        for surface in std::iter::once(&mut material.front).chain(&mut material.back) {
            (surface.ambient, surface.diffuse, surface.specular) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        }
        material.mirror = Vec3::ZERO;
    }
    let mut slots = world.query::<(Entity, &mut MaterialTextures)>();
    let mut own_slots = Vec::new();
    for (entity, mut textures) in slots.iter_mut(&mut world) {
        if let Some(slot) = &mut textures.metallic_roughness {
            own_slots.push((entity, slot.base_color, slot.dielectric));
            (slot.base_color, slot.dielectric) = (Vec3::ZERO, Vec3::ZERO);
        }
    }
    let (mut baked, _) = bake_world(conditions, world, options, None, told)?;
    for (entity, base_color, dielectric) in own_slots {
        let textures = baked.world.get_mut::<MaterialTextures>(entity);
        if let Some(slot) = textures.and_then(|textures| textures.into_inner().metallic_roughness.as_mut()) {
            (slot.base_color, slot.dielectric) = (base_color, dielectric);
        }
    }
    for (entity, material) in own {
        if let Ok(mut entity) = baked.world.get_entity_mut(entity) {
            entity.insert(material);
        }
    }
    Ok(baked)
}

/// Returns a callback that reports the progress of a bake; `told` are the fractions of the study that are
/// done before and after.
fn telling<'a>(
    conditions: &Conditions<'a>,
    [before, after]: [f64; 2],
) -> impl FnMut(Progress) -> ControlFlow<()> + Send + use<'a> {
    let listener = conditions.listener;
    move |progress| listener(Some(before + f64::from(progress.fraction) * (after - before)))
}

/// Returns the lightmaps of a World that has just been baked.
pub fn maps_of(world: &mut World) -> Maps {
    let mut maps = world.query::<(&Lightmap, &TexelErrors)>();
    let named = maps
        .iter(world)
        .map(|(map, errors)| (map.image.name.clone(), (Arc::clone(&map.image), Arc::clone(&errors.0))));
    named.collect()
}

/// Number of columns of a picture of texels.
const COLUMNS: usize = 256;

/// Returns the texels of all maps one after the other, in the order of their names. Texels that show no
/// surface are NaN.
pub fn picture_of_maps(maps: &Maps) -> Picture {
    let of_map = |(image, errors): &(Arc<LightmapImage>, Arc<[f32]>)| {
        let texels = image.texels.iter().zip(errors.iter());
        texels
            .map(|(texel, error)| if error.is_finite() { texel.as_dvec3() } else { DVec3::NAN })
            .collect::<Vec<_>>()
    };
    let mut radiance: Vec<DVec3> = maps.values().flat_map(of_map).collect();
    radiance.resize(radiance.len().next_multiple_of(COLUMNS), DVec3::NAN);
    Picture { width: COLUMNS, radiance }
}

/// Relative uncertainty of the noise that a bake states.
const NOISE_KNOWN_TO: f64 = 0.2;

/// Returns the difference of texels from those of a reference bake of the same maps: root mean square and
/// largest difference relative to the reference's mean, over the texels that show a surface in both.
///
/// The reference's noise is independent, and its stated variance is subtracted. The uncertainty follows from
/// [`NOISE_KNOWN_TO`]. If the noise explains all of the difference, the error may have any value up to the
/// difference itself. `None` if the maps differ in name or size.
pub fn texel_error(found: &Maps, reference: &Maps) -> Option<ErrorOf> {
    let (mut squares, mut noise, mut sum, mut largest, mut count) = (0.0, 0.0, 0.0, 0.0_f64, 0.0);
    for (name, (wanted, wanted_errors)) in reference {
        let (texels, errors) = found.get(name)?;
        if texels.texels.len() != wanted.texels.len() {
            return None;
        }
        let pairs = texels.texels.iter().zip(&wanted.texels).zip(errors.iter().zip(wanted_errors.iter()));
        for ((texel, expected), (error, expected_error)) in pairs {
            if !(error.is_finite() && expected_error.is_finite()) {
                continue;
            }
            let apart = (*texel - *expected).as_dvec3();
            squares += apart.length_squared() / 3.0;
            largest = largest.max(apart.abs().max_element());
            noise += f64::from(*expected_error).powi(2);
            sum += f64::from(expected.element_sum()) / 3.0;
            count += 1.0;
        }
    }
    if count == 0.0 {
        return None;
    }
    let mean = (sum / count).max(f64::MIN_POSITIVE);
    let without = |noise: f64| ((squares - noise).max(0.0) / count).sqrt() / mean;
    let [most, least] = [1.0 - NOISE_KNOWN_TO, 1.0 + NOISE_KNOWN_TO].map(|part| without(noise * part * part));
    let relative_rmse = without(noise);
    let uncertainty = match relative_rmse > 0.0 {
        true => (most - relative_rmse).max(relative_rmse - least),
        false => without(0.0),
    };
    Some(ErrorOf { relative_rmse, largest: largest / mean, flip: None, uncertainty })
}

#[cfg(test)]
mod tests {
    use lumbre_scene::LightmapEncoding;

    use super::*;

    fn maps(texels: Vec<Vec3>, error: f32) -> Maps {
        let errors: Arc<[f32]> = vec![error; texels.len()].into();
        let (name, width, height) = ("floor".to_owned(), texels.len() as u32, 1);
        let image = LightmapImage {
            name: name.clone(),
            width,
            height,
            texels,
            encoding: LightmapEncoding::Rgb32Float,
        };
        [(name, (Arc::new(image), errors))].into()
    }

    #[test]
    fn the_references_own_noise_is_taken_off() {
        let truth = maps(vec![Vec3::ONE; 100], 0.0);
        let noisy = |by: f32| {
            maps((0..100).map(|i| Vec3::splat(if i % 2 == 0 { 1.0 + by } else { 1.0 - by })).collect(), by)
        };
        let exact = texel_error(&noisy(0.05), &truth).expect("the maps are alike");
        assert!((exact.relative_rmse - 0.05).abs() < 1e-6 && exact.uncertainty == 0.0, "{exact:?}");
        // A map without error against a noisy reference that knows its noise.
        let none = texel_error(&truth, &noisy(0.05)).expect("the maps are alike");
        assert!(none.relative_rmse < 1e-3 && none.uncertainty > 0.01, "{none:?}");
        // A reference that states more noise than there is difference only shows that the error is at most
        // the difference.
        let unsure = texel_error(&truth, &maps(noisy(0.05)["floor"].0.texels.clone(), 0.2))
            .expect("the maps are alike");
        assert_eq!(unsure.relative_rmse, 0.0);
        assert!((unsure.uncertainty - 0.05).abs() < 1e-3, "{unsure:?}");
        assert_eq!(texel_error(&truth, &maps(vec![Vec3::ONE; 50], 0.0)), None);
    }
}
