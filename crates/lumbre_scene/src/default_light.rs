//! A light for files without one: a key light and a fill light attached to the camera, so that a scene
//! without lights is not drawn black. They are not part of the scene.

use bevy_ecs::prelude::*;
use glam::{DQuat, EulerRot, Vec3};
use lumbre_optics::{BakeMode, Light, Material};

use crate::{
    ChildOf, EmissiveLight, IrradianceVolume, Lightmap, MaterialTextures, Mesh, Name, SceneSettings,
    Transform, hidden_entities, update_transforms,
};

/// Radiance of a white surface that faces the key light.
const KEY: f32 = 0.75;
/// Radiance of a white surface that faces the fill light.
const FILL: f32 = 0.25;
/// Ambient radiance of every white surface. Metals, which have no diffuse reflection, show their colour by
/// it.
const AMBIENT: f32 = 0.2;

/// Returns true if a frame of a World would show its surfaces black: a lit mesh is visible, and nothing
/// lights it.
///
/// Sources of light are an enabled `Light` that is not black, global ambient light, a sky, a lightmap, an
/// irradiance volume, or a mesh with [`EmissiveLight`]. Emission without that component lights nothing else
/// in a frame, although it does in a bake.
pub fn is_without_light(world: &mut World) -> bool {
    let shines = |color: Vec3| color.max_element() > 0.0;
    let lamp = |light: &Light| {
        light.enabled && [light.ambient, light.diffuse, light.specular].into_iter().any(shines)
    };
    if world.get_resource::<SceneSettings>().is_some_and(|settings| shines(settings.ambient_with_sky()))
        || world.query::<&Light>().iter(world).any(lamp)
        || world.query_filtered::<(), (With<Lightmap>, With<Mesh>)>().iter(world).next().is_some()
        || world.query_filtered::<(), With<IrradianceVolume>>().iter(world).next().is_some()
        || world
            .query_filtered::<&Material, (With<EmissiveLight>, With<Mesh>)>()
            .iter(world)
            .any(|material| EmissiveLight::radiance(material).into_iter().any(shines))
    {
        return false;
    }
    // A mesh that glows all over is visible by itself; with an emissive texture it may glow in few places
    // only.
    let hidden = hidden_entities(world);
    let takes_light = |(entity, material, textures): (Entity, &Material, Option<&MaterialTextures>)| {
        let glows = shines(material.front.emission) && textures.is_none_or(|own| own.emissive.is_none());
        !material.unlit && !glows && !hidden.contains(&entity)
    };
    let mut objects = world.query_filtered::<(Entity, &Material, Option<&MaterialTextures>), With<Mesh>>();
    objects.iter(world).any(takes_light)
}

/// Attaches a key light from above the viewer's left shoulder and a fill light from the right to a camera.
/// Updates the global transforms.
pub fn add_default_light(world: &mut World, camera: Entity) {
    let light =
        |strength: f32| Light { bake: BakeMode::Dynamic, ..Light::directional(Vec3::splat(strength)) };
    let fill = Light { ambient: Vec3::splat(AMBIENT), specular: Vec3::ZERO, ..light(FILL) };
    for (name, light, yaw, pitch) in [("key light", light(KEY), -0.6, -0.6), ("fill light", fill, 0.9, -0.1)]
    {
        let rotation = DQuat::from_euler(EulerRot::YXZ, yaw, pitch, 0.0);
        world.spawn((Name::new(name), light, Transform { rotation, ..Transform::IDENTITY }, ChildOf(camera)));
    }
    update_transforms(world);
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;
    use lumbre_mesh::TriangleMesh;

    use super::*;
    use crate::{Camera, GlobalTransform, Image, LightmapEncoding, LightmapImage, TextureReference};

    fn world(material: Material) -> World {
        let mut world = World::new();
        world.spawn((Mesh(Arc::new(TriangleMesh::default())), material));
        world
    }

    #[test]
    fn what_counts_as_light() {
        let grey = || world(Material::matt(Vec3::splat(0.5)));
        assert!(is_without_light(&mut grey()));
        assert!(!is_without_light(&mut World::new()), "nothing is shown");
        assert!(!is_without_light(&mut world(Material { unlit: true, ..Material::default() })));

        let mut glowing = Material::default();
        glowing.front.emission = Vec3::ONE;
        assert!(!is_without_light(&mut world(glowing.clone())), "all that is shown shows itself");
        let mut display = world(glowing.clone());
        let shown = display.query_filtered::<Entity, With<Mesh>>().single(&display).unwrap();
        let image = Image { name: String::new(), width: 1, height: 1, rgba: vec![255; 4] };
        let texture = TextureReference::new(Arc::new(image));
        display
            .entity_mut(shown)
            .insert(MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() });
        assert!(is_without_light(&mut display), "a texture may glow in few places");
        let mut beside = grey();
        let emitter = beside.spawn((Mesh(Arc::new(TriangleMesh::default())), glowing)).id();
        assert!(is_without_light(&mut beside), "emission lights nothing else");
        beside.entity_mut(emitter).insert(EmissiveLight);
        assert!(!is_without_light(&mut beside));

        let mut baked = grey();
        baked.spawn(IrradianceVolume { resolution: glam::UVec3::ONE, cubes: Vec::new(), inside: Vec::new() });
        assert!(!is_without_light(&mut baked), "a bake has put light where nothing stands still");

        for (light, dark) in [
            (Light::point(Vec3::ONE), false),
            (Light::point(Vec3::ZERO), true),
            (Light { enabled: false, ..Light::point(Vec3::ONE) }, true),
        ] {
            let mut lit = grey();
            lit.spawn(light);
            assert_eq!(is_without_light(&mut lit), dark);
        }
        let mut ambient = grey();
        ambient.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
        assert!(!is_without_light(&mut ambient));
        let mut outside = grey();
        outside.insert_resource(SceneSettings { sky: Vec3::splat(0.1), ..SceneSettings::default() });
        assert!(!is_without_light(&mut outside));
        let mut baked = grey();
        let (encoding, texels) = (LightmapEncoding::Rgb32Float, vec![Vec3::ONE]);
        let image = LightmapImage { name: String::new(), width: 1, height: 1, texels, encoding };
        let mesh = Mesh(Arc::new(TriangleMesh::default()));
        baked.spawn((mesh, Lightmap { image: Arc::new(image) }));
        assert!(!is_without_light(&mut baked));
    }

    #[test]
    fn it_travels_with_the_camera() {
        let mut world = world(Material::default());
        let place = Transform::from_xyz(3.0, 1.0, 0.0).looking_at(DVec3::ZERO, DVec3::Y);
        let camera = world.spawn((Camera::default(), place)).id();
        add_default_light(&mut world, camera);
        assert!(!is_without_light(&mut world));
        let shining: Vec<DVec3> = world
            .query::<(&Light, &GlobalTransform)>()
            .iter(&world)
            .map(|(_, global)| global.forward())
            .collect();
        // Both shine away from the viewer and downwards.
        assert!(shining.iter().all(|axis| axis.x < -0.4 && axis.y < 0.0), "{shining:?}");
        world
            .entity_mut(camera)
            .insert(Transform::from_xyz(-3.0, 1.0, 0.0).looking_at(DVec3::ZERO, DVec3::Y));
        update_transforms(&mut world);
        assert!(
            world
                .query::<(&Light, &GlobalTransform)>()
                .iter(&world)
                .all(|(_, global)| global.forward().x > 0.4)
        );
    }
}
