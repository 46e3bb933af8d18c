//! An irradiance volume on the GPU: the sides of its ambient cubes in one texture, its placement in a
//! uniform, and their bind group. Layout twin: shaders/irradiance_volume.wesl.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, UVec3, Vec3};
use half::f16;
use lumbre_scene::{IrradianceVolume, VolumePlace};

use crate::Gpu;

/// The largest offset for shaders, in cells. It keeps sums finite even with cells of a nanometre and distant
/// points.
const FARTHEST: f64 = 1e30;

/// `ProbeGrid`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct ProbeGridData {
    scale: Vec3,
    padding: f32,
    offset: Vec3,
    padding_2: f32,
    resolution: Vec3,
    padding_3: f32,
}

/// A volume in the form that shaders read.
pub(super) struct ProbeTexture {
    pub group: Arc<wgpu::BindGroup>,
    grid: wgpu::Buffer,
    written: Option<ProbeGridData>,
}

impl ProbeTexture {
    /// Uploads a valid volume. Its placement is set by `stand`.
    pub fn new(
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        volume: &IrradianceVolume,
        uploaded: &mut u64,
    ) -> Self {
        let (group, texture, grid) = bind(gpu, layout, volume.resolution);
        let texels = texels(volume);
        let UVec3 { x: width, y, .. } = volume.resolution;
        let bytes: &[u8] = bytemuck::cast_slice(&texels);
        gpu.queue.write_texture(
            texture.as_image_copy(),
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(width * size_of::<[f16; 4]>() as u32),
                rows_per_image: Some(2 * y),
            },
            texture.size(),
        );
        *uploaded += bytes.len() as u64;
        Self { group: Arc::new(group), grid, written: None }
    }

    /// Writes its placement relative to the origin of frame space.
    pub fn stand(&mut self, gpu: &Gpu, place: &VolumePlace, origin: DVec3, uploaded: &mut u64) {
        let offset = place.seen_from(origin).offset.clamp(DVec3::splat(-FARTHEST), DVec3::splat(FARTHEST));
        let data = ProbeGridData {
            scale: place.scale.as_vec3(),
            offset: offset.as_vec3(),
            resolution: place.resolution.as_vec3(),
            ..ProbeGridData::default()
        };
        if self.written != Some(data) {
            gpu.queue.write_buffer(&self.grid, 0, bytemuck::bytes_of(&data));
            *uploaded += size_of::<ProbeGridData>() as u64;
            self.written = Some(data);
        }
    }
}

/// Returns texels of (light times openness, openness) for (Rx, 2 Ry, 3 Rz) texels, in the order that
/// `probe_grid_texel` expects.
fn texels(volume: &IrradianceVolume) -> Vec<[f16; 4]> {
    let [width, height, depth] = volume.resolution.to_array().map(|side| side as usize);
    let mut texels = Vec::with_capacity(6 * volume.cubes.len());
    for slice in 0..3 * depth {
        for row in 0..2 * height {
            let side = 2 * (slice / depth) + row / height;
            let first = ((slice % depth) * height + row % height) * width;
            for probe in first..first + width {
                let openness = volume.openness(probe);
                let light = volume.cubes[probe].0[side] * openness;
                let largest = Vec3::splat(f16::MAX.to_f32());
                let light = light.clamp(-largest, largest);
                texels.push([light.x, light.y, light.z, openness].map(f16::from_f32));
            }
        }
    }
    texels
}

/// Creates the layout of the group that surfaces read a volume from.
pub(crate) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D3,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("irradiance volume"),
        entries: &[entry(0, texture), entry(1, sampler), entry(2, uniform)],
    })
}

/// Creates the group of a volume with one cell and no data.
pub(crate) fn empty(gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
    bind(gpu, layout, UVec3::ONE).0
}

/// Creates a bind group together with its texture and its uniform.
fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resolution: UVec3,
) -> (wgpu::BindGroup, wgpu::Texture, wgpu::Buffer) {
    let [width, height, depth_or_array_layers] = (resolution * UVec3::new(1, 2, 3)).to_array();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("irradiance volume"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("irradiance volume"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    let grid = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("irradiance volume"),
        size: size_of::<ProbeGridData>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let view = texture.create_view(&Default::default());
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("irradiance volume"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
            wgpu::BindGroupEntry { binding: 2, resource: grid.as_entire_binding() },
        ],
    });
    (group, texture, grid)
}

#[cfg(test)]
mod tests {
    use lumbre_optics::probe_grid_texel;
    use lumbre_scene::AmbientCube;

    use super::*;

    #[test]
    fn every_side_is_where_shaders_look_for_it() {
        let resolution = UVec3::new(3, 2, 4);
        let light = |probe: usize, side: usize| Vec3::new(probe as f32, side as f32, 1.0);
        let cube = |probe| AmbientCube(std::array::from_fn(|side| light(probe, side)));
        let volume = IrradianceVolume { resolution, cubes: (0..24).map(cube).collect(), inside: Vec::new() };
        let found = texels(&volume);
        let sides = (resolution * UVec3::new(1, 2, 3)).as_dvec3();
        for probe in 0..24 {
            let cell = UVec3::new(probe % 3, probe / 3 % 2, probe / 6).as_dvec3() + 0.5;
            for side in 0..6 {
                let place = probe_grid_texel(cell, resolution.as_dvec3(), f64::from(side / 2), side % 2 == 1);
                let at = (place * sides).as_uvec3();
                let texel = found[((at.z * 4 + at.y) * 3 + at.x) as usize].map(f16::to_f32);
                assert_eq!(texel, [probe as f32, side as f32, 1.0, 1.0]);
            }
        }
    }

    #[test]
    fn probes_inside_count_little_and_what_is_bright_stays_finite() {
        let cubes = vec![AmbientCube([Vec3::splat(1e30); 6]), AmbientCube([Vec3::splat(8.0); 6])];
        let resolution = UVec3::new(2, 1, 1);
        let found = texels(&IrradianceVolume { resolution, cubes, inside: vec![false, true] });
        assert_eq!(found[0].map(f16::to_f32), [65504.0, 65504.0, 65504.0, 1.0]);
        assert_eq!(found[1].map(f16::to_f32), [8.0 / 1024.0, 8.0 / 1024.0, 8.0 / 1024.0, 1.0 / 1024.0]);
    }

    #[test]
    fn sizes_are_those_of_the_shaders() {
        assert_eq!(size_of::<ProbeGridData>(), 48);
    }
}
