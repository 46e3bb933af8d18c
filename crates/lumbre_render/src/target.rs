//! Where a frame goes: any colour texture, a window's or our own. Not how it is shown.

/// Format of the depth buffer: reversed-Z wants floats. 1 is at the near plane, 0 at infinity.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A colour texture that a frame ends in.
#[derive(Clone, Debug)]
pub struct FrameTarget {
    pub(crate) texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl FrameTarget {
    /// The first layer and mip level of a texture with RENDER_ATTACHMENT usage.
    pub fn from_texture(texture: &wgpu::Texture) -> Self {
        Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                mip_level_count: Some(1),
                array_layer_count: Some(1),
                ..Default::default()
            }),
            format: texture.format(),
            width: texture.width(),
            height: texture.height(),
            texture: texture.clone(),
        }
    }

    /// Width divided by height.
    pub fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Texel format.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.format
    }
}
