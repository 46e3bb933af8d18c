//! Shaders: the embedded sources, the variants that a frame calls for, and their compilation. Not pipelines: those are `pipelines`.

mod compile;
mod variant;

pub(crate) use compile::compile;
pub(crate) use variant::TABLES_IN_TEXTURES;
pub use variant::{DisplayVariant, Feature, Variant};
