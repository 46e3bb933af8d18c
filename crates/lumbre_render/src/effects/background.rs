//! Clears the frame to the scene's background colour, and the depth buffer to 0.

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_graph::LoadOp;
use lumbre_scene::SceneSettings;

use super::{Board, Effect, FrameGraph, Stage, display_color};
use crate::error::EffectError;
use crate::facts::SceneFacts;
use crate::frame_plan::FrameShape;
use crate::layout::radiance;
use crate::{FrameOptions, Gpu};

/// The largest finite half float.
pub(super) const LARGEST_HALF: Vec3 = Vec3::splat(65504.0);

#[derive(Debug, Default)]
pub(super) struct Background {
    /// The background's radiance.
    background: Vec3,
    /// The colour as the pass's target stores it.
    color: Vec3,
}

impl Effect for Background {
    fn name(&self) -> &'static str {
        "background"
    }

    fn stage(&self) -> Stage {
        Stage::Background
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, _: &FrameOptions) -> bool {
        self.background = radiance(SceneSettings::shown_background(&facts.settings));
        true
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn prepare(&mut self, _: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        self.color = match (frame.display_pass, frame.lit_format) {
            (true, wgpu::TextureFormat::Rgba16Float) => self.background.clamp(-LARGEST_HALF, LARGEST_HALF),
            (true, _) => self.background,
            (false, format) => display_color(frame.display, format, frame.exposure, self.background),
        };
        Ok(())
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let color = self.color.as_dvec3();
        let clear = wgpu::Color { r: color.x, g: color.y, b: color.z, a: 1.0 };
        let pass = board.lit_pass(graph, self.name(), LoadOp::Clear(clear));
        pass.depth(&mut board.depth, LoadOp::Clear(0.0)).run(|_| Ok(()));
    }
}
