//! The board holds the textures of a frame as graph handles, which the passes of one effect pass on to those
//! of the next.

use std::any::{Any, TypeId};
use std::collections::HashMap;

use lumbre_graph::{
    BufferHandle, BufferRead, LoadOp, PassBuilder, PassType, Raster, TextureDescriptor, TextureHandle,
};

use super::FrameGraph;
use crate::frame_plan::{Ending, FramePlan};
use crate::frame_scene::FrameScene;
use crate::target::{DEPTH_FORMAT, Viewport};

/// The textures of a frame. A pass that writes a texture advances its handle, so that later passes read what
/// it wrote.
pub struct Board {
    /// Linear radiance, one sample per pixel. It is complete at [`Stage::Radiance`](super::Stage::Radiance),
    /// if an effect of that stage is called for.
    pub linear: TextureHandle,
    /// Reversed-Z depth, with [`samples`](Self::samples) per pixel.
    pub depth: TextureHandle,
    /// The target. It holds the picture from [`Stage::Picture`](super::Stage::Picture) on.
    pub target: TextureHandle,
    /// Width and height of the frame in texels: of `linear` and `depth`, and of the part of `target` that the
    /// frame fills.
    pub size: [u32; 2],
    /// The part of the target that the frame fills, if that is not all of it.
    pub viewport: Option<Viewport>,
    /// Format of `linear`.
    pub linear_format: wgpu::TextureFormat,
    /// Samples per pixel of `depth` and of the lit passes.
    pub samples: u32,
    /// The multisampled colour target, if there are several samples per pixel.
    multisampled: Option<TextureHandle>,
    ending: Ending,
    /// The textures that surfaces are lit with.
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
            // Gives the linear frame a reason for being skipped. Passes that would read it are then skipped
            // for reasons of their own.
            graph
                .raster_pass("linear frame")
                .requires(false, "use for a linear frame")
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

    /// Creates a transient texture of the frame's size.
    pub fn texture(
        &self,
        graph: &mut FrameGraph<'_>,
        name: &'static str,
        format: wgpu::TextureFormat,
    ) -> TextureHandle {
        graph.texture(name, TextureDescriptor::new_2d(self.size[0], self.size[1], format))
    }

    /// Begins a pass that draws lit colours as radiance over the existing ones. A pass that tests depth adds
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

    /// Makes a pass that lights surfaces, but draws nothing into the frame, depend on what they are lit with.
    pub(super) fn lit<'g, 'a, K: PassType>(
        &self,
        pass: PassBuilder<'g, 'a, K, FrameScene<'a>>,
    ) -> PassBuilder<'g, 'a, K, FrameScene<'a>> {
        let pass = self.lit_by.iter().fold(pass, |pass, texture| pass.samples(texture));
        self.lit_by_buffers.iter().fold(pass, |pass, (buffer, how)| pass.reads(buffer, *how))
    }

    pub(super) fn has_display_pass(&self) -> bool {
        self.ending == Ending::DisplayPass
    }

    /// Makes every later [`lit_pass`](Self::lit_pass) sample a texture.
    pub(super) fn lit_by(&mut self, texture: TextureHandle) {
        self.lit_by.push(texture);
    }

    /// Makes every later [`lit_pass`](Self::lit_pass) that does not clear its target read a buffer.
    pub(crate) fn lit_by_buffer(&mut self, buffer: BufferHandle, how: BufferRead) {
        self.lit_by_buffers.push((buffer, how));
    }

    /// Stores a value for later effects, usually a handle in a type of its own.
    pub fn insert<T: Any>(&mut self, value: T) {
        self.others.insert(TypeId::of::<T>(), Box::new(value));
    }

    /// Returns what an earlier effect stored under this type.
    pub fn get<T: Any>(&self) -> Option<&T> {
        self.others.get(&TypeId::of::<T>())?.downcast_ref()
    }

    /// Like [`get`](Self::get), for handles that a write advances.
    pub fn get_mut<T: Any>(&mut self) -> Option<&mut T> {
        self.others.get_mut(&TypeId::of::<T>())?.downcast_mut()
    }
}
