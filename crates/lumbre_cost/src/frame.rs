//! A scene with the options for drawing a frame of it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bevy_ecs::world::World;
use lumbre_render::{Display, FrameOptions, Measure};
use lumbre_scene::SceneSettings;

/// A scene with the options for drawing a frame of it.
pub struct Frame {
    /// The scene, which several frames may share.
    world: Arc<Mutex<World>>,
    /// The options of the renderer.
    pub options: FrameOptions,
    /// The name of the renderer. Frames with the same name share a renderer and its compiled shaders, which
    /// take longer to compile than many frames take to draw. Each such frame is drawn twice in a row and the
    /// second drawing is timed, since in the first one the renderer reads another World. A frame without a
    /// name has a renderer of its own.
    pub renderer: Option<&'static str>,
    /// Whether every lamp that casts shadows moves slightly, alternately to and fro, before each timed frame,
    /// so that no shadow map can be reused.
    pub moving_lamps: bool,
    /// Whether the frame is timed.
    pub is_timed: bool,
    /// Whether it is drawn for its picture and its counts.
    pub is_pictured: bool,
    /// Settings that the scene gets before each drawing, so that frames with different settings can share it.
    settings: Option<SceneSettings>,
}

impl Frame {
    /// Creates a frame with a renderer of its own.
    pub fn new(world: World, options: FrameOptions) -> Self {
        Self::of(&Arc::new(Mutex::new(world)), options)
    }

    /// Creates a frame of a scene that other frames show too.
    pub fn of(world: &Arc<Mutex<World>>, options: FrameOptions) -> Self {
        Self {
            world: Arc::clone(world),
            options,
            renderer: None,
            moving_lamps: false,
            is_timed: true,
            is_pictured: true,
            settings: None,
        }
    }

    /// Locks the scene, which then has the frame's settings.
    pub fn world(&self) -> MutexGuard<'_, World> {
        // A thread that panicked was only drawing; the World is intact.
        let mut world = self.world.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(settings) = self.settings
            && world.get_resource::<SceneSettings>() != Some(&settings)
        {
            world.insert_resource(settings);
        }
        world
    }

    /// Returns the frame with a renderer shared by all frames with this name.
    pub fn sharing(self, renderer: &'static str) -> Self {
        Self { renderer: Some(renderer), ..self }
    }

    /// Returns the frame, timed or not.
    pub fn timed(self, is_timed: bool) -> Self {
        Self { is_timed, ..self }
    }

    /// Returns the frame, drawn for its picture or not.
    pub fn pictured(self, is_pictured: bool) -> Self {
        Self { is_pictured, ..self }
    }

    /// Returns the frame with these settings of its scene.
    pub fn with_settings(self, settings: SceneSettings) -> Self {
        Self { settings: Some(settings), ..self }
    }

    /// Returns the frame with moving lamps.
    pub fn with_moving_lamps(self) -> Self {
        Self { moving_lamps: true, ..self }
    }
}

/// Returns the options with which the picture of a frame is drawn: 32-bit floats, without exposure.
pub fn picture_options(options: &FrameOptions) -> FrameOptions {
    FrameOptions {
        display: Display::Linear,
        exposure: Some(1.0),
        full_precision: true,
        measure: Measure::Nothing,
        ..options.clone()
    }
}

/// Returns the options with which the light evaluations of a frame are counted, by shader variants that draw
/// its picture.
pub fn counting_options(options: &FrameOptions) -> FrameOptions {
    FrameOptions { measure: Measure::Lights, ..picture_options(options) }
}
