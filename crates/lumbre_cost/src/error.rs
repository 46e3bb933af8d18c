//! Why a report cannot be made, kept or compared.

use std::path::PathBuf;

use lumbre_bake::BakeError;
use lumbre_render::RenderError;
use lumbre_scene::{LightmapFileError, LoadError, SaveError};
use lumbre_trace::TraceError;
use thiserror::Error;

/// Why a report cannot be made, kept or compared. Each says what to do about it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CostError {
    /// Somebody asked it to end. What was finished is kept.
    #[error("interrupted")]
    Interrupted,
    /// A study that there is none of.
    #[error("there is no study `{name}`; there are: {known}")]
    UnknownStudy {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// A file or folder of the report.
    #[error("{}: {source}; check the folder given with -o", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A report that is none.
    #[error("{} is no report of lumbre cost ({source}); give a cost.json, or measure anew", path.display())]
    NotAReport {
        /// Which.
        path: PathBuf,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// The table cannot be written.
    #[error("{} cannot be written: {source}; check the folder given with -o", path.display())]
    Table {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        source: csv::Error,
    },
    /// A picture cannot be written or read.
    #[error("{}: {source}; remove the folder, or measure without --resume", path.display())]
    Picture {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        source: image::ImageError,
    },
    /// A picture that has another size than the one that it is compared with, or none.
    #[error("the pictures of \"{point}\" differ in size; give --size a width and height from 8 to 4096")]
    Sizes {
        /// Which.
        point: String,
    },
    /// A number that is none.
    #[error(
        "\"{point}\" of the study `{study}` holds a value that is not finite; this is a fault of the program, please report it with the scene"
    )]
    NotFinite {
        /// Which study.
        study: String,
        /// Which point.
        point: String,
    },
    /// A plot cannot be drawn.
    #[error("the plot \"{title}\" cannot be drawn: {reason}")]
    Plot {
        /// Which.
        title: String,
        /// What is wrong.
        reason: String,
    },
    /// A scene cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A scene of our own cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// A frame cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A scene cannot be traced.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// A scene cannot be baked.
    #[error(transparent)]
    Bake(BakeError),
    /// A lightmap cannot be kept.
    #[error(transparent)]
    Lightmap(#[from] LightmapFileError),
}

impl From<BakeError> for CostError {
    fn from(error: BakeError) -> Self {
        match error {
            BakeError::Cancelled { .. } => Self::Interrupted,
            error => Self::Bake(error),
        }
    }
}
