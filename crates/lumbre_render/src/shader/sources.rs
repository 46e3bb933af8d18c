//! The WESL modules of `shaders/`, embedded so that a program carries them.

macro_rules! modules {
    ($($path:literal),+ $(,)?) => {
        /// Module path and source of every file under `shaders/`.
        pub(crate) const MODULES: &[(&str, &str)] =
            &[$(($path, include_str!(concat!("../../../../shaders/", $path, ".wesl")))),+];
    };
}

modules!(
    "display",
    "forward",
    "frame",
    "light_clusters",
    "lighting",
    "lightmap",
    "material_textures",
    "normal_map",
    "occlusion_map",
    "surface_maps",
    "tone_curve",
    "optics/angle",
    "optics/attenuation",
    "optics/blinn_phong",
    "optics/emission",
    "optics/energy_keeping",
    "optics/evaluate_light",
    "optics/fog",
    "optics/fresnel",
    "optics/half_vector",
    "optics/lambert",
    "optics/microfacet_reflection",
    "optics/microfacets",
    "optics/normal_map",
    "optics/normalization",
    "optics/normalized_highlight",
    "optics/occlusion",
    "optics/phong",
    "optics/polygon_light",
    "optics/power",
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
        let root = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders"));
        let mut found = Vec::new();
        let mut folders = vec![root.to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
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
