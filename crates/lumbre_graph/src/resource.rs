//! What a resource is: its shape, where it comes from, and its size in bytes. The GPU objects are made by the
//! executor.

use std::borrow::Cow;

use crate::site::Site;

/// A name of a pass or a resource. A literal costs no allocation.
pub type Label = Cow<'static, str>;

/// The shape of a texture. The graph infers its usage from the passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureDescriptor {
    /// Width and height in texels; the depth in texels of a 3D texture, otherwise the number of array layers.
    pub size: wgpu::Extent3d,
    /// Texel format.
    pub format: wgpu::TextureFormat,
    /// Samples per texel: 1, or 2, 4, 8, 16 for a multisampled texture.
    pub sample_count: u32,
    /// Number of mip levels, at least 1.
    pub mip_level_count: u32,
    /// 2D (also arrays and cubes) or 3D.
    pub dimension: wgpu::TextureDimension,
    /// For a texture that the graph creates: usages to allow in addition to the inferred ones. For an imported
    /// texture: the usages that it was created with, against which the passes are checked; empty means that they
    /// are unknown until it is bound.
    pub usage: wgpu::TextureUsages,
}

impl TextureDescriptor {
    /// Creates the shape of a 2D texture with one layer, one mip level and one sample.
    #[must_use]
    pub fn new_2d(width: u32, height: u32, format: wgpu::TextureFormat) -> Self {
        Self {
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            format,
            sample_count: 1,
            mip_level_count: 1,
            dimension: wgpu::TextureDimension::D2,
            usage: wgpu::TextureUsages::empty(),
        }
    }

    /// The same with this many samples per texel.
    #[must_use]
    pub fn samples(mut self, count: u32) -> Self {
        self.sample_count = count;
        self
    }

    /// The same with this many mip levels.
    #[must_use]
    pub fn mips(mut self, count: u32) -> Self {
        self.mip_level_count = count;
        self
    }

    /// The same with this many array layers.
    #[must_use]
    pub fn layers(mut self, count: u32) -> Self {
        self.size.depth_or_array_layers = count;
        self
    }

    /// The same with these usages in addition to the inferred ones (or, if imported, as the only known ones).
    #[must_use]
    pub fn usage(mut self, usage: wgpu::TextureUsages) -> Self {
        self.usage = usage;
        self
    }

    /// Returns the size in bytes of all mip levels, layers and samples, without the driver's padding.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (0..self.mip_level_count.min(32)).fold(0_u64, |sum, level| {
            let texels = self.format.theoretical_memory_footprint(self.mip_size(level));
            sum.saturating_add(texels.saturating_mul(u64::from(self.sample_count)))
        })
    }

    /// Returns the size of one mip level. Array layers are kept, while the depth of a 3D texture shrinks.
    #[must_use]
    pub fn mip_size(&self, level: u32) -> wgpu::Extent3d {
        let shrink = |length: u32| length.checked_shr(level).unwrap_or(0).max(1);
        wgpu::Extent3d {
            width: shrink(self.size.width),
            height: shrink(self.size.height),
            depth_or_array_layers: match self.dimension {
                wgpu::TextureDimension::D3 => shrink(self.size.depth_or_array_layers),
                _ => self.size.depth_or_array_layers,
            },
        }
    }

    /// Returns the number of array layers (1 for a 3D texture).
    #[must_use]
    pub fn layer_count(&self) -> u32 {
        if self.dimension == wgpu::TextureDimension::D3 { 1 } else { self.size.depth_or_array_layers }
    }

    /// Returns true if a texture of this shape can hold NaN or Inf and the probe can read it.
    pub(crate) fn can_be_probed(&self) -> bool {
        use wgpu::TextureFormat as Format;
        let float = matches!(
            self.format,
            Format::R16Float
                | Format::Rg16Float
                | Format::Rgba16Float
                | Format::R32Float
                | Format::Rg32Float
                | Format::Rgba32Float
                | Format::Rg11b10Ufloat
        );
        float && self.dimension == wgpu::TextureDimension::D2
    }

    /// Returns true if the texture has a single part, so that clearing it as an attachment overwrites all of it.
    pub(crate) fn is_one_part(&self) -> bool {
        self.mip_level_count == 1 && self.size.depth_or_array_layers == 1
    }
}

/// The shape of a buffer. The graph infers its usage from the passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferDescriptor {
    /// Size in bytes, a multiple of 4.
    pub size: u64,
    /// As [`TextureDescriptor::usage`].
    pub usage: wgpu::BufferUsages,
}

impl BufferDescriptor {
    /// A buffer of `size` bytes (a multiple of 4).
    #[must_use]
    pub fn new(size: u64) -> Self {
        Self { size, usage: wgpu::BufferUsages::empty() }
    }

    /// The same with these usages in addition to the inferred ones (or, if imported, as the only known ones).
    #[must_use]
    pub fn usage(mut self, usage: wgpu::BufferUsages) -> Self {
        self.usage = usage;
        self
    }
}

/// Where a resource comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The pool provides it for part of one frame, and its memory serves other resources during the rest.
    Transient,
    /// The executor keeps it from frame to frame under its name.
    Retained,
    /// The caller binds it when the graph runs.
    Imported,
}

/// The shape of a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    /// A texture.
    Texture(TextureDescriptor),
    /// A buffer.
    Buffer(BufferDescriptor),
}

impl Shape {
    /// Returns true if a resource created with this shape can serve as `asked`: everything is equal and it has at
    /// least those usages.
    pub(crate) fn serves(&self, asked: &Self) -> bool {
        let usages = match (self, asked) {
            (Self::Texture(made), Self::Texture(asked)) => made.usage.contains(asked.usage),
            (Self::Buffer(made), Self::Buffer(asked)) => made.usage.contains(asked.usage),
            _ => false,
        };
        usages && self.without_usage() == asked.without_usage()
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Texture(texture) => texture.bytes(),
            Self::Buffer(buffer) => buffer.size,
        }
    }

    pub(crate) fn texture(&self) -> Option<&TextureDescriptor> {
        match self {
            Self::Texture(texture) => Some(texture),
            Self::Buffer(_) => None,
        }
    }

    /// The shape without its usages: resources for which it is equal can share memory.
    pub(crate) fn without_usage(&self) -> Self {
        match *self {
            Self::Texture(texture) => Self::Texture(texture.usage(wgpu::TextureUsages::empty())),
            Self::Buffer(buffer) => Self::Buffer(buffer.usage(wgpu::BufferUsages::empty())),
        }
    }
}

/// A declared resource.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ResourceDeclaration {
    pub name: Label,
    pub shape: Shape,
    pub origin: Origin,
    /// The pass that makes version `i + 1`.
    pub writers: Vec<usize>,
    pub exported: Option<u32>,
    /// Fingerprint of an imported resource's content, see `Graph::fingerprint`.
    pub fingerprint: Option<u64>,
    pub site: Site,
}

/// Formats usages without the type's name: `COPY_SRC | COPY_DST`.
pub(crate) fn flags(usage: &impl std::fmt::Debug) -> String {
    let text = format!("{usage:?}");
    match text.split_once('(') {
        Some((_, inner)) => inner.trim_end_matches(')').into(),
        None => text,
    }
}
