//! Why a bake ends without a result. The world is then as it was.

/// Why a bake ends without a result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The progress callback asked for the end.
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
    /// An object's share of texels is no number to multiply by.
    #[error(
        "{object}: its lightmap scale is {found}; give a positive finite number, 1 for the density of the scene"
    )]
    LightmapScale {
        /// The node's name.
        object: String,
        /// What it was.
        found: String,
    },
    /// A material reads the coordinates that the lightmap would have to replace.
    #[error(
        "{object}: the textures of its material use TEXCOORD_0 and TEXCOORD_1, and TEXCOORD_1 overlaps or tiles and so cannot hold a \
         lightmap; let them all use TEXCOORD_0, or give the mesh a TEXCOORD_1 without overlaps"
    )]
    CoordinatesInUse {
        /// The node's name.
        object: String,
    },
    /// A mesh got no lightmap coordinates.
    #[error("{object} cannot be unwrapped: {source}")]
    Unwrap {
        /// The node's name.
        object: String,
        /// What is wrong.
        source: lumbre_mesh::UnwrapError,
    },
    /// A mesh falls into more charts than the largest map has room for.
    #[error(
        "{object}: it falls into {charts} charts, which a lightmap of {limit} x {limit} texels does not hold; weld its vertices, split it into \
         several meshes, give it a TEXCOORD_1 of its own, or ask for a smaller gap"
    )]
    TooManyCharts {
        /// The node's name.
        object: String,
        /// Pieces that an unwrap makes of it.
        charts: usize,
        /// Largest side of a map, in texels.
        limit: u32,
    },
    /// The maps together would be larger than a bake allocates.
    #[error(
        "the lightmaps would hold {texels} texels, the limit is {limit}; lower the density or the map size"
    )]
    TooManyTexels {
        /// Texels asked for.
        texels: u64,
        /// The limit.
        limit: u64,
    },
    /// More triangles than indices can name.
    #[error("the scene holds {triangles} static triangles, the limit is {limit}")]
    TooManyTriangles {
        /// Triangles found.
        triangles: usize,
        /// The limit.
        limit: usize,
    },
    /// Even the fewest patches and rays would need more memory than is allowed.
    #[error(
        "the bake would need {} at least, of which {} for {covered} texels, and may take {}; allow more memory, lower the density or the \
         map size, or use fewer triangles", mebibytes(*needed), mebibytes(*texels), mebibytes(*limit)
    )]
    Memory {
        /// Bytes needed.
        needed: u64,
        /// Bytes of these that the texels need.
        texels: u64,
        /// Texels that show a surface.
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
        /// What the system says.
        reason: String,
    },
}

/// Why a checkpoint cannot be used at all: the bake does not begin. One that is merely damaged or of another bake is replaced, with a
/// warning that says why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Something else has the name.
    #[error("the file is no checkpoint of Lumbre; move it away, or name another")]
    Foreign,
    /// Another process has it open.
    #[error("another bake is using it; wait for its end, or name another output")]
    InUse,
    /// It cannot be read or written.
    #[error("{reason}; check the folder, its permissions and the space left")]
    Unusable {
        /// What the system says.
        reason: String,
    },
}

/// Bytes for people.
pub(crate) fn mebibytes(bytes: u64) -> String {
    format!("{:.0} MiB", (bytes as f64 / f64::from(1 << 20)).ceil())
}
