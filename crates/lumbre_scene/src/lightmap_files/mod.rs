//! Files of baked light: OpenEXR and KTX2 lightmaps, and KTX2 irradiance volumes. The glTF files that refer
//! to them and the baking are elsewhere.
//!
//! ```text
//!   LightmapImage ──► open_exr ─────────────────────────────────────► .exr   half or float, ZIP; the master
//!                └──► packed_format ──► ktx2_writer ──► zstandard ──► .ktx2  RGB9E5 or B10G11R11, for Bevy
//!   IrradianceVolume ─┘      ▲                              │
//!                            └──── ktx2_reader ◄────────────┘
//! ```
//!
//! Every encoder returns its error as an [`EncodingError`]. Numbers are little-endian, and rows go from top
//! to bottom.

mod data_format_descriptor;
mod encoding_error;
mod encoding_range;
mod irradiance_volume;
pub(crate) mod ktx2;
mod ktx2_reader;
mod ktx2_writer;
mod lightmap;
mod open_exr;
mod packed_format;
mod shared_exponent;
mod unsigned_float;
pub(crate) mod zstandard;

pub use encoding_error::EncodingError;
pub use irradiance_volume::{AmbientCube, IrradianceVolume};
pub use ktx2::{Ktx2Error, Ktx2Texture, Supercompression};
pub(crate) use ktx2_reader::Header as Ktx2Header;
pub use lightmap::{LightmapFileError, lightmap_to_ktx2, lightmap_to_open_exr};
pub use packed_format::PackedFormat;
