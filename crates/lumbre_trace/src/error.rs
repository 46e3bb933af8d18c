//! Why a World cannot be traced.

use bevy_ecs::entity::Entity;
use lumbre_mesh::MeshError;
use lumbre_optics::MaterialError;
use thiserror::Error;

/// Why a World cannot be traced. Each says what to do about it.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TraceError {
    /// There is no camera.
    #[error("the scene has no camera; spawn one, or name one that there is")]
    NoCamera,
    /// The entity asked for is no camera.
    #[error("{entity} is not a camera with a transform; name one that is")]
    NotACamera {
        /// The entity.
        entity: Entity,
    },
    /// A camera that sees nothing.
    #[error("the camera's {field} is {value}; it has to be {wanted}")]
    BadCamera {
        /// The field.
        field: &'static str,
        /// What it is.
        value: f64,
        /// What it has to be.
        wanted: &'static str,
    },
    /// A picture without pixels, or with too many.
    #[error("a picture of {width} x {height} pixels cannot be traced; ask for 1 to 32768 along each side")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// An option that makes no sense.
    #[error("{option} is {value}; it has to be {wanted}")]
    Option {
        /// Its name.
        option: &'static str,
        /// What it is.
        value: String,
        /// What it has to be.
        wanted: &'static str,
    },
    /// No light, no shining object and no other source has that name.
    #[error("no light and nothing that shines is called \"{name}\"; there are {known}")]
    NoSuchSource {
        /// The name.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A mesh that is none.
    #[error("the mesh of \"{object}\" cannot be read: {source}")]
    Mesh {
        /// The object.
        object: String,
        /// What is wrong.
        source: MeshError,
    },
    /// A material that nothing can be lit with.
    #[error("\"{object}\" cannot be lit: {source}")]
    Material {
        /// The object.
        object: String,
        /// What is wrong.
        source: MaterialError,
    },
    /// A surface by an equation that has no points.
    #[error("the exact surface of \"{object}\" has none: {reason}")]
    Quadric {
        /// The object.
        object: String,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// More triangles than there are numbers for.
    #[error("the scene has {triangles} triangles, and 2^29 is the most; leave some out")]
    TooManyTriangles {
        /// How many there are.
        triangles: usize,
    },
    /// Samples that cannot be gone on from.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The threads cannot be had.
    #[error("the threads cannot be started: {reason}; ask for fewer with --threads")]
    Threads {
        /// What the system says.
        reason: String,
    },
}

/// Why samples that were kept cannot be gone on from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Something else.
    #[error("these are no samples of a traced picture")]
    NotSamples,
    /// Of another version of the program, which may take others.
    #[error("these samples are of another version of the program")]
    Version,
    /// Cut short, or changed.
    #[error("these samples are damaged")]
    Damaged,
    /// Of another scene.
    #[error("the scene has changed since these samples were taken")]
    Scene,
    /// Of another picture of the scene.
    #[error(
        "these samples are of another picture of the scene: size, camera, depth, shadows, filter, adaptive sampling and auxiliary pictures have to be the same"
    )]
    Options,
}
