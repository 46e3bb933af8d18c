//! The context of a running pass: its wgpu pass or encoder, and only the resources that it declared.

use crate::handle::{BufferHandle, TextureHandle};
use crate::run::error::RunError;
use crate::run::record::FrameResources;

/// The result of a pass's function: nothing or any error, which becomes the frame's [`RunError::Pass`] with the
/// pass's name.
pub type BodyResult = Result<(), BodyError>;

/// Any error of a pass.
pub type BodyError = Box<dyn std::error::Error + Send + Sync>;

type RasterBody<'a, User> = Box<dyn FnOnce(&mut RasterContext<'_, User>) -> BodyResult + 'a>;
type ComputeBody<'a, User> = Box<dyn FnOnce(&mut ComputeContext<'_, User>) -> BodyResult + 'a>;
type TransferBody<'a, User> = Box<dyn FnOnce(&mut TransferContext<'_, User>) -> BodyResult + 'a>;

/// The function that a pass runs.
pub(crate) enum Body<'a, User> {
    Raster(RasterBody<'a, User>),
    Compute(ComputeBody<'a, User>),
    Transfer(TransferBody<'a, User>),
}

/// Context of a pass that draws. Its fields are separate so that they can be borrowed separately.
pub struct RasterContext<'a, User = ()> {
    /// The wgpu render pass. Merged passes share one, so set all the state that you rely on.
    pub pass: &'a mut wgpu::RenderPass<'static>,
    /// Device, queue and the declared resources.
    pub resources: PassResources<'a>,
    /// The state that the caller lent to [`Executor::execute_with`](crate::Executor::execute_with).
    pub user: &'a mut User,
}

/// Context of a pass that dispatches.
pub struct ComputeContext<'a, User = ()> {
    /// The wgpu compute pass.
    pub pass: &'a mut wgpu::ComputePass<'static>,
    /// Device, queue and the declared resources.
    pub resources: PassResources<'a>,
    /// The state that the caller lent to [`Executor::execute_with`](crate::Executor::execute_with).
    pub user: &'a mut User,
}

/// Context of a pass that records onto the encoder.
pub struct TransferContext<'a, User = ()> {
    /// The frame's command encoder.
    pub encoder: &'a mut wgpu::CommandEncoder,
    /// Device, queue and the declared resources.
    pub resources: PassResources<'a>,
    /// The state that the caller lent to [`Executor::execute_with`](crate::Executor::execute_with).
    pub user: &'a mut User,
}

/// The resources that a pass declared. Access to any other fails with [`RunError::Undeclared`].
#[derive(Clone, Copy)]
pub struct PassResources<'a> {
    /// The device, for bind groups and pipelines.
    pub device: &'a wgpu::Device,
    /// The queue. Data written through it arrives before any pass of this frame runs.
    pub queue: &'a wgpu::Queue,
    pub(crate) frame: &'a FrameResources<'a>,
    pub(crate) graph: u64,
    pub(crate) pass: usize,
}

impl<'a> PassResources<'a> {
    /// Returns the view of a declared texture: of the declared part, or of all mip levels and layers.
    ///
    /// # Errors
    /// [`RunError::Undeclared`], or [`RunError::Absent`] for an optional read of a texture that no pass wrote.
    pub fn view(&self, handle: &TextureHandle) -> Result<&'a wgpu::TextureView, RunError> {
        self.frame.view(self, handle)
    }

    /// The same as [`view`](Self::view), but `None` for an optional read of a texture that no pass wrote.
    ///
    /// # Errors
    /// [`RunError::Undeclared`].
    pub fn optional_view(&self, handle: &TextureHandle) -> Result<Option<&'a wgpu::TextureView>, RunError> {
        or_absent(self.view(handle))
    }

    /// Returns the texture itself, for copies and custom views.
    ///
    /// # Errors
    /// As [`view`](Self::view).
    pub fn texture(&self, handle: &TextureHandle) -> Result<&'a wgpu::Texture, RunError> {
        self.frame.texture(self, handle)
    }

    /// Returns a declared buffer.
    ///
    /// # Errors
    /// As [`view`](Self::view).
    pub fn buffer(&self, handle: &BufferHandle) -> Result<&'a wgpu::Buffer, RunError> {
        self.frame.buffer(self, handle)
    }

    /// The same as [`buffer`](Self::buffer), but `None` for an optional read of a buffer that no pass wrote.
    ///
    /// # Errors
    /// [`RunError::Undeclared`].
    pub fn optional_buffer(&self, handle: &BufferHandle) -> Result<Option<&'a wgpu::Buffer>, RunError> {
        or_absent(self.buffer(handle))
    }
}

fn or_absent<T>(answer: Result<T, RunError>) -> Result<Option<T>, RunError> {
    match answer {
        Ok(found) => Ok(Some(found)),
        Err(RunError::Absent { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}
