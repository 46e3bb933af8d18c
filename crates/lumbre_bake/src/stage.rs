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

    /// Its name in reports and progress.
    pub fn name(self) -> &'static str {
        match self {
            Self::Layout => "layout",
            Self::Hierarchy => "hierarchy",
            Self::DirectLight => "direct light",
            Self::FormFactors => "form factors",
            Self::Radiosity => "radiosity",
            Self::FinalGather => "final gather",
            Self::Probes => "probes",
            Self::Resolution => "resolution",
            Self::Texels => "texels",
            Self::Seams => "seams",
        }
    }

    /// Its usual share of the bake's time, in [0, 1].
    pub fn share_of_bake(self) -> f32 {
        match self {
            Self::Layout | Self::Texels => 0.03,
            Self::Hierarchy | Self::Resolution | Self::Seams => 0.02,
            Self::DirectLight => 0.2,
            Self::FormFactors => 0.1,
            Self::Radiosity | Self::Probes => 0.05,
            Self::FinalGather => 0.48,
        }
    }

    /// The usual share of the bake's time that the stages before it take, in [0, 1].
    pub fn share_of_bake_before(self) -> f32 {
        Self::ALL.into_iter().take_while(|stage| *stage != self).map(Self::share_of_bake).sum()
    }

    /// The share of the time limit after which it takes no more samples, so that time is left for a rough result of later
    /// stages, in (0, 1].
    pub fn share_of_limit(self) -> f64 {
        match self {
            Self::Layout | Self::Hierarchy | Self::Texels | Self::Seams => 1.0,
            Self::DirectLight => 0.38,
            Self::FormFactors | Self::Radiosity => 0.52,
            Self::FinalGather => 0.93,
            Self::Probes => 0.95,
            Self::Resolution => 0.97,
        }
    }

    /// Whether most of its time is spent on casting rays.
    pub fn casts_rays(self) -> bool {
        match self {
            Self::DirectLight | Self::FormFactors | Self::FinalGather | Self::Probes | Self::Resolution => {
                true
            }
            Self::Layout | Self::Hierarchy | Self::Radiosity | Self::Texels | Self::Seams => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stage_is_listed_once_and_they_take_the_whole_time() {
        for (place, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, place, "{} is at its place in the list", stage.name());
        }
        let last = Stage::ALL[Stage::ALL.len() - 1];
        assert!((last.share_of_bake_before() + last.share_of_bake() - 1.0).abs() < 1e-6);
    }
}
