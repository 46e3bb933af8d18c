//! Reads and writes `LUMBRE_quadric`, the exact surface of a node. The node's mesh remains for programs that
//! do not support the extension.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::error::LoadProblem;
use super::import_scene::unknown;
use crate::{Quadric, QuadricShape};

/// The JSON of the extension.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct QuadricExtension {
    /// `plane`, `sphere`, `cylinder`, `cone` or `quadric`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// In metres; 1 if missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// In metres; 1 if missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// Whether the ends of a cylinder or cone are closed by discs; true if missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed: Option<bool>,
    /// The coefficients a to j of a general quadric.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coefficients: Option<[f64; 10]>,
    /// Minimum corner of the trim box, in metres; `null` where the box is open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<Corner>,
    /// Maximum corner of the trim box, in metres; `null` where the box is open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<Corner>,
    /// Index of the material, for a node without a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<usize>,
}

/// A corner of the trim box. A component is `None` if it is infinite, for which JSON has no number.
type Corner = [Option<f64>; 3];

/// All values of `kind`.
const KINDS: [&str; 5] = ["plane", "sphere", "cylinder", "cone", "quadric"];

impl QuadricExtension {
    /// Converts the JSON to a surface and validates it.
    pub fn surface(&self, place: &str) -> Result<Quadric, LoadProblem> {
        let refused = |field: &str, value: String, expected: &str| LoadProblem::Value {
            place: place.to_owned(),
            field: format!("LUMBRE_quadric.{field}"),
            value,
            expected: expected.to_owned(),
        };
        let (radius, height) = (self.radius.unwrap_or(1.0), self.height.unwrap_or(1.0));
        let closed = self.closed.unwrap_or(true);
        let shape = match self.kind.as_deref() {
            Some("plane") => QuadricShape::Plane,
            Some("sphere") => QuadricShape::Sphere { radius },
            Some("cylinder") => QuadricShape::Cylinder { radius, height, closed },
            Some("cone") => QuadricShape::Cone { radius, height, closed },
            Some("quadric") => {
                let coefficients = self.coefficients.ok_or_else(|| {
                    refused("coefficients", "missing".to_owned(), "give the ten coefficients a to j")
                })?;
                QuadricShape::General { coefficients }
            }
            Some(other) => return Err(unknown(place, "LUMBRE_quadric.kind", other, KINDS.into_iter())),
            None => return Err(refused("kind", "missing".to_owned(), "say which surface it is")),
        };
        let corner =
            |own: Option<Corner>, open: f64| own.unwrap_or_default().map(|own| own.unwrap_or(open)).into();
        let trim = (self.min.is_some() || self.max.is_some())
            .then(|| [corner(self.min, f64::NEG_INFINITY), corner(self.max, f64::INFINITY)]);
        let quadric = Quadric { shape, trim };
        quadric
            .validate()
            .map_err(|error| refused("kind", format!("{:?}", self.kind), &error.to_string()))?;
        Ok(quadric)
    }

    /// The JSON for a valid surface.
    pub fn of(quadric: &Quadric) -> Self {
        let kind = |name: &str| Self { kind: Some(name.to_owned()), ..Self::default() };
        let own = match quadric.shape {
            QuadricShape::Plane => kind("plane"),
            QuadricShape::Sphere { radius } => Self { radius: Some(radius), ..kind("sphere") },
            QuadricShape::Cylinder { radius, height, closed } => Self {
                radius: Some(radius),
                height: Some(height),
                closed: (!closed).then_some(false),
                ..kind("cylinder")
            },
            QuadricShape::Cone { radius, height, closed } => Self {
                radius: Some(radius),
                height: Some(height),
                closed: (!closed).then_some(false),
                ..kind("cone")
            },
            QuadricShape::General { coefficients } => {
                Self { coefficients: Some(coefficients), ..kind("quadric") }
            }
        };
        let corner = |corner: DVec3| -> Option<Corner> {
            let finite = corner.to_array().map(|value| value.is_finite().then_some(value));
            finite.iter().any(Option::is_some).then_some(finite)
        };
        let [min, max] = quadric.trim.map_or([None, None], |trim| trim.map(corner));
        Self { min, max, ..own }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_read_back_as_they_were_written() {
        let trim = Some([DVec3::new(-1.0, f64::MIN, -3.0), DVec3::new(1.0, 2.0, 3.0)]);
        let open = Some([DVec3::NEG_INFINITY.with_y(0.0), DVec3::new(1.0, f64::INFINITY, 3.0)]);
        let half_space = Some([DVec3::NEG_INFINITY, DVec3::INFINITY.with_y(0.5)]);
        for shape in [
            QuadricShape::Plane,
            QuadricShape::Sphere { radius: 0.1 },
            QuadricShape::Cylinder { radius: 2.0, height: 0.3, closed: true },
            QuadricShape::Cone { radius: 2.0, height: 0.3, closed: false },
            QuadricShape::General { coefficients: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, -1.0] },
        ] {
            for trim in [None, trim, open, half_space] {
                let quadric = Quadric { shape, trim };
                let json = serde_json::to_value(QuadricExtension::of(&quadric)).expect("numbers and words");
                let again: QuadricExtension = serde_json::from_value(json).expect("what was written");
                assert_eq!(again.surface("nodes[0]").expect("a surface"), quadric);
            }
        }
    }

    #[test]
    fn what_is_no_surface_is_refused_by_its_place() {
        let read = |json: serde_json::Value| {
            let read: QuadricExtension = serde_json::from_value(json).expect("the keys have the types");
            read.surface("nodes[7]").expect_err("it is no surface").to_string()
        };
        for (json, words) in [
            (serde_json::json!({}), "kind"),
            (serde_json::json!({"kind": "torus"}), "sphere"),
            (serde_json::json!({"kind": "sphere", "radius": 0}), "radius"),
            (serde_json::json!({"kind": "sphere", "radius": 1e200}), "1e100"),
            (serde_json::json!({"kind": "quadric"}), "coefficients"),
            (serde_json::json!({"kind": "cone", "height": -1}), "height"),
            (serde_json::json!({"kind": "plane", "min": [0, 0, 0], "max": [1, 0, 1]}), "min"),
        ] {
            let error = read(json.clone());
            assert!(error.contains("nodes[7]") && error.contains(words), "{json}: {error}");
        }
    }
}
