//! Group 0 of the lit shaders: which of a frame's buffers a variant reads, and the layout with just these.
//! The bindings are those of shaders/frame.wesl, shaders/light_clusters.wesl and shaders/light_counts.wesl.
//! The contents of the buffers are not defined here.

use lumbre_optics::Shading;

use crate::Gpu;
use crate::shader::{Feature, Variant};
use crate::table_texture::table_binding;

/// A buffer of group 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameBuffer {
    Frame,
    Objects,
    Materials,
    Instances,
    Lights,
    LightList,
    ClusterGrid,
    ClusterLists,
    /// Inverse-square lights in a uniform buffer, as many as fit.
    UniformLights,
    /// The same lights in a table, any number of them.
    InverseSquareLights,
    /// Light counts of fragments, and of the pixels that compute shaders light.
    LightCounts,
    /// Light counts of vertices.
    VertexLightCounts,
}

/// A set of buffers of group 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct FrameBindings(u16);

impl FrameBuffer {
    const ALL: [Self; 12] = [
        Self::Frame,
        Self::Objects,
        Self::Materials,
        Self::Instances,
        Self::Lights,
        Self::LightList,
        Self::ClusterGrid,
        Self::ClusterLists,
        Self::UniformLights,
        Self::InverseSquareLights,
        Self::LightCounts,
        Self::VertexLightCounts,
    ];

    pub fn binding(self) -> u32 {
        self as u32
    }

    pub fn is_uniform(self) -> bool {
        matches!(self, Self::Frame | Self::ClusterGrid | Self::UniformLights)
    }

    /// Returns true if it is a texture on a device that keeps tables in textures.
    pub fn is_table(self) -> bool {
        match self {
            Self::Objects | Self::Materials | Self::Instances => true,
            Self::Lights | Self::LightList | Self::ClusterLists | Self::InverseSquareLights => true,
            Self::Frame | Self::ClusterGrid | Self::UniformLights => false,
            Self::LightCounts | Self::VertexLightCounts => false,
        }
    }

    /// Returns true if shaders write it.
    pub fn is_counted_in(self) -> bool {
        matches!(self, Self::LightCounts | Self::VertexLightCounts)
    }

    /// Returns the stages that it is bound for. Counts of vertices are bound apart from those of fragments and of
    /// compute shaders, because a device may support writes in fragments but not in vertices.
    fn visibility(self) -> wgpu::ShaderStages {
        match self {
            Self::LightCounts => wgpu::ShaderStages::FRAGMENT | wgpu::ShaderStages::COMPUTE,
            Self::VertexLightCounts => wgpu::ShaderStages::VERTEX,
            _ => wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
        }
    }

    /// Returns the name of the graph's resource if the buffer holds light.
    pub fn light_resource(self) -> Option<&'static str> {
        match self {
            Self::Frame | Self::Objects | Self::Materials | Self::Instances => None,
            Self::LightCounts | Self::VertexLightCounts => None,
            Self::Lights => Some("lights"),
            Self::LightList => Some("lights of objects"),
            Self::ClusterGrid => Some("cluster grid"),
            Self::ClusterLists => Some("lights of clusters"),
            Self::UniformLights | Self::InverseSquareLights => Some("inverse-square lights"),
        }
    }
}

impl FrameBindings {
    /// Returns the buffers that a variant reads.
    pub fn of(variant: &Variant) -> Self {
        let has = |feature| variant.has(feature);
        let listed = has(Feature::DynamicLights) || has(Feature::StaticLights);
        let inverse_square = has(Feature::InverseSquareClusters);
        let reads = |buffer: &FrameBuffer| match buffer {
            FrameBuffer::Frame | FrameBuffer::Objects | FrameBuffer::Materials | FrameBuffer::Instances => {
                true
            }
            FrameBuffer::Lights => listed || has(Feature::RangedClusters),
            FrameBuffer::LightList => listed,
            FrameBuffer::ClusterGrid | FrameBuffer::ClusterLists => has(Feature::Clusters),
            FrameBuffer::UniformLights => inverse_square && has(Feature::UniformLights),
            FrameBuffer::InverseSquareLights => inverse_square && !has(Feature::UniformLights),
            FrameBuffer::LightCounts => has(Feature::CountLights) && variant.shading == Shading::Phong,
            FrameBuffer::VertexLightCounts => has(Feature::CountLights) && variant.shading != Shading::Phong,
        };
        Self(FrameBuffer::ALL.into_iter().filter(reads).map(|buffer| 1 << buffer.binding()).sum())
    }

    /// Returns the union of both sets.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub fn buffers(self) -> impl Iterator<Item = FrameBuffer> {
        FrameBuffer::ALL.into_iter().filter(move |buffer| self.0 & (1 << buffer.binding()) != 0)
    }

    /// Returns true if lights are counted in one of them. Each pass then needs a bind group with its own
    /// counts.
    pub fn count_lights(self) -> bool {
        self.buffers().any(FrameBuffer::is_counted_in)
    }

    /// Returns the buffers that hold light, each once, with the name of the graph's resource.
    pub fn light_resources(self) -> impl Iterator<Item = (&'static str, FrameBuffer)> {
        let both = [FrameBuffer::UniformLights, FrameBuffer::InverseSquareLights];
        // Both are the same buffer, bound in two ways.
        let last = both.iter().all(|buffer| self.0 & (1 << buffer.binding()) != 0).then_some(both[1]);
        let named = self.buffers().filter(move |buffer| Some(*buffer) != last);
        named.filter_map(|buffer| Some((buffer.light_resource()?, buffer)))
    }

    pub fn layout(self, gpu: &Gpu) -> wgpu::BindGroupLayout {
        let entry = |buffer: FrameBuffer| wgpu::BindGroupLayoutEntry {
            binding: buffer.binding(),
            visibility: buffer.visibility(),
            ty: match buffer.is_table() {
                true => table_binding(gpu.reads_tables_from_textures()),
                false => wgpu::BindingType::Buffer {
                    ty: match buffer.is_uniform() {
                        true => wgpu::BufferBindingType::Uniform,
                        false => wgpu::BufferBindingType::Storage { read_only: !buffer.is_counted_in() },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            },
            count: None,
        };
        let entries: Vec<_> = self.buffers().map(entry).collect();
        gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("frame"),
            entries: &entries,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use lumbre_optics::{ReflectionModel, Shading};

    use super::*;
    use crate::extract::LitPass;
    use crate::g_buffer::{DeferredVariants, GBufferContents};
    use crate::shader::TableAccess;
    use lumbre_shaders::to_wgsl;

    #[test]
    fn a_variant_is_bound_what_it_reads_and_nothing_else() {
        let (mut seen, mut in_compute) = (BTreeSet::new(), false);
        let some: [&[Feature]; 8] = [
            &[],
            &[Feature::DynamicLights, Feature::PointLights],
            &[Feature::StaticLights, Feature::DirectionalLights],
            &[Feature::InverseSquareClusters, Feature::UniformLights],
            &[Feature::InverseSquareClusters],
            &[Feature::RangedClusters, Feature::SpotLights],
            &[Feature::RangedClusters, Feature::SpotLights, Feature::InverseSquareClusters, Feature::Shadows],
            &[Feature::DynamicLights, Feature::PolygonLights, Feature::RangedClusters, Feature::PointLights],
        ];
        for shading in Shading::ALL {
            for lit in some {
                for other in [
                    vec![],
                    vec![Feature::FogLinear, Feature::Fog],
                    vec![Feature::Matt],
                    vec![Feature::CountLights],
                ] {
                    let features: Vec<_> = [Feature::Lit].iter().chain(lit).chain(&other).copied().collect();
                    let mut variant = Variant::new(*shading, ReflectionModel::Blinn);
                    features.iter().for_each(|feature| variant.set(*feature, true));
                    let variant = variant.reduced();
                    let contents = GBufferContents { details: false, lit_in_compute: true };
                    let deferred = DeferredVariants::of(&variant, LitPass::Forward, Some(contents));
                    for variant in [Some(variant), deferred.map(|of| of.lighting)].into_iter().flatten() {
                        let read = read_in_group_0(&variant);
                        let bound = FrameBindings::of(&variant).buffers().map(FrameBuffer::binding);
                        // Deferred lighting reads the places of surfaces from the G-buffer.
                        let bound = bound.filter(|binding| {
                            *binding != FrameBuffer::Objects.binding() || read.contains(binding)
                        });
                        assert_eq!(read, bound.collect(), "{variant}");
                        in_compute |= variant.has(Feature::InCompute);
                        seen.insert(read);
                    }
                }
            }
        }
        assert!(seen.len() >= 12 && in_compute, "{seen:?}");
    }

    /// Returns the bindings of group 0 that the shader of a variant declares.
    fn read_in_group_0(variant: &Variant) -> BTreeSet<u32> {
        let source = to_wgsl(variant.module(), &variant.flags(TableAccess::default())).unwrap();
        let module = naga::front::wgsl::parse_str(&source).unwrap();
        let bindings = module.global_variables.iter().filter_map(|(_, global)| global.binding.as_ref());
        bindings.filter(|binding| binding.group == 0).map(|binding| binding.binding).collect()
    }
}
