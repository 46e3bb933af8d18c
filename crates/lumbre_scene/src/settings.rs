//! Settings of a whole scene: the `LUMBRE_scene` extension as a resource.

use bevy_ecs::resource::Resource;
use glam::Vec3;
use lumbre_optics::{FlatRule, Fog, ReflectionModel, Shading};

use crate::FrameSettings;

/// Scene-wide settings.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct SceneSettings {
    /// Global ambient light I_a, linear RGB.
    pub ambient: Vec3,
    /// Background, linear RGB. Where it is black, the sky is shown instead.
    pub background: Vec3,
    /// Radiance of the sky, W/(m² sr), linear RGB, the same in every direction: seen by rays of the bake that
    /// hit nothing, shown as the background of a frame, and used as ambient light for everything without a
    /// lightmap.
    pub sky: Vec3,
    /// Local viewer: the eye is at the camera (true) or infinitely far along the camera's +Z (false).
    pub local_viewer: bool,
    /// Double-sided surfaces seen from behind are lit with the reversed normal and the back material (glTF's
    /// rule, and the default for files that do not set it). If false, they are lit as if seen from the front
    /// (OpenGL without `LIGHT_MODEL_TWO_SIDE`).
    pub two_sided: bool,
    /// The specular model.
    pub reflection: ReflectionModel,
    /// The shading of objects that do not set their own.
    pub shading: Shading,
    /// The point at which flat shading evaluates the lighting of a polygon.
    pub flat_rule: FlatRule,
    /// Phong shading widens highlights by the variation of the normal within a pixel, so that small and
    /// curved surfaces do not sparkle (see `lumbre_optics::filtered_lobe`). If false, the unfiltered equation
    /// is used.
    pub specular_antialiasing: bool,
    /// Fog, if any.
    pub fog: Option<Fog>,
    /// Quality settings for frames of the scene.
    pub frame: FrameSettings,
}

impl SceneSettings {
    /// Radiance that a frame shows where there is no surface: the background, or the sky if the background is
    /// black.
    pub fn shown_background(&self) -> Vec3 {
        if self.background == Vec3::ZERO { self.sky } else { self.background }
    }

    /// Ambient light of objects without a lightmap: I_a plus the sky's radiance L. A sky of constant radiance
    /// L gives an unoccluded point the irradiance π L, of which k_d π L/π = k_d L is reflected. Occlusion by
    /// other objects is ignored here; only a bake accounts for it.
    pub fn ambient_with_sky(&self) -> Vec3 {
        self.ambient + self.sky
    }
}

impl Default for SceneSettings {
    fn default() -> Self {
        Self {
            ambient: Vec3::ZERO,
            background: Vec3::ZERO,
            sky: Vec3::ZERO,
            local_viewer: true,
            two_sided: true,
            reflection: ReflectionModel::Phong,
            shading: Shading::Phong,
            flat_rule: FlatRule::Centroid,
            specular_antialiasing: false,
            fog: None,
            frame: FrameSettings::default(),
        }
    }
}
