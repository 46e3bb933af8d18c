//! Bevy shows the light that Lumbre baked: [`LumbrePlugin`] reads `LUMBRE_lightmap` and `LUMBRE_irradiance_volume` of a glTF file while Bevy
//! loads it, and gives its meshes Bevy's own components. Nothing of Lumbre is linked, and nothing is drawn here.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use lumbre_bevy::LumbrePlugin;
//!
//! App::new().add_plugins((DefaultPlugins, LumbrePlugin::default())).add_systems(Startup, level).run();
//!
//! fn level(mut commands: Commands, assets: Res<AssetServer>) {
//!     commands.spawn(WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset("level.baked.glb"))));
//!     // A factor of 1 on radiance, as Lumbre's frames have it where the camera does not say otherwise.
//!     commands.spawn((Camera3d::default(), lumbre_bevy::exposure(1.0)));
//! }
//! ```
//!
//! Units: a texel of a lightmap is E/π. Bevy multiplies it by `lightmap_exposure` (1 unless a material says otherwise), the diffuse colour
//! and the camera's exposure, and gets the radiance that its lights, in candela and lux, have too. So nothing is scaled here.

use bevy::asset::LoadContext;
use bevy::camera::Exposure;
use bevy::gltf::GltfLoaderSettings;
use bevy::gltf::extensions::{ErasedGltfExtensionHandler, GltfExtensionHandler, GltfExtensionHandlers};
use bevy::image::{ImageLoaderSettings, ImageSampler};
use bevy::light::{GlobalAmbientLight, IrradianceVolume, LightProbe};
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use percent_encoding::percent_decode_str;
use serde_json::Value;

const LIGHTMAP: &str = "LUMBRE_lightmap";
const VOLUME: &str = "LUMBRE_irradiance_volume";
const LIGHT: &str = "LUMBRE_lights_phong";

/// Which of a bake's images are loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightmapImages {
    /// The .ktx2 images of a bake: four bytes a texel, and every device filters them.
    #[default]
    Ktx2,
    /// The images that the file names: OpenEXR, which needs the feature `exr` and a device that filters 32-bit floats.
    AsNamed,
}

/// Gives meshes of baked glTF files their [`Lightmap`], what moves an [`IrradianceVolume`], and lights whose light is in the maps no diffuse part
/// on lightmapped meshes. To be added after Bevy's `DefaultPlugins`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LumbrePlugin {
    /// Which of a bake's images are loaded.
    pub images: LightmapImages,
    /// Samples lightmaps bicubically: smoother, slower. The bake must have left room for it: `lumbre bake --gap 4`.
    pub bicubic_sampling: bool,
}

impl Plugin for LumbrePlugin {
    fn build(&self, app: &mut App) {
        // A scene is copied into the World by what is registered; without Bevy's feature `reflect_auto_register` nobody else does it.
        app.register_type::<Lightmap>().register_type::<IrradianceVolume>().register_type::<LightProbe>();
        let handler = Box::new(Handler { plugin: *self, lights: Vec::new(), mapped: Vec::new() });
        let Some(handlers) = app.world().get_resource::<GltfExtensionHandlers>() else {
            error!(
                "LumbrePlugin found no glTF loader: add it after DefaultPlugins (with Bevy's feature bevy_gltf)"
            );
            return;
        };
        // On the web nothing else runs that could hold the lock.
        match handlers.0.try_write() {
            Some(mut list) => list.push(handler),
            None => error!(
                "LumbrePlugin: a glTF file is being loaded already; add the plugin before the app runs"
            ),
        }
    }

    fn finish(&self, app: &mut App) {
        // Ambient light stands for the bounces, which lightmaps have.
        if let Some(mut ambient) = app.world_mut().get_resource_mut::<GlobalAmbientLight>() {
            ambient.affects_lightmapped_meshes = false;
        }
    }
}

/// A camera's exposure from a factor on radiance, as `lumbre render --exposure` and `LUMBRE_camera.exposure` state it.
pub fn exposure(factor: f32) -> Exposure {
    Exposure { ev100: -(1.2 * factor).log2() }
}

/// What is known of one file while it is loaded.
#[derive(Clone)]
struct Handler {
    plugin: LumbrePlugin,
    /// By the index of each light of the file.
    lights: Vec<PhongLight>,
    /// Nodes whose meshes have a lightmap.
    mapped: Vec<(Entity, Handle<Image>)>,
}

/// What `LUMBRE_lights_phong` says of a light that Bevy does not read by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PhongLight {
    /// Its diffuse light is in the lightmaps.
    is_baked: bool,
    is_enabled: bool,
}

impl PhongLight {
    /// From the `extensions` of a light.
    fn read(extensions: Option<&str>) -> Self {
        let extensions: Option<Value> = extensions.and_then(|text| serde_json::from_str(text).ok());
        let said = |key: &str| extensions.as_ref()?.get(LIGHT)?.get(key).cloned();
        Self {
            is_baked: said("bake").is_some_and(|mode| mode == "static"),
            is_enabled: said("enabled") != Some(Value::Bool(false)),
        }
    }
}

impl Handler {
    /// What the file says of the light of a node; switches it off if that is said.
    fn light(&self, node: &gltf::Node<'_>, entity: &mut EntityWorldMut<'_>) -> PhongLight {
        let said = node.light().and_then(|light| self.lights.get(light.index()).copied());
        let said = said.unwrap_or_else(|| PhongLight::read(None));
        if !said.is_enabled {
            entity.insert(Visibility::Hidden);
        }
        said
    }

    /// The image beside the file that an extension names.
    fn image(&self, context: &mut LoadContext<'_>, extension: &Value, place: &str) -> Option<Handle<Image>> {
        let uri = extension.get("image").and_then(|image| image.as_str());
        let Some(uri) = uri.and_then(|uri| percent_decode_str(uri).decode_utf8().ok()) else {
            warn!("{}: {place} names no image; bake the file again", context.path());
            return None;
        };
        let name = match (self.plugin.images, uri.strip_suffix(".exr")) {
            (LightmapImages::Ktx2, Some(stem)) => format!("{stem}.ktx2"),
            _ => uri.into_owned(),
        };
        let path = match context.path().resolve_embed_str(&name) {
            Ok(path) => path,
            Err(error) => {
                warn!("{}: {place} names {name}: {error}", context.path());
                return None;
            }
        };
        let linear = |settings: &mut ImageLoaderSettings| {
            settings.is_srgb = false;
            settings.sampler = ImageSampler::linear();
        };
        Some(context.load_builder().with_settings(linear).load(path))
    }
}

impl GltfExtensionHandler for Handler {
    fn dyn_clone(&self) -> Box<dyn ErasedGltfExtensionHandler> {
        Box::new(self.clone())
    }

    fn on_root(&mut self, _: &mut LoadContext<'_>, file: &gltf::Gltf, _: &GltfLoaderSettings) {
        let lights = file.as_json().extensions.as_ref().and_then(|all| all.khr_lights_punctual.as_ref());
        let lights = lights.map_or(&[][..], |lights| &lights.lights);
        self.lights = lights
            .iter()
            .map(|light| PhongLight::read(light.extensions.as_ref().map(|raw| raw.get())))
            .collect();
    }

    fn on_gltf_node(
        &mut self,
        context: &mut LoadContext<'_>,
        node: &gltf::Node<'_>,
        entity: &mut EntityWorldMut<'_>,
    ) {
        let place = || format!("node {} ({})", node.index(), node.name().unwrap_or_default());
        if let Some(extension) = node.extension_value(LIGHTMAP) {
            if extension.get("texCoord").is_some_and(|set| set != 1) {
                warn!("{}: the lightmap of {} lies on a set other than TEXCOORD_1", context.path(), place());
            } else if let Some(image) = self.image(context, extension, &place()) {
                self.mapped.push((entity.id(), image));
            }
        }
        if let Some(extension) = node.extension_value(VOLUME)
            && let Some(voxels) = self.image(context, extension, &place())
        {
            let volume = IrradianceVolume { voxels, intensity: 1.0, affects_lightmapped_meshes: false };
            entity.insert((LightProbe::default(), volume));
        }
    }

    fn on_scene_completed(
        &mut self,
        _: &mut LoadContext<'_>,
        _: &gltf::Scene<'_>,
        _: Entity,
        world: &mut World,
    ) {
        for (node, image) in std::mem::take(&mut self.mapped) {
            // A primitive is a child with a mesh; nodes below have none themselves.
            let below = world.get::<Children>(node).into_iter().flat_map(|all| all.iter());
            let meshes: Vec<Entity> = below.filter(|child| world.get::<Mesh3d>(*child).is_some()).collect();
            for child in meshes {
                let lightmap = Lightmap {
                    image: image.clone(),
                    uv_rect: Rect::new(0.0, 0.0, 1.0, 1.0),
                    bicubic_sampling: self.plugin.bicubic_sampling,
                };
                world.entity_mut(child).insert(lightmap);
            }
        }
    }

    fn on_spawn_light_directional(
        &mut self,
        _: &mut LoadContext<'_>,
        node: &gltf::Node<'_>,
        entity: &mut EntityWorldMut<'_>,
    ) {
        let said = self.light(node, entity);
        if let Some(mut light) = entity.get_mut::<DirectionalLight>() {
            light.affects_lightmapped_mesh_diffuse &= !said.is_baked;
        }
    }

    fn on_spawn_light_point(
        &mut self,
        _: &mut LoadContext<'_>,
        node: &gltf::Node<'_>,
        entity: &mut EntityWorldMut<'_>,
    ) {
        let said = self.light(node, entity);
        if let Some(mut light) = entity.get_mut::<PointLight>() {
            light.affects_lightmapped_mesh_diffuse &= !said.is_baked;
        }
    }

    fn on_spawn_light_spot(
        &mut self,
        _: &mut LoadContext<'_>,
        node: &gltf::Node<'_>,
        entity: &mut EntityWorldMut<'_>,
    ) {
        let said = self.light(node, entity);
        if let Some(mut light) = entity.get_mut::<SpotLight>() {
            light.affects_lightmapped_mesh_diffuse &= !said.is_baked;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_lights_is_read() {
        let light = |text| PhongLight::read(text);
        let plain = PhongLight { is_baked: false, is_enabled: true };
        assert_eq!(light(None), plain);
        assert_eq!(light(Some("{}")), plain);
        assert_eq!(light(Some(r#"{"LUMBRE_lights_phong": {"bake": "mixed", "enabled": true}}"#)), plain);
        let baked = r#"{"LUMBRE_lights_phong": {"bake": "static"}}"#;
        assert_eq!(light(Some(baked)), PhongLight { is_baked: true, ..plain });
        let off = r#"{"LUMBRE_lights_phong": {"enabled": false}}"#;
        assert_eq!(light(Some(off)), PhongLight { is_enabled: false, ..plain });
    }

    #[test]
    fn an_exposure_is_the_factor_that_was_asked_for() {
        for factor in [1.0, 0.001, 20.0] {
            assert!((exposure(factor).exposure() / factor - 1.0).abs() < 1e-5);
        }
    }
}
