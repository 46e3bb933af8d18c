//! How a pass uses a resource, and which GPU usage follows from that. Which pass uses which resource is in
//! `declaration`.

/// The content of an attachment when its pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadOp<V> {
    /// It is cleared to this value; the previous content is not needed.
    Clear(V),
    /// It keeps its previous content; it is an error if there is none.
    Load,
    /// It keeps what earlier passes of this frame wrote, and is cleared to this value if none of them did. A chain
    /// of passes that each may be skipped therefore needs no extra pass that clears: the first one that runs does
    /// it.
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

/// How a pass writes a texture other than as an attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureWrite {
    /// In a shader, as a storage texture, which may also be read.
    Storage,
    /// As the destination of a copy.
    CopyDestination,
    /// As an attachment of render passes that a transfer pass begins itself.
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
    /// In a shader, as storage, which may also be read.
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

    /// Hashes the exact bits of the value that an attachment is cleared to.
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

    /// A description for messages and explanations.
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

    /// The usage that a texture needs for this access; empty for an access to a buffer.
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

    /// The usage that a buffer needs for this access; empty for an access to a texture.
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
