//! Effects: the parts of a frame that a scene may or may not call for, those of this crate and those of a program that uses it. Each decides from the
//! World whether it is called for, keeps its own things on the GPU, and declares its own passes; the renderer knows none of them by name.
//!
//! ```text
//!   extract ──► called for? ──► prepare ──► declare
//!   World       with a reason   pipelines,   passes between the handles
//!                               buffers      of the Board
//! ```
//!
//! What a material or a light calls for within a shader is no effect of this kind: that is a feature of a shader's variant (`shader::variant`).

mod background;
mod board;
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

/// The graph of a frame. Its passes are lent the frame's scene as `context.user`.
pub type FrameGraph<'a> = Graph<'a, FrameScene<'a>>;

/// Where among the stages of a frame an effect declares its passes. Effects of one stage stand in the order in which the renderer was given them,
/// after its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// What surfaces are lit with: shadow maps. Nothing is drawn yet.
    Light,
    /// What lies behind everything.
    Background,
    /// Opaque surfaces. Afterwards [`Board::depth`] holds the nearest of them.
    Opaque,
    /// What is blended over them.
    Transparent,
    /// Between light and display: [`Board::linear`] holds the lit frame, as radiance, one sample per pixel. A frame in which such an effect is
    /// called for keeps its radiance until the display, as [others](Effect::needs_radiance) ask it to; any other is encoded where its colours are made.
    Radiance,
    /// From radiance to the numbers of the target.
    Display,
    /// Over the finished picture: [`Board::target`] holds it.
    Picture,
}

/// What an effect has done since it was built, beside its passes: numbers that only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EffectWork {
    /// Bytes that it uploaded itself.
    pub uploaded_bytes: u64,
    /// Pipelines that it made.
    pub pipelines_made: usize,
    /// Bytes of the renderer's own uploads that are there for it alone.
    pub(crate) of_renderer: u64,
}

impl EffectWork {
    /// Of an effect that has uploaded this many bytes and made this many pipelines.
    pub fn new(uploaded_bytes: u64, pipelines_made: usize) -> Self {
        Self { uploaded_bytes, pipelines_made, of_renderer: 0 }
    }
}

/// A part of the frame that a scene may or may not call for. [`Renderer::builder`](crate::Renderer::builder) takes those of a program.
///
/// Once a frame, in this order: `extract`; `ready` and `prepare`, if it is called for; `declare`. An explanation without a device leaves out `prepare` and runs no
/// pass. A frame that goes on as the one before, since pipelines are on their way, asks `extract` and `ready` once more, with what that one was drawn from; a frame in
/// which nothing has changed (`is_still`) asks neither.
pub trait Effect: Send + Sync {
    /// Its name, in plain words, for plans and errors.
    fn name(&self) -> &'static str;

    /// Where its passes stand.
    fn stage(&self) -> Stage;

    /// Takes from the World what it needs this frame; whether the scene calls for it. [`PassBuilder::calls_for`](lumbre_graph::PassBuilder::calls_for)
    /// of its passes gives the reason.
    fn extract(&mut self, world: &mut World, facts: &SceneFacts, options: &FrameOptions) -> bool;

    /// Whether `extract` would take from the World what it took last: that of a World in which no camera, light, mesh, material, texture, transform or setting has
    /// changed, with the same options. An effect that looks at nothing else answers true; one with components of its own looks whether they changed.
    fn is_still(&mut self, world: &mut World) -> bool {
        let _ = world;
        false
    }

    /// Whether its pipelines are there for such a frame, where frames do not wait for them ([`MissingPipelines::Background`](crate::MissingPipelines)): an effect
    /// that keeps them as [`Deferred`](crate::Deferred) begins to make them here. Until it answers true frames go on without it, or as they were with it.
    ///
    /// # Errors
    /// Whatever keeps the effect from being drawn.
    fn ready(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        let _ = (gpu, frame);
        Ok(true)
    }

    /// Makes what it needs on the GPU: pipelines, textures that outlive the frame, uniforms. Nothing that it is not called for.
    ///
    /// # Errors
    /// Whatever keeps the effect from being drawn: the frame is not drawn then.
    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        let _ = (gpu, frame);
        Ok(())
    }

    /// Binds what it imports into the graph: textures and buffers that outlive the frame, under the names that `declare` imports.
    fn imports(&self, imports: Imports) -> Imports {
        imports
    }

    /// Whether its passes draw the shapes of objects, through [`FrameScene::objects`].
    fn draws_objects(&self) -> bool {
        false
    }

    /// Whether a frame in which it is called for keeps its radiance until the display.
    fn needs_radiance(&self) -> bool {
        self.stage() == Stage::Radiance
    }

    /// What it has brought to the GPU and made there since it was built, for the accounts of frames ([`Accounting`](crate::Accounting)): whatever no pass shows.
    fn work(&self) -> EffectWork {
        EffectWork::default()
    }

    /// Declares its passes, those that are not called for too, so that the plan can say why.
    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board);
}

/// An effect of the renderer's own that it can be built without ([`RendererBuilder::without`](crate::RendererBuilder::without)). The background is none of them: it clears the
/// colours and depths that every other pass draws over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BuiltIn {
    /// Shadow maps: without them lights cast no shadows.
    ShadowMaps,
    /// The G-buffer: without it all surfaces are lit where they are drawn.
    GBuffer,
    /// Surfaces with a lightmap: without it they are lit as any others.
    Lightmap,
    /// Opaque surfaces: without it they are not drawn.
    Forward,
    /// What flat mirrors show: without it they are drawn without.
    Mirrors,
    /// What lies behind surfaces that light passes through: without it they are opaque.
    Refraction,
    /// Blended surfaces: without it they are not drawn.
    Transparent,
    /// The display pass: without it, or another at [`Stage::Display`], a frame that needs one is refused ([`RenderError::NoDisplay`](crate::RenderError::NoDisplay)).
    Display,
}

impl BuiltIn {
    /// Every one.
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

    /// Its name in plans and accounts.
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

    /// Switches off what a frame cannot have without it.
    pub(crate) fn switch_off(self, options: &mut FrameOptions) {
        match self {
            Self::ShadowMaps => options.shadows = false,
            Self::GBuffer => options.rendering_path = RenderingPath::Forward,
            Self::Lightmap => options.lightmaps = false,
            Self::Mirrors => options.mirror_depth = 0,
            Self::Refraction => options.refraction = false,
            // What the G-buffer holds of opaque surfaces would be lit by nothing.
            Self::Forward => options.rendering_path = RenderingPath::Forward,
            Self::Transparent | Self::Display => {}
        }
    }
}

/// The effects of this crate but for some, each in its stage.
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

/// In the order of their stages.
pub(crate) fn in_order(effects: &mut [Box<dyn Effect>]) {
    // Stable.
    effects.sort_by_key(|effect| effect.stage());
}
