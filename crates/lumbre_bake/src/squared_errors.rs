//! Squared errors of many texels. Not what they come from: that is the `error_ledger`.

/// Squared errors of texels, mean of the channels.
#[derive(Clone, Debug, Default)]
pub(crate) struct SquaredErrors {
    /// An upper estimate, as it is stated of single texels.
    pub cautious: Vec<f32>,
    /// As they are expected: to be added up over many.
    pub expected: Vec<f32>,
}

impl SquaredErrors {
    /// Other squared errors added, of which nothing more is known.
    pub fn with(&self, more: &[f32]) -> Self {
        let sum = |own: &[f32]| own.iter().zip(more).map(|(own, more)| own + more).collect();
        Self { cautious: sum(&self.cautious), expected: sum(&self.expected) }
    }
}
