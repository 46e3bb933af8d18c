//! The errors of a bake and of its checkpoint. After an error the World is as it was before the bake, except for
//! updated global transforms.

/// Why a bake ended without a result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The progress callback or a [`CancelToken`](crate::CancelToken) cancelled the bake.
    #[error("the bake was cancelled during {stage}; the scene is unchanged")]
    Cancelled {
        /// The stage that was running.
        stage: &'static str,
    },
    /// An option is out of its range.
    #[error("{option} is {found}; give {expected}")]
    Option {
        /// Which option.
        option: &'static str,
        /// What it was.
        found: String,
        /// What it may be.
        expected: &'static str,
    },
    /// A mesh has indices out of range or attributes of unequal length.
    #[error("the mesh of {object}: {source}")]
    Mesh {
        /// The node's name.
        object: String,
        /// What is wrong.
        source: lumbre_mesh::MeshError,
    },
    /// An object's lightmap scale is not a positive finite number.
    #[error(
        "{object}: its lightmap scale is {found}; give a positive finite number, 1 for the density of the scene"
    )]
    LightmapScale {
        /// The node's name.
        object: String,
        /// What it was.
        found: String,
    },
    /// A material's textures use both coordinate sets of the mesh, so that none is free for the lightmap.
    #[error(
        "{object}: the textures of its material use TEXCOORD_0 and TEXCOORD_1, and TEXCOORD_1 overlaps or tiles and so cannot hold a \
         lightmap; let them all use TEXCOORD_0, or give the mesh a TEXCOORD_1 without overlaps"
    )]
    CoordinatesInUse {
        /// The node's name.
        object: String,
    },
    /// A mesh could not be unwrapped.
    #[error("{object} cannot be unwrapped: {source}")]
    Unwrap {
        /// The node's name.
        object: String,
        /// What is wrong.
        source: lumbre_mesh::UnwrapError,
    },
    /// A mesh is unwrapped to more charts than the largest map has room for.
    #[error(
        "{object}: it falls into {charts} charts, which a lightmap of {limit} x {limit} texels does not hold; weld its vertices, split it into \
         several meshes, give it a TEXCOORD_1 of its own, or ask for a smaller gap"
    )]
    TooManyCharts {
        /// The node's name.
        object: String,
        /// Number of charts.
        charts: usize,
        /// Largest side of a map, in texels.
        limit: u32,
    },
    /// The maps together would be larger than a bake allocates.
    #[error(
        "the lightmaps would hold {texels} texels, the limit is {limit}; lower the density or the map size"
    )]
    TooManyTexels {
        /// Texels requested.
        texels: u64,
        /// The limit.
        limit: u64,
    },
    /// The scene has more triangles than the baker's indices can address.
    #[error("the scene holds {triangles} static triangles, the limit is {limit}")]
    TooManyTriangles {
        /// Triangles found.
        triangles: usize,
        /// The limit.
        limit: usize,
    },
    /// Even with the fewest patches and rays the bake would need more memory than
    /// [`BakeOptions::memory`](crate::BakeOptions::memory) allows.
    #[error(
        "the bake would need {} at least, of which {} for {covered} texels, and may take {}; allow more memory, lower the density or the \
         map size, or use fewer triangles", mebibytes(*needed), mebibytes(*texels), mebibytes(*limit)
    )]
    Memory {
        /// Bytes needed.
        needed: u64,
        /// How many of them the texels need.
        texels: u64,
        /// Number of texels that show a surface.
        covered: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The checkpoint cannot be used.
    #[error("the checkpoint {}: {source}", path.display())]
    Checkpoint {
        /// The file.
        path: std::path::PathBuf,
        /// Why not.
        source: CheckpointError,
    },
    /// The worker threads could not be started.
    #[error("worker threads could not be started: {reason}")]
    Threads {
        /// Why not.
        reason: String,
    },
}

/// Why a checkpoint's file cannot be used at all, so that the bake does not start. A checkpoint that is only damaged,
/// or that belongs to another bake, is no error: it is replaced, and a warning says why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file exists and is not a checkpoint.
    #[error("the file is no checkpoint of Lumbre; move it away, or name another")]
    Foreign,
    /// Another process has it open.
    #[error("another bake is using it; wait for its end, or name another output")]
    InUse,
    /// The file cannot be read or written.
    #[error("{reason}; check the folder, its permissions and the space left")]
    Unusable {
        /// The operating system's message.
        reason: String,
    },
}

/// Formats a number of bytes for messages, rounded up to whole MiB.
pub(crate) fn mebibytes(bytes: u64) -> String {
    format!("{:.0} MiB", (bytes as f64 / f64::from(1 << 20)).ceil())
}
