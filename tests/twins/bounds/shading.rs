//! Bounds of the lighting equation for one light.

use glam::DVec3;
use lumbre_optics::{LightSample, ReflectionModel, SurfaceSample};

use super::{Allowed, FLUSHED, Numbers, U, lobes, microfacets, vectors};

/// specular_factor: that of the chosen model.
pub fn specular_factor(
    model: ReflectionModel,
    [normal, light, viewer]: [DVec3; 3],
    shininess: f64,
    ior: f64,
    sharp: bool,
) -> Allowed {
    match model {
        ReflectionModel::Phong => lobes::phong(normal, light, viewer, shininess, sharp),
        ReflectionModel::Blinn => lobes::blinn_phong(normal, light, viewer, shininess, sharp),
        ReflectionModel::Blinn4n => lobes::blinn_phong_4n(normal, light, viewer, shininess, sharp),
        ReflectionModel::BlinnMatched => lobes::blinn_phong_matched(normal, light, viewer, shininess, sharp),
        ReflectionModel::TorranceSparrow => {
            microfacets::torrance_sparrow([normal, light, viewer], shininess, ior)
        }
    }
}

/// light_contribution: products with three and four roundings, and the errors of n·l and of the specular factor
/// times the other factors.
pub fn light_contribution(
    model: ReflectionModel,
    surface: &SurfaceSample,
    light: &LightSample,
    normal: DVec3,
    viewer: DVec3,
) -> Allowed {
    let lit = lumbre_optics::light_contribution(model, *surface, light, normal, viewer);
    let factor = light.attenuation * light.spot;
    let directions = [normal, light.direction, viewer];
    let of_factor = specular_factor(model, directions, surface.shininess, surface.ior, false);
    let flushed = DVec3::splat(1e12 * FLUSHED);
    let ambient = 3.0 * U * lit.ambient + flushed;
    let cosine = vectors::dot(normal, light.direction);
    let diffuse = 4.0 * U * lit.diffuse + surface.diffuse * light.diffuse * factor * cosine + flushed;
    let colors = surface.specular * light.specular * factor;
    let specular = 4.0 * U * lit.specular + colors * of_factor.error[0] + flushed;
    let together = |specular: DVec3, ambient: DVec3, diffuse: DVec3| {
        [ambient.to_array(), diffuse.to_array(), specular.to_array()]
            .concat()
            .into_iter()
            .collect::<Numbers>()
    };
    let other = of_factor.other.map(|other| together(colors * other[0], lit.ambient, lit.diffuse));
    Allowed { error: together(specular, ambient, diffuse), other }
}
