//! How a pass uses a resource, and which GPU usage follows from it. Not who uses it: see `declare::declaration`.

/// What an attachment holds when its pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadOp<V> {
    /// This value everywhere; what was there before is not needed.
    Clear(V),
    /// What was there before; an error if nothing was.
    Load,
    /// What the passes of this frame wrote before; this value if none of them did. So a chain of passes that each may
    /// be skipped needs no pass that clears: whichever runs first does.
    ClearIfFirst(V),
}

/// One image of a texture: a mip level of an array layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
pub struct Part {
    /// Mip level, 0 the largest.
    pub mip: u32,
    /// Array layer, or face of a cube.
    pub layer: u32,
}

impl Part {
    /// The first mip level of `layer`.
    #[must_use]
    pub fn layer(layer: u32) -> Self {
        Self { mip: 0, layer }
    }

    /// Mip level `mip` of the first layer.
    #[must_use]
    pub fn mip(mip: u32) -> Self {
        Self { mip, layer: 0 }
    }
}

/// How a pass reads a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureRead {
    /// In a shader, sampled or fetched.
    Sampled,
    /// In a shader, as a read-only storage texture.
    Storage,
    /// As the source of a copy.
    CopySource,
}

/// How a pass writes a texture otherwise than as an attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureWrite {
    /// In a shader, as a storage texture, perhaps reading it too.
    Storage,
    /// As the destination of a copy.
    CopyDestination,
    /// As attachment of render passes that a transfer pass begins by itself.
    Attachment,
}

/// How a pass reads a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BufferRead {
    /// In a shader, as a uniform.
    Uniform,
    /// In a shader, as read-only storage.
    Storage,
    /// As vertices or instances.
    Vertex,
    /// As indices.
    Index,
    /// As arguments of an indirect draw or dispatch.
    Indirect,
    /// As the source of a copy.
    CopySource,
}

/// How a pass writes a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BufferWrite {
    /// In a shader, as storage, perhaps reading it too.
    Storage,
    /// As the destination of a copy.
    CopyDestination,
}

/// Any way in which a pass uses a resource.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Access {
    Color(LoadOp<wgpu::Color>),
    /// Resolve target of the pass's colour attachment number `of`.
    Resolve {
        of: usize,
    },
    Depth(LoadOp<f32>),
    DepthReadOnly,
    ReadTexture(TextureRead),
    WriteTexture(TextureWrite),
    ReadBuffer(BufferRead),
    WriteBuffer(BufferWrite),
}

impl Access {
    pub fn writes(&self) -> bool {
        !matches!(self, Self::DepthReadOnly | Self::ReadTexture(_) | Self::ReadBuffer(_))
    }

    pub fn is_attachment(&self) -> bool {
        matches!(self, Self::Color(_) | Self::Resolve { .. } | Self::Depth(_) | Self::DepthReadOnly)
    }

    /// Adds the value that an attachment is cleared to, bit by bit.
    pub fn hash_clear(&self, hasher: &mut impl std::hash::Hasher) {
        match self {
            Self::Color(LoadOp::Clear(color) | LoadOp::ClearIfFirst(color)) => {
                for channel in [color.r, color.g, color.b, color.a] {
                    hasher.write_u64(channel.to_bits());
                }
            }
            Self::Depth(LoadOp::Clear(depth) | LoadOp::ClearIfFirst(depth)) => {
                hasher.write_u32(depth.to_bits());
            }
            _ => {}
        }
    }

    pub fn is_copy(&self) -> bool {
        matches!(
            self,
            Self::ReadTexture(TextureRead::CopySource)
                | Self::WriteTexture(TextureWrite::CopyDestination)
                | Self::ReadBuffer(BufferRead::CopySource)
                | Self::WriteBuffer(BufferWrite::CopyDestination)
        )
    }

    pub fn is_own_attachment(&self) -> bool {
        matches!(self, Self::WriteTexture(TextureWrite::Attachment))
    }

    /// For messages and explanations.
    pub fn describe(&self) -> &'static str {
        match self {
            Self::Color(LoadOp::Clear(_)) => "colour attachment (clear)",
            Self::Color(LoadOp::Load) => "colour attachment (load)",
            Self::Color(LoadOp::ClearIfFirst(_)) => "colour attachment (clear if first)",
            Self::Resolve { .. } => "resolve target",
            Self::Depth(LoadOp::Clear(_)) => "depth attachment (clear)",
            Self::Depth(LoadOp::Load) => "depth attachment (load)",
            Self::Depth(LoadOp::ClearIfFirst(_)) => "depth attachment (clear if first)",
            Self::DepthReadOnly => "depth attachment (read only)",
            Self::ReadTexture(TextureRead::Sampled) => "sampled texture",
            Self::ReadTexture(TextureRead::Storage) => "storage texture (read)",
            Self::ReadTexture(TextureRead::CopySource) => "copy source",
            Self::WriteTexture(TextureWrite::Storage) => "storage texture (write)",
            Self::WriteTexture(TextureWrite::CopyDestination) => "copy destination",
            Self::WriteTexture(TextureWrite::Attachment) => "attachment of own render passes",
            Self::ReadBuffer(BufferRead::Uniform) => "uniform buffer",
            Self::ReadBuffer(BufferRead::Storage) => "storage buffer (read)",
            Self::ReadBuffer(BufferRead::Vertex) => "vertex buffer",
            Self::ReadBuffer(BufferRead::Index) => "index buffer",
            Self::ReadBuffer(BufferRead::Indirect) => "indirect buffer",
            Self::ReadBuffer(BufferRead::CopySource) => "copy source",
            Self::WriteBuffer(BufferWrite::Storage) => "storage buffer (write)",
            Self::WriteBuffer(BufferWrite::CopyDestination) => "copy destination",
        }
    }

    /// Usage that a texture needs for this; empty for a buffer's access.
    pub fn texture_usage(&self) -> wgpu::TextureUsages {
        use wgpu::TextureUsages as Usage;
        match self {
            Self::Color(_)
            | Self::Resolve { .. }
            | Self::Depth(_)
            | Self::DepthReadOnly
            | Self::WriteTexture(TextureWrite::Attachment) => Usage::RENDER_ATTACHMENT,
            Self::ReadTexture(TextureRead::Sampled) => Usage::TEXTURE_BINDING,
            Self::ReadTexture(TextureRead::Storage) | Self::WriteTexture(TextureWrite::Storage) => {
                Usage::STORAGE_BINDING
            }
            Self::ReadTexture(TextureRead::CopySource) => Usage::COPY_SRC,
            Self::WriteTexture(TextureWrite::CopyDestination) => Usage::COPY_DST,
            Self::ReadBuffer(_) | Self::WriteBuffer(_) => Usage::empty(),
        }
    }

    /// Usage that a buffer needs for this; empty for a texture's access.
    pub fn buffer_usage(&self) -> wgpu::BufferUsages {
        use wgpu::BufferUsages as Usage;
        match self {
            Self::ReadBuffer(BufferRead::Uniform) => Usage::UNIFORM,
            Self::ReadBuffer(BufferRead::Storage) | Self::WriteBuffer(BufferWrite::Storage) => Usage::STORAGE,
            Self::ReadBuffer(BufferRead::Vertex) => Usage::VERTEX,
            Self::ReadBuffer(BufferRead::Index) => Usage::INDEX,
            Self::ReadBuffer(BufferRead::Indirect) => Usage::INDIRECT,
            Self::ReadBuffer(BufferRead::CopySource) => Usage::COPY_SRC,
            Self::WriteBuffer(BufferWrite::CopyDestination) => Usage::COPY_DST,
            _ => Usage::empty(),
        }
    }
}
