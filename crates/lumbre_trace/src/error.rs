//! Errors of the tracer.

use bevy_ecs::entity::Entity;
use lumbre_mesh::MeshError;
use lumbre_optics::MaterialError;
use thiserror::Error;

/// Reasons why a `World` cannot be traced. Every message says what to do about it.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TraceError {
    /// The scene has no camera.
    #[error("the scene has no camera; spawn one, or name one that there is")]
    NoCamera,
    /// The entity given as the camera is not a camera with a transform.
    #[error("{entity} is not a camera with a transform; name one that is")]
    NotACamera {
        /// The entity.
        entity: Entity,
    },
    /// A camera with a parameter out of range, so that it would see nothing.
    #[error("the camera's {field} is {value}; it has to be {wanted}")]
    BadCamera {
        /// The name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The values it can have.
        wanted: &'static str,
    },
    /// The picture has no pixels, or too many.
    #[error("a picture of {width} x {height} pixels cannot be traced; ask for 1 to 32768 along each side")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// An option is out of range.
    #[error("{option} is {value}; it has to be {wanted}")]
    Option {
        /// The name of the option.
        option: &'static str,
        /// Its value.
        value: String,
        /// The values it can have.
        wanted: &'static str,
    },
    /// No light, no emissive object and no other light source has the name given for an auxiliary picture.
    #[error("no light and nothing that shines is called \"{name}\"; there are {known}")]
    NoSuchSource {
        /// The name given.
        name: String,
        /// The names that exist, each in quotes.
        known: String,
    },
    /// A mesh is not valid.
    #[error("the mesh of \"{object}\" cannot be read: {source}")]
    Mesh {
        /// The name of the object.
        object: String,
        /// What is wrong with the mesh.
        source: MeshError,
    },
    /// A material has values that cannot be lit.
    #[error("\"{object}\" cannot be lit: {source}")]
    Material {
        /// The name of the object.
        object: String,
        /// What is wrong with the material.
        source: MaterialError,
    },
    /// An exact surface has no points: its equation is not valid, or its transform flattens it.
    #[error("the exact surface of \"{object}\" has none: {reason}")]
    Quadric {
        /// The name of the object.
        object: String,
        /// What is wrong, and what to do about it.
        reason: String,
    },
    /// There are more triangles than the hierarchy can index.
    #[error("the scene has {triangles} triangles, and 2^29 is the most; leave some out")]
    TooManyTriangles {
        /// The number of triangles.
        triangles: usize,
    },
    /// The samples of an earlier run cannot be continued.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The worker threads cannot be started.
    #[error("the threads cannot be started: {reason}; ask for fewer with --threads")]
    Threads {
        /// The error message of the system.
        reason: String,
    },
}

/// Reasons why the samples of an earlier run cannot be continued.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The data are not a checkpoint.
    #[error("these are no samples of a traced picture")]
    NotSamples,
    /// They come from another version of the program, whose samples may differ.
    #[error("these samples are of another version of the program")]
    Version,
    /// They are truncated or corrupted.
    #[error("these samples are damaged")]
    Damaged,
    /// They belong to another scene.
    #[error("the scene has changed since these samples were taken")]
    Scene,
    /// They belong to another picture of the same scene.
    #[error(
        "these samples are of another picture of the scene: size, camera, depth, shadows, filter, adaptive sampling and auxiliary pictures have to be the same"
    )]
    Options,
}
