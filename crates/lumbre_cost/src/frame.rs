//! A scene, and how a frame of it is drawn, for its picture and for its time. Not the drawing.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bevy_ecs::world::World;
use lumbre_render::{Display, FrameOptions, Measure};

/// A scene, and how a frame of it is drawn.
pub struct Frame {
    /// The scene, perhaps of several frames.
    world: Arc<Mutex<World>>,
    /// How it is drawn.
    pub options: FrameOptions,
    /// Frames of one name share a renderer, and with it what it has compiled, which takes longer than many a frame. Each is then drawn twice in a row, and the
    /// second one timed: in the first the renderer reads another World. Without a name a frame has a renderer of its own.
    pub renderer: Option<&'static str>,
    /// Before each frame that is timed every lamp that casts shadows moves by a hair and back again: no shadow map is as it was.
    pub moving_lamps: bool,
    /// The lights that it evaluates are counted, by shader variants that are compiled for nothing else.
    pub counts_lights: bool,
}

impl Frame {
    /// A frame with a renderer of its own.
    pub fn new(world: World, options: FrameOptions) -> Self {
        Self::of(&Arc::new(Mutex::new(world)), options)
    }

    /// The same of a scene that other frames show, too.
    pub fn of(world: &Arc<Mutex<World>>, options: FrameOptions) -> Self {
        Self { world: Arc::clone(world), options, renderer: None, moving_lamps: false, counts_lights: false }
    }

    /// Its scene, for whoever draws it next.
    pub fn world(&self) -> MutexGuard<'_, World> {
        // Whoever panicked was drawing: the World is as whole as before.
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The same with a renderer in common with all that name it so.
    pub fn sharing(self, renderer: &'static str) -> Self {
        Self { renderer: Some(renderer), ..self }
    }

    /// The same with its light evaluations counted, or not.
    pub fn counting_lights(self, counts_lights: bool) -> Self {
        Self { counts_lights, ..self }
    }

    /// The same with lamps that move.
    pub fn with_moving_lamps(self) -> Self {
        Self { moving_lamps: true, ..self }
    }
}

/// How the picture of a frame is drawn: in 32-bit floats and without exposure.
pub fn picture_options(options: &FrameOptions) -> FrameOptions {
    FrameOptions {
        display: Display::Linear,
        exposure: Some(1.0),
        full_precision: true,
        measure: Measure::Nothing,
        ..options.clone()
    }
}
