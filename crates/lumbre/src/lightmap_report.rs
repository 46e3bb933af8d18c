//! The files of a bake and the errors of their encodings, as text and for JSON. They are written in
//! `lumbre_scene`.

use lumbre::scene::{EncodingError, LightmapFile};
use serde::{Deserialize, Serialize};

/// One file in the JSON report.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FileLine {
    /// Its name, without the folder.
    file: String,
    encoding: String,
    bytes: u64,
    /// Encoding error, relative to the mean of the lit texels.
    error: EncodingError,
}

impl From<&LightmapFile> for FileLine {
    fn from(file: &LightmapFile) -> Self {
        let name = file.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self { file: name, encoding: file.encoding.to_owned(), bytes: file.bytes, error: file.error }
    }
}

/// Returns one line per encoding, with the largest error of its files.
pub fn summary_of_files(files: &[FileLine]) -> String {
    let mut encodings: Vec<&str> = Vec::new();
    for file in files {
        if !encodings.contains(&file.encoding.as_str()) {
            encodings.push(&file.encoding);
        }
    }
    let mut text = String::new();
    for encoding in encodings {
        let of_it = || files.iter().filter(move |file| file.encoding == encoding);
        let worst =
            |figure: fn(&EncodingError) -> f64| of_it().map(|file| figure(&file.error)).fold(0.0, f64::max);
        text.push_str(&format!(
            "  {encoding}: {} files, {:.1} MB, encoding error {:.3} % RMS, {:.3} % at most (of each map's mean)\n",
            of_it().count(),
            of_it().map(|file| file.bytes).sum::<u64>() as f64 * 1e-6,
            100.0 * worst(|error| error.relative_rmse),
            100.0 * worst(|error| error.largest),
        ));
    }
    text
}

/// Returns one line for each file whose encoding could not represent all of its light.
pub fn warnings_of_files(files: &[LightmapFile]) -> impl Iterator<Item = String> + '_ {
    files.iter().filter(|file| file.error.saturated > 0 || file.error.negative > 0).map(|file| {
        let EncodingError { saturated, negative, .. } = file.error;
        let (path, encoding) = (file.path.display(), file.encoding);
        format!("{path}: {encoding} cannot hold the light of {saturated} texels, which were cut; {negative} below 0 became 0")
    })
}
