//! The player's choices of how the level is drawn. The renderer reads them through its frame options.

use bevy_ecs::world::World;
use lumbre_optics::{ReflectionModel, Shading};
use lumbre_scene::SceneSettings;

use crate::input::Action;

/// The choices that keys change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewSettings {
    /// Shading of every object; `None` is what the level itself asks for.
    pub shading: Option<Shading>,
    /// The reflection model of every object; `None` is the level's own.
    pub reflection: Option<ReflectionModel>,
    /// Whether lightmaps and irradiance volumes are shown.
    pub lightmaps: bool,
    /// Whether lights that ask for shadows cast them.
    pub shadows: bool,
    /// Whether four samples per pixel are taken.
    pub multisample: bool,
    /// Whether the overlay is shown.
    pub overlay: bool,
    /// Whether the overlay counts the lights that are tested and that contribute.
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
    /// Returns the defaults, with the choices that the level itself makes.
    pub fn of(world: &World) -> Self {
        let asked = world.get_resource::<SceneSettings>().and_then(|settings| settings.frame.multisample);
        let usual = Self::default();
        Self { multisample: asked.unwrap_or(usual.multisample), ..usual }
    }

    /// Carries out an action; returns false if it does not concern these settings.
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

/// Returns the choice after this one. The level's own (`None`) comes after the last and before the first.
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
