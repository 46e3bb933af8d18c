//! Effects are the parts of a frame that a scene may or may not call for: those of this crate and those of a
//! program. Each effect decides from the World whether it is called for, keeps its own resources on the GPU
//! and declares its own passes. The renderer treats all of them alike.
//!
//! ```text
//!   extract ──► called for? ──► prepare ──► declare
//!   World       with a reason   pipelines,   passes between the handles
//!                               buffers      of the Board
//! ```
//!
//! What a material or a light needs within a lit shader is not an effect in this sense, but a feature of a
//! shader variant (`shader::variant`).

mod background;
mod board;
mod deferred_composite;
mod display;
mod forward;
mod g_buffer;
mod lightmap;
mod mirrors;
mod refraction;
mod shadows;
mod surface_uniforms;
mod transparent;

use bevy_ecs::world::World;
use lumbre_graph::{Graph, Imports};

pub use board::Board;
pub use display::display_color;

use crate::error::EffectError;
use crate::facts::SceneFacts;
use crate::frame_plan::FrameShape;
use crate::frame_scene::FrameScene;
use crate::{FrameOptions, Gpu, RenderingPath};

/// The graph of a frame. Its passes access the frame's scene as `context.user`.
pub type FrameGraph<'a> = Graph<'a, FrameScene<'a>>;

/// The stage of a frame at which an effect declares its passes. Effects of the same stage keep the order in
/// which the renderer was given them, after the built-in ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// What surfaces are lit with: shadow maps. Nothing has been drawn yet.
    Light,
    /// What lies behind all surfaces.
    Background,
    /// Opaque surfaces. After this stage, [`Board::depth`] holds the depth of the nearest of them.
    Opaque,
    /// What is blended over them.
    Transparent,
    /// Between lighting and display: [`Board::linear`] holds the lit frame as radiance, one sample per pixel.
    /// A frame with an effect of this stage, or with [another one that asks for it](Effect::needs_radiance),
    /// keeps its radiance until the display; otherwise the lit shaders may write the target's values
    /// directly.
    Radiance,
    /// Converts radiance to the target's values.
    Display,
    /// Draws over the finished picture, which [`Board::target`] holds.
    Picture,
}

/// What an effect has done outside of its passes since it was created. These numbers only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EffectWork {
    /// Bytes that it uploaded itself.
    pub uploaded_bytes: u64,
    /// Number of pipelines that it created.
    pub pipelines_made: usize,
    /// Bytes that the renderer uploaded for this effect alone.
    pub(crate) of_renderer: u64,
}

impl EffectWork {
    /// Describes an effect that has uploaded this many bytes and created this many pipelines.
    pub fn new(uploaded_bytes: u64, pipelines_made: usize) -> Self {
        Self { uploaded_bytes, pipelines_made, of_renderer: 0 }
    }
}

/// A part of the frame that a scene may or may not call for. [`Renderer::builder`](crate::Renderer::builder)
/// takes a program's effects.
///
/// The methods are called once per frame in this order: `extract`; `ready` (unless frames wait for pipelines)
/// and `prepare`, if the effect is called for; `declare`. An explanation without a device does not call
/// `prepare` and runs no pass. If pipelines are still being created, `extract` and `ready` are called once
/// more with the facts and options that an earlier frame was decided by. If nothing has changed (`is_unchanged`),
/// neither is called.
pub trait Effect: Send + Sync {
    /// Returns its name in plain words, for plans and errors.
    fn name(&self) -> &'static str;

    /// Returns the stage of its passes.
    fn stage(&self) -> Stage;

    /// Takes what it needs this frame from the World. Returns true if the scene calls for the effect.
    /// [`PassBuilder::requires`](lumbre_graph::PassBuilder::requires) of its passes gives the reason.
    fn extract(&mut self, world: &mut World, facts: &SceneFacts, options: &FrameOptions) -> bool;

    /// Returns true if `extract` would return the same as last time, for the same options and a World in
    /// which no camera, light, mesh, material, texture, transform or setting has changed. An effect that
    /// depends on nothing else returns true; one with components of its own checks whether these have
    /// changed.
    fn is_unchanged(&mut self, world: &mut World) -> bool {
        let _ = world;
        false
    }

    /// Returns true if its pipelines exist, in frames that do not wait for them
    /// ([`MissingPipelines::Background`](crate::MissingPipelines)). An effect that keeps its pipelines as
    /// [`Pending`](crate::Pending) starts to create them here. Until it returns true, frames are drawn
    /// without it, or as they were drawn with it before.
    ///
    /// # Errors
    /// Any error that keeps the effect from being drawn.
    fn ready(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        let _ = (gpu, frame);
        Ok(true)
    }

    /// Creates what it needs on the GPU: pipelines, textures that outlive the frame, uniforms. Called only
    /// for effects that are called for.
    ///
    /// # Errors
    /// Any error that keeps the effect from being drawn. The frame is not drawn then.
    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        let _ = (gpu, frame);
        Ok(())
    }

    /// Binds the textures and buffers that it imports into the graph and that outlive the frame, under the
    /// names that `declare` imports.
    fn imports(&self, imports: Imports) -> Imports {
        imports
    }

    /// Returns true if its passes draw the shapes of objects, through [`FrameScene::objects`].
    fn draws_objects(&self) -> bool {
        false
    }

    /// Returns true if a frame in which it is called for must keep its radiance until the display.
    fn needs_radiance(&self) -> bool {
        self.stage() == Stage::Radiance
    }

    /// Returns what it has uploaded and created since it was built, outside of its passes, for the accounts
    /// of frames ([`Accounting`](crate::Accounting)).
    fn work(&self) -> EffectWork {
        EffectWork::default()
    }

    /// Declares its passes, also when they are not called for, so that the plan can say why.
    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board);
}

/// A built-in effect that a renderer can be built without
/// ([`RendererBuilder::without`](crate::RendererBuilder::without)). The background is not among them, because
/// it clears the colours and depths that every other pass draws over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BuiltIn {
    /// Shadow maps. Without them lights cast no shadows.
    ShadowMaps,
    /// The G-buffer. Without it all surfaces are lit forward.
    GBuffer,
    /// Surfaces with a lightmap. Without it they are lit like any others.
    Lightmap,
    /// Opaque surfaces. Without it they are not drawn.
    Forward,
    /// The views in flat mirrors. Without it mirrors reflect nothing.
    Mirrors,
    /// Refraction. Without it transmissive surfaces are opaque.
    Refraction,
    /// Blended surfaces. Without it they are not drawn.
    Transparent,
    /// The display pass. Without it, or another effect at [`Stage::Display`], a frame that needs one is
    /// refused ([`RenderError::NoDisplay`](crate::RenderError::NoDisplay)).
    Display,
}

impl BuiltIn {
    /// All built-in effects that can be left out.
    pub const ALL: [Self; 8] = [
        Self::ShadowMaps,
        Self::GBuffer,
        Self::Lightmap,
        Self::Forward,
        Self::Mirrors,
        Self::Refraction,
        Self::Transparent,
        Self::Display,
    ];

    /// Returns its name in plans and accounts.
    pub fn name(self) -> &'static str {
        match self {
            Self::ShadowMaps => "shadow maps",
            Self::GBuffer => "g-buffer",
            Self::Lightmap => "lightmap",
            Self::Forward => "forward",
            Self::Mirrors => "mirrors",
            Self::Refraction => "refraction",
            Self::Transparent => "transparent",
            Self::Display => "display",
        }
    }

    /// Switches off the options that a frame cannot have without it.
    pub(crate) fn switch_off(self, options: &mut FrameOptions) {
        match self {
            Self::ShadowMaps => options.shadows = false,
            Self::GBuffer => options.rendering_path = RenderingPath::Forward,
            Self::Lightmap => options.lightmaps = false,
            Self::Mirrors => options.mirror_depth = 0,
            Self::Refraction => options.refraction = false,
            // The surfaces in the G-buffer would not be lit by any pass.
            Self::Forward => options.rendering_path = RenderingPath::Forward,
            Self::Transparent | Self::Display => {}
        }
    }
}

/// Returns the built-in effects except `without`, in the order of their stages.
pub(crate) fn own(without: &[BuiltIn]) -> Vec<Box<dyn Effect>> {
    let all: [Box<dyn Effect>; 9] = [
        Box::new(shadows::Shadows::default()),
        Box::new(background::Background::default()),
        Box::new(g_buffer::GBufferPass::default()),
        Box::new(lightmap::Lightmap::default()),
        Box::new(forward::Forward::default()),
        Box::new(mirrors::Mirrors::default()),
        Box::new(refraction::Refraction::default()),
        Box::new(transparent::Transparent::default()),
        Box::new(display::DisplayPass::default()),
    ];
    all.into_iter().filter(|effect| without.iter().all(|left_out| left_out.name() != effect.name())).collect()
}

/// Sorts effects by their stages.
pub(crate) fn in_order(effects: &mut [Box<dyn Effect>]) {
    // The sort is stable, so effects of one stage keep their order.
    effects.sort_by_key(|effect| effect.stage());
}
