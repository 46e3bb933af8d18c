//! Shaders: the variants that a frame needs, and their compilation from the embedded sources. Pipelines are
//! created in `pipelines`.

mod compile;
mod variant;

pub(crate) use compile::compile;
pub use variant::{DisplayVariant, Feature, Variant};
pub(crate) use variant::{TABLES_IN_TEXTURES, TableAccess};
