//! Converts radiance to the target's values: exposure, tone curve, encoding. This is a separate pass if
//! something needs the linear frame (several samples per pixel, blending, an effect at [`Stage::Radiance`],
//! the probe); otherwise the lit shaders convert their colours themselves.

use std::collections::HashMap;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_graph::LoadOp;
use lumbre_optics::{decode_srgb, encode_srgb, tone_curve};
use wgpu::util::DeviceExt;

use super::{Board, Effect, EffectWork, FrameGraph, Stage};
use crate::error::EffectError;
use crate::facts::SceneFacts;
use crate::frame_plan::FrameShape;
use crate::full_screen;
use crate::pending::Pending;
use crate::shader::{self, DisplayVariant};
use crate::target::Viewport;
use crate::{Display, FrameOptions, Gpu, RenderError};

/// The display effect and its pipelines.
#[derive(Debug, Default)]
pub(super) struct DisplayPass {
    device: Option<OnDevice>,
    /// The key of this frame's pipeline.
    key: Option<Key>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    variant: DisplayVariant,
    format: wgpu::TextureFormat,
    /// Whether the frame fills only a part of the target.
    viewport: bool,
}

impl Key {
    fn of(frame: &FrameShape) -> Self {
        let variant = DisplayVariant::new(frame.display, frame.target_format);
        Self { variant, format: frame.target_format, viewport: frame.viewport.is_some() }
    }
}

/// The uniform of a frame with exposure 1 that fills its target.
const UNEXPOSED: [f32; 4] = [1.0, 0.0, 0.0, 0.0];

#[derive(Debug)]
struct OnDevice {
    layout: wgpu::BindGroupLayout,
    pipelines: HashMap<Key, Pending<wgpu::RenderPipeline>>,
    uniform: wgpu::Buffer,
    /// The content of the uniform: the exposure, and the corner of the viewport.
    written: [f32; 4],
    /// Bytes written so far.
    uploaded: u64,
}

impl Effect for DisplayPass {
    fn name(&self) -> &'static str {
        "display"
    }

    fn stage(&self) -> Stage {
        Stage::Display
    }

    fn extract(&mut self, _: &mut World, _: &SceneFacts, _: &FrameOptions) -> bool {
        true
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn ready(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        let device = self.device.get_or_insert_with(|| OnDevice::new(gpu));
        Ok(!frame.display_pass || device.begin(gpu, frame)?)
    }

    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        self.key = None;
        if frame.display_pass {
            let device = self.device.get_or_insert_with(|| OnDevice::new(gpu));
            device.make(gpu, Key::of(frame))?;
            let [x, y] = frame.viewport.map_or([0, 0], |viewport| viewport.origin);
            device.write(gpu, [frame.exposure, x as f32, y as f32, 0.0]);
            self.key = Some(Key::of(frame));
        }
        Ok(())
    }

    fn work(&self) -> EffectWork {
        let made = |device: &OnDevice| {
            device.pipelines.values().filter(|pipeline| matches!(pipeline.get(), Some(Ok(_)))).count()
        };
        self.device
            .as_ref()
            .map_or_else(EffectWork::default, |device| EffectWork::new(device.uploaded, made(device)))
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let (linear, viewport) = (board.linear, board.viewport);
        let load = match viewport {
            None => LoadOp::Clear(wgpu::Color::BLACK),
            Some(Viewport { clear: Some(color), .. }) => LoadOp::Clear(color),
            Some(Viewport { clear: None, .. }) => LoadOp::Load,
        };
        graph
            .raster_pass(self.name())
            .requires(board.has_display_pass(), "use for a linear frame")
            .samples(&linear)
            .color(&mut board.target, load)
            .run(move |context| {
                let view = context.resources.view(&linear)?;
                if let Some(Viewport { origin: [x, y], size: [width, height], .. }) = viewport {
                    context.pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
                    context.pass.set_scissor_rect(x, y, width, height);
                }
                if let (Some(device), Some(key)) = (&self.device, &self.key) {
                    device.draw(context.resources.device, context.pass, key, view);
                }
                Ok(())
            });
    }
}

impl OnDevice {
    fn new(gpu: &Gpu) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("display"),
            entries: &[entry(0, texture), entry(1, uniform)],
        });
        let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("exposure"),
            contents: bytemuck::bytes_of(&UNEXPOSED),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        Self { layout, pipelines: HashMap::new(), uniform, written: UNEXPOSED, uploaded: 0 }
    }

    /// Creates the pipeline of a key, or waits for it.
    fn make(&mut self, gpu: &Gpu, key: Key) -> Result<(), EffectError> {
        let pipeline = self.pipelines.entry(key).or_insert_with(|| {
            let (device, layout) = (gpu.device.clone(), self.layout.clone());
            Pending::make(move || Ok(make(&device, &layout, key)?))
        });
        pipeline.is_there(true)?;
        Ok(())
    }

    /// Starts to create the pipeline of a frame on the device's worker thread. Returns true if it exists.
    fn begin(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        let key = Key::of(frame);
        let pipeline = self.pipelines.entry(key).or_insert_with(|| {
            let (device, layout) = (gpu.device.clone(), self.layout.clone());
            let warm_ups = frame.warm_ups.as_ref();
            let warm_up = warm_ups
                .and_then(|all| all.of_pass(gpu, key.format, move |gpu, pass| warm_up(gpu, pass, key)));
            Pending::begin(gpu, move || {
                let pipeline = make(&device, &layout, key)?;
                warm_up.into_iter().for_each(|warm_up| warm_up());
                Ok(pipeline)
            })
        });
        Ok(pipeline.is_there(false)?)
    }

    /// Writes the exposure and the corner of the viewport if they changed.
    fn write(&mut self, gpu: &Gpu, numbers: [f32; 4]) {
        if numbers != self.written {
            self.written = numbers;
            self.uploaded += size_of_val(&numbers) as u64;
            gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&numbers));
        }
    }

    /// Draws `frame` with a pipeline that `prepare` created.
    fn draw(
        &self,
        device: &wgpu::Device,
        pass: &mut wgpu::RenderPass<'static>,
        key: &Key,
        frame: &wgpu::TextureView,
    ) {
        let Some(Ok(pipeline)) = self.pipelines.get(key).and_then(Pending::get) else { return };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(frame) },
                wgpu::BindGroupEntry { binding: 1, resource: self.uniform.as_entire_binding() },
            ],
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Draws once with a pipeline, from a frame of one texel, as a warm-up.
fn warm_up(gpu: &Gpu, pass: &mut wgpu::RenderPass<'static>, key: Key) -> Result<(), EffectError> {
    let mut device = OnDevice::new(gpu);
    device.make(gpu, key)?;
    let frame = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("warm-up"),
        size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    device.draw(&gpu.device, pass, &key, &frame.create_view(&Default::default()));
    Ok(())
}

fn make(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    Key { variant, format, viewport }: Key,
) -> Result<wgpu::RenderPipeline, RenderError> {
    let mut flags = variant.flags();
    flags.push(("VIEWPORT", viewport));
    let module = shader::compile(device, "display", &flags)?;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("display"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    Ok(full_screen::pipeline(device, "display", &module, Some(&pipeline_layout), (format, None)))
}

/// Converts a colour to the values that the shaders write for a target of this format, in f64. Twin:
/// shaders/display_color.wesl.
pub fn display_color(display: Display, target: wgpu::TextureFormat, exposure: f32, radiance: Vec3) -> Vec3 {
    let exposed = radiance.as_dvec3() * f64::from(exposure);
    let shown = match display {
        Display::Linear => exposed,
        Display::Clamp => exposed.clamp(DVec3::ZERO, DVec3::ONE),
        Display::Srgb => tone_curve(exposed),
    };
    let variant = DisplayVariant::new(display, target);
    let within = shown.clamp(DVec3::ZERO, DVec3::ONE);
    match (variant.encode, variant.decode) {
        (true, _) => within.map(encode_srgb).as_vec3(),
        (false, true) => within.map(decode_srgb).as_vec3(),
        (false, false) => shown.as_vec3(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_shown_as_its_display_says() {
        let (eight_bits, encoded) = (wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Rgba8UnormSrgb);
        let shown = |display, format, color| display_color(display, format, 2.0, color);
        assert_eq!(shown(Display::Linear, eight_bits, Vec3::splat(3.0)), Vec3::splat(6.0));
        assert_eq!(shown(Display::Clamp, eight_bits, Vec3::new(-1.0, 0.25, 9.0)), Vec3::new(0.0, 0.5, 1.0));
        // Below its compression the Neutral tone mapper only subtracts a toe of 0.04: 0.3 becomes 0.26, which
        // is 0.5469 when encoded.
        let grey = shown(Display::Srgb, eight_bits, Vec3::splat(0.15)).x;
        assert!((grey - 0.5469).abs() < 1e-4, "{grey}");
        assert!((shown(Display::Srgb, encoded, Vec3::splat(0.15)).x - 0.26).abs() < 1e-6);
        let white = shown(Display::Srgb, eight_bits, Vec3::splat(1e30));
        assert!((white - Vec3::ONE).abs().max_element() < 1e-6, "{white}");
    }
}
