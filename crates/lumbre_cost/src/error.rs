//! Errors of making, writing, reading and comparing reports.

use std::path::PathBuf;

use lumbre_bake::BakeError;
use lumbre_render::RenderError;
use lumbre_scene::{LightmapFileError, LoadError, SaveError};
use lumbre_trace::TraceError;
use thiserror::Error;

/// Reasons why a report cannot be made, written, read or compared. Each message says what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CostError {
    /// The listener asked to stop. Finished studies are kept.
    #[error("interrupted")]
    Interrupted,
    /// There is no study with this name.
    #[error("there is no study `{name}`; there are: {known}")]
    UnknownStudy {
        /// The name.
        name: String,
        /// The names of all studies.
        known: String,
    },
    /// A file or folder of the report cannot be read or written.
    #[error("{}: {source}; check the folder given with -o", path.display())]
    File {
        /// Its path.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file is not a report.
    #[error("{} is no report of lumbre cost ({source}); give a cost.json, or measure anew", path.display())]
    NotAReport {
        /// Its path.
        path: PathBuf,
        /// The error of the JSON parser.
        source: serde_json::Error,
    },
    /// The table cannot be written.
    #[error("{} cannot be written: {source}; check the folder given with -o", path.display())]
    Table {
        /// Its path.
        path: PathBuf,
        /// The error of the CSV writer.
        source: csv::Error,
    },
    /// A picture cannot be written or read.
    #[error("{}: {source}; remove the folder, or measure without --resume", path.display())]
    Picture {
        /// Its path.
        path: PathBuf,
        /// The error of the image library.
        source: image::ImageError,
    },
    /// A picture is missing, or differs in size from its reference.
    #[error("the pictures of \"{point}\" differ in size; give --size a width and height from 8 to 4096")]
    Sizes {
        /// The point.
        point: String,
    },
    /// A value of a point is not finite.
    #[error(
        "\"{point}\" of the study `{study}` holds a value that is not finite; this is a fault of the program, please report it with the scene"
    )]
    NotFinite {
        /// The study.
        study: String,
        /// The point.
        point: String,
    },
    /// A plot cannot be drawn.
    #[error("the plot \"{title}\" cannot be drawn: {reason}")]
    Plot {
        /// Study and title of the plot.
        title: String,
        /// The reason.
        reason: String,
    },
    /// A scene cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A scene cannot be saved.
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
    /// A lightmap cannot be encoded.
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
