//! Reads and writes the folder of a report: `cost.json` with all data, `cost.csv` as a table, `index.html`
//! for reading, and the pictures and scenes. Every file is written under a temporary name first.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use image::codecs::jpeg::JpegEncoder;
use image::{Rgb32FImage, RgbImage};
use lumbre_trace::heat_color;
use rayon::prelude::*;

use crate::measured::Measured;
use crate::page::{Images, page};
use crate::picture::Picture;
use crate::table::write_table;
use crate::{CostError, CostReport, Point};

/// Name of the file with all data.
pub const REPORT: &str = "cost.json";
/// Name of the table.
pub const TABLE: &str = "cost.csv";
/// Name of the page.
pub const PAGE: &str = "index.html";

/// Extension of the pictures that are embedded in the page. They have a tenth of the size of the PNG files
/// beside them.
const IN_PAGE: &str = "page.jpg";
/// Their JPEG quality, of 100. The loss is smaller than the errors that the pictures show.
const QUALITY: u8 = 88;

/// The folder of a report.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// Opens a folder, and creates it if it does not exist.
    ///
    /// # Errors
    /// [`CostError::File`].
    pub fn open(path: &Path) -> Result<Self, CostError> {
        let failed = |source| CostError::File { path: path.to_owned(), source };
        fs::create_dir_all(path).map_err(failed)?;
        // Commands and links are relative to the folder, wherever the program runs.
        Ok(Self { path: path.canonicalize().map_err(failed)? })
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the report in the folder, or `None` if there is none.
    ///
    /// # Errors
    /// [`CostError::File`], [`CostError::NotAReport`].
    pub fn report(&self) -> Result<Option<CostReport>, CostError> {
        let path = self.path.join(REPORT);
        if path.exists() { read_report(&path).map(Some) } else { Ok(None) }
    }

    /// Writes the pictures of a study, replacing those of an earlier run.
    ///
    /// # Errors
    /// [`CostError::File`], [`CostError::Picture`].
    pub fn write_pictures(&self, measured: &Measured) -> Result<(), CostError> {
        let own = self.path.join("pictures").join(&measured.study.name);
        let failed = |source| CostError::File { path: own.clone(), source };
        if own.exists() {
            fs::remove_dir_all(&own).map_err(failed)?;
        }
        fs::create_dir_all(&own).map_err(failed)?;
        // Pictures are shown with the exposure of their reference. Several points may share a reference,
        // which is one file.
        let mut shown = BTreeMap::new();
        let points = measured.study.points.iter();
        for files in points.filter_map(|point| point.picture.as_ref()) {
            if let Some(reference) = measured.pictures.get(&files.reference) {
                let exposure = reference.exposure();
                shown.insert(&files.picture, exposure);
                shown.insert(&files.reference, exposure);
            }
        }
        let write = |name: &String, picture: &Picture| -> Result<(), CostError> {
            self.write_light(name, picture)?;
            if let Some(exposure) = shown.get(name) {
                self.write_shown(name, picture, *exposure)?;
            }
            if let Some(heat) = measured.heat.get(name) {
                let bytes = heat.iter().flat_map(|value| heat_color(*value)).collect();
                self.write_bytes(&format!("{name}.heat"), picture.width, bytes)?;
            }
            Ok(())
        };
        // Compressing the pictures takes longer than anything else here.
        measured.pictures.par_iter().try_for_each(|(name, picture)| write(name, picture))
    }

    /// Writes the report with its table and its page.
    ///
    /// # Errors
    /// [`CostError::File`], [`CostError::Table`], [`CostError::Plot`].
    pub fn write(&self, report: &CostReport) -> Result<(), CostError> {
        let path = self.path.join(REPORT);
        let text = serde_json::to_string_pretty(report)
            .map_err(|source| CostError::NotAReport { path: path.clone(), source })?;
        self.replace(REPORT, (text + "\n").as_bytes())?;
        let table =
            write_table(report).map_err(|source| CostError::Table { path: self.path.join(TABLE), source })?;
        self.replace(TABLE, &table)?;
        let images = |name: &str| fs::read(self.path.join(format!("{name}.{IN_PAGE}"))).ok();
        self.replace(PAGE, page(report, &images as &Images<'_>)?.as_bytes())
    }

    fn write_light(&self, name: &str, picture: &Picture) -> Result<(), CostError> {
        let path = self.path.join(format!("{name}.exr"));
        let floats = picture.radiance.iter().flat_map(|pixel| pixel.as_vec3().to_array()).collect();
        let image = Rgb32FImage::from_raw(picture.width as u32, picture.height() as u32, floats);
        let image = image.ok_or_else(|| CostError::Sizes { point: name.to_owned() })?;
        image.save(&path).map_err(|source| CostError::Picture { path, source })
    }

    fn write_shown(&self, name: &str, picture: &Picture, exposure: f64) -> Result<(), CostError> {
        let byte = |value: f64| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
        let shown = picture.shown(exposure);
        let bytes = shown.iter().flat_map(|pixel| pixel.to_array().map(byte)).collect();
        self.write_bytes(name, picture.width, bytes)
    }

    fn write_bytes(&self, name: &str, width: usize, bytes: Vec<u8>) -> Result<(), CostError> {
        let path = self.path.join(format!("{name}.png"));
        let height = bytes.len() / (3 * width.max(1));
        let image = RgbImage::from_raw(width as u32, height as u32, bytes);
        let image = image.ok_or_else(|| CostError::Sizes { point: name.to_owned() })?;
        image.save(&path).map_err(|source| CostError::Picture { path, source })?;
        let path = self.path.join(format!("{name}.{IN_PAGE}"));
        let mut bytes = Vec::new();
        let encoded = image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY));
        encoded.map_err(|source| CostError::Picture { path: path.clone(), source })?;
        fs::write(&path, bytes).map_err(|source| CostError::File { path, source })
    }

    fn replace(&self, name: &str, bytes: &[u8]) -> Result<(), CostError> {
        let path = self.path.join(name);
        let beside = self.path.join(format!(".{}.{name}", std::process::id()));
        let written = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, &path));
        written.map_err(|source| {
            // The file is incomplete. If it cannot be removed either, the first error is the one to report.
            let _ = fs::remove_file(&beside);
            CostError::File { path, source }
        })
    }
}

/// Reads a report from its file, or from the folder that contains it.
///
/// # Errors
/// [`CostError::File`], [`CostError::NotAReport`].
pub fn read_report(path: &Path) -> Result<CostReport, CostError> {
    let path = if path.is_dir() { path.join(REPORT) } else { path.to_owned() };
    let text = fs::read_to_string(&path).map_err(|source| CostError::File { path: path.clone(), source })?;
    serde_json::from_str(&text).map_err(|source| CostError::NotAReport { path, source })
}

/// Reads the radiance of a picture of a report, by the name with which a point refers to it.
///
/// # Errors
/// [`CostError::Picture`].
pub fn read_picture(folder: &Path, name: &str) -> Result<Picture, CostError> {
    let path = folder.join(format!("{name}.exr"));
    let image = image::open(&path).map_err(|source| CostError::Picture { path, source })?.into_rgb32f();
    let radiance = image.pixels().map(|pixel| glam::Vec3::from(pixel.0).as_dvec3()).collect();
    Ok(Picture { width: image.width() as usize, radiance })
}

/// Returns true if the pictures of a point exist.
pub fn has_pictures(folder: &Path, point: &Point) -> bool {
    let Some(files) = &point.picture else { return true };
    let (picture, heat, reference) = (&files.picture, &format!("{}.heat", files.picture), &files.reference);
    let light = [picture, reference].map(|name| format!("{name}.exr"));
    let shown = [picture, heat, reference].map(|name| [format!("{name}.png"), format!("{name}.{IN_PAGE}")]);
    light.iter().chain(shown.iter().flatten()).all(|name| folder.join(name).exists())
}
