//! Warm-up draws, on a device of their own, for pipelines that are created in the background. A software
//! rasterizer compiles a pipeline's shaders on the first draw, on the drawing thread, which takes half a
//! second and more. But it keeps the code on disk for every device of the machine (Mesa's shader cache). So
//! each such pipeline first draws one degenerate triangle on another device of the same adapter, and the
//! first frame that uses it finds the compiled code. GPUs need no warm-up: they compile when a pipeline is
//! created.

use std::fmt::Display;
use std::sync::{Arc, Mutex};

use lumbre_scene::{Lightmap, LightmapEncoding, LightmapImage, MaterialTextures};

use crate::frame_bindings::{FrameBindings, FrameBuffer};
use crate::g_buffer;
use crate::irradiance_volumes;
use crate::pipelines::{Afterwards, Pipeline, PipelineKey, Pipelines};
use crate::shader::Feature;
use crate::shadows::{CasterPipelines, PLANES_FORMAT};
use crate::target::DEPTH_FORMAT;
use crate::texture_sets::{TextureSet, TextureSets};
use crate::textures::Textures;
use crate::{EffectError, Gpu, RenderError};

/// The warm-up device, and what draws need on it.
#[derive(Debug)]
struct WarmUp {
    gpu: Gpu,
    pipelines: Pipelines,
    sets: TextureSets,
    textures: Textures,
    /// Zeros, as large as any uniform array: used as uniform, storage, vertex and index buffer.
    zeros: wgpu::Buffer,
}

/// Side of the render targets, in texels.
const SIDE: u32 = 16;
/// Size of the uniform array of lights.
const ZEROS: u64 = 1 << 16;

/// The warm-up device of a renderer, which is opened with the first warm-up draw. Two are equal if they are
/// the same object.
#[derive(Clone, Debug, Default)]
pub(crate) struct WarmUps(Arc<Mutex<Option<WarmUp>>>);

impl PartialEq for WarmUps {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl WarmUps {
    /// Returns a job that draws once with a pipeline and a material's textures; `None` if the adapter does
    /// not compile on the first draw. What is compiled also depends on the format of lightmaps.
    pub fn of(
        &self,
        gpu: &Gpu,
        key: PipelineKey,
        (textures, lightmaps): (Option<&TextureSet>, LightmapEncoding),
    ) -> Option<Afterwards> {
        // Variants that count lights are for measurements, where a long frame does not matter, and compute shaders
        // are for GPUs.
        if key.variant.has(Feature::CountLights) || key.variant.has(Feature::InCompute) {
            return None;
        }
        let textures = textures.map(|set| set.stand_ins.clone());
        self.job(gpu, move |warm_up| warm_up.draw(key, textures.as_ref(), lightmaps))
    }

    /// Returns a job that draws a shadow map once.
    pub fn of_casters(&self, gpu: &Gpu) -> Option<Afterwards> {
        self.job(gpu, WarmUp::draw_casters)
    }

    /// Returns a job that draws once in a pass of an effect. `draw` creates what it needs on the device that
    /// it is given, and draws.
    pub fn of_pass(
        &self,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        draw: impl FnOnce(&Gpu, &mut wgpu::RenderPass<'static>) -> Result<(), EffectError> + Send + 'static,
    ) -> Option<Afterwards> {
        self.job(gpu, move |warm_up| warm_up.draw_pass(format, draw).map_err(|error| error.to_string()))
    }

    fn job<E: Display>(
        &self,
        gpu: &Gpu,
        draw: impl FnOnce(&mut WarmUp) -> Result<(), E> + Send + 'static,
    ) -> Option<Afterwards> {
        if !gpu.is_software() {
            return None;
        }
        let (place, instance, adapter) = (Arc::clone(&self.0), gpu.instance.clone(), gpu.adapter.clone());
        // Shaders depend on the features of their device.
        let features = gpu.device.features();
        Some(Box::new(move || {
            let Ok(mut warm_up) = place.lock() else { return };
            if warm_up.is_none() {
                match WarmUp::new(instance, adapter, features) {
                    Ok(new) => *warm_up = Some(new),
                    Err(error) => tracing::debug!("no pipeline can be warmed up: {error}"),
                }
            }
            let Some(warm_up) = &mut *warm_up else { return };
            if let Err(error) = draw(warm_up) {
                // The first frame that uses the pipeline takes longer; nothing else is affected.
                tracing::debug!("a pipeline was not warmed up: {error}");
            }
        }))
    }
}

impl WarmUp {
    /// Opens a second device of the adapter, with the features of the first one.
    fn new(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        features: wgpu::Features,
    ) -> Result<Self, RenderError> {
        let gpu = Gpu::from_adapter(instance, adapter, features)?;
        let zeros = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("warm-up"),
            size: ZEROS,
            usage: wgpu::BufferUsages::UNIFORM
                | wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::VERTEX
                | wgpu::BufferUsages::INDEX,
            mapped_at_creation: false,
        });
        let (pipelines, sets, textures) = (Pipelines::new(&gpu), TextureSets::default(), Textures::default());
        Ok(Self { gpu, pipelines, sets, textures, zeros })
    }

    /// Draws with a pipeline and waits until the device has finished.
    ///
    /// # Errors
    /// The errors that a frame with this pipeline would have.
    fn draw(
        &mut self,
        key: PipelineKey,
        textures: Option<&MaterialTextures>,
        lightmaps: LightmapEncoding,
    ) -> Result<(), RenderError> {
        self.pipelines.prepare(&self.gpu, &mut self.sets, key, true, || None)?;
        let set = match textures {
            Some(textures) => self.sets.set(&self.gpu, &mut self.textures, textures)?,
            None => None,
        };
        let g_buffer = key.variant.has(Feature::Deferred).then(|| self.g_buffer_group());
        let baked_light = match key.variant.samples_lightmap() {
            true => {
                let (name, encoding) = ("warm-up".to_owned(), lightmaps);
                let texels = vec![glam::Vec3::ZERO; 16];
                let image = Arc::new(LightmapImage { name, width: 4, height: 4, texels, encoding });
                Some(self.sets.lightmap(&self.gpu, &mut self.textures, &Lightmap { image }, encoding)?)
            }
            false => key
                .variant
                .has(Feature::IrradianceVolume)
                .then(|| Arc::new(irradiance_volumes::empty(&self.gpu, self.pipelines.volume_layout()))),
        };
        let frame = self.frame_group(FrameBindings::of(&key.variant));
        let shadows = key.variant.has(Feature::Shadows).then(|| self.shadow_group());
        let Some(pipeline) = self.pipelines.get(&key) else { return Ok(()) };
        let textures = g_buffer.as_ref().or(set.as_ref().map(|set| &set.bind_group));
        let groups = [Some(&frame), textures, baked_light.as_deref(), shadows.as_ref()];
        let drawn = self.submit(key, pipeline, groups);
        self.sets.sweep();
        self.textures.sweep(&self.gpu, lightmaps);
        drawn
    }

    /// Draws a caster into a shadow map.
    fn draw_casters(&mut self) -> Result<(), RenderError> {
        let device = &self.gpu.device;
        let pipelines = CasterPipelines::new(device, self.gpu.reads_tables_from_textures())?;
        let table = self.texture(wgpu::TextureFormat::Rgba32Uint, 1);
        let group = pipelines.group(device, self.table(&table), &self.zeros);
        let map = self.texture(DEPTH_FORMAT, 1);
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("warm-up"),
            depth_stencil_attachment: Some(depth_attachment(&map)),
            ..Default::default()
        });
        pass.set_bind_group(0, &group, &[0]);
        pass.set_pipeline(&pipelines.clear);
        pass.draw(0..3, 0..1);
        pass.set_pipeline(&pipelines.caster);
        pass.set_vertex_buffer(0, self.zeros.slice(..));
        pass.set_index_buffer(self.zeros.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..3, 0, 0..1);
        drop(pass);
        let planes = self.texture(PLANES_FORMAT, 1);
        let group = pipelines.planes_group(device, &map);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("warm-up"),
            color_attachments: &[Some(color_attachment(&planes))],
            ..Default::default()
        });
        pass.set_bind_group(0, &group, &[]);
        pass.set_pipeline(&pipelines.planes);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.finish(encoder)
    }

    /// Draws into a texture of this format, without a depth buffer.
    fn draw_pass(
        &self,
        format: wgpu::TextureFormat,
        draw: impl FnOnce(&Gpu, &mut wgpu::RenderPass<'static>) -> Result<(), EffectError>,
    ) -> Result<(), EffectError> {
        let color = self.texture(format, 1);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("warm-up"),
                color_attachments: &[Some(color_attachment(&color))],
                ..Default::default()
            })
            .forget_lifetime();
        let drawn = draw(&self.gpu, &mut pass);
        drop(pass);
        drawn?;
        Ok(self.finish(encoder)?)
    }

    /// Submits commands and waits for them.
    fn finish(&self, encoder: wgpu::CommandEncoder) -> Result<(), RenderError> {
        self.gpu.queue.submit([encoder.finish()]);
        // `check` reports a lost device.
        let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        self.gpu.check()
    }

    fn texture(&self, format: wgpu::TextureFormat, sample_count: u32) -> wgpu::TextureView {
        let texture = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("warm-up"),
            size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: match [DEPTH_FORMAT, g_buffer::FORMAT, PLANES_FORMAT].contains(&format)
                && sample_count == 1
            {
                true => wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                false => wgpu::TextureUsages::RENDER_ATTACHMENT,
            },
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    }

    fn submit(
        &self,
        key: PipelineKey,
        pipeline: &Pipeline,
        groups: [Option<&wgpu::BindGroup>; 4],
    ) -> Result<(), RenderError> {
        let colors: Vec<_> =
            (0..key.variant.targets()).map(|_| self.texture(key.format, key.samples)).collect();
        let attachments: Vec<_> = colors.iter().map(|color| Some(color_attachment(color))).collect();
        let depth = self.texture(DEPTH_FORMAT, key.samples);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("warm-up"),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(depth_attachment(&depth)),
            ..Default::default()
        });
        let Some(drawing) = pipeline.render() else { return Ok(()) };
        pass.set_pipeline(drawing);
        for (index, group) in (0..).zip(groups).filter(|(_, group)| group.is_some()) {
            pass.set_bind_group(index, group, &[]);
        }
        for slot in 0..pipeline.attributes.len() as u32 {
            pass.set_vertex_buffer(slot, self.zeros.slice(..));
        }
        if pipeline.flat || pipeline.attributes.is_empty() {
            pass.draw(0..3, 0..1);
        } else {
            pass.set_index_buffer(self.zeros.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3, 0, 0..1);
        }
        drop(pass);
        self.finish(encoder)
    }

    /// Returns zeros for a table binding: this texture on a device that keeps tables in textures.
    fn table<'a>(&'a self, texture: &'a wgpu::TextureView) -> wgpu::BindingResource<'a> {
        match self.gpu.reads_tables_from_textures() {
            true => wgpu::BindingResource::TextureView(texture),
            false => self.zeros.as_entire_binding(),
        }
    }

    /// Creates group 0.
    fn frame_group(&mut self, bindings: FrameBindings) -> wgpu::BindGroup {
        let table = self.texture(wgpu::TextureFormat::Rgba32Uint, 1);
        let layout = self.pipelines.frame_layout(&self.gpu, bindings).clone();
        let entry = |buffer: FrameBuffer| wgpu::BindGroupEntry {
            binding: buffer.binding(),
            resource: match buffer.is_table() {
                true => self.table(&table),
                false => self.zeros.as_entire_binding(),
            },
        };
        let entries: Vec<_> = bindings.buffers().map(entry).collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("warm-up"),
            layout: &layout,
            entries: &entries,
        })
    }

    /// Creates group 1 of deferred lighting.
    fn g_buffer_group(&self) -> wgpu::BindGroup {
        let surfaces = self.texture(g_buffer::FORMAT, 1);
        g_buffer::group(&self.gpu.device, self.pipelines.g_buffer_layout(), &surfaces, None)
    }

    /// Creates group 3.
    fn shadow_group(&self) -> wgpu::BindGroup {
        let atlas = self.texture(DEPTH_FORMAT, 1);
        let table = self.texture(wgpu::TextureFormat::Rgba32Uint, 1);
        let planes = self.texture(PLANES_FORMAT, 1);
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("warm-up"),
            layout: self.pipelines.shadow_layout(),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&atlas) },
                wgpu::BindGroupEntry { binding: 1, resource: self.table(&table) },
                wgpu::BindGroupEntry { binding: 2, resource: self.zeros.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::TextureView(&planes) },
            ],
        })
    }
}

fn color_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let (load, store) = (wgpu::LoadOp::Clear(wgpu::Color::BLACK), wgpu::StoreOp::Store);
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store },
    }
}

fn depth_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}
