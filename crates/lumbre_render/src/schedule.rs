//! The renderer in a bevy_ecs schedule: one system, and the resources that it uses. Not needed by a program
//! that calls `Renderer::render`.

use bevy_ecs::prelude::*;

use crate::{FrameOptions, FrameReport, FrameTarget, RenderError, Renderer};

/// The target of the next frame. [`render_frame`] removes it: a window has another texture each frame, and an
/// offscreen target is inserted again.
#[derive(Resource, Clone, Debug)]
pub struct CurrentTarget(pub FrameTarget);

/// The result of the last frame that [`render_frame`] drew.
#[derive(Resource, Debug)]
pub struct LastFrame(pub Result<FrameReport, RenderError>);

/// System sets of a frame, for ordering other systems before and after.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RenderSet {
    /// [`render_frame`].
    Draw,
}

/// Draws a frame with the World's [`Renderer`] and [`FrameOptions`] (the default ones if there are none) into
/// its [`CurrentTarget`], and inserts [`LastFrame`]. Does nothing without a renderer or a target. This is an
/// exclusive system, because an effect may read anything in the World.
///
/// ```
/// # use std::sync::Arc;
/// # use bevy_ecs::prelude::*;
/// # use glam::Vec3;
/// # use lumbre_render::*;
/// let gpu = Gpu::headless()?;
/// let frame = Offscreen::new(&gpu, 64, 64, OffscreenFormat::Rgba8)?;
/// let mut world = World::new();
/// world.spawn((lumbre_scene::Camera::default(), lumbre_scene::Transform::IDENTITY));
/// world.insert_resource(Renderer::new(&gpu));
/// world.insert_resource(CurrentTarget(frame.target()));
/// let mut schedule = Schedule::default();
/// schedule.add_systems(render_frame.in_set(RenderSet::Draw));
/// schedule.run(&mut world);
/// let LastFrame(report) = world.remove_resource().unwrap();
/// assert_eq!(report?.statistics.draws, 0);
/// # Ok::<(), RenderError>(())
/// ```
pub fn render_frame(world: &mut World) {
    let Some(CurrentTarget(target)) = world.remove_resource() else { return };
    let options = world.get_resource::<FrameOptions>().cloned().unwrap_or_default();
    let Some(mut renderer) = world.remove_resource::<Renderer>() else { return };
    let frame = LastFrame(renderer.render(world, &target, &options));
    world.insert_resource(renderer);
    world.insert_resource(frame);
}
