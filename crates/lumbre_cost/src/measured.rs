//! The result of a study: its data, and the pictures that its points refer to. Files are written by `folder`.

use std::collections::BTreeMap;

use crate::picture::{Compared, Picture, ShownReference, compared_with};
use crate::{CostError, ErrorOf, ErrorOver, KeptMaps, Point, PointPicture, Study};

/// A finished study.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// The study.
    pub study: Study,
    /// Pictures and references, by the names with which points refer to them.
    pub pictures: BTreeMap<String, Picture>,
    /// FLIP of every pixel against the reference, by the name of the picture.
    pub heat: BTreeMap<String, Vec<f64>>,
    /// The reference of the last comparison with its name. Points with the same reference mostly follow each other.
    shown: Option<(String, ShownReference)>,
}

impl Measured {
    /// Begins the results of a study.
    pub fn of(study: Study) -> Self {
        Self { study, ..Self::default() }
    }

    /// Keeps a reference picture, and returns the name by which points refer to it.
    pub fn keep_reference(&mut self, name: &str, picture: Picture) -> String {
        let name = self.file_name(name);
        self.keep(name.clone(), picture);
        name
    }

    fn keep(&mut self, name: String, picture: Picture) {
        // What was known of another picture of this name is out of date.
        self.shown.take_if(|(known, _)| *known == name);
        self.pictures.insert(name, picture);
    }

    /// Adds a point with its picture. Its error is computed from the picture and a kept reference, unless
    /// `error_of` says that the point already has an error of something that the picture only shows.
    ///
    /// # Errors
    /// [`CostError::Sizes`], [`CostError::NotFinite`].
    pub fn add_picture(
        &mut self,
        point: Point,
        picture: Picture,
        reference: &str,
        error_of: ErrorOver,
    ) -> Result<(), CostError> {
        let found = self.compared(&point, &picture, reference, error_of)?;
        let name = self.file_name(&format!("{} {}", point.series, point.label));
        let maps = point.picture.as_ref().and_then(|files| files.maps.clone());
        let files = PointPicture { picture: name.clone(), reference: reference.to_owned(), error_of, maps };
        let error = match (error_of, point.error) {
            (ErrorOver::Beyond, Some(own)) => ErrorOf { flip: found.error.flip, ..own },
            (_, own) => ErrorOf { uncertainty: own.map_or(0.0, |own| own.uncertainty), ..found.error },
        };
        self.study.points.push(Point { error: Some(error), picture: Some(files), ..point });
        self.keep(name.clone(), picture);
        self.heat.insert(name, found.heat);
        Ok(())
    }

    /// Adds a point whose error is one of lightmaps, with a frame that shows them. The lightmaps and the
    /// frame are both kept, along with their references.
    ///
    /// # Errors
    /// [`CostError::Sizes`], [`CostError::NotFinite`].
    pub fn add_maps(
        &mut self,
        point: Point,
        (frame, reference): (Picture, &str),
        (maps, maps_of_reference): (Picture, &str),
    ) -> Result<(), CostError> {
        let name = self.file_name(&format!("{} {} maps", point.series, point.label));
        self.keep(name.clone(), maps);
        let kept = KeptMaps { picture: name, reference: maps_of_reference.to_owned() };
        let files = PointPicture { maps: Some(kept), ..PointPicture::default() };
        self.add_picture(Point { picture: Some(files), ..point }, frame, reference, ErrorOver::Beyond)
    }

    fn compared(
        &mut self,
        point: &Point,
        picture: &Picture,
        reference: &str,
        over: ErrorOver,
    ) -> Result<Compared, CostError> {
        let found = self.pictures.get(reference).and_then(|wanted| {
            let known = self.shown.take().filter(|(name, _)| name == reference);
            let shown = known.unwrap_or_else(|| (reference.to_owned(), ShownReference::of(wanted)));
            let (_, shown) = self.shown.insert(shown);
            compared_with((wanted, shown), picture, over)
        });
        checked(&self.study, point, found)
    }

    /// Returns the path of a picture below `pictures/STUDY`, reduced to letters, digits and hyphens.
    pub fn file_name(&self, name: &str) -> String {
        let mut plain = String::new();
        for c in name.to_lowercase().chars() {
            match c.is_ascii_alphanumeric() {
                true => plain.push(c),
                false if !plain.is_empty() && !plain.ends_with('-') => plain.push('-'),
                false => {}
            }
        }
        format!("pictures/{}/{}", self.study.name, plain.trim_end_matches('-'))
    }
}

/// Returns the result of a comparison, or an error if the pictures differ in size or hold values that are not
/// finite.
fn checked(study: &Study, point: &Point, found: Option<Compared>) -> Result<Compared, CostError> {
    let named = || format!("{}, {}", point.series, point.label);
    let found = found.ok_or_else(|| CostError::Sizes { point: named() })?;
    match found.error.relative_rmse.is_finite() && found.error.largest.is_finite() {
        true => Ok(found),
        false => Err(CostError::NotFinite { study: study.name.clone(), point: named() }),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_picture_is_compared_with_the_reference_that_is_kept_now() -> Result<(), CostError> {
        let grey = |radiance: f64| Picture { width: 4, radiance: vec![DVec3::splat(radiance); 16] };
        let mut measured = Measured::of(Study { name: "shades".into(), ..Study::default() });
        let mut flip_of = |reference: f64, label: &str| -> Result<Option<f64>, CostError> {
            let reference = measured.keep_reference("reference", grey(reference));
            let point = Point { label: label.into(), ..Point::default() };
            measured.add_picture(point, grey(0.25), &reference, ErrorOver::Picture)?;
            Ok(measured.study.points.last().and_then(|point| point.error?.flip))
        };
        assert_eq!(flip_of(0.25, "itself")?, Some(0.0));
        let other = flip_of(0.75, "another")?;
        assert!(other.is_some_and(|flip| flip > 0.1), "{other:?}");
        assert_eq!(flip_of(0.25, "itself again")?, Some(0.0));
        Ok(())
    }
}
