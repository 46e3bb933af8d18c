//! The board: the textures of a frame as handles, which the passes of one effect hand on to those of the next.

use std::any::{Any, TypeId};
use std::collections::HashMap;

use lumbre_graph::{BufferHandle, BufferRead, LoadOp, PassBuilder, Raster, TextureDescriptor, TextureHandle};

use super::FrameGraph;
use crate::frame_plan::{Ending, FramePlan};
use crate::frame_scene::FrameScene;
use crate::target::{DEPTH_FORMAT, Viewport};

/// The textures of a frame. A pass that writes one moves its handle on, so that later passes read what it wrote.
pub struct Board {
    /// Linear radiance, one sample per pixel: complete at [`Stage::Radiance`](super::Stage::Radiance), if an effect there is called for.
    pub linear: TextureHandle,
    /// Depth, reversed-Z, with [`samples`](Self::samples) per pixel.
    pub depth: TextureHandle,
    /// The target: holds the picture from [`Stage::Picture`](super::Stage::Picture) on.
    pub target: TextureHandle,
    /// Width and height of the frame in texels: of `linear` and `depth`, and of the part of `target` that the frame fills.
    pub size: [u32; 2],
    /// That part, if it is not all of the target.
    pub viewport: Option<Viewport>,
    /// Format of `linear`.
    pub linear_format: wgpu::TextureFormat,
    /// Samples per pixel of `depth` and of what is lit.
    pub samples: u32,
    /// What several samples per pixel are drawn into.
    multisampled: Option<TextureHandle>,
    ending: Ending,
    /// What surfaces are lit with.
    lit_by: Vec<TextureHandle>,
    lit_by_buffers: Vec<(BufferHandle, BufferRead)>,
    others: HashMap<TypeId, Box<dyn Any>>,
}

impl Board {
    pub(crate) fn new(
        graph: &mut FrameGraph<'_>,
        plan: &FramePlan,
        target: TextureDescriptor,
        viewport: Option<Viewport>,
    ) -> Self {
        let size = viewport.map_or([target.size.width, target.size.height], |viewport| viewport.size);
        let described = |format| TextureDescriptor::new_2d(size[0], size[1], format);
        let samples = plan.samples;
        let mut linear = graph.texture("linear frame", described(plan.linear_format));
        if plan.ending != Ending::DisplayPass {
            // So that whoever would read it is skipped for a reason of its own, and the plan has this one too.
            graph
                .raster_pass("linear frame")
                .calls_for(false, "use for a linear frame")
                .color(&mut linear, LoadOp::Clear(wgpu::Color::BLACK))
                .run(|_| Ok(()));
        }
        Self {
            linear,
            depth: graph.texture("depth", described(DEPTH_FORMAT).samples(samples)),
            target: graph.import_texture("target", target),
            size,
            viewport,
            linear_format: plan.linear_format,
            samples,
            multisampled: (samples > 1)
                .then(|| graph.texture("samples", described(plan.lit_format).samples(samples))),
            ending: plan.ending,
            lit_by: Vec::new(),
            lit_by_buffers: Vec::new(),
            others: HashMap::new(),
        }
    }

    /// A transient texture of the frame's size.
    pub fn texture(
        &self,
        graph: &mut FrameGraph<'_>,
        name: &'static str,
        format: wgpu::TextureFormat,
    ) -> TextureHandle {
        graph.texture(name, TextureDescriptor::new_2d(self.size[0], self.size[1], format))
    }

    /// Begins a pass that draws lit colours as radiance, over those that are there. Where it is to test depth it adds
    /// `.depth(&mut board.depth, LoadOp::Load)`.
    pub fn lit_pass<'g, 'a>(
        &mut self,
        graph: &'g mut FrameGraph<'a>,
        name: &'static str,
        load: LoadOp<wgpu::Color>,
    ) -> PassBuilder<'g, 'a, Raster, FrameScene<'a>> {
        let result = match self.ending {
            Ending::DisplayPass => &mut self.linear,
            Ending::Direct | Ending::Folded => &mut self.target,
        };
        let pass = graph.raster_pass(name);
        let pass = self.lit_by.iter().fold(pass, |pass, texture| pass.samples(texture));
        let drawn = !matches!(load, LoadOp::Clear(_));
        let buffers = self.lit_by_buffers.iter().filter(|_| drawn);
        let pass = buffers.fold(pass, |pass, (buffer, how)| pass.reads(buffer, *how));
        match &mut self.multisampled {
            Some(samples) => pass.color(samples, load).resolve(result),
            None => pass.color(result, load),
        }
    }

    /// Has a pass that draws lit surfaces elsewhere than in the frame depend on what they are lit with.
    pub(super) fn lit<'g, 'a>(
        &self,
        pass: PassBuilder<'g, 'a, Raster, FrameScene<'a>>,
    ) -> PassBuilder<'g, 'a, Raster, FrameScene<'a>> {
        let pass = self.lit_by.iter().fold(pass, |pass, texture| pass.samples(texture));
        self.lit_by_buffers.iter().fold(pass, |pass, (buffer, how)| pass.reads(buffer, *how))
    }

    pub(super) fn has_display_pass(&self) -> bool {
        self.ending == Ending::DisplayPass
    }

    /// Has every later [`lit_pass`](Self::lit_pass) sample a texture.
    pub(super) fn lit_by(&mut self, texture: TextureHandle) {
        self.lit_by.push(texture);
    }

    /// Has every later [`lit_pass`](Self::lit_pass) that draws over what is there read a buffer.
    pub(crate) fn lit_by_buffer(&mut self, buffer: BufferHandle, how: BufferRead) {
        self.lit_by_buffers.push((buffer, how));
    }

    /// Leaves a value, as a rule a handle in a type of its own, for the effects that come later.
    pub fn insert<T: Any>(&mut self, value: T) {
        self.others.insert(TypeId::of::<T>(), Box::new(value));
    }

    /// What an earlier effect left under this type.
    pub fn get<T: Any>(&self) -> Option<&T> {
        self.others.get(&TypeId::of::<T>())?.downcast_ref()
    }

    /// As [`get`](Self::get), to be moved on by a write.
    pub fn get_mut<T: Any>(&mut self) -> Option<&mut T> {
        self.others.get_mut(&TypeId::of::<T>())?.downcast_mut()
    }
}
