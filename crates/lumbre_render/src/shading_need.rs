//! What shading by need chose, and why, for each object and grouped for reports. Plain data; the choice
//! itself is made in `shading_by_need`.

use std::collections::BTreeMap;

use lumbre_optics::Shading;

/// Why the error of an object was predicted, or why it was not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Reason {
    /// It was predicted from mesh, lights and viewer.
    #[default]
    Predicted,
    /// The object covers so few pixels that nothing is cheaper than Phong shading.
    FewPixels,
    NoLight,
    Unlit,
    NormalTexture,
    MetallicRoughnessTexture,
    VertexColors,
    IrradianceVolume,
    PolygonLight,
    SpecularAntialiasing,
}

impl Reason {
    fn sentence(self) -> &'static str {
        match self {
            Self::Predicted => "predicted from mesh, lights and viewer",
            Self::FewPixels => "its pixels cost less than its vertices",
            Self::NoLight => "no light reaches it",
            Self::Unlit => "no light is evaluated on it",
            Self::NormalTexture => "its normal map is seen in fragments alone",
            Self::MetallicRoughnessTexture => "its metallic-roughness texture is seen in fragments alone",
            Self::VertexColors => "the colours of its vertices are interpolated beside the light",
            Self::IrradianceVolume => "an irradiance volume lights it, whose error is not predicted",
            Self::PolygonLight => "an emissive face lights it, whose error is not predicted",
            Self::SpecularAntialiasing => "its highlight is filtered in fragments alone",
        }
    }
}

/// What was chosen for an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Chosen {
    pub shading: Shading,
    pub reason: Reason,
    /// Predicted errors of flat and of Gouraud shading, in exposed radiance.
    pub errors: [f64; 2],
    /// Error of the chosen shading.
    pub error: f64,
}

/// Counts of what was chosen for the objects in view that are shaded by need.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct ShadingNeeds {
    /// Objects shaded once per polygon.
    pub flat: usize,
    /// Objects shaded at their vertices.
    pub gouraud: usize,
    /// Objects shaded at every fragment.
    pub phong: usize,
    /// The largest predicted error of any of them. No pixel and channel differs from Phong shading by more,
    /// in exposed linear radiance between 0 and 1.
    pub predicted_error: f64,
}

impl ShadingNeeds {
    pub(crate) fn add(&mut self, chosen: &Chosen) {
        match chosen.shading {
            Shading::Flat => self.flat += 1,
            Shading::Gouraud => self.gouraud += 1,
            Shading::Phong | Shading::Auto { .. } => self.phong += 1,
        }
        self.predicted_error = self.predicted_error.max(chosen.error);
    }
}

/// Objects for which the same was chosen for the same reason.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ShadingNeed {
    /// The chosen shading: `flat`, `gouraud` or `phong`.
    pub shading: &'static str,
    /// Number of objects, in view or not.
    pub objects: usize,
    /// Why it was chosen.
    pub reason: String,
    /// The smallest and the largest predicted error of Gouraud shading on these objects, in exposed linear
    /// radiance between 0 and 1; `None` if it is not predicted. An error above the bound may be larger than
    /// stated, because the prediction stops there.
    pub gouraud_error: Option<[f64; 2]>,
    /// The same for flat shading.
    pub flat_error: Option<[f64; 2]>,
}

impl ShadingNeed {
    /// Groups the choices of objects.
    pub(crate) fn group(chosen: &[Chosen]) -> Vec<Self> {
        let mut groups: BTreeMap<(&'static str, Reason), Vec<&Chosen>> = BTreeMap::new();
        for one in chosen {
            groups.entry((one.shading.name(), one.reason)).or_default().push(one);
        }
        let group = |((shading, reason), chosen): ((&'static str, Reason), Vec<&Chosen>)| {
            let range = |which: usize| {
                let least = chosen.iter().map(|one| one.errors[which]).fold(f64::INFINITY, f64::min);
                let most = chosen.iter().map(|one| one.errors[which]).fold(0.0, f64::max);
                // Radiance above white is shown as white.
                (least.is_finite() && reason == Reason::Predicted).then_some([least.min(1.0), most.min(1.0)])
            };
            let (gouraud_error, flat_error) = (range(1), range(0));
            let reason = reason.sentence().to_owned();
            Self { shading, objects: chosen.len(), reason, gouraud_error, flat_error }
        };
        groups.into_iter().map(group).collect()
    }

    /// Formats it as one line of text.
    pub fn line(&self) -> String {
        let objects = if self.objects == 1 { "1 object" } else { &format!("{} objects", self.objects) };
        let range = |name: &str, error: Option<[f64; 2]>| match error {
            Some([least, most]) if least == most => format!("; {name} may be {most:.4} off"),
            Some([least, most]) => format!("; {name} may be {least:.4} to {most:.4} off"),
            None => String::new(),
        };
        let errors = range("Gouraud", self.gouraud_error) + &range("flat", self.flat_error);
        format!("{} for {objects}: {}{errors}", self.shading, self.reason)
    }
}
