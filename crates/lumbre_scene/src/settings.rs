//! What holds for a whole scene: the `LUMBRE_scene` extension as a resource.

use bevy_ecs::resource::Resource;
use glam::Vec3;
use lumbre_optics::{FlatRule, Fog, ReflectionModel, Shading};

use crate::FrameSettings;

/// Scene-wide choices.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct SceneSettings {
    /// Global ambient light I_a, linear RGB.
    pub ambient: Vec3,
    /// Background, linear RGB. Where it is black the sky is.
    pub background: Vec3,
    /// Radiance of the sky, W/(m² sr), linear RGB, the same in every direction: what rays of the bake see that meet nothing, the background
    /// of a frame, and ambient light for all that has no lightmap.
    pub sky: Vec3,
    /// The viewer is at the eye (true) or infinitely far along +Z of the camera (false).
    pub local_viewer: bool,
    /// Double-sided surfaces seen from behind are lit with the reversed normal and the back material (glTF's rule, and
    /// what a file gets that does not say). Without it they are lit as if seen from the front (OpenGL without
    /// `LIGHT_MODEL_TWO_SIDE`).
    pub two_sided: bool,
    /// The specular model.
    pub reflection: ReflectionModel,
    /// The shading of objects that do not choose their own.
    pub shading: Shading,
    /// Where flat shading evaluates a polygon.
    pub flat_rule: FlatRule,
    /// Phong shading widens highlights by what the normals change within a pixel, so that small and curved surfaces do not
    /// sparkle (see `lumbre_optics::filtered_lobe`). Off: the bare equation.
    pub specular_antialiasing: bool,
    /// Fog, if any.
    pub fog: Option<Fog>,
    /// What frames of it are to spend.
    pub frame: FrameSettings,
}

impl SceneSettings {
    /// Radiance of what a frame shows where no surface is: the background, or the sky where that is black.
    pub fn shown_background(&self) -> Vec3 {
        if self.background == Vec3::ZERO { self.sky } else { self.background }
    }

    /// Ambient light of what has no lightmap: I_a, and the sky's radiance L. A sky of one radiance gives every point the irradiance π L from
    /// all around, of which k_d π L/π = k_d L is reflected; that things stand in each other's way only a bake knows.
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
