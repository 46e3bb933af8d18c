//! Connected components of the exchange of light: parts of a scene that exchange no light with each other, such as
//! closed rooms. Scaling their emissions to the same level lets the `solver` solve a dim room beside a bright one as
//! accurately as it would alone.

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use crate::disjoint_sets::DisjointSets;

/// For each patch, the first patch of its component.
fn components(factors: &FormFactors) -> Vec<u32> {
    let mut components = DisjointSets::new(factors.len());
    for patch in PatchIndex::all(factors.len()).take_while(|_| !factors.stop.is_cancelled()) {
        // The matrix is symmetric: half of it is enough.
        for (other, _) in factors.row(patch).filter(|&(other, g)| other > patch && g > 0.0) {
            components.join(patch.0, other.0);
        }
    }
    components.into_sets()
}

/// Per patch, the factor that brings the emission of its component to the norm of the brightest component's; 1 in
/// components without emission. Also returns the number of components with emission.
pub(crate) fn levels(factors: &FormFactors, emission: &[f64]) -> (Vec<f64>, usize) {
    let components = components(factors);
    // Squared norm of a component's emission, at its first patch; 0 at all other patches.
    let mut squares = vec![0.0f64; components.len()];
    for ((&component, emission), &area) in components.iter().zip(emission).zip(&factors.areas) {
        squares[component as usize] += emission * emission * f64::from(area);
    }
    let most = squares.iter().copied().fold(0.0, f64::max);
    let lit = squares.iter().filter(|&&square| square > 0.0).count();
    let factor = |square: f64| if square > 0.0 { (most / square).sqrt() } else { 1.0 };
    (components.iter().map(|&component| factor(squares[component as usize])).collect(), lit)
}
