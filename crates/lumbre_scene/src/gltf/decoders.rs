//! Decoders that a program can be built without: the extension that needs each, and what to do where it is missing. Not the decoders.

/// A decoder that is a cargo feature of this crate.
pub(crate) struct OptionalDecoder {
    /// The extension that it reads.
    pub extension: &'static str,
    /// The cargo feature.
    pub feature: &'static str,
    /// A command that writes a file without the extension.
    pub remedy: &'static str,
    /// Whether it is there.
    pub built: bool,
}

/// All of them.
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

/// The decoder of an extension, if it was left out of this program.
pub(crate) fn missing(extension: &str) -> Option<&'static OptionalDecoder> {
    OPTIONAL_DECODERS.iter().find(|decoder| decoder.extension == extension && !decoder.built)
}
