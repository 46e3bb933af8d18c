//! The shaders of Lumbre: embedded WESL modules, and their compilation to WGSL. Features are chosen by the
//! caller; nothing here depends on a device.
//!
//! ```text
//!   g_buffer, deferred_lighting, deferred_composite              deferred shading of the same surfaces
//!      ▼
//!   forward ──► lighting, light_clusters, lightmap, textures …   the passes of lumbre_render
//!      │           └──► optics/…                                 the equations; f64 twins in lumbre_optics
//!      ▼
//!   display ──► display_color ──► tone_curve
//! ```
//!
//! ```
//! use lumbre_shaders::{Kept, MODULES, Program, UnnamedFeatures};
//!
//! let modules: Vec<_> = MODULES.iter().map(|(path, source)| (*path, (*source).into())).collect();
//! let unnamed = UnnamedFeatures::AreOff;
//! let program =
//!     Program { modules: &modules, root: "optics/lambert", features: &[], unnamed, kept: Kept::RootModule };
//! let wgsl = program.to_wgsl().unwrap();
//! assert!(wgsl.contains("fn lambert(normal: vec3<f32>, light: vec3<f32>) -> f32"), "{wgsl}");
//! ```

mod program;

pub use program::{Kept, Program, UnnamedFeatures, WeslError, to_wgsl};

macro_rules! modules {
    ($($path:literal),+ $(,)?) => {
        /// The path of each module, without `package::` and with slashes, and its source.
        pub const MODULES: &[(&str, &str)] = &[$(($path, include_str!(concat!($path, ".wesl")))),+];
    };
}

modules!(
    "deferred_composite",
    "deferred_lighting",
    "depth_plane",
    "display",
    "display_color",
    "forward",
    "frame",
    "g_buffer",
    "irradiance_volume",
    "light_clusters",
    "light_counts",
    "lighting",
    "lightmap",
    "material_textures",
    "mirror",
    "normal_map",
    "occlusion_map",
    "octahedral",
    "refraction",
    "shadow_caster",
    "shadow_planes",
    "shadows",
    "shared_records",
    "shared_records_probe",
    "surface_bits",
    "surface_maps",
    "tone_curve",
    "optics/ambient_cube",
    "optics/angle",
    "optics/attenuation",
    "optics/blinn_phong",
    "optics/emission",
    "optics/energy_conserving",
    "optics/evaluate_light",
    "optics/fog",
    "optics/fresnel",
    "optics/half_vector",
    "optics/lambert",
    "optics/metal_reflectance",
    "optics/microfacet_reflection",
    "optics/microfacets",
    "optics/normal_map",
    "optics/normalization",
    "optics/normalized_highlight",
    "optics/occlusion",
    "optics/phong",
    "optics/polygon_light",
    "optics/power",
    "optics/probe_grid",
    "optics/roughness",
    "optics/shade",
    "optics/snell",
    "optics/specular_antialiasing",
    "optics/spot",
    "optics/torrance_sparrow",
    "optics/two_sided",
    "optics/viewer",
);

#[cfg(test)]
mod tests {
    use super::MODULES;

    #[test]
    fn every_shader_file_is_embedded() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut found = Vec::new();
        let mut folders = vec![root.to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "wesl") {
                    let relative = path.strip_prefix(root).unwrap().with_extension("");
                    found.push(relative.to_string_lossy().replace('\\', "/"));
                }
            }
        }
        found.sort();
        let mut embedded: Vec<_> = MODULES.iter().map(|(path, _)| (*path).to_owned()).collect();
        embedded.sort();
        assert_eq!(found, embedded);
    }
}
