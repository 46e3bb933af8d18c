//! The decoders that can be left out of a build: the extension that each one reads, and the remedy if it is
//! missing.

/// A decoder that is enabled by a cargo feature of this crate.
pub(crate) struct OptionalDecoder {
    /// Name of the extension that it reads.
    pub extension: &'static str,
    /// The cargo feature.
    pub feature: &'static str,
    /// A command that converts a file to one without the extension.
    pub remedy: &'static str,
    /// Whether it is compiled in.
    pub built: bool,
}

/// All optional decoders.
pub(crate) const OPTIONAL_DECODERS: [OptionalDecoder; 3] = [
    OptionalDecoder {
        extension: "KHR_draco_mesh_compression",
        feature: "draco",
        remedy: "npx @gltf-transform/cli copy IN.glb OUT.glb",
        built: cfg!(feature = "draco"),
    },
    OptionalDecoder {
        extension: "KHR_texture_basisu",
        feature: "basisu",
        remedy: "npx @gltf-transform/cli ktxdecompress IN.glb OUT.glb (it needs the KTX-Software of Khronos)",
        built: cfg!(feature = "basisu"),
    },
    OptionalDecoder {
        extension: "EXT_texture_webp",
        feature: "webp",
        remedy: "npx @gltf-transform/cli png --formats '*' IN.glb OUT.glb",
        built: cfg!(feature = "webp"),
    },
];

/// The decoder of an extension, if it is optional and not compiled in.
pub(crate) fn missing(extension: &str) -> Option<&'static OptionalDecoder> {
    OPTIONAL_DECODERS.iter().find(|decoder| decoder.extension == extension && !decoder.built)
}
