//! The texture that a frame is drawn into: any colour texture, of a window or created by the program, or a
//! part of it. Presenting it is not done here.

use crate::RenderError;

/// Format of the depth buffer. Depth is reversed-Z, which needs a float format: 1 at the near plane, 0 at
/// infinity.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A colour texture that a frame is drawn into.
#[derive(Clone, Debug)]
pub struct FrameTarget {
    pub(crate) texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
    pub(crate) format: wgpu::TextureFormat,
    /// Size of the frame: of the viewport if there is one.
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) viewport: Option<Viewport>,
}

/// The part of a target that a frame fills, in texels from the upper left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Column and row of the first texel.
    pub origin: [u32; 2],
    /// Width and height, at least 1.
    pub size: [u32; 2],
    /// What happens to the target around the viewport: cleared to this colour, given as the target stores it,
    /// before the frame is drawn, or kept if `None`.
    pub clear: Option<wgpu::Color>,
}

impl Viewport {
    /// Creates a viewport that leaves the rest of the target as it is, for split screens or a picture in a
    /// user interface.
    pub fn new(origin: [u32; 2], size: [u32; 2]) -> Self {
        Self { origin, size, clear: None }
    }

    /// Clears the rest of the target to a colour first.
    #[must_use]
    pub fn with_clear(self, color: wgpu::Color) -> Self {
        Self { clear: Some(color), ..self }
    }
}

impl FrameTarget {
    /// Creates a target from the first layer and mip level of a texture with RENDER_ATTACHMENT usage.
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
            viewport: None,
            texture: texture.clone(),
        }
    }

    /// Restricts the frame to a part of the texture. Such a frame always has a display pass. Drawing into a
    /// viewport that does not lie within the texture fails with [`RenderError::Viewport`]. Overlays and
    /// effects at [`Stage::Picture`](crate::effects::Stage::Picture) draw over the whole texture.
    #[must_use]
    pub fn with_viewport(self, viewport: Viewport) -> Self {
        let [width, height] = viewport.size;
        Self { width, height, viewport: Some(viewport), ..self }
    }

    /// Returns width divided by height, of the viewport if there is one.
    pub fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Returns width and height of the frame in texels, of the viewport if there is one.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns the texel format.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.format
    }

    /// Checks that the viewport lies within the texture.
    ///
    /// # Errors
    /// [`RenderError::Viewport`].
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let Some(Viewport { origin, size, .. }) = self.viewport else { return Ok(()) };
        let texture = [self.texture.width(), self.texture.height()];
        let within = |axis: usize| {
            size[axis] > 0 && origin[axis].checked_add(size[axis]).is_some_and(|end| end <= texture[axis])
        };
        match within(0) && within(1) {
            true => Ok(()),
            false => Err(RenderError::Viewport { origin, size, texture }),
        }
    }
}
