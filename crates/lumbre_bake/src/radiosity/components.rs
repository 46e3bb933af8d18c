//! The parts of a scene that exchange no light with each other: closed rooms, say. Each is solved to a residual of its own, so that a dim
//! room beside a bright one is as well solved as alone. Not the solving.

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use crate::disjoint_sets::DisjointSets;

/// For each patch, the first one of its part.
fn components(factors: &FormFactors) -> Vec<u32> {
    let mut parts = DisjointSets::new(factors.len());
    for patch in PatchIndex::all(factors.len()).take_while(|_| !factors.stop.is_cancelled()) {
        // Each pair once.
        for (other, _) in factors.row(patch).filter(|&(other, g)| other > patch && g > 0.0) {
            parts.join(patch.0, other.0);
        }
    }
    parts.into_sets()
}

/// What brings the emission of every part to the same size, 1 for the brightest: by patch, a factor (1 where nothing emits). And how many
/// parts have some.
pub(crate) fn levels(factors: &FormFactors, emission: &[f64]) -> (Vec<f64>, usize) {
    let part = components(factors);
    // By the first patch of a part; 0 at all others.
    let mut squares = vec![0.0f64; part.len()];
    for ((&part, emission), &area) in part.iter().zip(emission).zip(&factors.areas) {
        squares[part as usize] += emission * emission * f64::from(area);
    }
    let most = squares.iter().copied().fold(0.0, f64::max);
    let lit = squares.iter().filter(|&&square| square > 0.0).count();
    let factor = |square: f64| if square > 0.0 { (most / square).sqrt() } else { 1.0 };
    (part.iter().map(|&part| factor(squares[part as usize])).collect(), lit)
}
