//! The parts of a scene that exchange no light with each other: closed rooms, say. Each is solved to a residual of its own, so that a dim
//! room beside a bright one is as well solved as alone. Not the solving.

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;

/// For each patch, the number of its part; and how many parts there are.
pub(crate) fn components(factors: &FormFactors) -> (Vec<u32>, usize) {
    const NONE: u32 = u32::MAX;
    let mut part = vec![NONE; factors.len()];
    let mut count = 0;
    let mut open = Vec::new();
    for start in PatchIndex::all(part.len()) {
        if part[start.place()] != NONE {
            continue;
        }
        part[start.place()] = count;
        open.push(start);
        while let Some(patch) = open.pop().filter(|_| !factors.stop.is_cancelled()) {
            for (other, g) in factors.row(patch) {
                if g > 0.0 && part[other.place()] == NONE {
                    part[other.place()] = count;
                    open.push(other);
                }
            }
        }
        count += 1;
    }
    (part, count as usize)
}

/// What brings the emission of every part to the same size, 1 for the brightest: by patch, a factor (1 where nothing emits). And how many
/// parts have some.
pub(crate) fn levels(factors: &FormFactors, emission: &[f64]) -> (Vec<f64>, usize) {
    let (part, count) = components(factors);
    if factors.stop.is_cancelled() {
        return (vec![1.0; emission.len()], 1);
    }
    let mut squares = vec![0.0f64; count];
    for ((&part, emission), &area) in part.iter().zip(emission).zip(&factors.areas) {
        squares[part as usize] += emission * emission * f64::from(area);
    }
    let most = squares.iter().copied().fold(0.0, f64::max);
    let lit = squares.iter().filter(|&&square| square > 0.0).count();
    let factor = |square: f64| if square > 0.0 { (most / square).sqrt() } else { 1.0 };
    (part.iter().map(|&part| factor(squares[part as usize])).collect(), lit)
}
