//! Squared errors of many texels, in two figures. The terms that they are made of are in `final_gather::error_ledger`.

/// Squared errors of texels, mean of the channels.
#[derive(Clone, Debug, Default)]
pub(crate) struct SquaredErrors {
    /// Upper estimates, which are stated for single texels.
    pub cautious: Vec<f32>,
    /// Expected values, to be added up over many texels.
    pub expected: Vec<f32>,
}

impl SquaredErrors {
    /// The sum with other squared errors, for which both figures are the same.
    pub fn with(&self, more: &[f32]) -> Self {
        let sum = |squares: &[f32]| squares.iter().zip(more).map(|(square, more)| square + more).collect();
        Self { cautious: sum(&self.cautious), expected: sum(&self.expected) }
    }
}
