//! Whether the fragments of a subgroup can load records for each other on a device, as
//! shaders/shared_records.wesl does. That needs lanes which all run, also those whose fragment is not covered
//! or has been discarded. No specification promises this, so a small triangle is drawn once to find out.

use crate::full_screen;
use crate::growable_buffer::GrowableBuffer;
use crate::table_texture::TableTexture;
use crate::{Gpu, Offscreen, OffscreenFormat, RenderError, shader};

/// Lanes of a subgroup.
const LANES: u32 = 8;
/// Side of the picture in which the triangle is drawn, in pixels.
const SIDE: u32 = 16;
/// What a pixel has where nothing was drawn.
const NOTHING: u8 = 128;
/// What it has where the numbers of all lanes arrived, instead of 0.
const ARRIVED: u8 = 255;

/// Returns true if the fragments of a subgroup can load records for each other on this device. This is found
/// out once per device, and only for software rasterizers: where all fragments of a subgroup need the same
/// record, a GPU loads it once by itself.
pub(crate) fn can_share_records(gpu: &Gpu) -> bool {
    *gpu.record_sharing().get_or_init(|| find_out(gpu))
}

fn find_out(gpu: &Gpu) -> bool {
    if !gpu.is_software() || !has_subgroups_of_8(gpu) {
        return false;
    }
    match probe(gpu) {
        Ok(pixels) => {
            let value = |pixel: &[u8]| pixel.first().copied();
            let known = |value: Option<u8>| value == Some(NOTHING) || value == Some(ARRIVED);
            let arrived = pixels.chunks_exact(4).any(|pixel| value(pixel) == Some(ARRIVED));
            arrived && pixels.chunks_exact(4).all(|pixel| known(value(pixel)))
        }
        Err(error) => {
            tracing::warn!("fragments load their records separately: {error}");
            false
        }
    }
}

fn has_subgroups_of_8(gpu: &Gpu) -> bool {
    let info = gpu.adapter.get_info();
    let eight = [info.subgroup_min_size, info.subgroup_max_size] == [LANES; 2];
    eight && gpu.device.features().contains(wgpu::Features::SUBGROUP)
}

/// Draws the triangle and returns its picture.
fn probe(gpu: &Gpu) -> Result<Vec<u8>, RenderError> {
    const LABEL: &str = "lanes of a subgroup";
    let device = &gpu.device;
    let module = shader::compile(device, "shared_records_probe", &[])?;
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let numbers: [u32; LANES as usize] = std::array::from_fn(|lane| 3u32.pow(lane as u32));
    let entry_size = size_of::<u32>();
    let mut table = TableTexture::new();
    table.make_room(gpu, LABEL, (numbers.len(), entry_size))?;
    table.write(gpu, bytemuck::cast_slice(&numbers), entry_size, 0..numbers.len());
    let pipeline =
        full_screen::pipeline(device, LABEL, &module, None, (OffscreenFormat::Rgba8.texture_format(), None));
    // In a uniform buffer, an entry of an array takes sixteen bytes.
    let entries = numbers.map(|number| [number, 0, 0, 0]);
    let mut buffer = GrowableBuffer::uniform(LABEL, entries.len());
    buffer.replace(entries);
    buffer.upload(gpu)?;
    let bound = [table.view().map(wgpu::BindingResource::TextureView), buffer.bound()];
    let bound = (0..).zip(bound.into_iter().flatten());
    let bound = bound.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(LABEL),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &bound.collect::<Vec<_>>(),
    });
    let picture = Offscreen::new(gpu, SIDE, SIDE, OffscreenFormat::Rgba8)?;
    let gray = f64::from(NOTHING) / 255.0;
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(LABEL),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &picture.target().view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r: gray, g: gray, b: gray, a: 1.0 }),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    if let Some(error) = pollster::block_on(scope.pop()) {
        return Err(RenderError::Refused { message: error.to_string() });
    }
    picture.read_rgba8(gpu)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_is_drawn_and_partly_discarded() {
        let gpu = Gpu::headless().unwrap();
        if !has_subgroups_of_8(&gpu) {
            assert!(!can_share_records(&gpu));
            eprintln!("SKIPPED: {} has no subgroups of 8", gpu.describe());
            return;
        }
        let picture = probe(&gpu).unwrap();
        let count = |value| picture.chunks_exact(4).filter(|pixel| pixel[0] == value).count();
        let [nothing, missing, arrived] = [NOTHING, 0, ARRIVED].map(count);
        assert_eq!(nothing + missing + arrived, (SIDE * SIDE) as usize);
        assert!(nothing > 100 && missing + arrived > 50, "{nothing} {missing} {arrived}");
        assert_eq!(can_share_records(&gpu), missing == 0 && gpu.is_software());
        // Frames of other tests are meant to be drawn in this way here.
        let is_known_to_work = gpu.describe().contains("llvmpipe");
        assert!(missing == 0 || !is_known_to_work, "{missing} fragments lack a number");
    }
}
