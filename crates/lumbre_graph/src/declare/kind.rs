//! Type-level markers: which accesses a resource has, and which methods a pass has.

use crate::access::{Access, BufferRead, BufferWrite, TextureRead, TextureWrite};
use crate::declaration::PassKind;
use crate::handle::{Buffer, Texture};

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Texture {}
    impl Sealed for super::Buffer {}
    impl Sealed for super::Raster {}
    impl Sealed for super::Compute {}
    impl Sealed for super::Transfer {}
}

/// The kind of resource that a handle names: [`Texture`] or [`Buffer`].
pub trait ResourceKind: sealed::Sealed {
    /// How a pass may read it.
    type Read;
    /// How a pass may write it.
    type Write;
    #[doc(hidden)]
    const WORD: &'static str;
    #[doc(hidden)]
    fn read_access(how: Self::Read) -> AnyAccess;
    #[doc(hidden)]
    fn write_access(how: Self::Write) -> AnyAccess;
}

/// An access to either kind of resource, which is made and used inside this crate only.
#[doc(hidden)]
pub struct AnyAccess(pub(crate) Access);

impl ResourceKind for Texture {
    type Read = TextureRead;
    type Write = TextureWrite;
    const WORD: &'static str = "texture";
    fn read_access(how: TextureRead) -> AnyAccess {
        AnyAccess(Access::ReadTexture(how))
    }
    fn write_access(how: TextureWrite) -> AnyAccess {
        AnyAccess(Access::WriteTexture(how))
    }
}

impl ResourceKind for Buffer {
    type Read = BufferRead;
    type Write = BufferWrite;
    const WORD: &'static str = "buffer";
    fn read_access(how: BufferRead) -> AnyAccess {
        AnyAccess(Access::ReadBuffer(how))
    }
    fn write_access(how: BufferWrite) -> AnyAccess {
        AnyAccess(Access::WriteBuffer(how))
    }
}

/// The kinds of pass at type level: [`Raster`], [`Compute`], [`Transfer`].
pub trait PassType: sealed::Sealed {
    /// The same kind as a value.
    const KIND: PassKind;
}

/// A pass that draws.
#[derive(Debug)]
pub enum Raster {}
/// A pass that dispatches.
#[derive(Debug)]
pub enum Compute {}
/// A pass that records onto the command encoder.
#[derive(Debug)]
pub enum Transfer {}

impl PassType for Raster {
    const KIND: PassKind = PassKind::Raster;
}
impl PassType for Compute {
    const KIND: PassKind = PassKind::Compute;
}
impl PassType for Transfer {
    const KIND: PassKind = PassKind::Transfer;
}
