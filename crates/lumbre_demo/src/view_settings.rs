//! How the player wants the level drawn. Not the drawing: that is the renderer's.

use bevy_ecs::world::World;
use lumbre_optics::{ReflectionModel, Shading};
use lumbre_scene::SceneSettings;

use crate::input::Action;

/// Choices that the keys change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewSettings {
    /// Of every object; what the level itself asks for if there is none.
    pub shading: Option<Shading>,
    /// The specular model; the level's own if there is none.
    pub reflection: Option<ReflectionModel>,
    /// Whether baked light is shown.
    pub lightmaps: bool,
    /// Whether lights cast the shadows that they ask for.
    pub shadows: bool,
    /// Four samples per pixel.
    pub multisample: bool,
    /// Whether the overlay is shown.
    pub overlay: bool,
    /// Whether the overlay says how many lights are tested and contribute.
    pub count_lights: bool,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            shading: None,
            reflection: None,
            lightmaps: true,
            shadows: true,
            multisample: true,
            overlay: true,
            count_lights: false,
        }
    }
}

impl ViewSettings {
    /// As a level asks for it, where it does.
    pub fn of(world: &World) -> Self {
        let asked = world.get_resource::<SceneSettings>().and_then(|settings| settings.frame.multisample);
        let usual = Self::default();
        Self { multisample: asked.unwrap_or(usual.multisample), ..usual }
    }

    /// Carries out an action; false if it is none of the view's.
    pub fn apply(&mut self, action: Action) -> bool {
        match action {
            Action::ShadeFlat => self.shading = Some(Shading::Flat),
            Action::ShadeGouraud => self.shading = Some(Shading::Gouraud),
            Action::ShadePhong => self.shading = Some(Shading::Phong),
            Action::CycleShading => self.shading = next(self.shading, Shading::ALL),
            Action::CycleReflection => self.reflection = next(self.reflection, ReflectionModel::ALL),
            Action::ToggleLightmaps => self.lightmaps = !self.lightmaps,
            Action::ToggleMultisample => self.multisample = !self.multisample,
            Action::ToggleOverlay => self.overlay = !self.overlay,
            Action::ToggleLightCounts => self.count_lights = !self.count_lights,
            Action::ToggleReference
            | Action::MeasureSettings
            | Action::CheaperSettings
            | Action::BetterSettings
            | Action::ToggleTorch
            | Action::ToggleFlight
            | Action::OrbitEverything
            | Action::NextCamera
            | Action::ToggleAutoExposure
            | Action::ToggleBake
            | Action::SaveBake
            | Action::Quit => return false,
        }
        true
    }
}

/// The choice after this one; the level's own comes before the first and after the last.
fn next<T: Copy + PartialEq>(choice: Option<T>, all: &[T]) -> Option<T> {
    match choice {
        None => all.first().copied(),
        Some(choice) => all.iter().position(|&one| one == choice).and_then(|at| all.get(at + 1)).copied(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycling_comes_back_to_the_level() {
        let mut view = ViewSettings::default();
        let mut seen = Vec::new();
        for _ in 0..4 {
            assert!(view.apply(Action::CycleShading));
            seen.push(view.shading);
        }
        assert_eq!(seen, [Some(Shading::Flat), Some(Shading::Gouraud), Some(Shading::Phong), None]);
        for _ in 0..ReflectionModel::ALL.len() + 1 {
            view.apply(Action::CycleReflection);
        }
        assert_eq!(view.reflection, None);
    }

    #[test]
    fn toggles_toggle_and_others_are_left_alone() {
        let mut view = ViewSettings::default();
        view.apply(Action::ToggleLightmaps);
        view.apply(Action::ToggleMultisample);
        view.apply(Action::ToggleOverlay);
        view.apply(Action::ToggleLightCounts);
        assert!(!view.lightmaps && !view.multisample && !view.overlay && view.count_lights);
        assert!(!view.apply(Action::ToggleTorch));
    }
}
