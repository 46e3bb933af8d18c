//! glTF 2.0 files: importing one into a World, and exporting a World as one. Baking and drawing are
//! elsewhere.
//!
//! Import validates and decodes the whole file before it changes the World. Export writes every file under a
//! temporary name first, so that a file of the final name is always complete.

mod accessor;
mod accessor_format;
mod beside;
mod buffer_view;
mod compressed;
mod compressed_primitives;
mod compressed_views;
mod container;
mod decoders;
mod document;
mod draco;
mod error;
mod export;
mod export_baked;
mod export_data;
mod export_files;
mod export_light;
mod export_material;
mod export_nodes;
mod export_scene;
mod export_settings;
mod extensions;
mod frame_settings;
mod guarded;
mod hierarchy;
mod import;
mod import_image;
mod import_irradiance_volume;
mod import_light;
mod import_lightmap;
mod import_material;
mod import_medium;
mod import_mesh;
mod import_scene;
mod instancing;
mod lightmapped;
mod limits;
mod meshopt;
mod options;
mod patch;
mod prepared;
mod quadric_extension;
mod quadric_fallback;
mod source;
mod texture_ktx2;
mod texture_sets;
mod uri;
mod value;
mod vertex_data;

pub use error::{LoadError, LoadProblem, Note};
pub use export::{LightmapFile, SaveError, SaveOptions, SaveReport, save, save_with};
pub use export_baked::save_baked;
pub use export_settings::{FileSettings, save_settings};
pub use import::{LoadReport, load, load_slice, load_slice_within, load_with};
pub use limits::LoadLimits;
pub use options::LoadOptions;
pub use source::SourceFile;

/// Extensions that a file may list in `extensionsRequired`.
pub const SUPPORTED_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    #[cfg(feature = "webp")]
    "EXT_texture_webp",
    "KHR_animation_pointer",
    #[cfg(feature = "draco")]
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    #[cfg(feature = "basisu")]
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "LUMBRE_bake",
    "LUMBRE_camera",
    "LUMBRE_irradiance_volume",
    "LUMBRE_lightmap",
    "LUMBRE_lights_phong",
    "LUMBRE_materials_phong",
    "LUMBRE_object",
    "LUMBRE_quadric",
    "LUMBRE_scene",
    "LUMBRE_shading",
];
