//! The room with something for every effect that a frame can do without. The study `effects` switches each of
//! them off in turn.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, ErrorBound, Light, Material, Shading, Surface};
use lumbre_scene::{
    DynamicObject, Image, MaterialTextures, Medium, Mesh, Name, NormalTexture, OcclusionTexture,
    SceneSettings, TextureReference, Transform,
};

use super::{Air, room};

/// Creates the hazy room with a sky, ambient and distant light, a mirror, glass, cut-out and bumpy surfaces,
/// and objects that choose their own shading. Lightmaps and irradiance volumes are added by a bake.
pub fn every_effect() -> World {
    let mut world = room(Air::Hazy);
    world.get_resource_or_insert_with(SceneSettings::default).sky = Vec3::splat(0.05);
    world.spawn((Name::new("ambient light"), Light::ambient(Vec3::splat(0.03))));
    let low = Transform::IDENTITY.looking_at(glam::DVec3::new(-0.4, -0.6, -0.7), glam::DVec3::Y);
    world.spawn((Name::new("distant light"), Light::directional(Vec3::splat(0.15)), low));
    let ball = Arc::new(shapes::uv_sphere(0.22, 24, 13));
    let mut place = |name: &str, mesh: Arc<lumbre_mesh::TriangleMesh>, material: Material, at: Transform| {
        world.spawn((Name::new(name.to_owned()), Mesh(mesh), material, at, DynamicObject)).id()
    };
    let matt = |r, g, b| Material::matt(Vec3::new(r, g, b));
    let gouraud =
        place("Gouraud ball", ball.clone(), matt(0.6, 0.3, 0.2), Transform::from_xyz(-0.5, 0.22, 0.5));
    let by_need =
        place("ball by need", ball.clone(), matt(0.3, 0.6, 0.2), Transform::from_xyz(-1.1, 0.22, 0.4));
    let black = Surface { specular: Vec3::splat(0.3), shininess: 100.0, ..matt(0.0, 0.0, 0.0).front };
    let mirror = Material { front: black, mirror: Vec3::splat(0.85), ..Material::default() };
    let upright = |x: f64, y: f64, z: f64| {
        Transform::from_xyz(x, y, z).with_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2))
    };
    place("mirror", Arc::new(shapes::plane(1.1, 0.8, 1, 1)), mirror, upright(0.4, 1.7, -1.95));
    let glass = Material { front: black, transmission: Vec3::ONE, ior: 1.5, ..Material::default() };
    let clear = place(
        "ball of glass",
        Arc::new(shapes::uv_sphere(0.18, 48, 24)),
        glass,
        Transform::from_xyz(1.1, 0.9, 0.2),
    );
    let cut_out =
        Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, double_sided: true, ..matt(0.5, 0.5, 0.6) };
    let grating = place("grating", Arc::new(shapes::plane(0.7, 0.9, 1, 1)), cut_out, upright(-1.5, 0.9, 0.2));
    let slab = Arc::new(shapes::cuboid(Vec3::new(0.5, 0.5, 0.1), 1));
    let bumpy = place("bumpy slab", slab, matt(0.6, 0.55, 0.5), Transform::from_xyz(0.1, 0.25, 0.7));

    if let Some(max_error) = ErrorBound::new(0.03) {
        world.entity_mut(by_need).insert(Shading::Auto { max_error });
    }
    world.entity_mut(gouraud).insert(Shading::Gouraud);
    world.entity_mut(clear).insert(Medium { fresnel: true, ..Medium::default() });
    let bars = |x: u32, _: u32| [255, 255, 255, if (x / 4).is_multiple_of(2) { 255 } else { 0 }];
    world
        .entity_mut(grating)
        .insert(MaterialTextures { base_color: Some(texture("bars", bars)), ..MaterialTextures::default() });
    // Normals that lean to either side alternately look like ridges.
    let ridges = |x: u32, _: u32| [if (x / 4).is_multiple_of(2) { 88 } else { 168 }, 128, 240, 255];
    let cavities = |x: u32, y: u32| [if (x / 4 + y / 4).is_multiple_of(2) { 255 } else { 120 }, 0, 0, 255];
    world.entity_mut(bumpy).insert(MaterialTextures {
        normal: Some(NormalTexture { texture: texture("ridges", ridges), scale: 1.0 }),
        occlusion: Some(OcclusionTexture { texture: texture("cavities", cavities), strength: 1.0 }),
        ..MaterialTextures::default()
    });
    world
}

fn texture(name: &str, texel: impl Fn(u32, u32) -> [u8; 4]) -> TextureReference {
    let side = 32;
    let rgba =
        (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y)).collect();
    TextureReference::new(Arc::new(Image { name: name.to_owned(), width: side, height: side, rgba }))
}

#[cfg(test)]
mod tests {
    use lumbre_render::{FrameOptions, removable_effects};
    use lumbre_scene::{Census, update_transforms};

    use super::*;

    /// All effects that can be left out, except those of a bake.
    #[test]
    fn every_effect_is_called_for() {
        let mut world = every_effect();
        update_transforms(&mut world);
        let found = removable_effects(&Census::of(&mut world), &FrameOptions::default());
        let names: Vec<&str> = found.iter().map(|effect| effect.effect).collect();
        for name in [
            "Gouraud shading",
            "Phong shading",
            "shading by need",
            "sky",
            "global ambient",
            "ambient lights",
            "directional lights",
            "point lights",
            "spot lights",
            "shadows",
            "polygon lights",
            "specular",
            "emission",
            "textures",
            "normal textures",
            "occlusion textures",
            "alpha mask",
            "alpha blending",
            "two-sided",
            "refraction",
            "planar mirrors",
            "fog",
        ] {
            assert!(names.contains(&name), "{name} is missing among {names:?}");
        }
    }
}
