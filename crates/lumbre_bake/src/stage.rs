//! The stages of a bake: their names, and their shares of its time. Not what they do: each is called by `bake`; nor how
//! long they took: that is measured by `monitor`.

/// The stages, in order. A checkpoint identifies them by their position here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Layout,
    Hierarchy,
    DirectLight,
    FormFactors,
    Radiosity,
    FinalGather,
    Probes,
    Resolution,
    Texels,
    Seams,
}

/// What is known of a stage beforehand.
pub(crate) struct StageProfile {
    /// Its name in reports and progress.
    pub name: &'static str,
    /// Its usual share of the bake's time, in [0, 1].
    pub share_of_bake: f32,
    /// The share of the time limit after which it takes no more samples, so that time is left for a rough result of later
    /// stages, in (0, 1].
    pub share_of_limit: f64,
    /// Whether most of its time is spent on casting rays.
    pub casts_rays: bool,
}

impl Stage {
    pub const ALL: [Self; 10] = [
        Self::Layout,
        Self::Hierarchy,
        Self::DirectLight,
        Self::FormFactors,
        Self::Radiosity,
        Self::FinalGather,
        Self::Probes,
        Self::Resolution,
        Self::Texels,
        Self::Seams,
    ];

    /// What is known of it beforehand.
    pub fn profile(self) -> StageProfile {
        let (name, share_of_bake, share_of_limit, casts_rays) = match self {
            Self::Layout => ("layout", 0.03, 1.0, false),
            Self::Hierarchy => ("hierarchy", 0.02, 1.0, false),
            Self::DirectLight => ("direct light", 0.2, 0.38, true),
            Self::FormFactors => ("form factors", 0.1, 0.52, true),
            Self::Radiosity => ("radiosity", 0.05, 0.52, false),
            Self::FinalGather => ("final gather", 0.48, 0.93, true),
            Self::Probes => ("probes", 0.05, 0.95, true),
            Self::Resolution => ("resolution", 0.02, 0.97, true),
            Self::Texels => ("texels", 0.03, 1.0, false),
            Self::Seams => ("seams", 0.02, 1.0, false),
        };
        StageProfile { name, share_of_bake, share_of_limit, casts_rays }
    }

    /// The usual share of the bake's time that the stages before it take, in [0, 1].
    pub fn share_of_bake_before(self) -> f32 {
        Self::ALL
            .into_iter()
            .take_while(|stage| *stage != self)
            .map(|stage| stage.profile().share_of_bake)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stage_is_listed_once_and_they_take_the_whole_time() {
        for (place, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, place, "{} is at its place in the list", stage.profile().name);
        }
        let last = Stage::ALL[Stage::ALL.len() - 1];
        assert!((last.share_of_bake_before() + last.profile().share_of_bake - 1.0).abs() < 1e-6);
    }
}
