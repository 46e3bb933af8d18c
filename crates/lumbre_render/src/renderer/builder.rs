//! Builds a renderer with a program's own effects, or without some of the built-in ones.

use super::Renderer;
use crate::Gpu;
use crate::effects::{self, BuiltIn, Effect};

/// Builds a renderer with effects of a program, or without some of the built-in ones.
#[derive(Default)]
pub struct RendererBuilder {
    effects: Vec<Box<dyn Effect>>,
    without: Vec<BuiltIn>,
}

impl RendererBuilder {
    /// Adds an effect. Effects of the same [`Stage`](crate::effects::Stage) keep the order of these calls, after the built-in ones.
    #[must_use]
    pub fn with(mut self, effect: impl Effect + 'static) -> Self {
        self.effects.push(Box::new(effect));
        self
    }

    /// Leaves out a built-in effect.
    #[must_use]
    pub fn without(mut self, effect: BuiltIn) -> Self {
        self.without.push(effect);
        self
    }

    /// Creates the renderer on a device.
    #[must_use]
    pub fn build(self, gpu: &Gpu) -> Renderer {
        let mut renderer = Renderer::new(gpu);
        renderer.effects = effects::own(&self.without);
        renderer.effects.extend(self.effects);
        renderer.without = self.without;
        effects::in_order(&mut renderer.effects);
        renderer
    }
}
