//! Bind groups of a material's textures, and of lightmaps. A set binds only the textures that its material
//! has.

use std::collections::HashMap;
use std::sync::Arc;

use lumbre_scene::{Image, Lightmap, LightmapEncoding, MaterialTextures, Mipmap, Sampler, Wrap};

use wgpu::util::DeviceExt;

use crate::layout::SurfaceMapsData;
use crate::shader::Feature;
use crate::textures::{Texels, Textures};
use crate::{Gpu, RenderError};

/// The texture slots of a material in binding order, which is that of `MaterialTextures::slots`: the feature
/// that reads it, and what its texels are.
const SLOTS: [(Feature, Texels); MaterialTextures::SLOTS] = [
    (Feature::BaseColorTexture, Texels::Colors),
    (Feature::EmissiveTexture, Texels::Colors),
    (Feature::MetallicRoughnessTexture, Texels::Numbers),
    (Feature::NormalTexture, Texels::Normals),
    (Feature::OcclusionTexture, Texels::Numbers),
];

/// A bind group with some of the material textures.
#[derive(Debug)]
pub(crate) struct TextureSet {
    /// Bit i is set if slot i is bound.
    pub mask: u8,
    pub bind_group: wgpu::BindGroup,
    /// Small black textures in place of the material's, for warm-up draws.
    pub stand_ins: MaterialTextures,
}

/// The images with their samplers, and the bytes of the surface maps' uniform.
type SetKey = ([Option<(usize, Sampler)>; SLOTS.len()], Option<[u8; size_of::<SurfaceMapsData>()]>);

/// All sets in use.
#[derive(Debug, Default)]
pub(crate) struct TextureSets {
    layouts: HashMap<u8, wgpu::BindGroupLayout>,
    sets: HashMap<SetKey, Arc<TextureSet>>,
    lightmap_layout: Option<wgpu::BindGroupLayout>,
    lightmaps: HashMap<(usize, LightmapEncoding), Arc<wgpu::BindGroup>>,
}

/// Returns every texture feature, and whether a mask contains it.
pub(crate) fn features(mask: u8) -> impl Iterator<Item = (Feature, bool)> {
    SLOTS.iter().enumerate().map(move |(i, (feature, _))| (*feature, mask & (1 << i) != 0))
}

/// Returns black textures in place of a material's, as small as possible while a software rasterizer still
/// generates the same code for them. That depends on the samplers and on whether the sides are powers of two.
fn stand_ins(textures: &MaterialTextures) -> MaterialTextures {
    let mut small = textures.clone();
    for reference in small.references_mut() {
        let side = |side: u32| if side.is_power_of_two() { side.min(4) } else { 3 };
        let (width, height) = (side(reference.image.width), side(reference.image.height));
        let rgba = vec![0; 4 * (width * height) as usize];
        reference.image = Arc::new(Image { name: "warm-up".to_owned(), width, height, rgba });
    }
    small
}

impl TextureSets {
    /// Returns the layout for a mask; `None` if the mask is empty.
    pub fn layout(&mut self, gpu: &Gpu, mask: u8) -> Option<wgpu::BindGroupLayout> {
        (mask != 0).then(|| self.layouts.entry(mask).or_insert_with(|| make_layout(gpu, mask)).clone())
    }

    /// Returns the set of a material; `None` if it has no textures.
    pub fn set(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        material: &MaterialTextures,
    ) -> Result<Option<Arc<TextureSet>>, RenderError> {
        let mask = material.slot_mask();
        let Some(layout) = self.layout(gpu, mask) else { return Ok(None) };
        let slots = material.slots();
        let maps = SurfaceMapsData::new(material);
        let images = slots.map(|slot| slot.map(|t| (Arc::as_ptr(&t.image) as usize, t.sampler)));
        let key = (images, maps.map(bytemuck::cast));
        if let Some(set) = self.sets.get(&key) {
            return Ok(Some(Arc::clone(set)));
        }
        let mut bound = Vec::new();
        for ((slot, (_, texels)), binding) in slots.iter().zip(SLOTS).zip((0..).step_by(2)) {
            if let Some(texture) = slot {
                let view = textures.image(gpu, &texture.image, texels)?;
                bound.push((binding, view, textures.sampler(gpu, &texture.sampler)));
            }
        }
        let set = Arc::new(TextureSet {
            mask,
            bind_group: bind(gpu, &layout, &bound, maps.as_ref()),
            stand_ins: stand_ins(material),
        });
        self.sets.insert(key, Arc::clone(&set));
        Ok(Some(set))
    }

    /// Returns the layout of a lightmap's group.
    pub fn lightmap_layout(&mut self, gpu: &Gpu) -> wgpu::BindGroupLayout {
        let lit = wgpu::ShaderStages::FRAGMENT | wgpu::ShaderStages::COMPUTE;
        self.lightmap_layout.get_or_insert_with(|| layout_of(gpu, lit, &[0], false)).clone()
    }

    /// Returns the group of a lightmap, stored in this format.
    pub fn lightmap(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        lightmap: &Lightmap,
        format: LightmapEncoding,
    ) -> Result<Arc<wgpu::BindGroup>, RenderError> {
        let key = (Arc::as_ptr(&lightmap.image) as usize, format);
        if let Some(group) = self.lightmaps.get(&key) {
            return Ok(Arc::clone(group));
        }
        let layout = self.lightmap_layout(gpu);
        let view = textures.lightmap(gpu, &lightmap.image, format)?;
        let (wrap_u, wrap_v) = (Wrap::ClampToEdge, Wrap::ClampToEdge);
        let sampler =
            textures.sampler(gpu, &Sampler { wrap_u, wrap_v, mipmap: Mipmap::None, ..Sampler::default() });
        let group = Arc::new(bind(gpu, &layout, &[(0, view, sampler)], None));
        self.lightmaps.insert(key, Arc::clone(&group));
        Ok(group)
    }

    /// Drops bind groups that no object uses. They keep textures alive on the GPU, so `Textures::sweep` alone
    /// would not free these.
    pub fn sweep(&mut self) {
        self.sets.retain(|_, set| Arc::strong_count(set) > 1);
        self.lightmaps.retain(|_, group| Arc::strong_count(group) > 1);
    }
}

fn make_layout(gpu: &Gpu, mask: u8) -> wgpu::BindGroupLayout {
    let first: Vec<u32> = (0..SLOTS.len() as u32).filter(|i| mask & (1 << i) != 0).map(|i| i * 2).collect();
    let reads_maps =
        |(feature, bound)| bound && matches!(feature, Feature::NormalTexture | Feature::OcclusionTexture);
    layout_of(gpu, wgpu::ShaderStages::FRAGMENT, &first, features(mask).any(reads_maps))
}

/// Binding of `SurfaceMaps`, after all textures.
const SURFACE_MAPS_BINDING: u32 = 10;

/// Creates a layout with a texture and a sampler at each of these bindings for these stages, and the uniform of the surface
/// maps if there are any.
fn layout_of(gpu: &Gpu, visibility: wgpu::ShaderStages, first: &[u32], maps: bool) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let maps = maps.then(|| wgpu::BindGroupLayoutEntry {
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ..entry(SURFACE_MAPS_BINDING, uniform)
    });
    let textures = first.iter().flat_map(|&binding| [entry(binding, texture), entry(binding + 1, sampler)]);
    let entries: Vec<_> = textures.chain(maps).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("textures"),
        entries: &entries,
    })
}

fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    bound: &[(u32, wgpu::TextureView, wgpu::Sampler)],
    maps: Option<&SurfaceMapsData>,
) -> wgpu::BindGroup {
    let maps = maps.map(|maps| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("surface maps"),
            contents: bytemuck::bytes_of(maps),
            usage: wgpu::BufferUsages::UNIFORM,
        })
    });
    let maps = maps.as_ref().map(|buffer| wgpu::BindGroupEntry {
        binding: SURFACE_MAPS_BINDING,
        resource: buffer.as_entire_binding(),
    });
    let entries: Vec<_> = bound
        .iter()
        .flat_map(|(binding, view, sampler)| {
            [
                wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: wgpu::BindingResource::TextureView(view),
                },
                wgpu::BindGroupEntry {
                    binding: *binding + 1,
                    resource: wgpu::BindingResource::Sampler(sampler),
                },
            ]
        })
        .chain(maps)
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("textures"),
        layout,
        entries: &entries,
    })
}
